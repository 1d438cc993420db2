#include "xplane_bridge/nodes/messages/conversions.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace xplane_bridge {
namespace {

// Simulated quantities have no noise; what is left is the resolution of their float32 on the wire.
constexpr double kLocalPositionVariance = 1e-5;     ///< [m^2] about 3 mm
constexpr double kDoublePositionVariance = 1e-4;    ///< [m^2] RPOS and X-Plane Connect: moved to the frame's time
constexpr double kFloat32PositionVariance = 0.25;   ///< [m^2] steps of 0.4 to 1.35 m
constexpr double kOrientationVariance = 1e-10;      ///< [rad^2]
constexpr double kVelocityVariance = 1e-8;          ///< [m^2/s^2]
constexpr double kAngularVelocityVariance = 1e-10;  ///< [rad^2/s^2]
constexpr double kAccelerationVariance = 1e-8;      ///< [m^2/s^4]
constexpr double kWindVariance = 1e-4;              ///< [m^2/s^2]

double positionVariance(core::PositionSource source) {
  switch (source) {
    case core::PositionSource::kLocal:
    case core::PositionSource::kLocalUnchecked:
      return kLocalPositionVariance;
    case core::PositionSource::kRpos:
    case core::PositionSource::kXpc:
      return kDoublePositionVariance;
    default:
      return kFloat32PositionVariance;
  }
}

template <class Covariance>
void setDiagonal(std::size_t size, std::size_t first, std::size_t count, double variance, Covariance* covariance) {
  for (std::size_t i = first; i < first + count; ++i) {
    (*covariance)[i * size + i] = variance;
  }
}

template <class Message>
void copyVector(const Eigen::Vector3d& vector, Message* message) {
  message->x = vector.x();
  message->y = vector.y();
  message->z = vector.z();
}

void copyQuaternion(const Eigen::Quaterniond& quaternion, geometry_msgs::Quaternion* message) {
  message->x = quaternion.x();
  message->y = quaternion.y();
  message->z = quaternion.z();
  message->w = quaternion.w();
}

template <class Array, class Message>
void copyArray(const Array& array, Message* message) {
  static_assert(Message::static_size == std::tuple_size<Array>::value, "message and struct agree on the size");
  std::copy(array.begin(), array.end(), message->begin());
}

template <class Message>
void fillMissionHeader(const core::MissionHeader& state, const std::string& frame, Message* message) {
  message->header.stamp = toRosTime(state.stamp_ns);
  message->header.frame_id = frame;
  message->sim_time = state.sim_time;
  message->epoch = state.epoch;
  message->valid = state.valid;
}

// The level quaternion of the state against the axes of `map`.
Eigen::Quaterniond orientationInMap(const core::FlightState& state, const core::TangentFrame& map) {
  return map.orientation(core::quaternionEnuFlu(state.orientation), state.latitude, state.longitude);
}

Eigen::Vector3d positionInMap(const core::FlightState& state) {
  return core::enuFromNed({state.position_north, state.position_east, state.position_down});
}

geometry_msgs::TransformStamped axesTransform(const std::string& parent, const std::string& child,
                                              const ros::Time& stamp, const Eigen::Quaterniond& rotation) {
  geometry_msgs::TransformStamped transform;
  transform.header.stamp = stamp;
  transform.header.frame_id = parent;
  transform.child_frame_id = child;
  copyQuaternion(rotation, &transform.transform.rotation);
  return transform;
}

}  // namespace

