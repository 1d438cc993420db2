#include "xplane_bridge/core/simulator/airport_start.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <utility>
#include <vector>

#include "setting_texts.hpp"
#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

constexpr std::size_t kCode = 7;  // characters: PREL has 8, of which X-Plane may want the last for a zero
constexpr double kLeastFinal = 500.0, kMostFinal = 50000.0;  // [m]
constexpr double kMostSpeed = 600.0;                         // [m/s]
constexpr double kGlidePathDeg = 3.0;
constexpr double kThresholdHeight = 15.0;  // [m]
constexpr double kStands = 3.0;            // [m/s]
constexpr double kNearSpot = 500.0;        // [m] X-Plane lines up somewhat behind the threshold
constexpr double kSameHeadingDeg = 15.0;

// Rows of apt.dat that count here.
constexpr int kAirport = 1, kSeaplaneBase = 16, kHeliport = 17, kRunwayRow = 100, kRampRow = 1300, kOldRampRow = 15;
constexpr int kEnd = 99;
// Words of a runway's row: name, latitude and longitude of either end.
constexpr std::array<std::size_t, 2> kEndWords = {8, 17};
constexpr std::size_t kRunwayWords = 20;

struct Spot {
  std::string name;
  std::int32_t index, end;
  AirportPlace at;
};

std::vector<std::string> wordsOf(const std::string& line) {
  std::istringstream in(line);
  std::vector<std::string> out;
  for (std::string word; in >> word;) out.push_back(word);
  return out;
}

/// From one end of a runway to the other, true.
double bearingDeg(const AirportPlace& from, const AirportPlace& to) {
  const double north = to.latitude_deg - from.latitude_deg;
  const double east = (to.longitude_deg - from.longitude_deg) * std::cos(from.latitude_deg * kRadiansPerDegree);
  return wrap360(std::atan2(east, north) * kDegreesPerRadian);
}

double numberOf(const std::string& word) { return std::strtod(word.c_str(), nullptr); }

void addRunway(const std::vector<std::string>& words, std::int32_t index, std::vector<Spot>* out) {
  if (words.size() < kRunwayWords) return;
  std::array<Spot, 2> ends;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const std::size_t at = kEndWords[i];
    ends[i] = {words[at], index, static_cast<std::int32_t>(i), {numberOf(words[at + 1]), numberOf(words[at + 2]), 0.0}};
  }
  ends[0].at.heading_true_deg = bearingDeg(ends[0].at, ends[1].at);
  ends[1].at.heading_true_deg = bearingDeg(ends[1].at, ends[0].at);
  out->insert(out->end(), ends.begin(), ends.end());
}

/// `before_name`: words of the row that stand before the name.
void addRamp(const std::vector<std::string>& words, std::size_t before_name, std::int32_t index,
             std::vector<Spot>* out) {
  if (words.size() <= before_name) return;
  const std::vector<std::string> name(words.begin() + static_cast<std::ptrdiff_t>(before_name), words.end());
  out->push_back({join(name, " "), index, 0, {numberOf(words[1]), numberOf(words[2]), numberOf(words[3])}});
}

/// The spots of an airport, up to where the next one begins; `in` is behind its first row.
std::vector<Spot> spotsOf(std::istream& in, bool ramps) {
  std::vector<Spot> out;
  std::int32_t index = 0;
  for (std::string line; std::getline(in, line);) {
    const int row = std::atoi(line.c_str());
    if (row == kAirport || row == kSeaplaneBase || row == kHeliport || row == kEnd) break;
    if (ramps && (row == kRampRow || row == kOldRampRow))
      addRamp(wordsOf(line), row == kRampRow ? 6 : 4, index++, &out);
    if (!ramps && row == kRunwayRow) addRunway(wordsOf(line), index++, &out);
  }
  return out;
}

/// Reads on to the airport's rows; false: it is not in there.
bool goTo(std::istream& in, const std::string& airport) {
  for (std::string line; std::getline(in, line);) {
    const int row = std::atoi(line.c_str());
    if (row != kAirport && row != kSeaplaneBase && row != kHeliport) continue;
    const std::vector<std::string> words = wordsOf(line);
    if (words.size() > 4 && words[4] == airport) return true;
  }
  return false;
}

}  // namespace

