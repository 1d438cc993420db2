#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>

#include "xplane_bridge/LockstepStep.h"
#include "xplane_bridge/actuation/actuation.hpp"
#include "xplane_bridge/core/base/thread_turns.hpp"
#include "xplane_bridge/nodes/tx/tx_lockstep.hpp"

namespace xplane_bridge {

/// lockstep/step, run and hold: of lock-step, or of a simulator that does not wait for participants, which flies and is
/// paused then. They wait for frames; run and hold end a step that waits. Thread-safe.
class LockstepServices {
 public:
  /// @param lockstep null without lock-step
  /// @param ending whether the node ends, so that nothing is waited for any more
  /// @param who asks for a pause
  LockstepServices(TxLockstep* lockstep, Actuation* actuation, core::SimulatorPort* link, std::function<bool()> ending,
                   std::string who);

  void step(const LockstepStep::Request& request, LockstepStep::Response* response);
  /// @return what was in the way; empty: nothing
  std::string setRunning(bool running);

 private:
  /// Without lock-step; `turn_` is held. @return number of the call
  std::uint64_t note(bool holds);
  void stepInLockstep(const LockstepStep::Request& request, LockstepStep::Response* response);
  void stepFreely(const LockstepStep::Request& request, LockstepStep::Response* response);

  TxLockstep* const lockstep_;
  Actuation& actuation_;
  core::SimulatorPort& link_;
  const std::function<bool()> ending_;
  const std::string who_;
  // Without lock-step.
  core::TurnMutex turn_;                 // of who pauses X-Plane or lets it go on; guards the following
  bool last_holds_ = true;               // the last call
  std::atomic<std::uint64_t> calls_{0};  // read without turn_ as well
};

}  // namespace xplane_bridge
