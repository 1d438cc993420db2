#include "xplane_bridge/nodes/messages/reset_request.hpp"

#include <initializer_list>
#include <utility>

#include "xplane_bridge/nodes/messages/flight_conversions.hpp"

namespace xplane_bridge {
namespace {

using Request = ResetFlight::Request;

/// The first of them that is not 0; empty: none.
std::string notZero(std::initializer_list<std::pair<const char*, double>> fields) {
  for (const auto& [name, value] : fields) {
    if (value != 0.0) return name;
  }
  return "";
}

}  // namespace

core::AirportStart airportStart(const Request& request) {
  core::AirportStart out;
  out.spot = static_cast<core::AirportSpot>(request.start);
  out.airport = request.airport;
  out.name = request.spot;
  out.index = request.spot_index;
  out.end = request.runway_end;
  out.final_distance = static_cast<double>(request.final_distance);
  out.true_airspeed = static_cast<double>(request.true_airspeed);
  out.roll_deg = static_cast<double>(request.roll_deg);
  out.pitch_deg = static_cast<double>(request.pitch_deg);
  return out;
}

std::optional<std::string> wrongWith(const Request& request) {
  if (request.start > Request::FINAL) {
    return "start is " + std::to_string(request.start) + ": expected 0 (PLACE), 1 (RAMP), 2 (RUNWAY) or 3 (FINAL)";
  }
  const bool final = request.start == Request::FINAL;
  std::string surplus;
  if (request.start == Request::PLACE) {
    surplus = !request.airport.empty() ? "airport" : !request.spot.empty() ? "spot" : "";
    if (surplus.empty()) {
      surplus = notZero({{"spot_index", request.spot_index},
                         {"runway_end", request.runway_end},
                         {"final_distance", request.final_distance}});
    }
  } else {
    surplus = notZero({{"latitude", request.latitude},
                       {"longitude", request.longitude},
                       {"altitude_msl", request.altitude_msl},
                       {"heading_true_deg", request.heading_true_deg},
                       {"flight_path_angle_deg", request.flight_path_angle_deg}});
    if (surplus.empty() && !final) {
      surplus = notZero({{"true_airspeed", request.true_airspeed},
                         {"roll_deg", request.roll_deg},
                         {"pitch_deg", request.pitch_deg},
                         {"final_distance", request.final_distance}});
    }
    if (surplus.empty() && request.start == Request::RAMP && request.runway_end != 0) surplus = "runway_end";
  }
  if (!surplus.empty()) {
    return surplus + " does not go with start " + std::to_string(request.start) +
           (request.start == Request::PLACE ? " (PLACE): expected RAMP, RUNWAY or FINAL with an airport"
                                            : ": X-Plane knows the place, expected it to be left out");
  }
  return request.start == Request::PLACE ? core::check(toCore(request)) : core::check(airportStart(request));
}

void beginReset(FlightJobs* jobs, const Request& request, std::uint32_t number, const std::string& who) {
  if (request.start == Request::PLACE) {
    jobs->reset(toCore(request), number, who);
  } else {
    jobs->reset(airportStart(request), number, who);
  }
}

}  // namespace xplane_bridge