std::optional<std::string> check(const AirportStart& start) {
  const auto isCode = [](char c) { return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'); };
  if (start.airport.empty() || start.airport.size() > kCode ||
      !std::all_of(start.airport.begin(), start.airport.end(), isCode)) {
    return "airport is \"" + start.airport + "\": expected an ICAO code of 1 to " + std::to_string(kCode) +
           " capital letters and digits";
  }
  if (start.index < 0) return "spot_index is " + std::to_string(start.index) + ": expected 0 or more";
  if (start.end < 0 || start.end > 1) return "runway_end is " + std::to_string(start.end) + ": expected 0 or 1";
  if (!start.name.empty() && (start.index != 0 || start.end != 0)) {
    return "spot and numbers are both given: expected a name, or spot_index and runway_end";
  }
  if (start.spot != AirportSpot::kFinal) return std::nullopt;
  if (auto wrong = outside("final_distance", start.final_distance, kLeastFinal, kMostFinal, "m")) return wrong;
  if (auto wrong = outside("true_airspeed", start.true_airspeed, 1.0, kMostSpeed, "m/s")) return wrong;
  if (auto wrong = outside("roll_deg", start.roll_deg, -180.0, 180.0, "deg, right +")) return wrong;
  return outside("pitch_deg", start.pitch_deg, -90.0, 90.0, "deg, nose up +");
}

std::string findSpot(std::istream& airport_data, AirportStart* start) {
  if (!goTo(airport_data, start->airport)) return "there is no airport " + start->airport;
  const bool ramps = start->spot == AirportSpot::kRamp;
  const std::vector<Spot> spots = spotsOf(airport_data, ramps);
  const auto named = [start](const Spot& spot) { return spot.name == start->name; };
  const auto found = std::find_if(spots.begin(), spots.end(), named);
  if (found == spots.end()) {
    const std::string have = join(spots, ", ", [](const Spot& spot) { return spot.name; });
    return start->airport + " has no " + (ramps ? "ramp \"" : "runway \"") + start->name + "\", but " +
           (have.empty() ? "none" : have);
  }
  start->index = found->index;
  start->end = found->end;
  start->at = found->at;
  return "";
}

Placement placementOf(const AirportStart& start) {
  Placement out;
  out.start = start.spot == AirportSpot::kRamp ? StartType::kRamp : StartType::kRunway;
  out.airport = start.airport;
  out.runway = start.index;
  out.runway_direction = start.end;
  return out;
}

bool isThere(const AirportStart& start, const ShownFlight& shown) {
  if (!(shown.velocity_ned.norm() <= kStands)) return false;
  if (!start.at) return true;
  const double turn = wrap180(shown.attitude.heading * kDegreesPerRadian - start.at->heading_true_deg);
  return groundDistance({start.at->latitude_deg, start.at->longitude_deg, 0.0}, shown.place) <= kNearSpot &&
         std::abs(turn) <= kSameHeadingDeg;
}

FlightStart finalStart(const AirportStart& start, const ShownFlight& lined_up) {
  const double heading = lined_up.attitude.heading;
  const TangentFrame level({lined_up.place.latitude_deg, lined_up.place.longitude_deg, 0.0}, kEarthRadius);
  const GeoPoint before =
      level.geoPoint({-start.final_distance * std::sin(heading), -start.final_distance * std::cos(heading), 0.0});
  FlightStart out;
  out.latitude_deg = before.latitude_deg;
  out.longitude_deg = before.longitude_deg;
  out.altitude_msl =
      lined_up.place.height + kThresholdHeight + start.final_distance * std::tan(kGlidePathDeg * kRadiansPerDegree);
  out.roll_deg = start.roll_deg;
  out.pitch_deg = start.pitch_deg;
  out.heading_true_deg = wrap360(heading * kDegreesPerRadian);
  out.true_airspeed = start.true_airspeed;
  out.flight_path_angle_deg = -kGlidePathDeg;
  return out;
}

}  // namespace xplane_bridge::core