void toMessage(const core::FlightState& state, const std::string& frame, FlightState* message) {
  message->header.stamp = toRosTime(state.stamp_ns);
  message->header.frame_id = frame;
  message->valid = state.valid;
  message->sim_time = state.sim_time;
  message->sim_time_unwrapped = state.sim_time_unwrapped;
  message->stamp_uncertainty = state.stamp_uncertainty;
  message->frame_period = state.frame_period;
  message->epoch = state.epoch;
  message->frame_count = state.frame_count;
  message->paused = static_cast<std::uint8_t>(state.paused);
  message->replay = static_cast<std::uint8_t>(state.replay);
  message->latitude = state.latitude;
  message->longitude = state.longitude;
  message->altitude_msl = state.altitude_msl;
  message->position_north = state.position_north;
  message->position_east = state.position_east;
  message->position_down = state.position_down;
  message->position_epoch = state.position_epoch;
  message->position_source = static_cast<std::uint8_t>(state.position_source);
  message->altitude_agl = state.altitude_agl;
  message->altitude_indicated = state.altitude_indicated;
  message->altitude_pressure = state.altitude_pressure;
  message->roll_deg = state.roll_deg;
  message->pitch_deg = state.pitch_deg;
  message->heading_true_deg = state.heading_true_deg;
  message->heading_magnetic_deg = state.heading_magnetic_deg;
  message->declination_deg = state.declination_deg;
  copyQuaternion(state.orientation, &message->orientation);
  copyVector(state.angular_velocity, &message->angular_velocity);
  copyVector(state.euler_rates, &message->euler_rates);
  copyVector(state.angular_acceleration, &message->angular_acceleration);
  copyVector(state.velocity_ned, &message->velocity_ned);
  copyVector(state.velocity_body, &message->velocity_body);
  message->ground_speed = state.ground_speed;
  message->track_deg = state.track_deg;
  message->flight_path_angle_deg = state.flight_path_angle_deg;
  message->vertical_speed = state.vertical_speed;
  copyVector(state.air_velocity_body, &message->air_velocity_body);
  message->alpha_deg = state.alpha_deg;
  message->beta_deg = state.beta_deg;
  message->indicated_airspeed = state.indicated_airspeed;
  message->calibrated_airspeed = state.calibrated_airspeed;
  message->equivalent_airspeed = state.equivalent_airspeed;
  message->true_airspeed = state.true_airspeed;
  message->mach = state.mach;
  message->dynamic_pressure = state.dynamic_pressure;
  message->air_density = state.air_density;
  message->load_factor_normal = state.load_factor_normal;
  message->load_factor_axial = state.load_factor_axial;
  message->load_factor_side = state.load_factor_side;
  copyVector(state.specific_force, &message->specific_force);
  message->xplane_alpha_deg = state.xplane_alpha_deg;
  message->xplane_beta_deg = state.xplane_beta_deg;
  message->xplane_hpath_deg = state.xplane_hpath_deg;
  message->xplane_vpath_deg = state.xplane_vpath_deg;
  copyVector(state.wind_ned, &message->wind_ned);
  message->wind_speed = state.wind_speed;
  message->wind_from_deg = state.wind_from_deg;
  copyVector(state.aero_moment, &message->aero_moment);
  message->control_roll = state.control_roll;
  message->control_pitch = state.control_pitch;
  message->control_yaw = state.control_yaw;
  message->control_throttle = state.control_throttle;
  message->on_ground = static_cast<std::uint8_t>(state.on_ground);
}

void toMessage(const core::EngineStates& state, const std::string& frame, EngineStates* message) {
  fillMissionHeader(state, frame, message);
  message->count = state.count;
  copyArray(state.throttle_command, &message->throttle_command);
  copyArray(state.throttle_actual, &message->throttle_actual);
  copyArray(state.propeller_command, &message->propeller_command);
  copyArray(state.mixture, &message->mixture);
  copyArray(state.engine_speed, &message->engine_speed);
  copyArray(state.propeller_speed, &message->propeller_speed);
  copyArray(state.propeller_pitch, &message->propeller_pitch);
  copyArray(state.n1, &message->n1);
  copyArray(state.n2, &message->n2);
  copyArray(state.manifold_pressure, &message->manifold_pressure);
  copyArray(state.engine_pressure_ratio, &message->engine_pressure_ratio);
  copyArray(state.torque, &message->torque);
  copyArray(state.thrust, &message->thrust);
  copyArray(state.power, &message->power);
  copyArray(state.fuel_flow, &message->fuel_flow);
  copyArray(state.itt, &message->itt);
  copyArray(state.egt, &message->egt);
  copyArray(state.cht, &message->cht);
  copyArray(state.oil_pressure, &message->oil_pressure);
  copyArray(state.oil_temperature, &message->oil_temperature);
  copyArray(state.fuel_pressure, &message->fuel_pressure);
  copyArray(state.running, &message->running);
  copyArray(state.propeller_mode, &message->propeller_mode);
}

void toMessage(const core::SurfaceStates& state, const std::string& frame, SurfaceStates* message) {
  fillMissionHeader(state, frame, message);
  copyArray(state.aileron1, &message->aileron1);
  copyArray(state.aileron2, &message->aileron2);
  copyArray(state.spoiler1, &message->spoiler1);
  copyArray(state.spoiler2, &message->spoiler2);
  copyArray(state.flap1, &message->flap1);
  copyArray(state.flap2, &message->flap2);
  copyArray(state.speedbrake1, &message->speedbrake1);
  copyArray(state.speedbrake2, &message->speedbrake2);
  copyArray(state.yaw_brake, &message->yaw_brake);
  copyArray(state.elevator, &message->elevator);
  copyArray(state.rudder, &message->rudder);
  message->delta_aileron = state.delta_aileron;
  message->delta_elevator = state.delta_elevator;
  message->delta_rudder = state.delta_rudder;
}

