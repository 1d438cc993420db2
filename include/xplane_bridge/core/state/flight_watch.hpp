#pragma once

/// The few quantities tx_node watches every frame: triggers, attitude limits, read-back times, resets. Not a state
/// source: that is the state assembler's (field_table.hpp).

#include <cmath>
#include <string>
#include <vector>

#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {

struct FlightWatch {
  double sim_time = std::nan("");            ///< [s] raw simulator time
  double frame_period = std::nan("");        ///< [s]
  double height_agl = std::nan("");          ///< [m]
  double indicated_airspeed = std::nan("");  ///< [m/s]
  double roll_deg = std::nan("");            ///< right +
  double pitch_deg = std::nan("");           ///< nose up +
  double alpha_deg = std::nan("");           ///< nose up +
  double beta_deg = std::nan("");            ///< [? beta-sign] as X-Plane has it: for floating surfaces
  double flight_time = std::nan("");         ///< [s] since the flight began
  double latitude_deg = std::nan("");        ///< to a metre: X-Plane sends it as float32
  double longitude_deg = std::nan("");
  double elevation = std::nan("");         ///< [m] MSL
  double ground_speed = std::nan("");      ///< [m/s]
  double true_airspeed = std::nan("");     ///< [m/s]
  double roll_rate_deg_s = std::nan("");   ///< about the body's axes: right +
  double pitch_rate_deg_s = std::nan("");  ///< nose up +
  double yaw_rate_deg_s = std::nan("");    ///< nose right +
  bool on_ground = false;                  ///< a wheel is
  bool crashed = false;
  bool replay = false;  ///< what X-Plane shows is of earlier
};

/// What to subscribe; the position is the index.
const std::vector<std::string>& flightWatchDatarefs();

/// Takes what a datagram carries of flightWatchDatarefs() into `watch`; the rest stays.
void updateFlightWatch(const RrefView& datagram, FlightWatch* watch);

}  // namespace xplane_bridge::core
