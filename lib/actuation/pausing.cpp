#include "xplane_bridge/actuation/pausing.hpp"

#include "xplane_bridge/core/simulator/simulator_settings.hpp"

namespace xplane_bridge {

PauseOutcome setPaused(core::SimulatorPort* link, bool pause, double timeout_s, const std::function<bool()>& given_up) {
  // Read now: the link's own status may be a fifth of a second old, and a toggle on that would do the opposite.
  const auto shown = link->read({core::kPausedDataref}, timeout_s);
  if (shown.empty() || !shown.front()) return PauseOutcome::kUnknown;
  const bool was_so = (*shown.front() != 0.0F) == pause;
  if (!was_so) link->command(core::pauseCommand(pause, link->status().version));
  const auto is_so = [&] { return link->status().paused == pause; };
  link->waitUntil([&] { return given_up() || is_so(); }, timeout_s);
  if (!is_so()) return PauseOutcome::kNotFollowed;
  return was_so ? PauseOutcome::kWasSo : PauseOutcome::kFollowed;
}

}  // namespace xplane_bridge