void toMessage(const core::ControlStates& state, const std::string& frame, ControlStates* message) {
  fillMissionHeader(state, frame, message);
  message->stick_roll = state.stick_roll;
  message->stick_pitch = state.stick_pitch;
  message->stick_yaw = state.stick_yaw;
  message->augmentation_roll = state.augmentation_roll;
  message->augmentation_pitch = state.augmentation_pitch;
  message->augmentation_yaw = state.augmentation_yaw;
  message->total_roll = state.total_roll;
  message->total_pitch = state.total_pitch;
  message->total_yaw = state.total_yaw;
  message->trim_roll = state.trim_roll;
  message->trim_pitch = state.trim_pitch;
  message->trim_yaw = state.trim_yaw;
  message->flap_handle = state.flap_handle;
  message->flap_ratio = state.flap_ratio;
  message->slat_ratio = state.slat_ratio;
  message->speedbrake_handle = state.speedbrake_handle;
  message->speedbrake_ratio = state.speedbrake_ratio;
  message->gear_handle = state.gear_handle;
  copyArray(state.gear_deploy_ratio, &message->gear_deploy_ratio);
  message->nose_wheel_deg = state.nose_wheel_deg;
  message->parking_brake = state.parking_brake;
  message->left_brake = state.left_brake;
  message->right_brake = state.right_brake;
  message->thrust_vector_request = state.thrust_vector_request;
  message->thrust_vector_ratio = state.thrust_vector_ratio;
  copyArray(state.nacelle_angle_deg, &message->nacelle_angle_deg);
  message->override_joystick = static_cast<std::uint8_t>(state.override_joystick);
  message->override_throttles = static_cast<std::uint8_t>(state.override_throttles);
  message->override_control_surfaces = static_cast<std::uint8_t>(state.override_control_surfaces);
}

void toMessage(const core::ElectricalState& state, const std::string& frame, ElectricalState* message) {
  fillMissionHeader(state, frame, message);
  copyArray(state.bus_voltage, &message->bus_voltage);
  copyArray(state.bus_load, &message->bus_load);
  copyArray(state.battery_on, &message->battery_on);
  copyArray(state.battery_current, &message->battery_current);
  copyArray(state.battery_voltage, &message->battery_voltage);
  copyArray(state.generator_on, &message->generator_on);
  copyArray(state.generator_current, &message->generator_current);
  copyArray(state.inverter_on, &message->inverter_on);
  message->apu_running = state.apu_running;
  message->apu_n1 = state.apu_n1;
  copyArray(state.hydraulic_pressure, &message->hydraulic_pressure);
  copyArray(state.hydraulic_quantity, &message->hydraulic_quantity);
  message->avionics_on = state.avionics_on;
  message->navigation_lights_on = state.navigation_lights_on;
  message->beacon_on = state.beacon_on;
  message->strobe_lights_on = state.strobe_lights_on;
  message->landing_lights_on = state.landing_lights_on;
  message->taxi_light_on = state.taxi_light_on;
  message->pitot_heat_on = state.pitot_heat_on;
  message->cross_tie = state.cross_tie;
}

void toMessage(const core::AutopilotState& state, const std::string& frame, AutopilotState* message) {
  fillMissionHeader(state, frame, message);
  message->flight_director_mode = state.flight_director_mode;
  message->servos_on = state.servos_on;
  message->autothrottle_enabled = state.autothrottle_enabled;
  message->heading_mode = state.heading_mode;
  message->altitude_mode = state.altitude_mode;
  message->nav_status = state.nav_status;
  message->altitude_hold_status = state.altitude_hold_status;
  message->approach_status = state.approach_status;
  message->vnav_status = state.vnav_status;
  message->glideslope_status = state.glideslope_status;
  message->back_course_status = state.back_course_status;
  message->target_airspeed = state.target_airspeed;
  message->target_heading_deg = state.target_heading_deg;
  message->target_vertical_speed = state.target_vertical_speed;
  message->target_altitude = state.target_altitude;
  message->director_pitch_deg = state.director_pitch_deg;
  message->director_roll_deg = state.director_roll_deg;
}

