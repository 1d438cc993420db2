#pragma once

#include <cstdint>
#include <string>

#include <ros/callback_queue_interface.h>
#include <ros/subscriber.h>
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

// ROS's time with `use_sim_time`. roscpp gives every message of /clock to a thread of its own; a node that has the time
// anyway, or serves messages where they are read, spares itself that.

/// ros::init() for a node that moves ROS's time itself. Takes ROS's arguments out of `argv`, as ros::init() does.
void initWithOwnTime(int* argc, char** argv, const std::string& name, std::uint32_t options = 0);

/// Whether the node is to move ROS's time by ros::Time::setNow(): whether `use_sim_time` is set. Its time stands at 0
/// from then on. Needs a master, and initWithOwnTime().
bool movesRosTime();

/// Moves ROS's time with /clock. @param queue serves its messages, and outlives the subscription
ros::Subscriber followClock(ros::CallbackQueueInterface* queue);

}  // namespace xplane_bridge
