// What JSBSim knows of an aircraft, in our units: jsbsim_state.StateReader (emulator/flight), operation by operation as
// it is there, so that the same bits come out of both.
#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "xplane_bridge/bindings/names.hpp"
#include "xplane_bridge/bindings/python_property.hpp"
#include "xplane_bridge/bindings/python_type.hpp"
#include "xplane_bridge/bindings/twin_physics.hpp"

namespace xplane_bridge::bindings {
namespace {

constexpr std::size_t kInputs = 48;   // jsbsim_state._STATE_PROPERTIES
constexpr std::size_t kOutputs = 51;  // numbers of a ModelState

/// Python's % of a positive divisor.
double modulo(double value, double divisor) {
  const double rest = std::fmod(value, divisor);
  if (rest == 0.0) return 0.0;
  return rest < 0.0 ? rest + divisor : rest;
}

class Reader {
 public:
  explicit Reader(PyObject* getters) : names_(kNames.begin(), kNames.end()), quaternion_("quaternion") {
    for (const Object& getter : items(getters)) getters_.emplace_back(getter);
    if (getters_.size() != kInputs) {
      throw std::invalid_argument("StateReader: expected " + std::to_string(kInputs) + " getters");
    }
    // Not worked out anew: Python's ** rounds otherwise than a product.
    const Object units(PyImport_ImportModule("xplane_bridge.emulator.flight.jsbsim_state"));
    foot_ = constant(units, "FOOT_M");
    pound_force_ = constant(units, "POUND_FORCE_N");
    slug_ = constant(units, "SLUG_KG");
    knot_ = constant(units, "KNOT_MPS");
    psf_ = constant(units, "PSF_PA");
    density_ = constant(units, "SLUG_FT3_KG_M3");
    pound_foot_ = constant(units, "POUND_FOOT_NM");
    inch_ = constant(units, "INCH_M");
    rankine_ = constant(units, "RANKINE_K");
    earth_radius_ = constant(units, "EARTH_RADIUS_M");
    gravity_ = constant(units, "GRAVITY_MPS2");
  }

  void read(PyObject* state, PyObject* gravity_force) const {
    std::array<double, kInputs> in{};
    for (std::size_t i = 0; i < kInputs; ++i) in[i] = getters_[i].get();
    std::array<double, 3> gravity{};
    readNumbers(gravity_force, gravity.data(), gravity.size());
    const Quaternion rotation = rotationOf(in[4], in[5], in[6]);
    const std::array<double, kOutputs> out = work(in, rotation, gravity);
    for (std::size_t i = 0; i < kOutputs; ++i) names_[i].set(state, out[i]);
    const Object quaternion(Py_BuildValue("(dddd)", rotation.w, rotation.x, rotation.y, rotation.z));
    quaternion_.set(state, quaternion.get());
  }

 private:
  struct Quaternion {
    double w, x, y, z;
  };

  /// In the order of work().
  static constexpr std::array<const char*, kOutputs> kNames{
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
      "mass_kg",
      "specific_force_x_mps2",
      "specific_force_y_mps2",
      "specific_force_z_mps2",
      "acceleration_north_mps2",
      "acceleration_east_mps2",
      "acceleration_down_mps2",
      "wind_north_mps",
      "wind_east_mps",
      "wind_down_mps",
      "alpha_rad",
      "beta_rad",
      "alpha_dot_rad_s",
      "true_airspeed_mps",
      "equivalent_airspeed_mps",
      "calibrated_airspeed_mps",
      "mach",
      "dynamic_pressure_pa",
      "air_density_kg_m3",
      "pressure_pa",
      "temperature_k",
      "speed_of_sound_mps",
      "pressure_altitude_m",
      "cg_forward_m",
      "cg_right_m",
      "cg_down_m",
      "drag_n",
      "side_force_n",
      "lift_n",
      "aero_roll_nm",
      "aero_pitch_nm",
      "aero_yaw_nm",
  };

  static Quaternion rotationOf(double roll, double pitch, double heading) {
    const double cr = std::cos(roll / 2.0), sr = std::sin(roll / 2.0);
    const double cp = std::cos(pitch / 2.0), sp = std::sin(pitch / 2.0);
    const double cy = std::cos(heading / 2.0), sy = std::sin(heading / 2.0);
    return {cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy};
  }

