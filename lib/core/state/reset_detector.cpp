#include "xplane_bridge/core/state/reset_detector.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "xplane_bridge/core/state/frames.hpp"

namespace xplane_bridge::core {
namespace {

double finite(double value) { return std::isfinite(value) ? value : 0.0; }

/// [m], height included; NaN while either place is unknown.
double distanceMoved(const FlightWatch& a, const FlightWatch& b) {
  const double over_ground =
      groundDistance({a.latitude_deg, a.longitude_deg, 0.0}, {b.latitude_deg, b.longitude_deg, 0.0});
  return std::hypot(over_ground, a.elevation - b.elevation);
}

/// Before a flight is loaded X-Plane shows zeros.
bool isNowhere(const FlightWatch& watch) { return watch.latitude_deg == 0.0 && watch.longitude_deg == 0.0; }

}  // namespace

std::optional<std::string> ResetDetector::add(const FlightWatch& now) {
  if (isNowhere(now)) return std::nullopt;
  const FlightWatch before = std::exchange(before_, now);
  if (now.flight_time < before.flight_time - options_.time_step) return "the flight began anew";
  // Twice the way it could have flown: accelerations over a gap in the stream are no jump.
  const double elapsed = std::max(0.0, finite(now.sim_time - before.sim_time));
  const double reach = options_.jump_distance + 2.0 * finite(before.ground_speed) * elapsed;
  const double moved = distanceMoved(before, now);
  if (!(moved > reach)) return std::nullopt;
  char text[64];
  std::snprintf(text, sizeof text, "the aircraft was placed %.0f m away", moved);
  return std::string(text);
}

}  // namespace xplane_bridge::core
