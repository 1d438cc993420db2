// The lines of the field table, in the order of the messages. See field_table.hpp.
//
// Names and types of the datarefs are from Laminar's published lists for X-Plane 11.10 and 12.08
// (X-Plane/XPlane2Blender, io_xplane2blender/resources/DataRefs.txt); rows and slots from the protocol reference,
// section 1.4.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <type_traits>
#include <utility>

#include "xplane_bridge/core/state/field_table.hpp"
#include "xplane_bridge/core/state/state_decoder.hpp"

namespace xplane_bridge::core {
namespace {

// --- units on the wire ---

constexpr Conversion kPlain{"", 1.0, 0.0};
constexpr Conversion kNegated{"negated", -1.0, 0.0};
constexpr Conversion kFeet{"ft", kMetersPerFoot, 0.0};
constexpr Conversion kKnots{"kt", kMetersPerSecondPerKnot, 0.0};
constexpr Conversion kFeetPerMinute{"ft/min", kMetersPerSecondPerFootPerMinute, 0.0};
constexpr Conversion kDegreesRate{"deg/s", kRadiansPerDegree, 0.0};
constexpr Conversion kDegreesAcceleration{"deg/s^2", kRadiansPerDegree, 0.0};
constexpr Conversion kPoundsPerSquareFoot{"psf", kPascalsPerPoundPerSquareFoot, 0.0};
constexpr Conversion kPsi{"psi", kPascalsPerPsi, 0.0};
constexpr Conversion kInchesOfMercury{"inHg", kPascalsPerInchOfMercury, 0.0};
constexpr Conversion kDensityRatio{"of 1.225 kg/m^3", 1.225, 0.0};
constexpr Conversion kFootPounds{"ft lb", kNewtonMetersPerFootPound, 0.0};
constexpr Conversion kPoundsForce{"lbf", kNewtonsPerPoundForce, 0.0};
constexpr Conversion kPounds{"lb", kKilogramsPerPound, 0.0};
constexpr Conversion kPoundsPerHour{"lb/h", kKilogramsPerSecondPerPoundPerHour, 0.0};
constexpr Conversion kHorsepower{"hp", kWattsPerHorsepower, 0.0};
constexpr Conversion kRpm{"rpm", kRadiansPerSecondPerRpm, 0.0};
/// Row 1's zulu and local time: decimal hours in the captures, seconds by other sources [?].
constexpr Conversion kHours{"h", kSecondsPerHour, 0.0};
constexpr Conversion kRowAxial{"g", kRowAxialSign, 0.0};
constexpr Conversion kRowSide{"g", kRowSideSign, 0.0};
constexpr Conversion kRowNormal{"g", kRowNormalSign, 0.0};
constexpr Conversion kDatarefAxial{"g, aft +", kDatarefAxialSign, 0.0};
constexpr Conversion kDatarefSide{"g", kDatarefSideSign, 0.0};
constexpr Conversion kDatarefNormal{"g", kDatarefNormalSign, 0.0};

// --- storing through member pointers ---

template <typename T>
struct MemberOf;
template <typename Class, typename Member>
struct MemberOf<Member Class::*> {
  using Owner = Class;
  using Type = Member;
};

template <typename T>
struct ElementCount {
  static constexpr int kValue = 1;
};
template <std::size_t N>
struct ElementCount<std::array<float, N>> {
  static constexpr int kValue = static_cast<int>(N);
};
template <>
struct ElementCount<Eigen::Vector3d> {
  static constexpr int kValue = 3;
};

template <typename State, auto Member>
void storeMember(void* target, const double* values, int count) {
  using Type = typename MemberOf<decltype(Member)>::Type;
  auto& member = static_cast<State*>(target)->*Member;
  if constexpr (std::is_same_v<Type, bool>) {
    member = *values > 0.5;
  } else if constexpr (std::is_integral_v<Type>) {
    member = std::isfinite(*values) ? static_cast<Type>(*values) : Type{};
  } else if constexpr (std::is_floating_point_v<Type>) {
    member = static_cast<Type>(*values);
  } else if constexpr (std::is_same_v<Type, Eigen::Vector3d>) {
    for (int i = 0; i < count; ++i) member(i) = values[i];
  } else {
    for (int i = 0; i < count; ++i) member[static_cast<std::size_t>(i)] = static_cast<float>(values[i]);
  }
  static_cast<void>(count);
}

// --- a line, written as a sentence ---

class Line {
 public:
  explicit Line(const FieldSpec& spec) : spec_(spec) {}
  operator FieldSpec() const { return spec_; }  // NOLINT(google-explicit-constructor)

  /// Dataref, the same in both versions.
  Line ref(const char* path, const Conversion& conversion = kPlain) const {
    Line line = *this;
    line.spec_.dataref = {path, nullptr, conversion, conversion};
    return line;
  }
  /// Dataref in X-Plane 12 where it has another name there.
  Line ref12(const char* path, const Conversion& conversion = kPlain) const {
    Line line = *this;
    line.spec_.dataref.path12 = path;
    line.spec_.dataref.conversion12 = conversion;
    return line;
  }
  /// Slot of a DATA row, the same in both versions; elements follow each other.
  Line row(int index, int slot, const Conversion& conversion = kPlain) const {
    Line line = *this;
    line.spec_.row = {index, slot, index, slot, conversion, conversion, std::min(spec_.count, 8 - slot)};
    return line;
  }
  /// Row of X-Plane 12 where it differs.
  Line row12(int index, int slot, const Conversion& conversion) const {
    Line line = *this;
    line.spec_.row.row12 = index;
    line.spec_.row.slot12 = slot;
    line.spec_.row.conversion12 = conversion;
    return line;
  }
  /// The row carries only so many elements.
  Line carries(int count) const {
    Line line = *this;
    line.spec_.row.count = count;
    return line;
  }
  /// The row's slot is one number with a bit for each element.
  Line bitfield() const {
    Line line = *this;
    line.spec_.row.bitfield = true;
    line.spec_.row.count = spec_.count;
    return line;
  }
  Line mayBeBlank() const {
    Line line = *this;
    line.spec_.row.may_be_blank = true;
    return line;
  }
  Line elements(int count) const {
    Line line = *this;
    line.spec_.count = count;
    return line;
  }
  Line perEngine() const {
    Line line = *this;
    line.spec_.per_engine = true;
    return line;
  }
  Line engineCount() const {
    Line line = *this;
    line.spec_.is_engine_count = true;
    return line;
  }
  Line because(const char* derivation) const {
    Line line = *this;
    line.spec_.derivation = derivation;
    return line;
  }
  Line note(const char* remark) const {
    Line line = *this;
    line.spec_.remark = remark;
    return line;
  }

