#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <limits>

namespace xplane_bridge::core {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr float kNaNf = std::numeric_limits<float>::quiet_NaN();

/// A vector nobody has filled yet.
inline Eigen::Vector3d nanVector() { return Eigen::Vector3d::Constant(kNaN); }

/// Where the position of a FlightState comes from. Values as in FlightState.msg.
enum class PositionSource : std::uint8_t {
  kNone = 0,
  kLocal = 1,           ///< float32 scenery coordinates on the sphere (2 to 8 mm), checked against RPOS
  kLocalUnchecked = 2,  ///< the same, the check is not done yet or not possible
  kRpos = 3,            ///< RPOS doubles
  kXpc = 4,             ///< X-Plane Connect doubles
  kFloat32 = 5,         ///< float32 latitude and longitude, steps of 0.4 to 1.35 m
};

/// Flight state of the user's aircraft at one simulator frame. Mirrors FlightState.msg field by field: the same names,
/// units (SI; degrees where a name ends in _deg), frames and signs. A group whose inputs are missing or stale is NaN
/// (false for flags) and its bit in `valid` is clear.
struct FlightState {
  /// Bits of `valid`, as in FlightState.msg. A bit is set only when every field of its group is known and fresh.
  enum Valid : std::uint32_t {
    kValidSim = 1U << 0,
    kValidPosition = 1U << 1,
    kValidAgl = 1U << 2,
    kValidBaro = 1U << 3,
    kValidAttitude = 1U << 4,
    kValidMagnetic = 1U << 5,
    kValidRates = 1U << 6,
    kValidAngularAccel = 1U << 7,
    kValidVelocity = 1U << 8,
    kValidAirVelocity = 1U << 9,
    kValidAirspeeds = 1U << 10,
    kValidAtmosphere = 1U << 11,
    kValidLoad = 1U << 12,
    kValidRawAirflow = 1U << 13,
    kValidWind = 1U << 14,
    kValidMoments = 1U << 15,
    kValidControls = 1U << 16,
    kValidContact = 1U << 17,
    kValidAll = (1U << 18) - 1,
  };

  std::int64_t stamp_ns = 0;  ///< host time of the simulator frame, from the clock filter [ns]
  std::uint32_t valid = 0;

  // simulator
  float sim_time = kNaNf;  ///< raw float32 as received: the pairing key [s]
  double sim_time_unwrapped = kNaN;
  double stamp_uncertainty = kNaN;
  float frame_period = kNaNf;
  std::uint32_t epoch = 0;
  std::uint32_t frame_count = 0;
  bool paused = false;
  bool replay = false;

  // position
  double latitude = kNaN;   ///< [deg]
  double longitude = kNaN;  ///< [deg]
  double altitude_msl = kNaN;
  double position_north = kNaN;  ///< in map_ned
  double position_east = kNaN;
  double position_down = kNaN;
  std::uint32_t position_epoch = 0;
  PositionSource position_source = PositionSource::kNone;
  float altitude_agl = kNaNf;
  float altitude_indicated = kNaNf;
  float altitude_pressure = kNaNf;

  // attitude
  double roll_deg = kNaN;
  double pitch_deg = kNaN;
  double heading_true_deg = kNaN;
  double heading_magnetic_deg = kNaN;
  float declination_deg = kNaNf;                           ///< east +
  Eigen::Quaterniond orientation{kNaN, kNaN, kNaN, kNaN};  ///< FRD -> NED

  // rotation
  Eigen::Vector3d angular_velocity = nanVector();      ///< FRD: p, q, r [rad/s]
  Eigen::Vector3d euler_rates = nanVector();           ///< d/dt of roll, pitch, heading [rad/s]
  Eigen::Vector3d angular_acceleration = nanVector();  ///< FRD [rad/s^2]

  // velocity over ground
  Eigen::Vector3d velocity_ned = nanVector();
  Eigen::Vector3d velocity_body = nanVector();  ///< FRD
  float ground_speed = kNaNf;
  float track_deg = kNaNf;
  float flight_path_angle_deg = kNaNf;
  float vertical_speed = kNaNf;  ///< up +

  // air data
  Eigen::Vector3d air_velocity_body = nanVector();  ///< FRD, relative to the air
  float alpha_deg = kNaNf;
  float beta_deg = kNaNf;  ///< wind from the right +
  float indicated_airspeed = kNaNf;
  float calibrated_airspeed = kNaNf;
  float equivalent_airspeed = kNaNf;
  float true_airspeed = kNaNf;
  float mach = kNaNf;
  float dynamic_pressure = kNaNf;  ///< [Pa]
  float air_density = kNaNf;       ///< [kg/m^3]

  // loads
  float load_factor_normal = kNaNf;
  float load_factor_axial = kNaNf;
  float load_factor_side = kNaNf;
  Eigen::Vector3d specific_force = nanVector();  ///< FRD [m/s^2]

  // X-Plane's own airflow angles
  float xplane_alpha_deg = kNaNf;
  float xplane_beta_deg = kNaNf;
  float xplane_hpath_deg = kNaNf;
  float xplane_vpath_deg = kNaNf;

  // wind
  Eigen::Vector3d wind_ned = nanVector();  ///< velocity of the air
  float wind_speed = kNaNf;
  float wind_from_deg = kNaNf;

  Eigen::Vector3d aero_moment = nanVector();  ///< FRD [N m]

  // control inputs
  float control_roll = kNaNf;
  float control_pitch = kNaNf;
  float control_yaw = kNaNf;
  float control_throttle = kNaNf;

  bool on_ground = false;

  bool has(std::uint32_t bits) const { return (valid & bits) == bits; }
};

}  // namespace xplane_bridge::core
