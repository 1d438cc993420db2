#pragma once

#include <string>
#include <vector>

#include <diagnostic_updater/DiagnosticStatusWrapper.h>

#include "xplane_bridge/core/link/sim_link.hpp"

namespace xplane_bridge {

/// Says in one diagnostic status how the link to X-Plane is: OK while connected or paused, WARN while stale, searching
/// or with something a user should act on, ERROR when lost. Counts that matter are given in total and since `last`.
/// @param now,last the link's counters now and at the previous report
/// @param unanswered datarefs X-Plane does not know
void fillLinkDiagnostics(const core::LinkStatus& link, const core::LinkCounters& now, const core::LinkCounters& last,
                         const std::vector<std::string>& unanswered,
                         diagnostic_updater::DiagnosticStatusWrapper* status);

}  // namespace xplane_bridge
