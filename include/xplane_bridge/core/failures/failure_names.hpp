#pragma once

/// Every failure X-Plane has a dataref for.

#include <string>
#include <vector>

#include "xplane_bridge/core/base/simulator_version.hpp"

namespace xplane_bridge::core {

/// Failures that come and go with the same versions of X-Plane.
struct FailureNames {
  VersionRange versions;
  const char* leaves;  ///< without "rel_", separated by spaces
};
/// All sim/operation/failures/rel_* of the lists that Laminar ships with X-Plane.
const std::vector<FailureNames>& failureNameTable();

/// Full datarefs sim/operation/failures/rel_* of a version; while it is unknown those of all. A later X-Plane may
/// have more: any rel_* can be set by its name, but those that are not listed are not noticed when they are set in the
/// simulator's menu.
std::vector<std::string> simulatorFailures(SimulatorVersion version);

/// Whether a version has a failure (full dataref).
bool hasFailure(SimulatorVersion version, const std::string& dataref);

/// Whether a failure dataref keeps surfaces from following stick, trims and flaps.
bool touchesSurfaces(const std::string& dataref);

}  // namespace xplane_bridge::core
