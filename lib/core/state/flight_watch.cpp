#include "xplane_bridge/core/state/flight_watch.hpp"

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

struct Row {
  const char* dataref;
  double FlightWatch::*value;
  double factor;
};
constexpr Row kRows[] = {
    {"sim/time/total_running_time_sec", &FlightWatch::sim_time, 1.0},
    {"sim/operation/misc/frame_rate_period", &FlightWatch::frame_period, 1.0},
    {"sim/flightmodel/position/y_agl", &FlightWatch::height_agl, 1.0},
    {"sim/flightmodel/position/indicated_airspeed", &FlightWatch::indicated_airspeed, kMetersPerSecondPerKnot},
    {"sim/flightmodel/position/true_phi", &FlightWatch::roll_deg, 1.0},
    {"sim/flightmodel/position/true_theta", &FlightWatch::pitch_deg, 1.0},
    {"sim/flightmodel/position/alpha", &FlightWatch::alpha_deg, 1.0},
    {"sim/flightmodel/position/beta", &FlightWatch::beta_deg, 1.0},
    {"sim/time/total_flight_time_sec", &FlightWatch::flight_time, 1.0},
    {"sim/flightmodel/position/latitude", &FlightWatch::latitude_deg, 1.0},
    {"sim/flightmodel/position/longitude", &FlightWatch::longitude_deg, 1.0},
    {"sim/flightmodel/position/elevation", &FlightWatch::elevation, 1.0},
    {"sim/flightmodel/position/groundspeed", &FlightWatch::ground_speed, 1.0},
    {"sim/flightmodel/position/Prad", &FlightWatch::roll_rate_deg_s, 1.0 / kRadiansPerDegree},
    {"sim/flightmodel/position/Qrad", &FlightWatch::pitch_rate_deg_s, 1.0 / kRadiansPerDegree},
    {"sim/flightmodel/position/Rrad", &FlightWatch::yaw_rate_deg_s, 1.0 / kRadiansPerDegree},
    {"sim/flightmodel/position/true_airspeed", &FlightWatch::true_airspeed, 1.0},
};
constexpr std::size_t kRowCount = sizeof kRows / sizeof kRows[0];
// Behind them.
constexpr const char* kCrashed = "sim/flightmodel2/misc/has_crashed";
constexpr const char* kOnGround = "sim/flightmodel/failures/onground_any";
constexpr const char* kReplay = "sim/time/is_in_replay";

}  // namespace

const std::vector<std::string>& flightWatchDatarefs() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> out;
    for (const Row& row : kRows) out.emplace_back(row.dataref);
    out.emplace_back(kCrashed);
    out.emplace_back(kOnGround);
    out.emplace_back(kReplay);
    return out;
  }();
  return names;
}

void updateFlightWatch(const RrefView& datagram, FlightWatch* watch) {
  for (std::size_t i = 0; i < datagram.size(); ++i) {
    const RrefPair pair = datagram[i];
    if (pair.index < 0) continue;
    const auto index = static_cast<std::size_t>(pair.index);
    const auto value = static_cast<double>(pair.value);
    if (index < kRowCount) watch->*kRows[index].value = value * kRows[index].factor;
    if (index == kRowCount) watch->crashed = value != 0.0;
    if (index == kRowCount + 1) watch->on_ground = value != 0.0;
    if (index == kRowCount + 2) watch->replay = value != 0.0;
  }
}

}  // namespace xplane_bridge::core
