#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include "xplane_bridge/core/base/clock.hpp"

namespace xplane_bridge::core {

/// The clock of a node in lock-step: it stands, and moves from frame to frame of the simulator.
///
/// Before the first frame (held) and after release() nothing of the simulator moves it: its steady time goes at the
/// host's pace then, so that X-Plane can be found and left, and its system time stands. While it flies, both go by
/// simulated time; in a pause, in which that stands, the steady time goes on by a frame's length with each frame. The
/// steady time never steps. Thread-safe.
class LockstepClock {
 public:
  /// @param host whose pace it goes at while it does not fly
  /// @param start_ns [ns] its system time at simulated time 0
  LockstepClock(Clock host, std::int64_t start_ns);

  Clock clock() const;

  enum class Phase : std::uint8_t { kHeld, kFlying, kReleased };
  Phase phase() const;

  /// The newest complete frame is of this simulated time [ns]; the first call begins the flight. Nothing after
  /// release().
  void move(std::int64_t sim_ns);
  /// The flight is over: the node ends, and must not wait for frames that never come.
  void release();
  /// Lets those go on whose time has come. To be called every few milliseconds while it does not fly.
  void tick();

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace xplane_bridge::core
