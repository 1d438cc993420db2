#pragma once

#include <functional>

#include <ros/node_handle.h>
#include <ros/steady_timer.h>

namespace xplane_bridge {

/// Shows the guardian ten times a second that the thread of the subscriptions runs, also while the node's clock stands.
class Heartbeat {
 public:
  /// @param beat says whether the guardian has acted since the last beat, because this one was late
  /// @param on_hang what follows then
  void start(const ros::NodeHandle& handle, std::function<bool()> beat, std::function<void()> on_hang);
  /// A beat out of turn; nothing unless started.
  void beat() const {
    if (beat_ && beat_()) on_hang_();
  }
  void stop() { timer_.stop(); }

 private:
  std::function<bool()> beat_;
  std::function<void()> on_hang_;
  ros::SteadyTimer timer_;
};

}  // namespace xplane_bridge
