#include "xplane_bridge/nodes/messages/conversions.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "xplane_bridge/nodes/messages/field_copy.hpp"

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
  putField(rotation, &transform.transform.rotation);
  return transform;
}

}  // namespace

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

geometry_msgs::Transform toTransform(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation) {
  geometry_msgs::Transform transform;
  putField(translation, &transform.translation);
  putField(rotation, &transform.rotation);
  return transform;
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
  putField(positionInMap(state), &message->pose.pose.position);
  putField(orientationInMap(state, map), &message->pose.pose.orientation);
  setDiagonal(6, 0, 3, positionVariance(state.position_source), &message->pose.covariance);
  setDiagonal(6, 3, 3, kOrientationVariance, &message->pose.covariance);
  putField(core::fluFromFrd(state.velocity_body), &message->twist.twist.linear);
  putField(core::fluFromFrd(state.angular_velocity), &message->twist.twist.angular);
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
  putField(positionInMap(state), &message->transform.translation);
  putField(orientationInMap(state, map), &message->transform.rotation);
  return true;
}

bool toImu(const core::FlightState& state, const FrameNames& frames, sensor_msgs::Imu* message) {
  if (!state.has(core::FlightState::kValidAttitude | core::FlightState::kValidRates | core::FlightState::kValidLoad)) {
    return false;
  }
  message->header.stamp = toRosTime(state.stamp_ns);
  message->header.frame_id = frames.base_link;
  putField(core::quaternionEnuFlu(state.orientation), &message->orientation);
  putField(core::fluFromFrd(state.angular_velocity), &message->angular_velocity);
  putField(core::fluFromFrd(state.specific_force), &message->linear_acceleration);
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
  putField(map.frameFromLevel(state.latitude, state.longitude) * core::enuFromNed(state.wind_ned),
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
