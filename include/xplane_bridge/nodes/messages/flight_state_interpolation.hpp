#pragma once

#include "xplane_bridge/FlightState.h"

namespace xplane_bridge {

/// The state between two received ones, at `fraction` (0 = from, 1 = to) of the simulator time between them.
///
/// Numbers are linear, angles go the short way round (also across +-180 and 0/360), the orientation turns at a constant
/// rate. What cannot be between (epoch, counts, sources, booleans) is the nearer one's; `valid` has only bits that both
/// have. Which field is what, its line in FlightState.msg says; made by cmake/message_code.
FlightState interpolate(const FlightState& from, const FlightState& to, double fraction);

}  // namespace xplane_bridge
