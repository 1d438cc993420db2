#pragma once

/// @file
/// The slower groups of state, one struct a `mission/*` message, field by field: names, units and signs as in the .msg
/// files. Unknown values are NaN. `valid` is derived from the field table's bits (see state_decoder.hpp).

#include <array>
#include <cstdint>

#include "xplane_bridge/core/base/limits.hpp"
#include "xplane_bridge/core/state/flight_state.hpp"

namespace xplane_bridge::core {

/// N values nobody has filled yet.
template <std::size_t N>
constexpr std::array<float, N> nanArray() {
  std::array<float, N> a{};
  for (auto& x : a) x = kNaNf;
  return a;
}

/// What every mission message starts with.
struct MissionHeader {
  std::int64_t stamp_ns = 0;  ///< host time [ns]
  float sim_time = kNaNf;     ///< raw simulator time [s]
  std::uint32_t epoch = 0;
  std::uint32_t valid = 0;  ///< bits as in the message
};

inline constexpr int kMaxWings = 8;
inline constexpr int kMaxGears = 10;
inline constexpr int kMaxTanks = 9;
inline constexpr int kMaxBuses = 6;
inline constexpr int kMaxBatteries = 8;
inline constexpr int kMaxGenerators = 8;
inline constexpr int kMaxInverters = 2;

/// EngineStates.msg. Bit k of `valid`: the k-th array, in this order.
struct EngineStates : MissionHeader {
  using PerEngine = std::array<float, kMaxEngines>;
  static constexpr std::uint32_t kValidAll = (1U << 23) - 1;

  std::uint8_t count = 0;  ///< engines of the aircraft, 0 unknown; entries from here on are NaN
  PerEngine throttle_command = nanArray<kMaxEngines>();
  PerEngine throttle_actual = nanArray<kMaxEngines>();
  PerEngine propeller_command = nanArray<kMaxEngines>();
  PerEngine mixture = nanArray<kMaxEngines>();
  PerEngine engine_speed = nanArray<kMaxEngines>();
  PerEngine propeller_speed = nanArray<kMaxEngines>();
  PerEngine propeller_pitch = nanArray<kMaxEngines>();
  PerEngine n1 = nanArray<kMaxEngines>();
  PerEngine n2 = nanArray<kMaxEngines>();
  PerEngine manifold_pressure = nanArray<kMaxEngines>();
  PerEngine engine_pressure_ratio = nanArray<kMaxEngines>();
  PerEngine torque = nanArray<kMaxEngines>();
  PerEngine thrust = nanArray<kMaxEngines>();
  PerEngine power = nanArray<kMaxEngines>();
  PerEngine fuel_flow = nanArray<kMaxEngines>();
  PerEngine itt = nanArray<kMaxEngines>();
  PerEngine egt = nanArray<kMaxEngines>();
  PerEngine cht = nanArray<kMaxEngines>();
  PerEngine oil_pressure = nanArray<kMaxEngines>();
  PerEngine oil_temperature = nanArray<kMaxEngines>();
  PerEngine fuel_pressure = nanArray<kMaxEngines>();
  PerEngine running = nanArray<kMaxEngines>();
  PerEngine propeller_mode = nanArray<kMaxEngines>();
};

/// SurfaceStates.msg. Degrees, trailing edge down +, rudders trailing edge right +.
struct SurfaceStates : MissionHeader {
  enum Valid : std::uint32_t {
    kValidAileron1 = 1U << 0,
    kValidAileron2 = 1U << 1,
    kValidSpoiler1 = 1U << 2,
    kValidSpoiler2 = 1U << 3,
    kValidFlap1 = 1U << 4,
    kValidFlap2 = 1U << 5,
    kValidSpeedbrake1 = 1U << 6,
    kValidSpeedbrake2 = 1U << 7,
    kValidYawBrake = 1U << 8,
    kValidElevator = 1U << 9,
    kValidRudder = 1U << 10,
    kValidAll = (1U << 11) - 1,
  };
  using PerWing = std::array<float, kMaxWings>;

