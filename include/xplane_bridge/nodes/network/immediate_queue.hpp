#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <utility>

#include <ros/callback_queue_interface.h>

namespace xplane_bridge {

/// Serves callbacks of subscriptions where their messages are read, on roscpp's network thread, so that no other thread
/// has to be woken for each. One at a time, in order. Until open() they are kept. They must be short, must not wait for
/// another message, and must not publish by shared pointer to a topic that the same node subscribes to.
class ImmediateQueue final : public ros::CallbackQueueInterface {
 public:
  /// Serves what was kept, and from now on each at once.
  void open();

  void addCallback(const ros::CallbackInterfacePtr& callback, std::uint64_t owner) override;
  void removeByID(std::uint64_t owner) override;

 private:
  std::mutex mutex_;  // guards the following, and is held during a callback
  bool open_ = false;
  std::deque<std::pair<std::uint64_t, ros::CallbackInterfacePtr>> kept_;
};

}  // namespace xplane_bridge