  std::array<double, kOutputs> work(const std::array<double, kInputs>& in, const Quaternion& rotation,
                                    const std::array<double, 3>& gravity) const {
    const auto& [w, x, y, z] = rotation;
    const double latitude = in[0], altitude = in[2] * foot_;
    const double vn = in[13] * foot_, ve = in[14] * foot_, vd = in[15] * foot_;
    const double mass = in[22] * slug_;
    const double ax = (in[19] * pound_force_ - gravity[0]) / mass;
    const double ay = (in[20] * pound_force_ - gravity[1]) / mass;
    const double az = (in[21] * pound_force_ - gravity[2]) / mass;
    // Specific force in NED plus gravity, less what the turning of the local level takes (planet at rest).
    const double an = (1.0 - 2.0 * (y * y + z * z)) * ax + 2.0 * (x * y - w * z) * ay + 2.0 * (x * z + w * y) * az;
    const double ae = 2.0 * (x * y + w * z) * ax + (1.0 - 2.0 * (x * x + z * z)) * ay + 2.0 * (y * z - w * x) * az;
    const double ad = 2.0 * (x * z - w * y) * ax + 2.0 * (y * z + w * x) * ay + (1.0 - 2.0 * (x * x + y * y)) * az;
    const double radius = earth_radius_ + altitude;
    const double tangent = std::tan(radians(latitude));
    return {latitude,
            in[1],
            altitude,
            in[3] * foot_,
            in[4],
            in[5],
            modulo(in[6], 2.0 * kPi),
            in[7],
            in[8],
            in[9],
            in[10],
            in[11],
            in[12],
            vn,
            ve,
            vd,
            in[16] * foot_,
            in[17] * foot_,
            in[18] * foot_,
            mass,
            ax,
            ay,
            az,
            an + (vn * vd - ve * ve * tangent) / radius,
            ae + (ve * vd + ve * vn * tangent) / radius,
            ad + gravity_ - (vn * vn + ve * ve) / radius,
            in[23] * foot_,
            in[24] * foot_,
            in[25] * foot_,
            in[26],
            in[27],
            in[28],
            in[29] * foot_,
            in[30] * knot_,
            in[31] * knot_,
            in[32],
            in[33] * psf_,
            in[34] * density_,
            in[35] * psf_,
            in[36] * rankine_,
            in[37] * foot_,
            in[38] * foot_,
            -in[39] * inch_,
            in[40] * inch_,
            -in[41] * inch_,
            in[42] * pound_force_,
            in[43] * pound_force_,
            in[44] * pound_force_,
            in[45] * pound_foot_,
            in[46] * pound_foot_,
            in[47] * pound_foot_};
  }

  std::vector<Property> getters_;
  std::vector<Name> names_;
  Name quaternion_;
  double foot_ = 0.0, pound_force_ = 0.0, slug_ = 0.0, knot_ = 0.0, psf_ = 0.0, density_ = 0.0, pound_foot_ = 0.0,
         inch_ = 0.0, rankine_ = 0.0, earth_radius_ = 0.0, gravity_ = 0.0;
};

PyObject* create(PyTypeObject* type, PyObject* arguments, PyObject* /*keywords*/) {
  return guarded([&]() -> PyObject* {
    PyObject* getters = nullptr;
    if (!PyArg_ParseTuple(arguments, "O", &getters)) throw PythonError{};
    return makeOwner(type, std::make_unique<Reader>(getters));
  });
}

PyObject* read(PyObject* object, PyObject* arguments) {
  return guarded([&]() -> PyObject* {
    PyObject *state = nullptr, *gravity_force = nullptr;
    if (!PyArg_ParseTuple(arguments, "OO", &state, &gravity_force)) throw PythonError{};
    ownedBy<Reader>(object).read(state, gravity_force);
    return none();
  });
}

PyMethodDef methods[] = {
    {"read", method(read), METH_VARARGS, "read(state, gravity_force): as jsbsim_state.StateReader.read."},
    {nullptr, nullptr, 0, nullptr},
};

char description[] =
    "StateReader(getters): fills in a ModelState from JSBSim's properties, the same bits as in Python.";

PyType_Slot slots[] = {
    {Py_tp_new, reinterpret_cast<void*>(create)},
    {Py_tp_dealloc, reinterpret_cast<void*>(destroyOwner<Reader>)},
    {Py_tp_methods, methods},
    {Py_tp_doc, description},
    {0, nullptr},
};

PyType_Spec specification = {"xplane_bridge._core.StateReader", sizeof(Owner<Reader>), 0, Py_TPFLAGS_DEFAULT, slots};

}  // namespace

void addStateReader(PyObject* module) { addType(module, "StateReader", &specification); }

}  // namespace xplane_bridge::bindings