 private:
  FieldSpec spec_;
};

/// A field that is received. State: the group's struct (the member may belong to its base).
template <typename State, auto Member>
Line received(const char* name, const char* unit, std::uint32_t valid = 0) {
  FieldSpec spec;
  spec.group = GroupOf<State>::kGroup;
  spec.field = name;
  spec.count = ElementCount<typename MemberOf<decltype(Member)>::Type>::kValue;
  spec.unit = unit;
  spec.valid = valid;
  spec.store = storeMember<State, Member>;
  return Line(spec);
}

/// A field computed from others.
Line computed(FieldGroup group, const char* name, int count, const char* unit, std::uint32_t valid,
              const char* derivation) {
  FieldSpec spec;
  spec.group = group;
  spec.field = name;
  spec.count = count;
  spec.unit = unit;
  spec.valid = valid;
  spec.derivation = derivation;
  return Line(spec);
}

using Lines = std::vector<FieldSpec>;

// One field a line, whatever its length.
// clang-format off

void addFlight(Lines& t) {
  using F = FlightState;
  using I = FlightInputs;
  const FieldGroup g = FieldGroup::kFlight;
#define XPB_INPUT(member, unit, valid) received<I, &I::member>(#member, unit, valid)
  t.push_back(XPB_INPUT(sim_time, "s", F::kValidSim).ref("sim/time/total_running_time_sec").row(1, 1).note("pairing key, raw float32; [?] row 1 `total` is the same clock"));
  t.push_back(computed(g, "sim_time_unwrapped", 1, "s", 0, "accumulated from frame periods by the clock filter"));
  t.push_back(XPB_INPUT(frame_period, "s", F::kValidSim).ref("sim/operation/misc/frame_rate_period").row(0, 3));
  t.push_back(XPB_INPUT(paused, "0, 1", F::kValidSim).ref("sim/time/paused"));
  t.push_back(XPB_INPUT(replay, "0, 1", F::kValidSim).ref("sim/time/is_in_replay"));

  t.push_back(XPB_INPUT(local_position, "m", F::kValidPosition).ref("sim/flightmodel/position/local_{x,y,z}").row(21, 0).because("input: OpenGL axes at the scenery origin; position on the sphere"));
  t.push_back(XPB_INPUT(origin_latitude, "deg", F::kValidPosition).ref("sim/flightmodel/position/lat_ref").row(20, 6).because("input: latitude of the scenery origin").note("X-Plane 10 sends the tile's corner instead: found by the check against float32 latitude"));
  t.push_back(XPB_INPUT(origin_longitude, "deg", F::kValidPosition).ref("sim/flightmodel/position/lon_ref").row(20, 7).because("input: longitude of the scenery origin"));
  t.push_back(XPB_INPUT(earth_radius, "m", 0).ref("sim/physics/earth_radius_m").because("input: radius of the sphere; 6378145 m where it does not answer"));
  t.push_back(XPB_INPUT(latitude, "deg", 0).ref("sim/flightmodel/position/latitude").row(20, 0).because("input: float32 check of the sphere, and position source `float32`").note("double in X-Plane, float32 on the wire"));
  t.push_back(XPB_INPUT(longitude, "deg", 0).ref("sim/flightmodel/position/longitude").row(20, 1).because("input: as latitude"));
  t.push_back(XPB_INPUT(elevation, "m", 0).ref("sim/flightmodel/position/elevation").row(20, 2, kFeet).because("input: as latitude"));
  t.push_back(computed(g, "latitude, longitude, altitude_msl", 3, "deg, deg, m", F::kValidPosition, "local_position on X-Plane's sphere about the scenery origin (doubles)"));
  t.push_back(computed(g, "position_north, position_east, position_down", 3, "m", F::kValidPosition, "the same in `map_ned`, tangent to the sphere at the map's origin"));
  t.push_back(XPB_INPUT(altitude_agl, "m", F::kValidAgl).ref("sim/flightmodel/position/y_agl").row(20, 3, kFeet));
  t.push_back(XPB_INPUT(altitude_indicated, "m", F::kValidBaro).ref("sim/cockpit2/gauges/indicators/altitude_ft_pilot", kFeet).row(20, 5, kFeet));
  t.push_back(XPB_INPUT(altitude_pressure, "m", F::kValidBaro).ref("sim/flightmodel2/position/pressure_altitude", kFeet).note("not in the 11.10 list; where it does not answer, computed from static_pressure"));
  t.push_back(XPB_INPUT(static_pressure, "Pa", 0).ref("sim/weather/barometer_current_inhg", kInchesOfMercury).ref12("sim/weather/aircraft/barometer_current_pas").row(6, 0, kInchesOfMercury).because("input: altitude_pressure in the standard atmosphere"));

  t.push_back(XPB_INPUT(roll_deg, "deg", F::kValidAttitude).ref("sim/flightmodel/position/true_phi").row(17, 1).note("[?] row 17: local level or scenery origin axes"));
  t.push_back(XPB_INPUT(pitch_deg, "deg", F::kValidAttitude).ref("sim/flightmodel/position/true_theta").row(17, 0).note("[?] as roll_deg"));
  t.push_back(XPB_INPUT(heading_true_deg, "deg", F::kValidAttitude).ref("sim/flightmodel/position/true_psi").row(17, 2).note("[?] as roll_deg"));
  t.push_back(XPB_INPUT(heading_magnetic_deg, "deg", F::kValidMagnetic).ref("sim/flightmodel/position/mag_psi").row(17, 3));
  t.push_back(XPB_INPUT(declination_deg, "deg", F::kValidMagnetic).ref("sim/flightmodel/position/magnetic_variation", kNegated).row(19, 1, kNegated).note("east +; [?] sign of the dataref taken as the row's"));
  t.push_back(computed(g, "orientation", 4, "-", F::kValidAttitude, "quaternion FRD -> NED of roll, pitch, true heading"));

  t.push_back(XPB_INPUT(roll_rate, "rad/s", F::kValidRates).ref("sim/flightmodel/position/Prad").row(16, 1).row12(16, 0, kDegreesRate).because("input: angular_velocity.x").note("row 16 is Q, P, R in rad/s in X-Plane 9 to 11 and P, Q, R in deg/s in 12"));
  t.push_back(XPB_INPUT(pitch_rate, "rad/s", F::kValidRates).ref("sim/flightmodel/position/Qrad").row(16, 0).row12(16, 1, kDegreesRate).because("input: angular_velocity.y"));
  t.push_back(XPB_INPUT(yaw_rate, "rad/s", F::kValidRates).ref("sim/flightmodel/position/Rrad").row(16, 2).row12(16, 2, kDegreesRate).because("input: angular_velocity.z"));
  t.push_back(computed(g, "euler_rates", 3, "rad/s", F::kValidRates, "from angular_velocity and attitude; roll and heading NaN within 0.1 deg of pitch +-90 deg"));
  t.push_back(XPB_INPUT(angular_acceleration, "rad/s^2", F::kValidAngularAccel).ref("sim/flightmodel/position/{P,Q,R}_dot", kDegreesAcceleration));

  t.push_back(XPB_INPUT(local_velocity, "m/s", F::kValidVelocity).ref("sim/flightmodel/position/local_v{x,y,z}").row(21, 3).because("input: OpenGL axes at the scenery origin, turned to the local level"));
  t.push_back(computed(g, "velocity_ned, vertical_speed", 4, "m/s", F::kValidVelocity, "local_velocity turned by the tilt between scenery origin and aircraft"));
  t.push_back(computed(g, "velocity_body", 3, "m/s", F::kValidVelocity, "velocity_ned in FRD"));
  t.push_back(computed(g, "ground_speed, track_deg, flight_path_angle_deg", 3, "m/s, deg, deg", F::kValidVelocity, "of velocity_ned; below 0.5 m/s the track is the true heading"));

  t.push_back(computed(g, "air_velocity_body", 3, "m/s", F::kValidAirVelocity, "velocity_ned - wind_ned, in FRD"));
  t.push_back(computed(g, "alpha_deg, beta_deg", 2, "deg", F::kValidAirVelocity, "atan2(w, u), asin(v/V) of air_velocity_body; 0 below 1 m/s"));
  t.push_back(XPB_INPUT(indicated_airspeed, "m/s", F::kValidAirspeeds).ref("sim/flightmodel/position/indicated_airspeed", kKnots).row(3, 0, kKnots).note("row 3.0 is calibrated airspeed: the same number there"));
  t.push_back(XPB_INPUT(calibrated_airspeed, "m/s", F::kValidAirspeeds).row(3, 0, kKnots).because("where no row comes: compressible formula from dynamic_pressure and mach"));
  t.push_back(XPB_INPUT(equivalent_airspeed, "m/s", F::kValidAirspeeds).ref12("sim/flightmodel/position/equivalent_airspeed", kKnots).row(3, 1, kKnots).because("X-Plane 11 by RREF: true_airspeed * sqrt(air_density / 1.225)"));
  t.push_back(XPB_INPUT(true_airspeed, "m/s", F::kValidAirspeeds).ref("sim/flightmodel/position/true_airspeed").row(3, 2, kKnots));
  t.push_back(XPB_INPUT(mach, "-", F::kValidAirspeeds).ref("sim/flightmodel/misc/machno").row(4, 0));
  t.push_back(XPB_INPUT(dynamic_pressure, "Pa", F::kValidAirspeeds).ref("sim/flightmodel/misc/Qstatic", kPoundsPerSquareFoot).row(6, 5, kPoundsPerSquareFoot));
  t.push_back(XPB_INPUT(air_density, "kg/m^3", F::kValidAtmosphere).ref("sim/weather/rho").row(6, 3, kDensityRatio));

  t.push_back(XPB_INPUT(load_factor_normal, "g", F::kValidLoad).ref("sim/flightmodel/forces/g_nrml", kDatarefNormal).row(4, 4, kRowNormal));
  t.push_back(XPB_INPUT(load_factor_axial, "g", F::kValidLoad).ref("sim/flightmodel/forces/g_axil", kDatarefAxial).row(4, 5, kRowAxial).note("[?] row and dataref differ in sign; at rest +sin(pitch)"));
  t.push_back(XPB_INPUT(load_factor_side, "g", F::kValidLoad).ref("sim/flightmodel/forces/g_side", kDatarefSide).row(4, 6, kRowSide).note("[?]"));
  t.push_back(computed(g, "specific_force", 3, "m/s^2", F::kValidLoad, "9.80665 (axial, side, -normal), FRD"));

  t.push_back(XPB_INPUT(xplane_alpha_deg, "deg", F::kValidRawAirflow).ref("sim/flightmodel/position/alpha").row(18, 0));
  t.push_back(XPB_INPUT(xplane_beta_deg, "deg", F::kValidRawAirflow).ref("sim/flightmodel/position/beta").row(18, 1).note("[?] sign disputed: the list says hpath + beta = psi"));
  t.push_back(XPB_INPUT(xplane_hpath_deg, "deg", F::kValidRawAirflow).ref("sim/flightmodel/position/hpath").row(18, 2).note("[?] meaning in wind disputed"));
  t.push_back(XPB_INPUT(xplane_vpath_deg, "deg", F::kValidRawAirflow).ref("sim/flightmodel/position/vpath").row(18, 3));

  t.push_back(XPB_INPUT(wind_local, "m/s", F::kValidWind).ref("sim/weather/wind_now_{x,y,z}_msc").ref12("sim/weather/aircraft/wind_now_{x,y,z}_msc").because("input: velocity of the air, OpenGL axes at the scenery origin").note("[?] where the air goes, not where it comes from"));
  t.push_back(XPB_INPUT(wind_from_deg, "deg", F::kValidWind).row(5, 4).because("input of wind_ned where rows carry the wind: no vertical part"));
  t.push_back(XPB_INPUT(wind_speed, "m/s", F::kValidWind).row(5, 3, kKnots).because("input, as wind_from_deg"));
  t.push_back(computed(g, "wind_ned, wind_speed, wind_from_deg", 5, "m/s, m/s, deg", F::kValidWind, "wind turned to the local level, horizontal speed and direction; 0 deg when calm"));

  t.push_back(XPB_INPUT(aero_moment, "N m", F::kValidMoments).ref("sim/flightmodel/forces/{L,M,N}_aero").row(64, 3, kFootPounds));

  t.push_back(XPB_INPUT(control_roll, "-1..1", F::kValidControls).ref("sim/joystick/yoke_roll_ratio").row(8, 1));
  t.push_back(XPB_INPUT(control_pitch, "-1..1", F::kValidControls).ref("sim/joystick/yoke_pitch_ratio").row(8, 0));
  t.push_back(XPB_INPUT(control_yaw, "-1..1", F::kValidControls).ref("sim/joystick/yoke_heading_ratio").row(8, 2));
  t.push_back(XPB_INPUT(control_throttle, "-1..1", F::kValidControls).ref("sim/cockpit2/engine/actuators/throttle_ratio[0]").row(25, 0));
  t.push_back(XPB_INPUT(on_ground, "0, 1", F::kValidContact).ref("sim/flightmodel/failures/onground_any").note("row 20.4 says only `on a runway`"));
#undef XPB_INPUT
}

#define XPB_FIELD(member, unit, valid) received<S, &S::member>(#member, unit, valid)

/// What every mission group carries besides.
template <typename S>
void addSimTime(Lines& t) {
  t.push_back(received<S, &MissionHeader::sim_time>("sim_time", "s", 0).ref("sim/time/total_running_time_sec").row(1, 1));
}

void addEngines(Lines& t) {
  using S = EngineStates;
  addSimTime<S>(t);
  t.push_back(XPB_FIELD(count, "-", 0).ref("sim/aircraft/engine/acf_num_engines").engineCount());
  std::uint32_t bit = 1;
  const auto add = [&](const Line& line) {
    FieldSpec spec = line.perEngine();
    spec.valid = bit;
    bit <<= 1;
    t.push_back(spec);
  };
  const char* const temperature = "deg C or deg F, as the aircraft file says";
  add(XPB_FIELD(throttle_command, "-1..1", 0).ref("sim/cockpit2/engine/actuators/throttle_ratio[*]").row(25, 0));
  add(XPB_FIELD(throttle_actual, "-1..1", 0).ref("sim/flightmodel/engine/ENGN_thro_use[*]").row(26, 0));
  add(XPB_FIELD(propeller_command, "rad/s", 0).ref("sim/flightmodel/engine/ENGN_prop[*]").row(28, 0, kRpm).note("[?] row 28: rpm or ratio by aircraft"));
  add(XPB_FIELD(mixture, "0..1", 0).ref("sim/flightmodel/engine/ENGN_mixt[*]").row(29, 0));
  add(XPB_FIELD(engine_speed, "rpm", 0).ref("sim/cockpit2/engine/indicators/engine_speed_rpm[*]").row(37, 0));
  add(XPB_FIELD(propeller_speed, "rpm", 0).ref("sim/cockpit2/engine/indicators/prop_speed_rpm[*]").row(38, 0));
  add(XPB_FIELD(propeller_pitch, "deg", 0).ref("sim/flightmodel/engine/POINT_pitch_deg[*]").row(39, 0));
  add(XPB_FIELD(n1, "%", 0).ref("sim/flightmodel/engine/ENGN_N1_[*]").row(41, 0));
  add(XPB_FIELD(n2, "%", 0).ref("sim/flightmodel/engine/ENGN_N2_[*]").row(42, 0));
  add(XPB_FIELD(manifold_pressure, "Pa", 0).ref("sim/flightmodel/engine/ENGN_MPR[*]", kInchesOfMercury).row(43, 0, kInchesOfMercury).note("[?] unit of the dataref is not in the list; taken as inHg"));
  add(XPB_FIELD(engine_pressure_ratio, "-", 0).ref("sim/flightmodel/engine/ENGN_EPR[*]").row(44, 0));
  add(XPB_FIELD(torque, "N m", 0).ref("sim/flightmodel/engine/ENGN_TRQ[*]").row(36, 0, kFootPounds));
  add(XPB_FIELD(thrust, "N", 0).ref("sim/flightmodel/engine/POINT_thrust[*]").row(35, 0, kPoundsForce));
  add(XPB_FIELD(power, "W", 0).ref("sim/flightmodel/engine/ENGN_power[*]").row(34, 0, kHorsepower).note("[?] unit of the dataref is not in the list; taken as W"));
  add(XPB_FIELD(fuel_flow, "kg/s", 0).ref("sim/flightmodel/engine/ENGN_FF_[*]").row(45, 0, kPoundsPerHour));
  add(XPB_FIELD(itt, temperature, 0).ref("sim/flightmodel/engine/ENGN_ITT_c[*]").row(46, 0));
  add(XPB_FIELD(egt, temperature, 0).ref("sim/flightmodel/engine/ENGN_EGT_c[*]").row(47, 0));
  add(XPB_FIELD(cht, temperature, 0).ref("sim/flightmodel/engine/ENGN_CHT_c[*]").row(48, 0));
  add(XPB_FIELD(oil_pressure, "Pa", 0).ref("sim/flightmodel/engine/ENGN_oil_press_psi[*]", kPsi).row(49, 0, kPsi));
  add(XPB_FIELD(oil_temperature, temperature, 0).ref("sim/flightmodel/engine/ENGN_oil_temp_c[*]").row(50, 0));
  add(XPB_FIELD(fuel_pressure, "Pa", 0).ref("sim/cockpit2/engine/indicators/fuel_pressure_psi[*]", kPsi).row(51, 0, kPsi));
  add(XPB_FIELD(running, "0, 1", 0).ref("sim/flightmodel/engine/ENGN_running[*]"));
  add(XPB_FIELD(propeller_mode, "-", 0).ref("sim/flightmodel/engine/ENGN_propmode[*]").row(27, 0));
}

void addSurfaces(Lines& t) {
  using S = SurfaceStates;
  const FieldGroup g = FieldGroup::kSurfaces;
  addSimTime<S>(t);
  t.push_back(XPB_FIELD(aileron1, "deg", S::kValidAileron1).ref("sim/flightmodel/controls/wing{1,2,3,4}{l,r}_ail1def").row(70, 0).mayBeBlank());
  t.push_back(XPB_FIELD(aileron2, "deg", S::kValidAileron2).ref("sim/flightmodel/controls/wing{1,2,3,4}{l,r}_ail2def").row(71, 0).mayBeBlank());
  t.push_back(XPB_FIELD(spoiler1, "deg", S::kValidSpoiler1).ref("sim/flightmodel/controls/wing{1,2,3,4}{l,r}_spo1def").row(72, 0).mayBeBlank());
  t.push_back(XPB_FIELD(spoiler2, "deg", S::kValidSpoiler2).ref("sim/flightmodel/controls/wing{1,2,3,4}{l,r}_spo2def").row(73, 0).mayBeBlank());
  t.push_back(XPB_FIELD(flap1, "deg", S::kValidFlap1).ref("sim/flightmodel/controls/wing{1,2,3,4}{l,r}_fla1def"));
  t.push_back(XPB_FIELD(flap2, "deg", S::kValidFlap2).ref("sim/flightmodel/controls/wing{1,2,3,4}{l,r}_fla2def"));
  t.push_back(XPB_FIELD(speedbrake1, "deg", S::kValidSpeedbrake1).ref("sim/flightmodel2/wing/speedbrake1_deg[*]"));
  t.push_back(XPB_FIELD(speedbrake2, "deg", S::kValidSpeedbrake2).ref("sim/flightmodel2/wing/speedbrake2_deg[*]"));
  t.push_back(XPB_FIELD(yaw_brake, "deg", S::kValidYawBrake).ref("sim/flightmodel/controls/wing{1,2,3,4}{l,r}_yawbdef").row(76, 0).mayBeBlank());
  t.push_back(XPB_FIELD(elevator, "deg", S::kValidElevator).ref("sim/flightmodel/controls/{hstab1_elv1,hstab2_elv1,hstab1_elv2,hstab2_elv2}def").row(74, 0).mayBeBlank());
  t.push_back(XPB_FIELD(rudder, "deg", S::kValidRudder).ref("sim/flightmodel/controls/{vstab1_rud1,vstab2_rud1,vstab1_rud2,vstab2_rud2}def").row(75, 0).mayBeBlank());
  t.push_back(computed(g, "delta_aileron", 1, "deg", S::kValidAileron1, "(left - right) / 2 of the wings that carry ailerons"));
  t.push_back(computed(g, "delta_elevator", 1, "deg", S::kValidElevator, "mean of the elevators that move"));
  t.push_back(computed(g, "delta_rudder", 1, "deg", S::kValidRudder, "-(mean of the rudders that move)"));
}

void addControls(Lines& t) {
  using S = ControlStates;
  addSimTime<S>(t);
  t.push_back(XPB_FIELD(stick_roll, "-1..1", S::kValidStick).ref("sim/joystick/yoke_roll_ratio").row(8, 1));
  t.push_back(XPB_FIELD(stick_pitch, "-1..1", S::kValidStick).ref("sim/joystick/yoke_pitch_ratio").row(8, 0));
  t.push_back(XPB_FIELD(stick_yaw, "-1..1", S::kValidStick).ref("sim/joystick/yoke_heading_ratio").row(8, 2));
  t.push_back(XPB_FIELD(augmentation_roll, "-1..1", S::kValidAugmentation).ref("sim/joystick/artstab_roll_ratio").row(10, 1));
  t.push_back(XPB_FIELD(augmentation_pitch, "-1..1", S::kValidAugmentation).ref("sim/joystick/artstab_pitch_ratio").row(10, 0));
  t.push_back(XPB_FIELD(augmentation_yaw, "-1..1", S::kValidAugmentation).ref("sim/joystick/artstab_heading_ratio").row(10, 2));
  t.push_back(XPB_FIELD(total_roll, "-1..1", S::kValidTotal).ref("sim/cockpit2/controls/total_roll_ratio").row(11, 1).note("not in the 11.10 list, in that of 11.40"));
  t.push_back(XPB_FIELD(total_pitch, "-1..1", S::kValidTotal).ref("sim/cockpit2/controls/total_pitch_ratio").row(11, 0).note("not in the 11.10 list, as total_roll"));
  t.push_back(XPB_FIELD(total_yaw, "-1..1", S::kValidTotal).ref("sim/cockpit2/controls/total_heading_ratio").row(11, 2).note("not in the 11.10 list, as total_roll"));
  t.push_back(XPB_FIELD(trim_roll, "-1..1", S::kValidTrim).ref("sim/cockpit2/controls/aileron_trim").row(13, 1));
  t.push_back(XPB_FIELD(trim_pitch, "-1..1", S::kValidTrim).ref("sim/cockpit2/controls/elevator_trim").row(13, 0));
  t.push_back(XPB_FIELD(trim_yaw, "-1..1", S::kValidTrim).ref("sim/cockpit2/controls/rudder_trim").row(13, 2));
  t.push_back(XPB_FIELD(flap_handle, "0..1", S::kValidFlaps).ref("sim/cockpit2/controls/flap_ratio").ref12("sim/cockpit2/controls/flap_handle_request_ratio").row(13, 3).note("flap_ratio is marked replaced in 12.08"));
  t.push_back(XPB_FIELD(flap_ratio, "0..1", S::kValidFlaps).ref("sim/flightmodel2/controls/flap1_deploy_ratio").row(13, 4));
  t.push_back(XPB_FIELD(slat_ratio, "0..1", S::kValidFlaps).ref("sim/flightmodel2/controls/slat1_deploy_ratio").row(13, 5));
  t.push_back(XPB_FIELD(speedbrake_handle, "-0.5..1", S::kValidSpeedbrake).ref("sim/cockpit2/controls/speedbrake_ratio").row(13, 6));
  t.push_back(XPB_FIELD(speedbrake_ratio, "0..1.5", S::kValidSpeedbrake).ref("sim/flightmodel2/controls/speedbrake_ratio").row(13, 7));
  t.push_back(XPB_FIELD(gear_handle, "0, 1", S::kValidGear).ref("sim/cockpit2/controls/gear_handle_down").row(14, 0));
  t.push_back(XPB_FIELD(gear_deploy_ratio, "0..1", S::kValidGear).ref("sim/flightmodel2/gear/deploy_ratio[*]").row(67, 0));
  t.push_back(XPB_FIELD(nose_wheel_deg, "deg", S::kValidGear).ref("sim/flightmodel2/gear/tire_steer_actual_deg[0]").row(11, 4));
  t.push_back(XPB_FIELD(parking_brake, "0..1", S::kValidBrakes).ref("sim/cockpit2/controls/parking_brake_ratio").row(14, 1));
  t.push_back(XPB_FIELD(left_brake, "0..1", S::kValidBrakes).ref("sim/cockpit2/controls/left_brake_ratio").row(14, 2));
  t.push_back(XPB_FIELD(right_brake, "0..1", S::kValidBrakes).ref("sim/cockpit2/controls/right_brake_ratio").row(14, 3));
  t.push_back(XPB_FIELD(thrust_vector_request, "0..1", S::kValidThrustVector).ref("sim/cockpit2/controls/thrust_vector_ratio").row(9, 0));
  t.push_back(XPB_FIELD(thrust_vector_ratio, "0..1", S::kValidThrustVector).ref("sim/flightmodel2/controls/thrust_vector_ratio").row(12, 3));
  t.push_back(XPB_FIELD(nacelle_angle_deg, "deg", S::kValidThrustVector).ref("sim/flightmodel2/engines/nacelle_vertical_angle_deg[*]"));
  t.push_back(XPB_FIELD(override_joystick, "0, 1", S::kValidOverrides).ref("sim/operation/override/override_joystick"));
  t.push_back(XPB_FIELD(override_throttles, "0, 1", S::kValidOverrides).ref("sim/operation/override/override_throttles"));
  t.push_back(XPB_FIELD(override_control_surfaces, "0, 1", S::kValidOverrides).ref("sim/operation/override/override_control_surfaces"));
}

void addElectrical(Lines& t) {
  using S = ElectricalState;
  addSimTime<S>(t);
  t.push_back(XPB_FIELD(bus_voltage, "V", S::kValidBuses).ref("sim/cockpit2/electrical/bus_volts[*]").row(124, 0).carries(2));
  t.push_back(XPB_FIELD(bus_load, "A", S::kValidBuses).ref("sim/cockpit2/electrical/bus_load_amps[*]").row(124, 2).carries(2));
  t.push_back(XPB_FIELD(battery_on, "0, 1", S::kValidBatteries).ref("sim/cockpit2/electrical/battery_on[*]").row(57, 0));
  t.push_back(XPB_FIELD(battery_current, "A", S::kValidBatteries).ref("sim/cockpit2/electrical/battery_amps[*]").row(53, 0));
  t.push_back(XPB_FIELD(battery_voltage, "V", S::kValidBatteries).ref("sim/cockpit2/electrical/battery_voltage_actual_volts[*]").row(54, 0));
  t.push_back(XPB_FIELD(generator_on, "0, 1", S::kValidGenerators).ref("sim/cockpit2/electrical/generator_on[*]").row(58, 0));
  t.push_back(XPB_FIELD(generator_current, "A", S::kValidGenerators).ref("sim/cockpit2/electrical/generator_amps[*]").row(52, 0));
  t.push_back(XPB_FIELD(inverter_on, "0, 1", S::kValidInverters).ref("sim/cockpit2/electrical/inverter_on[*]").row(59, 0));
  t.push_back(XPB_FIELD(apu_running, "0, 1", S::kValidApu).ref("sim/cockpit2/electrical/APU_running").row(121, 0));
  t.push_back(XPB_FIELD(apu_n1, "%", S::kValidApu).ref("sim/cockpit2/electrical/APU_N1_percent").row(121, 1));
  t.push_back(XPB_FIELD(hydraulic_pressure, "Pa", S::kValidHydraulics).ref("sim/cockpit2/hydraulics/indicators/hydraulic_pressure_{1,2}", kPsi).row(123, 6, kPsi).note("[?] X-Plane's unit is the aircraft file's; taken as psi"));
  t.push_back(XPB_FIELD(hydraulic_quantity, "0..1", S::kValidHydraulics).ref("sim/cockpit2/hydraulics/indicators/hydraulic_fluid_ratio_{1,2}").row(123, 4));
  t.push_back(XPB_FIELD(avionics_on, "0, 1", S::kValidSwitches).ref("sim/cockpit2/switches/avionics_power_on").row(106, 0));
  t.push_back(XPB_FIELD(navigation_lights_on, "0, 1", S::kValidSwitches).ref("sim/cockpit2/switches/navigation_lights_on").row(106, 1));
  t.push_back(XPB_FIELD(beacon_on, "0, 1", S::kValidSwitches).ref("sim/cockpit2/switches/beacon_on").row(106, 2));
  t.push_back(XPB_FIELD(strobe_lights_on, "0, 1", S::kValidSwitches).ref("sim/cockpit2/switches/strobe_lights_on").row(106, 3));
  t.push_back(XPB_FIELD(landing_lights_on, "0, 1", S::kValidSwitches).ref("sim/cockpit2/switches/landing_lights_on").row(106, 4));
  t.push_back(XPB_FIELD(taxi_light_on, "0, 1", S::kValidSwitches).ref("sim/cockpit2/switches/taxi_light_on").row(106, 5));
  t.push_back(XPB_FIELD(pitot_heat_on, "0, 1", S::kValidSwitches).ref("sim/cockpit2/ice/ice_pitot_heat_on_pilot").row(109, 4));
  t.push_back(XPB_FIELD(cross_tie, "0, 1", S::kValidSwitches).ref("sim/cockpit2/electrical/cross_tie"));
}

void addAutopilot(Lines& t) {
  using S = AutopilotState;
  addSimTime<S>(t);
  t.push_back(XPB_FIELD(flight_director_mode, "-", S::kValidModes).ref("sim/cockpit2/autopilot/flight_director_mode").row(108, 1));
  t.push_back(XPB_FIELD(servos_on, "0, 1", S::kValidModes).ref("sim/cockpit2/autopilot/servos_on"));
  t.push_back(XPB_FIELD(autothrottle_enabled, "0, 1", S::kValidModes).ref("sim/cockpit2/autopilot/autothrottle_enabled").row(117, 0));
  t.push_back(XPB_FIELD(heading_mode, "-", S::kValidModes).ref("sim/cockpit2/autopilot/heading_mode").row(117, 1));
  t.push_back(XPB_FIELD(altitude_mode, "-", S::kValidModes).ref("sim/cockpit2/autopilot/altitude_mode").row(117, 2));
  t.push_back(XPB_FIELD(nav_status, "-", S::kValidModes).ref("sim/cockpit2/autopilot/nav_status").row(116, 0).note("[?] the rows' coding of modes may differ from the datarefs'"));
  t.push_back(XPB_FIELD(altitude_hold_status, "-", S::kValidModes).ref("sim/cockpit2/autopilot/altitude_hold_status").row(116, 1).note("[?] as nav_status"));
  t.push_back(XPB_FIELD(approach_status, "-", S::kValidModes).ref("sim/cockpit2/autopilot/approach_status").row(117, 5).note("[?] as nav_status"));
  t.push_back(XPB_FIELD(vnav_status, "-", S::kValidModes).ref("sim/cockpit2/autopilot/vnav_status").row(116, 3).note("[?] as nav_status"));
  t.push_back(XPB_FIELD(glideslope_status, "-", S::kValidModes).ref("sim/cockpit2/autopilot/glideslope_status").row(116, 6).note("[?] as nav_status"));
  t.push_back(XPB_FIELD(back_course_status, "-", S::kValidModes).ref("sim/cockpit2/autopilot/backcourse_status").row(117, 4).note("[?] as nav_status"));
  t.push_back(XPB_FIELD(target_airspeed, "m/s, or Mach", S::kValidTargets).ref("sim/cockpit2/autopilot/airspeed_dial_kts_mach").row(118, 0).because("knots become m/s; a dial below 10 is in Mach"));
  t.push_back(XPB_FIELD(target_heading_deg, "deg", S::kValidTargets).ref("sim/cockpit2/autopilot/heading_dial_deg_mag_pilot").row(118, 1));
  t.push_back(XPB_FIELD(target_vertical_speed, "m/s", S::kValidTargets).ref("sim/cockpit2/autopilot/vvi_dial_fpm", kFeetPerMinute).row(118, 2, kFeetPerMinute));
  t.push_back(XPB_FIELD(target_altitude, "m", S::kValidTargets).ref("sim/cockpit2/autopilot/altitude_dial_ft", kFeet).row(118, 3, kFeet));
  t.push_back(XPB_FIELD(director_pitch_deg, "deg", S::kValidDirector).ref("sim/cockpit2/autopilot/flight_director_pitch_deg").row(108, 2));
  t.push_back(XPB_FIELD(director_roll_deg, "deg", S::kValidDirector).ref("sim/cockpit2/autopilot/flight_director_roll_deg").row(108, 3));
}

void addWarnings(Lines& t) {
  using S = WarningState;
  const char* const bits = "[?] row 115 taken as a bit for each engine, as the datarefs without `_low` are";
  addSimTime<S>(t);
  t.push_back(XPB_FIELD(master_caution, "0, 1", S::kValidMaster).ref("sim/cockpit2/annunciators/master_caution").row(113, 0));
  t.push_back(XPB_FIELD(master_warning, "0, 1", S::kValidMaster).ref("sim/cockpit2/annunciators/master_warning").row(113, 1));
  t.push_back(XPB_FIELD(autopilot_disconnect, "0, 1", S::kValidSystems).ref("sim/cockpit2/annunciators/autopilot_disconnect").row(113, 3));
  t.push_back(XPB_FIELD(low_vacuum, "0, 1", S::kValidSystems).ref("sim/cockpit2/annunciators/low_vacuum").row(113, 4));
  t.push_back(XPB_FIELD(low_voltage, "0, 1", S::kValidSystems).ref("sim/cockpit2/annunciators/low_voltage").row(113, 5));
  t.push_back(XPB_FIELD(fuel_quantity, "0, 1", S::kValidSystems).ref("sim/cockpit2/annunciators/fuel_quantity").row(113, 6));
  t.push_back(XPB_FIELD(hydraulic_pressure, "0, 1", S::kValidSystems).ref("sim/cockpit2/annunciators/hydraulic_pressure").row(113, 7));
  t.push_back(XPB_FIELD(yaw_damper, "0, 1", S::kValidSystems).ref("sim/cockpit2/annunciators/yaw_damper").row(114, 0));
  t.push_back(XPB_FIELD(speedbrake, "0, 1", S::kValidSystems).ref("sim/cockpit2/annunciators/speedbrake").row(114, 1));
  t.push_back(XPB_FIELD(gpws, "0, 1", S::kValidSystems).ref("sim/cockpit2/annunciators/GPWS").row(114, 2));
  t.push_back(XPB_FIELD(ice, "0, 1", S::kValidSystems).ref("sim/cockpit2/annunciators/ice").row(114, 3));
  t.push_back(XPB_FIELD(pitot_heat, "0, 1", S::kValidSystems).ref("sim/cockpit2/annunciators/pitot_heat").row(114, 4));
  t.push_back(XPB_FIELD(cabin_altitude, "0, 1", S::kValidSystems).ref("sim/cockpit2/annunciators/cabin_altitude_12500").row(114, 5));
  t.push_back(XPB_FIELD(fuel_pressure_low, "0, 1", S::kValidEngines).ref("sim/cockpit2/annunciators/fuel_pressure_low[*]").row(115, 0).bitfield().note(bits));
  t.push_back(XPB_FIELD(oil_pressure_low, "0, 1", S::kValidEngines).ref("sim/cockpit2/annunciators/oil_pressure_low[*]").row(115, 1).bitfield().note(bits));
  t.push_back(XPB_FIELD(oil_temperature_high, "0, 1", S::kValidEngines).ref("sim/cockpit2/annunciators/oil_temperature_high[*]").row(115, 2).bitfield().note(bits));
  t.push_back(XPB_FIELD(inverter_off, "0, 1", S::kValidEngines).elements(2).ref("sim/cockpit2/annunciators/inverter_off[*]").row(115, 3).bitfield().note(bits));
  t.push_back(XPB_FIELD(generator_off, "0, 1", S::kValidEngines).ref("sim/cockpit2/annunciators/generator_off[*]").row(115, 4).bitfield().note(bits));
  t.push_back(XPB_FIELD(chip_detected, "0, 1", S::kValidEngines).ref("sim/cockpit2/annunciators/chip_detected[*]").row(115, 5).bitfield().note(bits));
  t.push_back(XPB_FIELD(engine_fire, "0, 1", S::kValidEngines).ref("sim/cockpit2/annunciators/engine_fires[*]").row(115, 6).bitfield().note(bits));
  t.push_back(XPB_FIELD(stall, "0, 1", S::kValidFlight).ref("sim/cockpit2/annunciators/stall_warning").row(127, 6));
  t.push_back(XPB_FIELD(gear_unsafe, "0, 1", S::kValidFlight).ref("sim/cockpit2/annunciators/gear_unsafe").row(127, 5));
  t.push_back(XPB_FIELD(overspeed, "0, 1", S::kValidFlight).ref("sim/flightmodel/failures/over_vne"));
  t.push_back(XPB_FIELD(crashed, "0, 1", S::kValidFlight).ref("sim/flightmodel2/misc/has_crashed").note("not in the 11.10 list, in that of 11.40"));
}

void addFuel(Lines& t) {
  using S = FuelState;
  addSimTime<S>(t);
  t.push_back(XPB_FIELD(fuel_tank, "kg", S::kValidFuel).ref("sim/flightmodel/weight/m_fuel[*]").row(62, 0, kPounds));
  t.push_back(XPB_FIELD(fuel_total, "kg", S::kValidFuel).ref("sim/flightmodel/weight/m_fuel_total").row(63, 2, kPounds));
  t.push_back(XPB_FIELD(empty_mass, "kg", S::kValidWeights).ref("sim/aircraft/weight/acf_m_empty").row(63, 0, kPounds).note("[?] unit of the dataref is not in the list; taken as kg"));
  t.push_back(XPB_FIELD(payload_mass, "kg", S::kValidWeights).ref("sim/flightmodel/weight/m_fixed").row(63, 1, kPounds));
  t.push_back(XPB_FIELD(jettison_mass, "kg", S::kValidWeights).ref("sim/flightmodel/weight/m_jettison").row(63, 3, kPounds));
  t.push_back(XPB_FIELD(total_mass, "kg", S::kValidWeights).ref("sim/flightmodel/weight/m_total").row(63, 4, kPounds));
  t.push_back(XPB_FIELD(max_mass, "kg", S::kValidWeights).ref("sim/aircraft/weight/acf_m_max").row(63, 5, kPounds).note("[?] as empty_mass"));
  t.push_back(XPB_FIELD(cg_offset, "m", S::kValidCg).ref("sim/flightmodel/misc/cgz_ref_to_default").row(63, 7, kFeet));
}

void addSim(Lines& t) {
  using S = SimStatus;
  const FieldGroup g = FieldGroup::kSim;
  addSimTime<S>(t);
  t.push_back(XPB_FIELD(frame_period, "s", S::kValidRate).ref("sim/operation/misc/frame_rate_period").row(0, 3));
  t.push_back(XPB_FIELD(frame_rate, "1/s", 0).row(0, 0).because("where no row comes: 1 / frame_period"));
  t.push_back(computed(g, "time_ratio", 1, "-", 0, "slope of the clock filter: simulator time over host time"));
  t.push_back(XPB_FIELD(time_ratio_requested, "-", S::kValidTime).ref("sim/time/sim_speed").row(0, 7));
  t.push_back(XPB_FIELD(flight_time, "s", S::kValidTime).ref("sim/time/total_flight_time_sec").row(1, 2));
  t.push_back(XPB_FIELD(zulu_time, "s", S::kValidTime).ref("sim/time/zulu_time_sec").row(1, 5, kHours).note("[?] row 1: decimal hours, or seconds"));
  t.push_back(XPB_FIELD(local_time, "s", S::kValidTime).ref("sim/time/local_time_sec").row(1, 6, kHours).note("[?] as zulu_time"));
  t.push_back(XPB_FIELD(paused, "0, 1", S::kValidTime).ref("sim/time/paused"));
  t.push_back(XPB_FIELD(replay, "0, 1", S::kValidTime).ref("sim/time/is_in_replay"));
  t.push_back(XPB_FIELD(view_type, "-", S::kValidView).ref("sim/graphics/view/view_type"));
  t.push_back(XPB_FIELD(view_external, "0, 1", S::kValidView).ref("sim/graphics/view/view_is_external"));
  t.push_back(XPB_FIELD(view_heading_deg, "deg", S::kValidView).ref("sim/graphics/view/pilots_head_psi"));
  t.push_back(XPB_FIELD(view_pitch_deg, "deg", S::kValidView).ref("sim/graphics/view/pilots_head_the"));
  t.push_back(XPB_FIELD(field_of_view_deg, "deg", S::kValidView).ref("sim/graphics/view/field_of_view_deg"));
  t.push_back(XPB_FIELD(window_width, "px", S::kValidWindow).ref("sim/graphics/view/window_width"));
  t.push_back(XPB_FIELD(window_height, "px", S::kValidWindow).ref("sim/graphics/view/window_height"));
}

#undef XPB_FIELD

// clang-format on

}  // namespace

const std::vector<FieldSpec>& fieldTable() {
  static const Lines table = [] {
    Lines lines;
    addFlight(lines);
    addEngines(lines);
    addSurfaces(lines);
    addControls(lines);
    addElectrical(lines);
    addAutopilot(lines);
    addWarnings(lines);
    addFuel(lines);
    addSim(lines);
    return lines;
  }();
  return table;
}

}  // namespace xplane_bridge::core