void toMessage(const core::WarningState& state, const std::string& frame, WarningState* message) {
  fillMissionHeader(state, frame, message);
  message->master_caution = state.master_caution;
  message->master_warning = state.master_warning;
  message->autopilot_disconnect = state.autopilot_disconnect;
  message->low_vacuum = state.low_vacuum;
  message->low_voltage = state.low_voltage;
  message->fuel_quantity = state.fuel_quantity;
  message->hydraulic_pressure = state.hydraulic_pressure;
  message->yaw_damper = state.yaw_damper;
  message->speedbrake = state.speedbrake;
  message->gpws = state.gpws;
  message->ice = state.ice;
  message->pitot_heat = state.pitot_heat;
  message->cabin_altitude = state.cabin_altitude;
  copyArray(state.fuel_pressure_low, &message->fuel_pressure_low);
  copyArray(state.oil_pressure_low, &message->oil_pressure_low);
  copyArray(state.oil_temperature_high, &message->oil_temperature_high);
  copyArray(state.inverter_off, &message->inverter_off);
  copyArray(state.generator_off, &message->generator_off);
  copyArray(state.chip_detected, &message->chip_detected);
  copyArray(state.engine_fire, &message->engine_fire);
  message->stall = state.stall;
  message->gear_unsafe = state.gear_unsafe;
  message->overspeed = state.overspeed;
  message->crashed = state.crashed;
}

void toMessage(const core::FuelState& state, const std::string& frame, FuelState* message) {
  fillMissionHeader(state, frame, message);
  copyArray(state.fuel_tank, &message->fuel_tank);
  message->fuel_total = state.fuel_total;
  message->empty_mass = state.empty_mass;
  message->payload_mass = state.payload_mass;
  message->jettison_mass = state.jettison_mass;
  message->total_mass = state.total_mass;
  message->max_mass = state.max_mass;
  message->cg_offset = state.cg_offset;
}

void toMessage(const core::SimStatus& state, const std::string& frame, SimStatus* message) {
  fillMissionHeader(state, frame, message);
  message->frame_period = state.frame_period;
  message->frame_rate = state.frame_rate;
  message->time_ratio = state.time_ratio;
  message->time_ratio_requested = state.time_ratio_requested;
  message->flight_time = state.flight_time;
  message->zulu_time = state.zulu_time;
  message->local_time = state.local_time;
  message->paused = static_cast<std::uint8_t>(state.paused);
  message->replay = static_cast<std::uint8_t>(state.replay);
  message->view_type = state.view_type;
  message->view_external = state.view_external;
  message->view_heading_deg = state.view_heading_deg;
  message->view_pitch_deg = state.view_pitch_deg;
  message->field_of_view_deg = state.field_of_view_deg;
  message->window_width = state.window_width;
  message->window_height = state.window_height;
}

void toMessage(const core::LinkStatus& link, const std::string& transport, LinkState* message) {
  message->state = static_cast<std::uint8_t>(link.state);
  message->state_name = core::toString(link.state);
  message->reason = link.reason;
  message->link_epoch = link.epoch;
  message->host = link.peer.address != 0 ? link.peer.addressString() : "";
  message->port = link.peer.port;
  message->transport = transport;
  message->xplane_version = link.version.number;
  message->host_name = link.computer_name;
  message->silence = link.silence_s;
}

bool toOdometry(const core::FlightState& state, const core::TangentFrame& map, const FrameNames& frames,
                nav_msgs::Odometry* message) {
  if (!state.has(core::FlightState::kValidPosition | core::FlightState::kValidAttitude |
                 core::FlightState::kValidVelocity | core::FlightState::kValidRates)) {
    return false;
  }
  message->header.stamp = toRosTime(state.stamp_ns);
  message->header.frame_id = frames.map;
  message->child_frame_id = frames.base_link;
  copyVector(positionInMap(state), &message->pose.pose.position);
  copyQuaternion(orientationInMap(state, map), &message->pose.pose.orientation);
  setDiagonal(6, 0, 3, positionVariance(state.position_source), &message->pose.covariance);
  setDiagonal(6, 3, 3, kOrientationVariance, &message->pose.covariance);
  copyVector(core::fluFromFrd(state.velocity_body), &message->twist.twist.linear);
  copyVector(core::fluFromFrd(state.angular_velocity), &message->twist.twist.angular);
  setDiagonal(6, 0, 3, kVelocityVariance, &message->twist.covariance);
  setDiagonal(6, 3, 3, kAngularVelocityVariance, &message->twist.covariance);
  return true;
}

