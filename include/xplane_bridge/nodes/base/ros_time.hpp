#pragma once

#include <cstdint>

#include <ros/time.h>

namespace xplane_bridge {

/// ROS's own topic of simulated time.
constexpr const char* kClockTopic = "/clock";

/// A clock's system time as a ROS time, exact to the nanosecond.
/// @param system_ns [ns] since the Unix epoch; a time before it becomes 0, which ROS takes for "no time"
/// @throws std::runtime_error beyond the year 2106, where ROS times end
inline ros::Time toRosTime(std::int64_t system_ns) {
  ros::Time out;
  if (system_ns > 0) out.fromNSec(static_cast<std::uint64_t>(system_ns));
  return out;
}

}  // namespace xplane_bridge
