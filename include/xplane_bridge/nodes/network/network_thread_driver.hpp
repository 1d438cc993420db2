#pragma once

#include <functional>
#include <memory>

#include <ros/poll_set.h>

#include "xplane_bridge/core/base/clock.hpp"

namespace xplane_bridge {

/// What is done whenever a descriptor is readable, and now and then.
struct DrivenByNetwork {
  int fd = -1;
  std::function<bool()> receive;  ///< reads what there is, and returns at once whether step() is due
  std::function<void()> step;
  /// [ms] until the next step() at the latest. Called behind each step().
  std::function<int()> patience_ms;
};

/// Has a link receive on roscpp's network thread: what the link publishes is then sent by the thread that has received
/// it, and no other has to be woken. What else is due is done by a thread of the driver's own, so that no subscriber
/// waits for that, or for a name server that does not answer. (A link in lock-step does all in receive().) One of the
/// two at a time.
class NetworkThreadDriver {
 public:
  /// Begins at once. @param clock that runs by itself @param poll_set of roscpp; outlives the driver
  NetworkThreadDriver(DrivenByNetwork driven, core::Clock clock, ros::PollSet* poll_set);
  /// Ends it; then neither is under way.
  ~NetworkThreadDriver();
  NetworkThreadDriver(const NetworkThreadDriver&) = delete;
  NetworkThreadDriver& operator=(const NetworkThreadDriver&) = delete;

 private:
  class Impl;
  const std::shared_ptr<Impl> impl_;  // the network thread may still hold it
};

}  // namespace xplane_bridge
