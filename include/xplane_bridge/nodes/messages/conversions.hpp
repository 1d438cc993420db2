#pragma once

/// @file
/// Core structs into ROS messages. Free functions; they fill a message the caller keeps, so that publishing at a
/// kilohertz allocates nothing here. Those of the bridge's own states are in state_messages.hpp, made by
/// cmake/message_code. Axes come from core/frames.hpp (REP 103, 105, 145, 147).

#include <cstdint>
#include <string>

#include <geometry_msgs/Transform.h>
#include <geometry_msgs/TransformStamped.h>
#include <geometry_msgs/TwistWithCovarianceStamped.h>
#include <nav_msgs/Odometry.h>
#include <ros/time.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/NavSatFix.h>

#include "xplane_bridge/LinkState.h"
#include "xplane_bridge/core/link/sim_link.hpp"
#include "xplane_bridge/core/state/flight_state.hpp"
#include "xplane_bridge/core/state/frames.hpp"
#include "xplane_bridge/nodes/base/common_options.hpp"
#include "xplane_bridge/nodes/base/ros_time.hpp"
#include "xplane_bridge/nodes/messages/state_messages.hpp"

namespace xplane_bridge {

/// All of a link's status except header.stamp and the aircraft.
void toMessage(const core::LinkStatus& link, const std::string& transport, LinkState* message);

/// @param translation [m]
geometry_msgs::Transform toTransform(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation);

// Standard messages. Each returns false, with the message untouched, when one of its inputs is not valid; nothing may
// be published then.

/// Pose of the aircraft in `map` (ENU at the origin, also the orientation: turned by tilt and convergence), twist in
/// base_link (FLU), so that d(position)/dt is the twist turned into `map`.
/// @param map the frame that state.position_* refers to
bool toOdometry(const core::FlightState& state, const core::TangentFrame& map, const FrameNames& frames,
                nav_msgs::Odometry* message);

/// The same pose as a transform map -> base_link.
bool toTransform(const core::FlightState& state, const core::TangentFrame& map, const FrameNames& frames,
                 geometry_msgs::TransformStamped* message);

/// Specific force and rates in base_link (FLU; +9.81 on z at rest), orientation FLU -> local-level ENU at the aircraft.
bool toImu(const core::FlightState& state, const FrameNames& frames, sensor_msgs::Imu* message);

/// Latitude and longitude as X-Plane has them (on its sphere).
/// @param geoid_undulation [m] added to the altitude above mean sea level
bool toNavSatFix(const core::FlightState& state, double geoid_undulation, const FrameNames& frames,
                 sensor_msgs::NavSatFix* message);

/// Velocity of the air in `map` (ENU at the origin).
bool toWind(const core::FlightState& state, const core::TangentFrame& map, const FrameNames& frames,
            geometry_msgs::TwistWithCovarianceStamped* message);

/// The origin of `map`; its altitude is above mean sea level plus the undulation.
void toOrigin(const core::GeoPoint& origin, std::int64_t stamp_ns, double geoid_undulation, const FrameNames& frames,
              sensor_msgs::NavSatFix* message);

/// base_link -> base_link_frd: half a turn about the forward axis.
geometry_msgs::TransformStamped baseLinkFrdTransform(const FrameNames& frames, const ros::Time& stamp);
/// map -> map_ned: the axes swapped, the third reversed.
geometry_msgs::TransformStamped mapNedTransform(const FrameNames& frames, const ros::Time& stamp);

}  // namespace xplane_bridge
