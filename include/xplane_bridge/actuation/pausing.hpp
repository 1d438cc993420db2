#pragma once

#include <cstdint>
#include <functional>

#include "xplane_bridge/core/link/simulator_port.hpp"

namespace xplane_bridge {

enum class PauseOutcome : std::uint8_t {
  kWasSo,        ///< nothing was sent
  kFollowed,     ///< X-Plane shows it
  kNotFollowed,  ///< sent, but X-Plane does not show it in time
  kUnknown,      ///< X-Plane does not tell whether it is paused; nothing was sent
};

/// Pauses X-Plane or lets it go on. What X-Plane shows decides whether anything is sent at all, and it is sent once:
/// before 12.10 there is only a toggle, and a toggle sent twice is none. Waits.
/// @param timeout_s for X-Plane's answer, and again until it shows what was asked for
/// @param given_up asked while waiting
PauseOutcome setPaused(core::SimulatorPort* link, bool pause, double timeout_s, const std::function<bool()>& given_up);

}  // namespace xplane_bridge
