// What a controller sees of a flight in process: the emulator's datarefs of a frame, float32 as X-Plane sends them, and
// what rx_node makes of these, by rx_node's own code. The first half is operation by operation as the emulator does it
// (emulator/flight/earth.py, frame.py, datarefs/tables), so that the same bits come out.
#include <array>
#include <cmath>
#include <cstddef>

#include "xplane_bridge/bindings/names.hpp"
#include "xplane_bridge/bindings/python_object.hpp"
#include "xplane_bridge/bindings/twin_physics.hpp"
#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/core/state/flight_computation.hpp"

namespace xplane_bridge::bindings {
namespace {

using Vec = std::array<double, 3>;
using Rows = std::array<Vec, 3>;

constexpr double kPsfPerPascal = 0.3048 * 0.3048 / 4.4482216152605;  // frame.PA_TO_PSF

/// Of a ModelState, in this order.
enum StateNumber : std::size_t {
  kTime,
  kLatitude,
  kLongitude,
  kAltitude,
  kAgl,
  kRoll,
  kPitch,
  kHeading,
  kP,
  kQ,
  kR,
  kPDot,
  kQDot,
  kRDot,
  kNorth,
  kEast,
  kDown,
  kWindNorth,
  kWindEast,
  kWindDown,
  kTrueAirspeed,
  kMach,
  kDynamicPressure,
  kDensity,
  kForceX,
  kForceY,
  kForceZ,
  kStateNumbers
};

struct Parts {
  Names state{"sim_time_s",
              "latitude_deg",
              "longitude_deg",
              "altitude_m",
              "agl_m",
              "roll_rad",
              "pitch_rad",
              "heading_rad",
              "p_rad_s",
              "q_rad_s",
              "r_rad_s",
              "p_dot_rad_s2",
              "q_dot_rad_s2",
              "r_dot_rad_s2",
              "v_north_mps",
              "v_east_mps",
              "v_down_mps",
              "wind_north_mps",
              "wind_east_mps",
              "wind_down_mps",
              "true_airspeed_mps",
              "mach",
              "dynamic_pressure_pa",
              "air_density_kg_m3",
              "specific_force_x_mps2",
              "specific_force_y_mps2",
              "specific_force_z_mps2"};
  Names stick{"roll", "pitch", "yaw"};
  Name throttle{"throttle"};
};

Rows levelRows(double latitude_deg, double longitude_deg) {
  const double lat = radians(latitude_deg), lon = radians(longitude_deg);
  const double sin_lat = std::sin(lat), cos_lat = std::cos(lat), sin_lon = std::sin(lon), cos_lon = std::cos(lon);
  return {{{-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat},
           {-sin_lon, cos_lon, 0.0},
           {-cos_lat * cos_lon, -cos_lat * sin_lon, -sin_lat}}};
}

Vec turned(const Rows& rows, const Vec& v) {
  Vec out{};
  for (std::size_t i = 0; i < 3; ++i) out[i] = rows[i][0] * v[0] + rows[i][1] * v[1] + rows[i][2] * v[2];
  return out;
}

/// As X-Plane sends it: float32, and what is too large is an error, as of Python's struct.
double sent(double value) {
  const auto out = static_cast<float>(value);
  if (std::isinf(out) && !std::isinf(value)) raise(PyExc_OverflowError, "float too large to pack with f format");
  return static_cast<double>(out);
}

/// Of north, east and down: OpenGL's X east, Y up, Z south.
Eigen::Vector3d sentOpengl(const Vec& ned) { return {sent(ned[1]), sent(-ned[2]), sent(-ned[0])}; }

void placeInScenery(const std::array<double, kStateNumbers>& s, core::FlightInputs* in, double origin_latitude,
                    double origin_longitude) {
  const Rows origin = levelRows(origin_latitude, origin_longitude);
  const Rows level = levelRows(s[kLatitude], s[kLongitude]);
  Rows turn{};
  for (std::size_t j = 0; j < 3; ++j) {
    const Vec column = turned(origin, level[j]);
    for (std::size_t i = 0; i < 3; ++i) turn[i][j] = column[i];
  }
  const double distance = -(core::kEarthRadius + s[kAltitude]);
  const Vec place = turned(origin, {level[2][0] * distance, level[2][1] * distance, level[2][2] * distance});
  in->local_position = {sent(place[1]), sent(-place[2] - core::kEarthRadius), sent(-place[0])};
  in->origin_latitude = sent(origin_latitude);
  in->origin_longitude = sent(origin_longitude);
  in->earth_radius = sent(core::kEarthRadius);
  in->local_velocity = sentOpengl(turned(turn, {s[kNorth], s[kEast], s[kDown]}));
  in->wind_local = sentOpengl(turned(turn, {s[kWindNorth], s[kWindEast], s[kWindDown]}));
}

core::FlightInputs inputsOf(const std::array<double, kStateNumbers>& s, const std::array<double, 4>& stick,
                            double period, double height, double origin_latitude, double origin_longitude) {
  core::FlightInputs in;
  in.sim_time = sent(s[kTime]);
  in.frame_period = sent(period);
  in.paused = in.replay = 0.0;
  placeInScenery(s, &in, origin_latitude, origin_longitude);
  in.altitude_agl = sent(height);
  in.roll_deg = sent(degrees(s[kRoll]));
  in.pitch_deg = sent(degrees(s[kPitch]));
  in.heading_true_deg = sent(core::wrap360(degrees(s[kHeading])));
  in.roll_rate = sent(s[kP]);
  in.pitch_rate = sent(s[kQ]);
  in.yaw_rate = sent(s[kR]);
  for (int i = 0; i < 3; ++i) {
    in.angular_acceleration[i] = sent(degrees(s[kPDot + static_cast<std::size_t>(i)])) * core::kRadiansPerDegree;
  }
  in.indicated_airspeed = 0.0;  // of an instrument, which a flight in process has none of
  in.true_airspeed = sent(s[kTrueAirspeed]);
  in.mach = sent(s[kMach]);
  in.dynamic_pressure = sent(s[kDynamicPressure] * kPsfPerPascal) * core::kPascalsPerPoundPerSquareFoot;
  in.air_density = sent(s[kDensity]);
  in.load_factor_normal = sent(-s[kForceZ] / core::kStandardGravity) * core::kDatarefNormalSign;
  in.load_factor_axial = sent(core::kDatarefAxialSign * s[kForceX] / core::kStandardGravity) * core::kDatarefAxialSign;
  in.load_factor_side = sent(s[kForceY] / core::kStandardGravity) * core::kDatarefSideSign;
  in.control_roll = sent(stick[0]);
  in.control_pitch = sent(stick[1]);
  in.control_yaw = sent(stick[2]);
  in.control_throttle = sent(stick[3]);
  return in;
}

/// In the order of in_process.view.
Object numbersOf(const core::FlightState& s) {
  const auto single = [](float value) { return static_cast<double>(value); };
  const std::array<double, 48> out{single(s.frame_period),
                                   single(s.sim_time),
                                   s.latitude,
                                   s.longitude,
                                   s.altitude_msl,
                                   single(s.altitude_agl),
                                   s.roll_deg,
                                   s.pitch_deg,
                                   s.heading_true_deg,
                                   s.angular_velocity.x(),
                                   s.angular_velocity.y(),
                                   s.angular_velocity.z(),
                                   s.angular_acceleration.x(),
                                   s.angular_acceleration.y(),
                                   s.angular_acceleration.z(),
                                   s.velocity_ned.x(),
                                   s.velocity_ned.y(),
                                   s.velocity_ned.z(),
                                   s.velocity_body.x(),
                                   s.velocity_body.y(),
                                   s.velocity_body.z(),
                                   s.wind_ned.x(),
                                   s.wind_ned.y(),
                                   s.wind_ned.z(),
                                   s.specific_force.x(),
                                   s.specific_force.y(),
                                   s.specific_force.z(),
                                   single(s.vertical_speed),
                                   single(s.ground_speed),
                                   single(s.track_deg),
                                   single(s.flight_path_angle_deg),
                                   single(s.alpha_deg),
                                   single(s.beta_deg),
                                   single(s.calibrated_airspeed),
                                   single(s.equivalent_airspeed),
                                   single(s.true_airspeed),
                                   single(s.mach),
                                   single(s.dynamic_pressure),
                                   single(s.air_density),
                                   single(s.load_factor_normal),
                                   single(s.load_factor_axial),
                                   single(s.load_factor_side),
                                   single(s.control_roll),
                                   single(s.control_pitch),
                                   single(s.control_yaw),
                                   single(s.control_throttle),
                                   single(s.wind_speed),
                                   single(s.wind_from_deg)};
  Object tuple(PyTuple_New(static_cast<Py_ssize_t>(out.size())));
  for (std::size_t i = 0; i < out.size(); ++i) {
    PyTuple_SET_ITEM(tuple.get(), static_cast<Py_ssize_t>(i), makeNumber(out[i]).release());
  }
  return tuple;
}

PyObject* flightNumbers(PyObject* /*module*/, PyObject* arguments) {
  return guarded([&]() -> PyObject* {
    static const Parts& parts = *new Parts();  // never ended: Python ends before static objects do
    PyObject *state = nullptr, *controls = nullptr;
    double period = 0.0, standing_height = 0.0, parked_height = 0.0, origin_latitude = 0.0, origin_longitude = 0.0;
    if (!PyArg_ParseTuple(arguments, "OOddddd", &state, &controls, &period, &standing_height, &parked_height,
                          &origin_latitude, &origin_longitude)) {
      throw PythonError{};
    }
    std::array<double, kStateNumbers> s{};
    parts.state.read(state, s.data());
    std::array<double, 4> stick{};
    parts.stick.read(controls, stick.data());
    readNumbers(parts.throttle.of(controls).get(), &stick[3], 1);
    const core::FlightInputs in =
        inputsOf(s, stick, period, s[kAgl] - standing_height + parked_height, origin_latitude, origin_longitude);
    return numbersOf(core::computeFlightState(in, core::localPosition(in), core::TangentFrame())).release();
  });
}

PyMethodDef functions[] = {
    {"flight_numbers", flightNumbers, METH_VARARGS,
     "flight_numbers(state, controls, period, standing_height, parked_height, origin_latitude, origin_longitude) -> "
     "tuple: the numbers of a FlightView, in its order."},
    {nullptr, nullptr, 0, nullptr},
};

}  // namespace

void addFlightView(PyObject* module) { check(PyModule_AddFunctions(module, functions)); }

}  // namespace xplane_bridge::bindings
