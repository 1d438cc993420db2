#pragma once

#include <string>
#include <variant>
#include <vector>

#include "xplane_bridge/TrafficCommand.h"
#include "xplane_bridge/TrafficState.h"
#include "xplane_bridge/core/simulator/traffic_motion.hpp"
#include "xplane_bridge/core/state/traffic.hpp"

namespace xplane_bridge {

/// All but header and epoch.
void toMessage(const core::TrafficState& state, TrafficState* message);

/// Their poses; or, in words, which array does not have the length of the others.
std::variant<std::vector<core::TrafficPose>, std::string> toCore(const TrafficCommand& message);

}  // namespace xplane_bridge
