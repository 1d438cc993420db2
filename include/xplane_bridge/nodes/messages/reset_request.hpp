#pragma once

/// @file
/// What tx_node/reset_flight is asked for: a place, or a spot of an airport.

#include <cstdint>
#include <optional>
#include <string>

#include "xplane_bridge/ResetFlight.h"
#include "xplane_bridge/actuation/flight_jobs.hpp"
#include "xplane_bridge/core/simulator/airport_start.hpp"

namespace xplane_bridge {

/// Only of a request whose `start` is not PLACE.
core::AirportStart airportStart(const ResetFlight::Request& request);

/// What is wrong with a request, in words that say what was expected; nullopt: nothing.
std::optional<std::string> wrongWith(const ResetFlight::Request& request);

/// See FlightJobs::reset(). Only of a request with which nothing is wrong.
void beginReset(FlightJobs* jobs, const ResetFlight::Request& request, std::uint32_t number, const std::string& who);

}  // namespace xplane_bridge
