#pragma once

#include <cstdint>

#include "xplane_bridge/core/state/flight_state.hpp"
#include "xplane_bridge/core/state/frames.hpp"

namespace xplane_bridge::core {

/// What the flight group's table lines deliver for one frame, in SI units (degrees where a name ends in _deg),
/// whichever transport it came by. NaN: not carried. Axes: OpenGL = X-Plane's scenery axes at its origin.
struct FlightInputs {
  double sim_time = kNaN;  ///< raw float32
  double frame_period = kNaN;
  double paused = kNaN;  ///< 0 or 1
  double replay = kNaN;  ///< 0 or 1

  Eigen::Vector3d local_position = nanVector();  ///< OpenGL
  double origin_latitude = kNaN;                 ///< of the scenery origin [deg]
  double origin_longitude = kNaN;
  double earth_radius = kNaN;
  double latitude = kNaN;  ///< float32, coarse [deg]
  double longitude = kNaN;
  double elevation = kNaN;  ///< MSL
  double altitude_agl = kNaN;
  double altitude_indicated = kNaN;
  double altitude_pressure = kNaN;
  double static_pressure = kNaN;  ///< outside the aircraft [Pa]

  double roll_deg = kNaN;
  double pitch_deg = kNaN;
  double heading_true_deg = kNaN;
  double heading_magnetic_deg = kNaN;
  double declination_deg = kNaN;  ///< east +

  double roll_rate = kNaN;  ///< p
  double pitch_rate = kNaN;
  double yaw_rate = kNaN;
  Eigen::Vector3d angular_acceleration = nanVector();  ///< FRD
  Eigen::Vector3d local_velocity = nanVector();        ///< OpenGL

  double indicated_airspeed = kNaN;
  double calibrated_airspeed = kNaN;  ///< only where X-Plane gives it
  double equivalent_airspeed = kNaN;  ///< only where X-Plane gives it
  double true_airspeed = kNaN;
  double mach = kNaN;
  double dynamic_pressure = kNaN;
  double air_density = kNaN;

  double load_factor_normal = kNaN;
  double load_factor_axial = kNaN;
  double load_factor_side = kNaN;

  double xplane_alpha_deg = kNaN;
  double xplane_beta_deg = kNaN;
  double xplane_hpath_deg = kNaN;
  double xplane_vpath_deg = kNaN;

  Eigen::Vector3d wind_local = nanVector();  ///< velocity of the air, OpenGL
  double wind_from_deg = kNaN;               ///< the same by direction and speed, where that is what comes
  double wind_speed = kNaN;

  Eigen::Vector3d aero_moment = nanVector();  ///< FRD

  double control_roll = kNaN;
  double control_pitch = kNaN;
  double control_yaw = kNaN;
  double control_throttle = kNaN;
  double on_ground = kNaN;  ///< 0 or 1
};

/// A position with the source it came from.
struct PositionFix {
  GeoPoint place{kNaN, kNaN, kNaN};
  PositionSource source = PositionSource::kNone;
};

/// Axes against which X-Plane gives roll, pitch and heading. The datarefs asked for are the local level's; for row 17
/// it is not known [?], and the default below is what the working programs assume.
enum class AttitudeReference : std::uint8_t { kLocalLevel, kSceneryOrigin };
inline constexpr AttitudeReference kDefaultRowAttitudeReference = AttitudeReference::kLocalLevel;

/// Below this ground speed the track is the true heading [m/s].
inline constexpr double kMinSpeedForTrack = 0.5;

/// @return earth radius that X-Plane gave, or kEarthRadius where it gave none that can be
double usableEarthRadius(const FlightInputs& inputs);

/// The simulator answers with nothing but zeros while no flight is loaded.
bool isNoFlight(const FlightInputs& inputs);

/// Position from scenery coordinates on the sphere.
/// @return source kNone when an input is missing or not finite; else kLocalUnchecked
PositionFix localPosition(const FlightInputs& inputs);

/// Position from float32 latitude, longitude and elevation. @return source kNone or kFloat32
PositionFix float32Position(const FlightInputs& inputs);

/// Computes every field that does not depend on the clock: groups, their validity, standard derived quantities.
/// stamp_ns, sim_time_unwrapped, stamp_uncertainty, epoch, frame_count and position_epoch are left to the caller.
/// @param position may have source kNone: velocity, wind and attitude then are not valid either, as they need the tilt
/// @param map frame of position_north, _east, _down
FlightState computeFlightState(const FlightInputs& inputs, const PositionFix& position, const TangentFrame& map,
                               AttitudeReference attitude_reference = AttitudeReference::kLocalLevel);

}  // namespace xplane_bridge::core
