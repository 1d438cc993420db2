#pragma once

/// @file
/// The one place that converts axes and signs.
///
/// Axes
///   NED     local level, north-east-down, at the aircraft
///   ENU     local level, east-north-up, at the aircraft
///   FRD     body, forward-right-down (aerospace)
///   FLU     body, forward-left-up (REP 103)
///   OpenGL  X-Plane's scenery axes: X east, Y up, Z south, tangent to the sphere at the scenery origin
///   map     ENU tangent to X-Plane's sphere at an origin the user chooses; does not jump with the scenery
///
/// `R_a_b` turns components in b into components in a: `v_a = R_a_b * v_b`. Radians unless a name ends in `_deg`.

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace xplane_bridge::core {

/// Attitude of the body (FRD) against a level NED frame [rad].
struct EulerAngles {
  double roll = 0.0;     ///< right wing down +
  double pitch = 0.0;    ///< nose up +
  double heading = 0.0;  ///< of the nose, clockwise from true north
};

/// A place on X-Plane's sphere. Latitude and longitude as X-Plane gives them, height above the sphere (MSL).
struct GeoPoint {
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double height = 0.0;  ///< [m]
};

/// X-Plane's earth is a sphere of this radius [m] (docs/protocol.md 1.8; `sim/physics/earth_radius_m` says it).
inline constexpr double kEarthRadius = 6378145.0;

/// Signs that turn X-Plane's load values into load factors (axial forward +, side right +, normal up +), in units of g.
/// DATA row 4 and the datarefs `sim/flightmodel/forces/g_*` differ in the axial sign (docs/protocol.md 1.9)
/// [? axial-sign] [? side-sign]: at rest the axial load factor must be +sin(pitch).
inline constexpr double kRowAxialSign = +1.0;
inline constexpr double kRowSideSign = +1.0;
inline constexpr double kRowNormalSign = +1.0;
inline constexpr double kDatarefAxialSign = -1.0;
inline constexpr double kDatarefSideSign = +1.0;
inline constexpr double kDatarefNormalSign = +1.0;

// --- angles ---

/// @return the angle in [-pi, pi).
double wrapPi(double angle);
/// @return the angle in [-180, 180) [deg].
double wrap180(double angle_deg);
/// @return the angle in [0, 360) [deg].
double wrap360(double angle_deg);

// --- axis permutations (each its own inverse where the name reads both ways) ---

inline Eigen::Vector3d enuFromNed(const Eigen::Vector3d& v) { return {v.y(), v.x(), -v.z()}; }
inline Eigen::Vector3d nedFromEnu(const Eigen::Vector3d& v) { return {v.y(), v.x(), -v.z()}; }
inline Eigen::Vector3d fluFromFrd(const Eigen::Vector3d& v) { return {v.x(), -v.y(), -v.z()}; }
inline Eigen::Vector3d frdFromFlu(const Eigen::Vector3d& v) { return {v.x(), -v.y(), -v.z()}; }
inline Eigen::Vector3d enuFromOpengl(const Eigen::Vector3d& v) { return {v.x(), -v.z(), v.y()}; }
inline Eigen::Vector3d openglFromEnu(const Eigen::Vector3d& v) { return {v.x(), v.z(), -v.y()}; }

// --- attitude ---

/// @return R_ned_frd = Rz(heading) Ry(pitch) Rx(roll).
Eigen::Matrix3d rotationNedFrd(const EulerAngles& attitude);
/// @return unit quaternion that turns FRD vectors into NED; w >= 0.
Eigen::Quaterniond quaternionNedFrd(const EulerAngles& attitude);
/// @return unit quaternion that turns FLU vectors into ENU (REP 103); w >= 0. Equals Rz(90 deg - heading) Ry(-pitch)
/// Rx(roll).
Eigen::Quaterniond quaternionEnuFlu(const Eigen::Quaterniond& q_ned_frd);
/// Inverse of rotationNedFrd.
/// @return roll and heading in [-pi, pi), pitch in [-pi/2, pi/2]. At pitch = +-90 deg roll is 0 and heading takes all.
EulerAngles eulerAngles(const Eigen::Matrix3d& R_ned_frd);

/// Rates of roll, pitch and heading [rad/s] from body rates.
/// @param rates_frd p, q, r [rad/s]
/// @return NaN in roll and heading where |pitch| is within 0.1 deg of 90 deg: they are not defined there.
Eigen::Vector3d eulerRates(const EulerAngles& attitude, const Eigen::Vector3d& rates_frd);

// --- air data axes ---

/// Airspeed [m/s], angle of attack and sideslip [rad] of an air-relative velocity in FRD [m/s].
struct AirAngles {
  double true_airspeed = 0.0;
  double angle_of_attack = 0.0;  ///< air from below +
  double sideslip = 0.0;         ///< air from the right +
};

/// Below this airspeed [m/s] the two angles are noise and 0 is returned for them.
inline constexpr double kMinAirspeedForAngles = 1.0;

/// @return velocity of the aircraft through the air, FRD [m/s].
Eigen::Vector3d airRelativeVelocity(const Eigen::Matrix3d& R_ned_frd, const Eigen::Vector3d& velocity_ned,
                                    const Eigen::Vector3d& wind_ned);
AirAngles airAngles(const Eigen::Vector3d& air_relative_velocity_frd);

/// Velocity of the air, NED [m/s], from where it comes [rad, true] and how fast [m/s]; no vertical part.
Eigen::Vector3d windNedFromDirection(double from_direction, double speed);
/// @return where the wind comes from, true, [0, 360) [deg]; 0 when calm (below 1 mm/s).
double windFromDirectionDeg(const Eigen::Vector3d& wind_ned);

/// Specific force, FRD [m/s^2]: what an accelerometer reads, (0, 0, -g) in level flight and at rest.
/// @param axial,side,normal load factors in g: forward +, right +, up +
Eigen::Vector3d specificForce(double axial, double side, double normal);

// --- X-Plane's sphere ---

/// Columns: east, north, up at that place in earth-fixed axes (z to the north pole, x to latitude 0, longitude 0).
Eigen::Matrix3d levelAxes(double latitude_deg, double longitude_deg);

/// Great-circle distance over ground between two places, heights ignored [m].
double groundDistance(const GeoPoint& a, const GeoPoint& b, double earth_radius = kEarthRadius);

/// Cartesian ENU frame tangent to X-Plane's sphere at an origin. It serves both as X-Plane's scenery frame (origin
/// height 0, axes OpenGL) and as the ROS `map` frame (origin anywhere), in which d(position)/dt equals the twist
/// exactly.
class TangentFrame {
 public:
  TangentFrame() : TangentFrame(GeoPoint{}) {}
  /// @param earth_radius [m]
  explicit TangentFrame(const GeoPoint& origin, double earth_radius = kEarthRadius);

  const GeoPoint& origin() const { return origin_; }
  double earthRadius() const { return earth_radius_; }

  /// @return position in this frame, ENU of the origin [m].
  Eigen::Vector3d position(const GeoPoint& place) const;
  /// @param position ENU of the origin [m]
  GeoPoint geoPoint(const Eigen::Vector3d& position) const;

  /// @return R_level_frame: this frame's ENU components into local level ENU at the place (tilt and convergence).
  Eigen::Matrix3d levelFromFrame(double latitude_deg, double longitude_deg) const;
  /// @return R_frame_level: local level ENU at the place into this frame's ENU.
  Eigen::Matrix3d frameFromLevel(double latitude_deg, double longitude_deg) const;
  /// @return quaternion FLU -> this frame, from the level one (FLU -> ENU at the place); w >= 0.
  Eigen::Quaterniond orientation(const Eigen::Quaterniond& q_enu_flu, double latitude_deg, double longitude_deg) const;

 private:
  GeoPoint origin_;
  double earth_radius_;
  Eigen::Matrix3d axes_;          ///< columns: E, N, U of the origin, earth-fixed
  Eigen::Vector3d origin_earth_;  ///< origin in earth-fixed axes [m]
};

/// @return R_ned_frd at the aircraft: attitude given against the scenery origin's axes turned into attitude against the
/// local level.
/// @param R_originned_frd FRD -> NED of the scenery origin
Eigen::Matrix3d levelAttitude(const TangentFrame& scenery, const Eigen::Matrix3d& R_originned_frd, double latitude_deg,
                              double longitude_deg);

}  // namespace xplane_bridge::core
