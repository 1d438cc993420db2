#pragma once

/// @file
/// Requests, results and labels of actuation/ from and into messages. Free functions, no state.

#include "xplane_bridge/ExcitationState.h"
#include "xplane_bridge/FailureState.h"
#include "xplane_bridge/InjectExcitation.h"
#include "xplane_bridge/ServiceResult.h"
#include "xplane_bridge/SetFailure.h"
#include "xplane_bridge/actuation/excitation_manager.hpp"
#include "xplane_bridge/actuation/failure_manager.hpp"
#include "xplane_bridge/actuation/request_result.hpp"
#include "xplane_bridge/core/failures/failures.hpp"

namespace xplane_bridge {

core::FailureRequest toCore(const SetFailure::Request& request);
ExcitationRequest toCore(const InjectExcitation::Request& request);

ServiceResult toMessage(const RequestResult& result);
/// All but the header.
void toMessage(const FailureSnapshot& snapshot, FailureState* message);
void toMessage(const ExcitationLabel& label, ExcitationState* message);

}  // namespace xplane_bridge
