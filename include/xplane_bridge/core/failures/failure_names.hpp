/// Every failure X-Plane has a dataref for.
#pragma once

#include <string>
#include <vector>

#include "xplane_bridge/core/base/simulator_version.hpp"

namespace xplane_bridge::core {

/// Full datarefs sim/operation/failures/rel_* of a version, as Laminar's published lists have them (11.40, 12.08;
/// X-Plane2Blender, io_xplane2blender/resources/DataRefs.txt). [?] A later X-Plane may have more: any rel_* can be set
/// by its name, but those that are not listed are not noticed when they are set in the simulator's menu.
const std::vector<std::string>& simulatorFailures(SimulatorVersion version);

/// Whether a failure dataref keeps surfaces from following stick, trims and flaps.
bool touchesSurfaces(const std::string& dataref);

}  // namespace xplane_bridge::core
