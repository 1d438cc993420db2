// What a flight in process shows of a frame, and keeps of it: in_process.view.FlightView and campaign.flight.
#include <array>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <vector>

#include "xplane_bridge/bindings/python_object.hpp"
#include "xplane_bridge/bindings/python_property.hpp"
#include "xplane_bridge/bindings/twin_physics.hpp"

namespace xplane_bridge::bindings {
namespace {

constexpr double kG0 = 9.80665;  // [m/s^2]

/// Attributes of Python objects, whose names are made once.
class Names {
 public:
  explicit Names(std::initializer_list<const char*> names) {
    for (const char* name : names) names_.emplace_back(PyUnicode_InternFromString(name));
  }
  std::size_t size() const { return names_.size(); }
  void read(PyObject* object, double* out) const {
    for (const Object& name : names_) *out++ = number(attribute(object, name.get()).get());
  }

 private:
  std::vector<Object> names_;
};

/// As struct's "f": rounded, and what is too large is an error.
double rounded(double value) {
  const auto out = static_cast<float>(value);
  if (std::isinf(out) && !std::isinf(value)) raise(PyExc_OverflowError, "float too large to pack with f format");
  return static_cast<double>(out);
}

/// What both functions look up. Never ended: Python ends before static objects do.
struct Parts {
  Names view{"sim_time_s",
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
             "u_mps",
             "v_mps",
             "w_mps",
             "wind_north_mps",
             "wind_east_mps",
             "wind_down_mps",
             "alpha_rad",
             "beta_rad",
             "calibrated_airspeed_mps",
             "equivalent_airspeed_mps",
             "true_airspeed_mps",
             "mach",
             "dynamic_pressure_pa",
             "air_density_kg_m3",
             "specific_force_x_mps2",
             "specific_force_y_mps2",
             "specific_force_z_mps2"};
  Names stick{"roll", "pitch", "yaw"};
  Names place{"sim_time_s", "latitude_deg", "longitude_deg", "altitude_m"};
  Names motion{"p_rad_s",        "q_rad_s",       "r_rad_s",
               "v_north_mps",    "v_east_mps",    "v_down_mps",
               "alpha_rad",      "beta_rad",      "calibrated_airspeed_mps",
               "wind_north_mps", "wind_east_mps", "wind_down_mps",
               "mass_kg"};
  Names thrust{"thrust_n"};
  Names rpm{"rpm"};
  Object throttle{PyUnicode_InternFromString("throttle")};
  Object quaternion{PyUnicode_InternFromString("quaternion")};
  Object surfaces{PyUnicode_InternFromString("surfaces_deg")};
  Object engines{PyUnicode_InternFromString("engines")};
  // Python's, which rounds otherwise than the C library's.
  Property hypot = property(Object(PyImport_ImportModule("math")).get(), "hypot");
};

const Parts& parts() {
  static const Parts& made = *new Parts();
  return made;
}

PyObject* flightNumbers(PyObject* /*module*/, PyObject* arguments) {
  return guarded([&]() -> PyObject* {
    const Parts& p = parts();
    PyObject *state = nullptr, *controls = nullptr;
    double period = 0.0, standing_height = 0.0, parked_height = 0.0;
    if (!PyArg_ParseTuple(arguments, "OOddd", &state, &controls, &period, &standing_height, &parked_height)) {
      throw PythonError{};
    }
    std::array<double, 34> s{};
    std::array<double, 3> stick{};
    p.view.read(state, s.data());
    p.stick.read(controls, stick.data());
    double throttle = 0.0;
    readNumbers(attribute(controls, p.throttle.get()).get(), &throttle, 1);
    const auto length = [&p](double x, double y) {
      return number(p.hypot.call(makeNumber(x).get(), makeNumber(y).get()).get());
    };
    const double north = s[20], east = s[21];
    const std::array<double, 42> out{period,
                                     s[0],
                                     s[1],
                                     s[2],
                                     s[3],
                                     s[4] - standing_height + parked_height,
                                     degrees(s[5]),
                                     degrees(s[6]),
                                     modulo(degrees(s[7]), 360.0),
                                     s[8],
                                     s[9],
                                     s[10],
                                     s[11],
                                     s[12],
                                     s[13],
                                     s[14],
                                     s[15],
                                     s[16],
                                     s[17],
                                     s[18],
                                     s[19],
                                     north,
                                     east,
                                     s[22],
                                     length(s[14], s[15]),
                                     degrees(s[23]),
                                     degrees(s[24]),
                                     s[25],
                                     s[26],
                                     s[27],
                                     s[28],
                                     s[29],
                                     s[30],
                                     -s[33] / kG0,
                                     s[31] / kG0,
                                     s[32] / kG0,
                                     stick[0],
                                     stick[1],
                                     stick[2],
                                     throttle,
                                     length(north, east),
                                     modulo(degrees(std::atan2(-east, -north)), 360.0)};
    Object tuple(PyTuple_New(static_cast<Py_ssize_t>(out.size())));
    for (std::size_t i = 0; i < out.size(); ++i) {
      PyTuple_SET_ITEM(tuple.get(), static_cast<Py_ssize_t>(i), makeNumber(rounded(out[i])).release());
    }
    return tuple.release();
  });
}

PyObject* truthBytes(PyObject* /*module*/, PyObject* state) {
  return guarded([&]() -> PyObject* {
    const Parts& p = parts();
    std::vector<double> out(p.place.size() + 4 + p.motion.size());
    p.place.read(state, out.data());
    readNumbers(attribute(state, p.quaternion.get()).get(), out.data() + p.place.size(), 4);
    p.motion.read(state, out.data() + p.place.size() + 4);
    const Object deflections(PyDict_Values(attribute(state, p.surfaces.get()).get()));
    for (const Object& deflection : items(deflections.get())) out.push_back(number(deflection.get()));
    const std::vector<Object> all = items(attribute(state, p.engines.get()).get());
    for (const Names* name : {&p.thrust, &p.rpm}) {
      for (const Object& engine : all) name->read(engine.get(), &out.emplace_back());
    }
    return PyBytes_FromStringAndSize(reinterpret_cast<const char*>(out.data()),
                                     static_cast<Py_ssize_t>(out.size() * sizeof(double)));
  });
}

PyMethodDef functions[] = {
    {"flight_numbers", flightNumbers, METH_VARARGS,
     "flight_numbers(state, controls, period, standing_height, parked_height) -> tuple: the numbers of a FlightView, "
     "in "
     "its order, as float32 rounds them."},
    {"truth_bytes", truthBytes, METH_O,
     "truth_bytes(state) -> bytes: what the flight model really did, in doubles of this computer: what two flights "
     "must "
     "share to be the same."},
    {nullptr, nullptr, 0, nullptr},
};

}  // namespace

void addFlightRecord(PyObject* module) { check(PyModule_AddFunctions(module, functions)); }

}  // namespace xplane_bridge::bindings
