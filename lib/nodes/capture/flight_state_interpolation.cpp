#include "xplane_bridge/nodes/capture/flight_state_interpolation.hpp"

#include <Eigen/Geometry>
#include <cstdint>

#include "xplane_bridge/core/camera/image_association.hpp"

namespace xplane_bridge {
namespace {

constexpr double kSigned = -180.0;  // branch [-180, 180)
constexpr double kCompass = 0.0;    // branch [0, 360)

/// Interpolates members of two messages into a third.
class Blend {
 public:
  Blend(const FlightState& from, const FlightState& to, double fraction, FlightState* result)
      : from_(from), to_(to), fraction_(fraction), result_(result) {}

  template <class T>
  void linear(T FlightState::*member) const {
    const auto from = static_cast<double>(from_.*member);
    result_->*member = static_cast<T>(from + fraction_ * (static_cast<double>(to_.*member) - from));
  }

  void linear(geometry_msgs::Vector3 FlightState::*member) const {
    const geometry_msgs::Vector3& from = from_.*member;
    const geometry_msgs::Vector3& to = to_.*member;
    geometry_msgs::Vector3& result = result_->*member;
    result.x = from.x + fraction_ * (to.x - from.x);
    result.y = from.y + fraction_ * (to.y - from.y);
    result.z = from.z + fraction_ * (to.z - from.z);
  }

  template <class T>
  void angle(T FlightState::*member, double lower) const {
    result_->*member = static_cast<T>(core::interpolateAngleDeg(static_cast<double>(from_.*member),
                                                                static_cast<double>(to_.*member), fraction_, lower));
  }

 private:
  const FlightState& from_;
  const FlightState& to_;
  double fraction_;
  FlightState* result_;
};

Eigen::Quaterniond toEigen(const geometry_msgs::Quaternion& q) { return {q.w, q.x, q.y, q.z}; }

}  // namespace

FlightState interpolate(const FlightState& from, const FlightState& to, double fraction) {
  using F = FlightState;
  FlightState result = fraction < 0.5 ? from : to;
  const Blend blend(from, to, fraction, &result);

  result.valid = from.valid & to.valid;
  result.header.stamp = from.header.stamp + ros::Duration((to.header.stamp - from.header.stamp).toSec() * fraction);
  blend.linear(&F::sim_time);
  blend.linear(&F::sim_time_unwrapped);
  blend.linear(&F::stamp_uncertainty);
  blend.linear(&F::frame_period);

  for (const auto member : {&F::latitude, &F::altitude_msl, &F::position_north, &F::position_east, &F::position_down}) {
    blend.linear(member);
  }
  blend.angle(&F::longitude, kSigned);
  for (const auto member : {&F::altitude_agl, &F::altitude_indicated, &F::altitude_pressure}) blend.linear(member);

  blend.angle(&F::roll_deg, kSigned);
  blend.linear(&F::pitch_deg);
  blend.angle(&F::heading_true_deg, kCompass);
  blend.angle(&F::heading_magnetic_deg, kCompass);
  blend.angle(&F::declination_deg, kSigned);
  const Eigen::Quaterniond q = core::interpolateAttitude(toEigen(from.orientation), toEigen(to.orientation), fraction);
  result.orientation.w = q.w();
  result.orientation.x = q.x();
  result.orientation.y = q.y();
  result.orientation.z = q.z();

  for (const auto member :
       {&F::angular_velocity, &F::euler_rates, &F::angular_acceleration, &F::velocity_ned, &F::velocity_body,
        &F::air_velocity_body, &F::specific_force, &F::wind_ned, &F::aero_moment}) {
    blend.linear(member);
  }
  for (const auto member : {&F::ground_speed,        &F::flight_path_angle_deg, &F::vertical_speed,
                            &F::alpha_deg,           &F::indicated_airspeed,    &F::calibrated_airspeed,
                            &F::equivalent_airspeed, &F::true_airspeed,         &F::mach,
                            &F::dynamic_pressure,    &F::air_density,           &F::load_factor_normal,
                            &F::load_factor_axial,   &F::load_factor_side,      &F::xplane_alpha_deg,
                            &F::xplane_beta_deg,     &F::xplane_vpath_deg,      &F::wind_speed,
                            &F::control_roll,        &F::control_pitch,         &F::control_yaw,
                            &F::control_throttle}) {
    blend.linear(member);
  }
  blend.angle(&F::track_deg, kCompass);
  blend.angle(&F::beta_deg, kSigned);
  blend.angle(&F::xplane_hpath_deg, kCompass);
  blend.angle(&F::wind_from_deg, kCompass);
  return result;
}

}  // namespace xplane_bridge
