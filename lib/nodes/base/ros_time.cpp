#include "xplane_bridge/nodes/base/ros_time.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <ros/init.h>
#include <ros/master.h>
#include <ros/node_handle.h>
#include <ros/this_node.h>
#include <rosgraph_msgs/Clock.h>
#include <xmlrpcpp/XmlRpcValue.h>

namespace xplane_bridge {
namespace {

constexpr const char* kUseSimTime = "/use_sim_time";

}  // namespace

void initWithOwnTime(int* argc, char** argv, const std::string& name, std::uint32_t options) {
  std::string elsewhere = std::string(kUseSimTime) + ":=/use_sim_time_is_read_by_xplane_bridge";  // not found there
  std::vector<char*> words(argv, argv + *argc);
  words.push_back(elsewhere.data());
  int count = static_cast<int>(words.size());
  ros::init(count, words.data(), name, options);
  *argc = count;
  std::copy_n(words.begin(), count, argv);
}

bool movesRosTime() {
  // Not by ros::param, which reads what roscpp reads.
  XmlRpc::XmlRpcValue request, response, value;
  request[0] = ros::this_node::getName();
  request[1] = kUseSimTime;
  const bool is_set = ros::master::execute("getParam", request, response, value, false);
  if (!is_set || value.getType() != XmlRpc::XmlRpcValue::TypeBoolean || !static_cast<bool>(value)) return false;
  ros::Time::setNow(ros::Time());
  return true;
}

ros::Subscriber followClock(ros::CallbackQueueInterface* queue) {
  ros::SubscribeOptions options;
  options.init<rosgraph_msgs::Clock>(
      kClockTopic, 1, [](const rosgraph_msgs::ClockConstPtr& clock) { ros::Time::setNow(clock->clock); });
  options.transport_hints = ros::TransportHints().tcpNoDelay();
  options.callback_queue = queue;
  return ros::NodeHandle().subscribe(options);
}

}  // namespace xplane_bridge
