#pragma once

/// @file
/// Requests, results and labels of actuation/ from and into messages. Free functions, no state.

#include <vector>

#include "xplane_bridge/AppliedCommand.h"
#include "xplane_bridge/DisturbanceState.h"
#include "xplane_bridge/ExcitationState.h"
#include "xplane_bridge/FailureState.h"
#include "xplane_bridge/IdentifySurfaces.h"
#include "xplane_bridge/InjectExcitation.h"
#include "xplane_bridge/ServiceResult.h"
#include "xplane_bridge/SetDisturbance.h"
#include "xplane_bridge/SetFailure.h"
#include "xplane_bridge/actuation/control_path.hpp"
#include "xplane_bridge/actuation/disturbance/disturbance_manager.hpp"
#include "xplane_bridge/actuation/excitation_manager.hpp"
#include "xplane_bridge/actuation/failure_manager.hpp"
#include "xplane_bridge/actuation/request_result.hpp"
#include "xplane_bridge/actuation/surface_control.hpp"
#include "xplane_bridge/actuation/surface_identification.hpp"
#include "xplane_bridge/core/failures/failures.hpp"

namespace xplane_bridge {

core::FailureRequest toCore(const SetFailure::Request& request);
/// Without its kind, which is a word.
core::DisturbanceSpec toCore(const SetDisturbance::Request& request);
ExcitationRequest toCore(const InjectExcitation::Request& request);
IdentificationRequest toCore(const IdentifySurfaces::Request& request);

ServiceResult toMessage(const RequestResult& result);
/// Stamped with the time of sending.
void toMessage(const AppliedControls& applied, const std::vector<core::SurfaceDeflection>& surfaces,
               AppliedCommand* message);
/// All but the header.
void toMessage(const SurfaceControl::Echo& echo, core::FlightMode mode,
               const std::vector<core::SurfaceDeflection>& surfaces, AppliedCommand* message);
void toMessage(const FailureSnapshot& snapshot, FailureState* message);
void toMessage(const ExcitationLabel& label, ExcitationState* message);
void toMessage(const DisturbanceLabel& label, DisturbanceState* message);

}  // namespace xplane_bridge
