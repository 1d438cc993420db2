#pragma once

/// @file
/// Requests of tx_node's flight services into core structs. Free functions, no state.

#include <optional>
#include <string>

#include "xplane_bridge/LoadAircraft.h"
#include "xplane_bridge/ResetFlight.h"
#include "xplane_bridge/SetAutopilot.h"
#include "xplane_bridge/SetLoading.h"
#include "xplane_bridge/SetTime.h"
#include "xplane_bridge/SetWeather.h"
#include "xplane_bridge/SetWind.h"
#include "xplane_bridge/Situation.h"
#include "xplane_bridge/core/simulator/autopilot_settings.hpp"
#include "xplane_bridge/core/simulator/flight_settings.hpp"
#include "xplane_bridge/core/simulator/flight_start.hpp"
#include "xplane_bridge/core/simulator/world_settings.hpp"
#include "xplane_bridge/nodes/messages/reset_request.hpp"

namespace xplane_bridge {

core::FlightStart toCore(const ResetFlight::Request& request);
core::UniformWind toCore(const SetWind::Request& request);
core::Loading toCore(const SetLoading::Request& request);
core::AutopilotSetting toCore(const SetAutopilot::Request& request);
core::TimeSetting toCore(const SetTime::Request& request);
/// Only of a request with which nothing is wrong: lists of one length.
core::Weather toCore(const SetWeather::Request& request);

/// What is wrong with a request, in words that say what was expected; nullopt: nothing.
std::optional<std::string> wrongWith(const SetWind::Request& request);
std::optional<std::string> wrongWith(const SetLoading::Request& request);
std::optional<std::string> wrongWith(const SetAutopilot::Request& request);
std::optional<std::string> wrongWith(const SetTime::Request& request);
std::optional<std::string> wrongWith(const SetWeather::Request& request);
std::optional<std::string> wrongWith(const LoadAircraft::Request& request);
std::optional<std::string> wrongWith(const Situation::Request& request);

}  // namespace xplane_bridge
