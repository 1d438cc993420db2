#pragma once

/// Placing the aircraft in the air (docs/protocol.md 5.4): what is sent, and whether X-Plane shows it.

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "xplane_bridge/core/control/control_channels.hpp"
#include "xplane_bridge/core/state/frames.hpp"
#include "xplane_bridge/core/wire/dataref_reader.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {

/// Where and how a flight goes on. Angles in degrees.
struct FlightStart {
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double altitude_msl = 0.0;           ///< [m]
  double roll_deg = 0.0;               ///< right +
  double pitch_deg = 0.0;              ///< nose up +
  double heading_true_deg = 0.0;       ///< 0..360; the flight path through the air goes this way
  double true_airspeed = 0.0;          ///< [m/s] along the flight path
  double flight_path_angle_deg = 0.0;  ///< climbing +, through the air
};

/// What is wrong with it: name, value, expected range; nullopt: nothing.
std::optional<std::string> check(const FlightStart& start);

/// PREL: a new flight at the place, X-Plane 11's way. It takes heading and speed; the rest is motionWrites()' [? prel].
Placement placementOf(const FlightStart& start);
/// VEHS: X-Plane 12's way, which leaves the velocity as it is [? vehs].
VehiclePose poseOf(const FlightStart& start);

/// The same flight as X-Plane shows it.
struct ShownFlight {
  TangentFrame scenery;                                    ///< of the local axes
  GeoPoint place;                                          ///< millimetres, from the local position
  EulerAngles attitude;                                    ///< relative to the local level [rad]
  Eigen::Vector3d velocity_ned = Eigen::Vector3d::Zero();  ///< over ground, local level [m/s]
  Eigen::Vector3d wind_ned = Eigen::Vector3d::Zero();      ///< velocity of the air, horizontal [m/s]
};

/// What to read for it.
std::vector<std::string> shownFlightDatarefs(SimulatorVersion version);
/// From the values of shownFlightDatarefs(), in that order; nullopt while one is missing.
std::optional<ShownFlight> shownFlightFrom(const std::vector<DatarefValue>& values);

/// X-Plane shows it there: within 1 km, when the place has been taken but the motion has not been set.
bool isNear(const FlightStart& start, const ShownFlight& shown);
/// Attitude (by q, which alone sets it), velocity over ground and rates (none), for the scenery origin and the wind
/// that X-Plane shows at the place; during a pause [? paused-motion].
std::vector<DatarefWrite> motionWrites(const FlightStart& start, const ShownFlight& shown);
/// In what X-Plane differs from it, in words; empty: in nothing. Tolerances are those of an aircraft that has flown on
/// for 0.2 s.
std::string differenceOf(const FlightStart& start, const ShownFlight& shown);
/// The same of the place alone.
std::string placeDifferenceOf(const FlightStart& start, const ShownFlight& shown);

}  // namespace xplane_bridge::core
