#pragma once

#include <functional>
#include <mutex>
#include <utility>

#include <ros/node_handle.h>
#include <ros/steady_timer.h>

namespace xplane_bridge {

/// Shows the guardian ten times a second that the thread of the timers runs, also while the node's clock stands.
class Heartbeat {
 public:
  struct Hooks {
    std::function<void()> beat;
    std::function<bool()> acted;    ///< whether the guardian has acted since that was last asked, as a beat was late
    std::function<void()> on_hang;  ///< what follows then
  };

  void start(const ros::NodeHandle& handle, Hooks hooks);
  /// The same without a timer: the caller beats.
  void start(Hooks hooks) { hooks_ = std::move(hooks); }
  /// A beat out of turn, after look(); nothing unless started.
  void beat();
  /// After a hang nothing may be sent as before: returns when what follows from it is done. For any thread, and nothing
  /// unless started.
  void look();
  void stop() { timer_.stop(); }

 private:
  std::mutex mutex_;  // held from the question to the end of what follows
  Hooks hooks_;
  ros::SteadyTimer timer_;
};

}  // namespace xplane_bridge
