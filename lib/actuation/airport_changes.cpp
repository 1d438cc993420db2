#include <cstdio>
#include <fstream>

#include "xplane_bridge/actuation/flight_changes.hpp"

namespace xplane_bridge {
namespace {

constexpr const char* kRefused = "reset_flight: ";

std::string spotOf(const core::AirportStart& start) {
  const bool ramp = start.spot == core::AirportSpot::kRamp;
  std::string name = start.name.empty() ? std::to_string(start.index) : start.name;
  if (start.name.empty() && !ramp) name += ", end " + std::to_string(start.end);
  return (ramp ? "ramp " : "runway ") + name + " of " + start.airport;
}

/// Gives a spot that is named its numbers and place; returns what is wrong, empty: nothing.
std::string resolve(const std::string& airport_data, core::AirportStart* start) {
  if (start->name.empty()) return "";
  if (airport_data.empty()) {
    return "\"" + start->name +
           "\" is a name: set tx_node's parameter airport_data to X-Plane's apt.dat, or give spot_index and runway_end";
  }
  std::ifstream file(airport_data);
  if (!file) return "airport_data " + airport_data + " cannot be read: expected X-Plane's apt.dat";
  const std::string problem = core::findSpot(file, start);
  return problem.empty() ? "" : problem + " (in " + airport_data + ")";
}

}  // namespace

FlightChangeOutcome FlightChanges::placeAt(const core::AirportStart& asked, const std::string& who) {
  const auto failed = [](const std::string& problem) {
    return FlightChangeOutcome{core::EventKind::kReset, kRefused + problem, false};
  };
  core::AirportStart start = asked;
  if (const std::string problem = resolve(options_.airport_data, &start); !problem.empty()) return failed(problem);
  if (!tellsBeginning()) {
    return failed("the flight has only just begun, so X-Plane would not show a new one" + linkCondition() +
                  ": let it fly for a second, then ask again");
  }
  const PauseOutcome before = pause(true, who);
  PauseOutcome again = PauseOutcome::kUnknown;
  std::optional<core::ShownFlight> shown;
  const std::string problem = waitForAirport(start, &shown);
  if (problem.empty()) again = pause(true, who);
  pauseAsBefore(before, again, who);
  if (!problem.empty()) return failed(problem);
  if (start.spot != core::AirportSpot::kFinal) {
    return {core::EventKind::kReset, "the flight begins at " + spotOf(start), true};
  }
  FlightChangeOutcome outcome = place(core::finalStart(start, *shown), who);
  if (outcome.success) {
    char distance[32];
    std::snprintf(distance, sizeof distance, "%.0f m", start.final_distance);
    outcome.text = std::string("the flight goes on ") + distance + " before " + spotOf(start);
  }
  return outcome;
}

std::string FlightChanges::waitForAirport(const core::AirportStart& start, std::optional<core::ShownFlight>* shown) {
  const core::Deadline deadline = deadlineAfter(options_.load_timeout);
  const unsigned resets = hooks_.resets();
  const auto there = [&start](const std::optional<core::ShownFlight>& now) {
    return now && core::isThere(start, *now);
  };
  if (beginThere({core::placementOf(start), there, true, true}, deadline, shown)) return "";
  if (hooks_.resets() == resets) {
    return "X-Plane begins no flight at " + spotOf(start) + (isUp() ? "" : linkCondition()) +
           ": does it have that airport, and so many ramps or runways there?";
  }
  if (!*shown) return "X-Plane does not show where the aircraft is" + linkCondition();
  return "X-Plane has begun a flight, but the aircraft does not stand at " + spotOf(start) + linkCondition();
}

}  // namespace xplane_bridge
