#pragma once

/// @file
/// Control messages into core structs and back. Free functions, no state.

#include "xplane_bridge/AppliedCommand.h"
#include "xplane_bridge/ControlCommand.h"
#include "xplane_bridge/ControlMode.h"
#include "xplane_bridge/core/control/control_arbiter.hpp"
#include "xplane_bridge/core/control/control_command.hpp"
#include "xplane_bridge/core/surfaces/surfaces.hpp"

namespace xplane_bridge {

core::ControlCommand toCore(const ControlCommand& message);
/// All but the header.
void toMessage(const core::ControlCommand& command, ControlCommand* message);

/// Fills everything the arbiter knows: all but header, surfaces and read-back.
void toMessage(const core::ArbitratedControls& controls, AppliedCommand* message);
/// All but the header.
void toMessage(const core::ModeStatus& status, double sim_time, ControlMode* message);
/// Fills the surfaces sent one by one.
void fillSurfaces(const std::vector<core::SurfaceDeflection>& surfaces, AppliedCommand* message);

}  // namespace xplane_bridge
