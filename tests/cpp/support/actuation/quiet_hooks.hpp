#pragma once

#include <string>
#include <vector>

#include "xplane_bridge/actuation/actuation.hpp"

namespace xplane_bridge {

/// An Actuation's hooks that do nothing; the node never ends. A test replaces those that it listens to.
inline ActuationHooks quietHooks() {
  ActuationHooks hooks;
  hooks.mode = [](const core::ModeStatus&, double) {};
  hooks.applied = [](const AppliedControls&, const auto&) {};
  hooks.surfaces_applied = [](const SurfaceControl::Echo&, core::FlightMode, const auto&) {};
  hooks.failures = [](const FailureSnapshot&) {};
  hooks.excitation = [](const ExcitationLabel&) {};
  hooks.disturbance = [](const DisturbanceLabel&) {};
  hooks.event = [](const ActuationEvent&) {};
  hooks.warn = [](const std::string&) {};
  hooks.journal_problem = [](const std::string&) {};
  hooks.stopping = [] { return false; };
  return hooks;
}

}  // namespace xplane_bridge
