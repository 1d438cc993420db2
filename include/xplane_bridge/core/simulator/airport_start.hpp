#pragma once

/// A flight that begins at an airport: what is asked of X-Plane, and whether it shows it. X-Plane alone knows where its
/// airports are; a file of its own (apt.dat) gives the names of runways and ramps.

#include <cstdint>
#include <istream>
#include <optional>
#include <string>

#include "xplane_bridge/core/simulator/flight_start.hpp"

namespace xplane_bridge::core {

/// As in ResetFlight.srv.
enum class AirportSpot : std::uint8_t { kRamp = 1, kRunway = 2, kFinal = 3 };

/// Where apt.dat has a ramp, or the end of a runway.
struct AirportPlace {
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double heading_true_deg = 0.0;
};

struct AirportStart {
  AirportSpot spot = AirportSpot::kRamp;
  std::string airport;             ///< ICAO code
  std::string name;                ///< of the ramp or runway; empty: `index` and `end` count
  std::int32_t index = 0;          ///< of the ramp or runway, as X-Plane counts, from 0
  std::int32_t end = 0;            ///< of the runway: 0 or 1
  double final_distance = 0.0;     ///< [m] before where X-Plane lines an aircraft up; kFinal
  double true_airspeed = 0.0;      ///< [m/s] kFinal
  double roll_deg = 0.0;           ///< right +; kFinal
  double pitch_deg = 0.0;          ///< nose up +; kFinal
  std::optional<AirportPlace> at;  ///< where a named one is
};

/// What is wrong with it: name, value, what is expected; nullopt: nothing.
std::optional<std::string> check(const AirportStart& start);

/// Finds index, end and place of the spot that is named, in X-Plane's apt.dat (versions 1000 to 1200).
/// @return what is wrong: no such airport, or no such name there, with those it has; empty: nothing.
std::string findSpot(std::istream& airport_data, AirportStart* start);

/// PREL: a new flight on the ramp or runway; of kFinal the runway. Its airport is `start`'s text.
Placement placementOf(const AirportStart& start);

/// X-Plane shows an aircraft that stands, and if it is known where the spot is, stands there.
bool isThere(const AirportStart& start, const ShownFlight& shown);

/// On the glide path to the runway that `lined_up` shows: 15 m above it at a distance of 0.
FlightStart finalStart(const AirportStart& start, const ShownFlight& lined_up);

}  // namespace xplane_bridge::core