bool toTransform(const core::FlightState& state, const core::TangentFrame& map, const FrameNames& frames,
                 geometry_msgs::TransformStamped* message) {
  if (!state.has(core::FlightState::kValidPosition | core::FlightState::kValidAttitude)) {
    return false;
  }
  message->header.stamp = toRosTime(state.stamp_ns);
  message->header.frame_id = frames.map;
  message->child_frame_id = frames.base_link;
  copyVector(positionInMap(state), &message->transform.translation);
  copyQuaternion(orientationInMap(state, map), &message->transform.rotation);
  return true;
}

bool toImu(const core::FlightState& state, const FrameNames& frames, sensor_msgs::Imu* message) {
  if (!state.has(core::FlightState::kValidAttitude | core::FlightState::kValidRates | core::FlightState::kValidLoad)) {
    return false;
  }
  message->header.stamp = toRosTime(state.stamp_ns);
  message->header.frame_id = frames.base_link;
  copyQuaternion(core::quaternionEnuFlu(state.orientation), &message->orientation);
  copyVector(core::fluFromFrd(state.angular_velocity), &message->angular_velocity);
  copyVector(core::fluFromFrd(state.specific_force), &message->linear_acceleration);
  setDiagonal(3, 0, 3, kOrientationVariance, &message->orientation_covariance);
  setDiagonal(3, 0, 3, kAngularVelocityVariance, &message->angular_velocity_covariance);
  setDiagonal(3, 0, 3, kAccelerationVariance, &message->linear_acceleration_covariance);
  return true;
}

bool toNavSatFix(const core::FlightState& state, double geoid_undulation, const FrameNames& frames,
                 sensor_msgs::NavSatFix* message) {
  if (!state.has(core::FlightState::kValidPosition)) {
    return false;
  }
  message->header.stamp = toRosTime(state.stamp_ns);
  message->header.frame_id = frames.base_link;
  message->status.status = sensor_msgs::NavSatStatus::STATUS_FIX;
  message->status.service = sensor_msgs::NavSatStatus::SERVICE_GPS;
  message->latitude = state.latitude;
  message->longitude = state.longitude;
  message->altitude = state.altitude_msl + geoid_undulation;
  setDiagonal(3, 0, 3, positionVariance(state.position_source), &message->position_covariance);
  message->position_covariance_type = sensor_msgs::NavSatFix::COVARIANCE_TYPE_DIAGONAL_KNOWN;
  return true;
}

bool toWind(const core::FlightState& state, const core::TangentFrame& map, const FrameNames& frames,
            geometry_msgs::TwistWithCovarianceStamped* message) {
  if (!state.has(core::FlightState::kValidWind | core::FlightState::kValidPosition)) {
    return false;
  }
  message->header.stamp = toRosTime(state.stamp_ns);
  message->header.frame_id = frames.map;
  copyVector(map.frameFromLevel(state.latitude, state.longitude) * core::enuFromNed(state.wind_ned),
             &message->twist.twist.linear);
  setDiagonal(6, 0, 3, kWindVariance, &message->twist.covariance);
  return true;
}

void toOrigin(const core::GeoPoint& origin, std::int64_t stamp_ns, double geoid_undulation, const FrameNames& frames,
              sensor_msgs::NavSatFix* message) {
  message->header.stamp = toRosTime(stamp_ns);
  message->header.frame_id = frames.map;
  message->status.status = sensor_msgs::NavSatStatus::STATUS_FIX;
  message->status.service = sensor_msgs::NavSatStatus::SERVICE_GPS;
  message->latitude = origin.latitude_deg;
  message->longitude = origin.longitude_deg;
  message->altitude = origin.height + geoid_undulation;
  message->position_covariance_type = sensor_msgs::NavSatFix::COVARIANCE_TYPE_DIAGONAL_KNOWN;
}

geometry_msgs::TransformStamped baseLinkFrdTransform(const FrameNames& frames, const ros::Time& stamp) {
  return axesTransform(frames.base_link, frames.base_link_frd, stamp, Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0));
}

geometry_msgs::TransformStamped mapNedTransform(const FrameNames& frames, const ros::Time& stamp) {
  const double half = std::sqrt(0.5);
  return axesTransform(frames.map, frames.map_ned, stamp, Eigen::Quaterniond(0.0, half, half, 0.0));
}

}  // namespace xplane_bridge
