#pragma once

/// @file
/// What controls, driven surfaces, failures and the guardian say of themselves on /diagnostics.

#include <diagnostic_updater/DiagnosticStatusWrapper.h>

#include "xplane_bridge/actuation/actuation.hpp"
#include "xplane_bridge/actuation/failure_manager.hpp"
#include "xplane_bridge/actuation/guardian.hpp"
#include "xplane_bridge/actuation/surface_control.hpp"

namespace xplane_bridge {

void fillDiagnostics(const ControlSnapshot& control, diagnostic_updater::DiagnosticStatusWrapper* status);
void fillDiagnostics(const SurfaceControlStatus& surfaces, diagnostic_updater::DiagnosticStatusWrapper* status);
void fillDiagnostics(const FailureSnapshot& failures, diagnostic_updater::DiagnosticStatusWrapper* status);
/// Starts it once more where it has ended by itself, and says so.
void watchGuardian(Guardian* guardian, diagnostic_updater::DiagnosticStatusWrapper* status);

}  // namespace xplane_bridge
