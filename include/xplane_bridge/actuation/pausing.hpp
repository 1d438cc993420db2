#pragma once

#include <cstdint>
#include <functional>

#include "xplane_bridge/core/link/simulator_port.hpp"

namespace xplane_bridge {

enum class PauseOutcome : std::uint8_t {
  kWasSo,        ///< nothing was sent
  kFollowed,     ///< X-Plane shows it
  kNotFollowed,  ///< sent, but X-Plane does not show it in time
  kUnknown,      ///< X-Plane does not report whether it is paused; nothing was sent
};

/// Pauses X-Plane or lets it go on. What X-Plane shows decides whether anything is sent at all, and it is sent once:
/// before 12.10 there is only a toggle, and a toggle sent twice is none. Waits, also for others of this process that
/// do the same. Thread-safe.
/// @param timeout_s for X-Plane's answer, and again until it shows what was asked for
/// @param given_up asked while waiting
/// @param before called right before anything is sent
PauseOutcome setPaused(core::SimulatorPort* link, bool pause, double timeout_s, const std::function<bool()>& given_up,
                       const std::function<void()>& before = {});

/// Journal purpose of pauses that must not outlive who asked for them.
extern const char* const kPausePurpose;
/// To be called before such a pause, and once it is over. Throw core::JournalError.
void recordPause(core::SimulatorPort* link);
void forgetPause(core::SimulatorPort* link);
/// Whether such a pause of this process is not over. Throws core::JournalError.
bool isPauseOurs(core::SimulatorPort* link);
/// Leaves it to resumeLeftovers(), as X-Plane has not been seen to go on. Throws core::JournalError.
void leavePause(core::SimulatorPort* link);
/// Lets X-Plane go on that a crashed run, or leavePause(), has left paused. Waits up to `timeout_s` twice. Returns
/// whether no such pause is left. Throws core::JournalError.
bool resumeLeftovers(core::SimulatorPort* link, double timeout_s);

}  // namespace xplane_bridge