  PerWing aileron1 = nanArray<kMaxWings>();
  PerWing aileron2 = nanArray<kMaxWings>();
  PerWing spoiler1 = nanArray<kMaxWings>();
  PerWing spoiler2 = nanArray<kMaxWings>();
  PerWing flap1 = nanArray<kMaxWings>();
  PerWing flap2 = nanArray<kMaxWings>();
  PerWing speedbrake1 = nanArray<kMaxWings>();
  PerWing speedbrake2 = nanArray<kMaxWings>();
  PerWing yaw_brake = nanArray<kMaxWings>();
  std::array<float, 4> elevator = nanArray<4>();
  std::array<float, 4> rudder = nanArray<4>();
  float delta_aileron = kNaNf;
  float delta_elevator = kNaNf;
  float delta_rudder = kNaNf;
};

/// ControlStates.msg
struct ControlStates : MissionHeader {
  enum Valid : std::uint32_t {
    kValidStick = 1U << 0,
    kValidAugmentation = 1U << 1,
    kValidTotal = 1U << 2,
    kValidTrim = 1U << 3,
    kValidFlaps = 1U << 4,
    kValidSpeedbrake = 1U << 5,
    kValidGear = 1U << 6,
    kValidBrakes = 1U << 7,
    kValidThrustVector = 1U << 8,
    kValidOverrides = 1U << 9,
    kValidAll = (1U << 10) - 1,
  };

  float stick_roll = kNaNf;
  float stick_pitch = kNaNf;
  float stick_yaw = kNaNf;
  float augmentation_roll = kNaNf;
  float augmentation_pitch = kNaNf;
  float augmentation_yaw = kNaNf;
  float total_roll = kNaNf;
  float total_pitch = kNaNf;
  float total_yaw = kNaNf;
  float trim_roll = kNaNf;
  float trim_pitch = kNaNf;
  float trim_yaw = kNaNf;
  float flap_handle = kNaNf;
  float flap_ratio = kNaNf;
  float slat_ratio = kNaNf;
  float speedbrake_handle = kNaNf;
  float speedbrake_ratio = kNaNf;
  float gear_handle = kNaNf;
  std::array<float, kMaxGears> gear_deploy_ratio = nanArray<kMaxGears>();
  float nose_wheel_deg = kNaNf;
  float parking_brake = kNaNf;
  float left_brake = kNaNf;
  float right_brake = kNaNf;
  float thrust_vector_request = kNaNf;
  float thrust_vector_ratio = kNaNf;
  std::array<float, kMaxEngines> nacelle_angle_deg = nanArray<kMaxEngines>();
  bool override_joystick = false;
  bool override_throttles = false;
  bool override_control_surfaces = false;
};

/// ElectricalState.msg
struct ElectricalState : MissionHeader {
  enum Valid : std::uint32_t {
    kValidBuses = 1U << 0,
    kValidBatteries = 1U << 1,
    kValidGenerators = 1U << 2,
    kValidInverters = 1U << 3,
    kValidApu = 1U << 4,
    kValidHydraulics = 1U << 5,
    kValidSwitches = 1U << 6,
    kValidAll = (1U << 7) - 1,
  };

  std::array<float, kMaxBuses> bus_voltage = nanArray<kMaxBuses>();
  std::array<float, kMaxBuses> bus_load = nanArray<kMaxBuses>();
  std::array<float, kMaxBatteries> battery_on = nanArray<kMaxBatteries>();
  std::array<float, kMaxBatteries> battery_current = nanArray<kMaxBatteries>();
  std::array<float, kMaxBatteries> battery_voltage = nanArray<kMaxBatteries>();
  std::array<float, kMaxGenerators> generator_on = nanArray<kMaxGenerators>();
  std::array<float, kMaxGenerators> generator_current = nanArray<kMaxGenerators>();
  std::array<float, kMaxInverters> inverter_on = nanArray<kMaxInverters>();
  float apu_running = kNaNf;
  float apu_n1 = kNaNf;
  std::array<float, 2> hydraulic_pressure = nanArray<2>();
  std::array<float, 2> hydraulic_quantity = nanArray<2>();
  float avionics_on = kNaNf;
  float navigation_lights_on = kNaNf;
  float beacon_on = kNaNf;
  float strobe_lights_on = kNaNf;
  float landing_lights_on = kNaNf;
  float taxi_light_on = kNaNf;
  float pitot_heat_on = kNaNf;
  float cross_tie = kNaNf;
};

/// AutopilotState.msg
struct AutopilotState : MissionHeader {
  enum Valid : std::uint32_t {
    kValidModes = 1U << 0,
    kValidTargets = 1U << 1,
    kValidDirector = 1U << 2,
    kValidAll = 7
  };

