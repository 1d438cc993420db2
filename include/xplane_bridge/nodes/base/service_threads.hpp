#pragma once

#include <cstdint>

#include <ros/callback_queue.h>
#include <ros/spinner.h>

namespace xplane_bridge {

/// Threads that serve services of their own, so that these do not wait until those of other threads have answered.
class ServiceThreads {
 public:
  explicit ServiceThreads(std::uint32_t threads) : spinner_(threads, &queue_) {}

  /// For ros::AdvertiseServiceOptions.
  ros::CallbackQueue* queue() { return &queue_; }
  void start() { spinner_.start(); }
  /// Calls fail at once from here on; those under way go on.
  void refuse() { queue_.disable(); }
  /// Waits for calls under way.
  void stop() {
    refuse();
    spinner_.stop();
  }

 private:
  ros::CallbackQueue queue_;
  ros::AsyncSpinner spinner_;
};

}  // namespace xplane_bridge
