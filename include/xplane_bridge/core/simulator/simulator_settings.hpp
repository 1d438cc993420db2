#pragma once

/// Commands and datarefs behind tx_node's services: pause, and datarefs by name.

#include <string>
#include <vector>

#include "xplane_bridge/core/control/control_channels.hpp"

namespace xplane_bridge::core {

/// 0: the flight runs.
inline constexpr const char* kPausedDataref = "sim/time/paused";
/// Command that pauses or resumes. Before 12.10 there is only a toggle: send it once, and only if it is to change.
const char* pauseCommand(bool pause, SimulatorVersion version);

/// The names of `count` (1 and up) values beginning at `name`: the name itself for one, the elements that follow for
/// several. Throws std::invalid_argument as datarefElements() does; `name` is one dataref or element, no range.
std::vector<std::string> consecutiveElements(const std::string& name, std::size_t count);

}  // namespace xplane_bridge::core
