#pragma once

#include <cmath>
#include <optional>
#include <string>

#include "xplane_bridge/core/state/flight_watch.hpp"

namespace xplane_bridge::core {

/// Detects from frame to frame that the flight was reset or placed anew, whatever the cause: X-Plane says nothing of
/// it, but the flight's time begins again, or the aircraft is where it cannot have flown.
class ResetDetector {
 public:
  struct Options {
    double time_step = 0.25;       ///< [s] backwards in flight time: more than datagrams overtake each other
    double jump_distance = 100.0;  ///< [m] off what could have been flown
  };

  ResetDetector() : ResetDetector(Options{}) {}
  explicit ResetDetector(const Options& options) : options_(options) {}

  /// Takes a frame. Returns how the flight was reset, in words; nullopt: it goes on.
  std::optional<std::string> add(const FlightWatch& now);
  /// What comes next is not to be compared with what was: another X-Plane.
  void restart() { before_ = FlightWatch(); }
  /// What comes next is after a long silence, in which the aircraft may have been accelerated: only the flight's time
  /// shows a reset.
  void forgetPlace() { before_.latitude_deg = before_.longitude_deg = std::nan(""); }

 private:
  Options options_;
  FlightWatch before_;
};

}  // namespace xplane_bridge::core
