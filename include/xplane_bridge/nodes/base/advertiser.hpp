#pragma once

#include <cstdint>
#include <string>

#include <ros/node_handle.h>

namespace xplane_bridge {

/// Advertises a node's topics. In a replay and in lock-step, which are faster than a flight, no message may fall out of
/// a queue.
class Advertiser {
 public:
  explicit Advertiser(ros::NodeHandle* handle) : handle_(handle) {}

  /// From now on queues have no limit.
  void keepAll() { keeps_all_ = true; }

  template <class Message>
  ros::Publisher advertise(const std::string& topic, std::uint32_t queue_size, bool latch = false) const {
    return handle_->advertise<Message>(topic, keeps_all_ ? 0 : queue_size, latch);  // 0: without a limit
  }

 private:
  ros::NodeHandle* handle_;
  bool keeps_all_ = false;
};

}  // namespace xplane_bridge
