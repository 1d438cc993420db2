#include "xplane_bridge/core/state/flight_computation.hpp"

#include <cmath>
#include <optional>

#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/core/state/air_data.hpp"

namespace xplane_bridge::core {
namespace {

template <typename... Values>
bool allFinite(Values... values) {
  return (std::isfinite(values) && ...);
}

bool allFinite(const Eigen::Vector3d& v) { return v.allFinite(); }

/// Rotations that several groups need; NaN where they cannot be known.
struct Rotations {
  Eigen::Matrix3d R_ned_frd = unknown();
  Eigen::Matrix3d R_ned_opengl = unknown();  ///< scenery axes -> local level NED

  static Eigen::Matrix3d unknown() { return Eigen::Matrix3d::Constant(kNaN); }
};

std::optional<TangentFrame> sceneryFrame(const FlightInputs& in) {
  if (!allFinite(in.origin_latitude, in.origin_longitude)) return std::nullopt;
  if (std::abs(in.origin_latitude) > 90.0 || std::abs(in.origin_longitude) > 360.0) return std::nullopt;
  return TangentFrame({in.origin_latitude, in.origin_longitude, 0.0}, usableEarthRadius(in));
}

Eigen::Matrix3d levelFromScenery(const TangentFrame& scenery, const GeoPoint& place) {
  const Eigen::Matrix3d R_enu = scenery.levelFromFrame(place.latitude_deg, place.longitude_deg);
  Eigen::Matrix3d R_ned_opengl;
  for (int axis = 0; axis < 3; ++axis) {
    R_ned_opengl.col(axis) = nedFromEnu(R_enu * enuFromOpengl(Eigen::Vector3d::Unit(axis)));
  }
  return R_ned_opengl;
}

// Time and flags of the frame, known or not what else the group has: the time is the key that pairs messages.
void fillSim(const FlightInputs& in, FlightState& s) {
  takeField(in.sim_time, s.sim_time);
  takeField(in.frame_period, s.frame_period);
  takeField(in.paused, s.paused);
  takeField(in.replay, s.replay);
  takeReceived(in, FlightState::kValidSim, s);
}

void fillPosition(const PositionFix& position, const TangentFrame& map, FlightState& s) {
  if (position.source == PositionSource::kNone) return;
  s.position_source = position.source;
  s.latitude = position.place.latitude_deg;
  s.longitude = position.place.longitude_deg;
  s.altitude_msl = position.place.height;
  const Eigen::Vector3d p = nedFromEnu(map.position(position.place));
  s.position_north = p.x();
  s.position_east = p.y();
  s.position_down = p.z();
  s.valid |= FlightState::kValidPosition;
}

/// The inputs with what X-Plane gave none of worked out from others, and angles in their messages' range.
FlightInputs completed(const FlightInputs& in) {
  FlightInputs out = in;
  if (!isKnown(in.altitude_pressure)) out.altitude_pressure = pressureAltitude(in.static_pressure);
  if (!isKnown(in.equivalent_airspeed)) out.equivalent_airspeed = equivalentAirspeed(in.true_airspeed, in.air_density);
  if (!isKnown(in.calibrated_airspeed)) {
    out.calibrated_airspeed = calibratedAirspeed(impactPressure(in.dynamic_pressure, in.mach));
  }
  out.heading_magnetic_deg = wrap360(in.heading_magnetic_deg);
  return out;
}

/// @return FRD -> NED; NaN when unknown.
Eigen::Matrix3d fillAttitude(const FlightInputs& in, const std::optional<TangentFrame>& scenery,
                             AttitudeReference reference, FlightState& s) {
  if (!allFinite(in.roll_deg, in.pitch_deg, in.heading_true_deg)) return Rotations::unknown();
  EulerAngles level{in.roll_deg * kRadiansPerDegree, in.pitch_deg * kRadiansPerDegree,
                    in.heading_true_deg * kRadiansPerDegree};
  if (reference == AttitudeReference::kSceneryOrigin) {
    if (!scenery || !s.has(FlightState::kValidPosition)) return Rotations::unknown();
    level = eulerAngles(levelAttitude(*scenery, rotationNedFrd(level), s.latitude, s.longitude));
  }
  s.roll_deg = level.roll * kDegreesPerRadian;
  s.pitch_deg = level.pitch * kDegreesPerRadian;
  s.heading_true_deg = wrap360(level.heading * kDegreesPerRadian);
  s.orientation = quaternionNedFrd(level);
  s.valid |= FlightState::kValidAttitude;
  return rotationNedFrd(level);
}

void fillRates(const FlightInputs& in, FlightState& s) {
  if (allFinite(in.roll_rate, in.pitch_rate, in.yaw_rate) && s.has(FlightState::kValidAttitude)) {
    s.angular_velocity = {in.roll_rate, in.pitch_rate, in.yaw_rate};
    s.euler_rates =
        eulerRates({s.roll_deg * kRadiansPerDegree, s.pitch_deg * kRadiansPerDegree, 0.0}, s.angular_velocity);
    s.valid |= FlightState::kValidRates;
  }
}

void fillVelocity(const FlightInputs& in, const Rotations& k, FlightState& s) {
  const Eigen::Vector3d velocity_ned = k.R_ned_opengl * in.local_velocity;
  if (!allFinite(velocity_ned) || !k.R_ned_frd.allFinite()) return;
  s.velocity_ned = velocity_ned;
  s.velocity_body = k.R_ned_frd.transpose() * velocity_ned;
  const double ground_speed = std::hypot(velocity_ned.x(), velocity_ned.y());
  s.ground_speed = static_cast<float>(ground_speed);
  const double track = ground_speed >= kMinSpeedForTrack
                           ? std::atan2(velocity_ned.y(), velocity_ned.x()) * kDegreesPerRadian
                           : s.heading_true_deg;
  s.track_deg = static_cast<float>(wrap360(track));
  if (s.track_deg >= 360.0F) s.track_deg = 0.0F;  // float32 rounds 359.99999.. up
  s.flight_path_angle_deg = static_cast<float>(std::atan2(-velocity_ned.z(), ground_speed) * kDegreesPerRadian);
  s.vertical_speed = static_cast<float>(-velocity_ned.z());
  s.valid |= FlightState::kValidVelocity;
}

void fillWind(const FlightInputs& in, const Rotations& k, FlightState& s) {
  Eigen::Vector3d wind = k.R_ned_opengl * in.wind_local;
  if (!allFinite(wind)) wind = windNedFromDirection(in.wind_from_deg * kRadiansPerDegree, in.wind_speed);
  if (!allFinite(wind)) return;
  s.wind_ned = wind;
  s.wind_speed = static_cast<float>(std::hypot(wind.x(), wind.y()));
  s.wind_from_deg = static_cast<float>(windFromDirectionDeg(wind));
  if (s.wind_from_deg >= 360.0F) s.wind_from_deg = 0.0F;
  s.valid |= FlightState::kValidWind;
}

void fillAirVelocity(const Rotations& k, FlightState& s) {
  if (!s.has(FlightState::kValidVelocity | FlightState::kValidWind)) return;
  s.air_velocity_body = airRelativeVelocity(k.R_ned_frd, s.velocity_ned, s.wind_ned);
  const AirAngles angles = airAngles(s.air_velocity_body);
  s.alpha_deg = static_cast<float>(angles.angle_of_attack * kDegreesPerRadian);
  s.beta_deg = static_cast<float>(angles.sideslip * kDegreesPerRadian);
  s.valid |= FlightState::kValidAirVelocity;
}

}  // namespace

double usableEarthRadius(const FlightInputs& inputs) {
  // Any planet X-Plane flies on; its own earth is 6378 km.
  constexpr double kSmallest = 1e6, kLargest = 1e7;
  const bool usable = inputs.earth_radius > kSmallest && inputs.earth_radius < kLargest;
  return usable ? inputs.earth_radius : kEarthRadius;
}

bool isNoFlight(const FlightInputs& in) {
  const auto nothing = [](double value) { return value == 0.0 || std::isnan(value); };
  const bool local = in.local_position.isZero(0.0) || !in.local_position.allFinite();
  return local && nothing(in.latitude) && nothing(in.longitude) && nothing(in.origin_latitude) &&
         nothing(in.origin_longitude) && nothing(in.elevation);
}

PositionFix localPosition(const FlightInputs& in) {
  const std::optional<TangentFrame> scenery = sceneryFrame(in);
  if (!scenery || !in.local_position.allFinite()) return {};
  return {scenery->geoPoint(enuFromOpengl(in.local_position)), PositionSource::kLocalUnchecked};
}

PositionFix float32Position(const FlightInputs& in) {
  if (!allFinite(in.latitude, in.longitude, in.elevation)) return {};
  if (std::abs(in.latitude) > 90.0 || std::abs(in.longitude) > 360.0) return {};
  return {{in.latitude, wrap180(in.longitude), in.elevation}, PositionSource::kFloat32};
}

FlightState computeFlightState(const FlightInputs& in, const PositionFix& position, const TangentFrame& map,
                               AttitudeReference attitude_reference) {
  FlightState s;
  fillSim(in, s);
  if (isNoFlight(in)) return s;
  fillPosition(position, map, s);
  Rotations k;
  const std::optional<TangentFrame> scenery = sceneryFrame(in);
  if (scenery && s.has(FlightState::kValidPosition)) k.R_ned_opengl = levelFromScenery(*scenery, position.place);
  k.R_ned_frd = fillAttitude(in, scenery, attitude_reference, s);
  fillRates(in, s);
  fillVelocity(in, k, s);
  fillWind(in, k, s);
  fillAirVelocity(k, s);
  takeReceived(completed(in), kReceivedGroups & ~FlightState::kValidSim, s);
  if (s.has(FlightState::kValidLoad)) {
    s.specific_force = specificForce(in.load_factor_axial, in.load_factor_side, in.load_factor_normal);
  }
  return s;
}

}  // namespace xplane_bridge::core