  float flight_director_mode = kNaNf;
  float servos_on = kNaNf;
  float autothrottle_enabled = kNaNf;
  float heading_mode = kNaNf;
  float altitude_mode = kNaNf;
  float nav_status = kNaNf;
  float altitude_hold_status = kNaNf;
  float approach_status = kNaNf;
  float vnav_status = kNaNf;
  float glideslope_status = kNaNf;
  float back_course_status = kNaNf;
  float target_airspeed = kNaNf;
  float target_heading_deg = kNaNf;
  float target_vertical_speed = kNaNf;
  float target_altitude = kNaNf;
  float director_pitch_deg = kNaNf;
  float director_roll_deg = kNaNf;
};

/// WarningState.msg
struct WarningState : MissionHeader {
  enum Valid : std::uint32_t {
    kValidMaster = 1U << 0,
    kValidSystems = 1U << 1,
    kValidEngines = 1U << 2,
    kValidFlight = 1U << 3,
    kValidAll = 15,
  };
  using PerEngine = std::array<float, kMaxEngines>;

  float master_caution = kNaNf;
  float master_warning = kNaNf;
  float autopilot_disconnect = kNaNf;
  float low_vacuum = kNaNf;
  float low_voltage = kNaNf;
  float fuel_quantity = kNaNf;
  float hydraulic_pressure = kNaNf;
  float yaw_damper = kNaNf;
  float speedbrake = kNaNf;
  float gpws = kNaNf;
  float ice = kNaNf;
  float pitot_heat = kNaNf;
  float cabin_altitude = kNaNf;
  PerEngine fuel_pressure_low = nanArray<kMaxEngines>();
  PerEngine oil_pressure_low = nanArray<kMaxEngines>();
  PerEngine oil_temperature_high = nanArray<kMaxEngines>();
  PerEngine inverter_off = nanArray<kMaxEngines>();
  PerEngine generator_off = nanArray<kMaxEngines>();
  PerEngine chip_detected = nanArray<kMaxEngines>();
  PerEngine engine_fire = nanArray<kMaxEngines>();
  float stall = kNaNf;
  float gear_unsafe = kNaNf;
  float overspeed = kNaNf;
  float crashed = kNaNf;
};

/// FuelState.msg
struct FuelState : MissionHeader {
  enum Valid : std::uint32_t { kValidFuel = 1U << 0, kValidWeights = 1U << 1, kValidCg = 1U << 2, kValidAll = 7 };

  std::array<float, kMaxTanks> fuel_tank = nanArray<kMaxTanks>();
  float fuel_total = kNaNf;
  float empty_mass = kNaNf;
  float payload_mass = kNaNf;
  float jettison_mass = kNaNf;
  float total_mass = kNaNf;
  float max_mass = kNaNf;
  float cg_offset = kNaNf;
};

/// SimStatus.msg
struct SimStatus : MissionHeader {
  enum Valid : std::uint32_t {
    kValidRate = 1U << 0,
    kValidTime = 1U << 1,
    kValidView = 1U << 2,
    kValidWindow = 1U << 3,
    kValidAll = 15,
  };

  float frame_period = kNaNf;
  float frame_rate = kNaNf;
  float time_ratio = kNaNf;
  float time_ratio_requested = kNaNf;
  float flight_time = kNaNf;
  float zulu_time = kNaNf;
  float local_time = kNaNf;
  bool paused = false;
  bool replay = false;
  float view_type = kNaNf;
  float view_external = kNaNf;
  float view_heading_deg = kNaNf;
  float view_pitch_deg = kNaNf;
  float field_of_view_deg = kNaNf;
  float window_width = kNaNf;
  float window_height = kNaNf;
};

}  // namespace xplane_bridge::core
