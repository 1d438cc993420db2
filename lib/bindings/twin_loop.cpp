// A frame of the light twin, for FixedWing (emulator/aircraft/fixed_wing): reads surfaces,
// engines, propellers and gusts from the Python objects, steps them with JSBSim through its own getters, setters and
// `run`, and writes them back. The order of every writing and operation is the Python code's; of the readings, a height
// is kept until the next `run`, because it costs JSBSim ten times another value.
#include "xplane_bridge/bindings/twin_mirrors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <vector>

#include "xplane_bridge/bindings/names.hpp"
#include "xplane_bridge/bindings/python_type.hpp"
#include "xplane_bridge/bindings/twin_frame.hpp"
#include "xplane_bridge/bindings/twin_physics.hpp"

namespace xplane_bridge::bindings {
namespace {

constexpr double kFoot = 0.3048;
constexpr double kCrashWatch = 20.0;  // [m]
constexpr double kStrutsWorkCosine = 0.5;
constexpr double kThinnestAir = 1e-3;  // [kg/m3]

/// Attributes of the model itself, which the loop must not keep: the model has the loop.
struct ModelNames {
  Name fuel{"_fuel_kg"}, wind{"_wind"}, gravity{"_gravity_force"}, step{"_fdm_step"}, crashed{"_crashed"},
      gusts{"_gusts"};
};

class Loop {
 public:
  explicit Loop(PyObject* model) : frame_(model) {
    const auto getters = [model](const char* name) { return items(attribute(model, name).get()); };
    air_ = properties(model, "_air_getters");
    if (air_.size() != 7) throw std::invalid_argument("_air_getters: expected 7 of them");
    alpha_ = property(model, "_alpha");
    pressure_ = property(model, "_pressure");
    temperature_ = property(model, "_temperature");
    agl_ = property(model, "_agl");
    roll_ = property(model, "_roll");
    pitch_ = property(model, "_pitch");
    heading_ = property(model, "_heading");
    airspeed_ = property(model, "_airspeed");
    gear_ = attribute(model, "_gear");
    gear_position_now_ = Attribute(gear_.get(), "position");
    extend_gear_ = property(gear_.get(), "_set_extension");
    wind_ = properties(model, "_wind_setters");
    const Object fdm = attribute(model, "_fdm");
    run_ = property(fdm.get(), "run");
    set_dt_ = property(fdm.get(), "set_dt");
    hit_ = property(attribute(model, "_contacts").get(), "hit");
    contact_height_ = number(attribute(model, "contact_height_m").get());
    contact_runs_ = static_cast<int>(number(attribute(model, "contact_runs").get()));
    surface_setters_ = properties(model, "_surface_setters");
    for (const Object& pair : getters("_load_setters")) {
      const std::vector<Object> both = items(pair.get());
      load_setters_.push_back({Property(both.at(0)), number(both.at(1).get())});
    }
    const Object surface_set = attribute(model, "_surface_set");
    for (const Object& o : items(attribute(surface_set.get(), "actuators").get())) {
      surfaces_.push_back(std::make_unique<SurfaceMirror>(o));
    }
    for (const Object& o : getters("_rotors")) rotors_.push_back(std::make_unique<RotorMirror>(o));
    for (const Object& o : getters("_governors")) governors_.push_back(std::make_unique<GovernorMirror>(o));
    for (const Object& o : getters("_engines")) engines_.push_back(std::make_unique<EngineMirror>(o));
    turbulence_ = TurbulenceMirror(attribute(model, "_turbulence"));
    // Not worked out anew: Python's ** rounds otherwise than a product.
    const Object units(PyImport_ImportModule("xplane_bridge.emulator.flight.jsbsim_state"));
    density_unit_ = constant(units, "SLUG_FT3_KG_M3");
    pressure_unit_ = constant(units, "PSF_PA");
    temperature_unit_ = constant(units, "RANKINE_K");
  }

  /// Flies `count` steps of `substep` [s], in all `dt` [s]. What had been flown is written back also where JSBSim gives
  /// up.
  void fly(PyObject* model, int count, double substep, double dt, PyObject* controls) {
    frame_.begin(model, dt, controls);
    const std::vector<SurfaceOrder> orders = frame_.orders(model, controls);
    const std::vector<Throttle> throttles = frame_.throttles(controls);
    read(model);
    try {
      for (int i = 0; i < count; ++i) step(substep, orders, throttles);
    } catch (const PythonError&) {
      PyObject *type = nullptr, *value = nullptr, *trace = nullptr;
      PyErr_Fetch(&type, &value, &trace);
      write(model);
      PyErr_Restore(type, value, trace);
      throw;
    }
    write(model);
    frame_.load(model);
  }

  void fill(PyObject* model, PyObject* state, PyObject* controls) const { frame_.fill(model, state, controls); }

  /// FixedWing._settle_engines but for its end: the engines alone in the air as it passes now.
  void settle(PyObject* model, int count, double dt, PyObject* controls) {
    const std::vector<Throttle> throttles = frame_.throttles(controls);
    readEngines(model);
    const Air air = readAir(false);
    for (std::size_t i = 0; i < engines_.size(); ++i) {
      for (int k = 0; k < count; ++k) {
        Rotor& rotor = rotors_[i]->rotor;
        governors_[i]->governor.step(dt, rotor, throttles[i].propeller);
        rotor.airLoads(dt, air);
        const double torque =
            engines_[i]->engine.torque(dt, rotor.omega, throttles[i].lever, throttles[i].mixture, air, fuel_[i] > 0.0);
        rotor.turn(dt, torque, air.rates);
      }
    }
    writeEngines(model);
  }

 private:
  void readEngines(PyObject* model) {
    for (auto& rotor : rotors_) rotor->mirror.read();
    for (auto& governor : governors_) governor->mirror.read();
    for (auto& engine : engines_) engine->read();
    const Object fuel = names_.fuel.of(model);
    fuel_.resize(static_cast<std::size_t>(std::max<Py_ssize_t>(PySequence_Size(fuel.get()), 0)));
    if (fuel_.size() < engines_.size()) throw std::invalid_argument("_fuel_kg: expected a tank for each engine");
    readNumbers(fuel.get(), fuel_.data(), fuel_.size());
  }

  void writeEngines(PyObject* model) const {
    for (const auto& rotor : rotors_) rotor->mirror.write();
    for (const auto& governor : governors_) governor->mirror.write();
    for (const auto& engine : engines_) engine->write();
    writeNumbers(names_.fuel.of(model).get(), fuel_.data(), fuel_.size());
  }

  void read(PyObject* model) {
    readEngines(model);
    for (auto& surface : surfaces_) surface->read();
    turbulence_.read();
    readNumbers(names_.wind.of(model).get(), steady_wind_.data(), steady_wind_.size());
    readNumbers(names_.gravity.of(model).get(), gravity_.data(), gravity_.size());
    gear_position_ = gear_position_now_.getNumber();
    fdm_step_ = names_.step.numberOf(model);
    crashed_ = names_.crashed.trueFor(model);
    height_m_ = agl_.get() * kFoot;
    // Others set them between frames.
    applied_deg_.assign(surfaces_.size(), std::numeric_limits<double>::quiet_NaN());
    extended_ = std::numeric_limits<double>::quiet_NaN();
    blown_ = false;
  }

  void write(PyObject* model) const {
    writeEngines(model);
    for (const auto& surface : surfaces_) surface->write();
    turbulence_.write();
    names_.step.set(model, fdm_step_);
    names_.crashed.set(model, crashed_);
    if (!blown_) return;
    const Object gusts(PyList_New(3));
    for (Py_ssize_t axis = 0; axis < 3; ++axis) {
      PyObject* gust = PyFloat_FromDouble(gusts_[static_cast<std::size_t>(axis)]);
      if (!gust) throw PythonError{};
      PyList_SetItem(gusts.get(), axis, gust);
    }
    names_.gusts.set(model, gusts.get());
  }

  Air readAir(bool floor) const {
    std::array<double, 7> values{};
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = air_[i].get();
    Air air;
    air.velocity = {values[0] * kFoot, values[1] * kFoot, values[2] * kFoot};
    air.rates = {values[3], values[4], values[5]};
    const double density = values[6] * density_unit_;
    air.density = floor ? pythonMax(density, kThinnestAir) : density;
    air.pressure = pressure_.get() * pressure_unit_;
    air.temperature = temperature_.get() * temperature_unit_;
    return air;
  }

  void updateGusts(double dt) {
    const double heading = heading_.get();
    const double speed = airspeed_.get() * kFoot;
    const Dryden::Gusts g = turbulence_.dryden.step(dt, speed, height_m_, [this] { return turbulence_.gauss(); });
    const double sine = std::sin(heading), cosine = std::cos(heading);
    gusts_ = {g.along * cosine - g.across * sine, g.along * sine + g.across * cosine, g.down};
    blown_ = true;
    for (std::size_t axis = 0; axis < 3; ++axis) wind_[axis].set((steady_wind_[axis] + gusts_[axis]) / kFoot);
  }

  void advance(double dt, const std::vector<SurfaceOrder>& orders, const std::vector<Throttle>& throttles) {
    const Air air = readAir(true);
    const double alpha_deg = degrees(alpha_.get());
    for (std::size_t i = 0; i < surfaces_.size(); ++i) surfaces_[i]->actuator.step(orders[i], dt, alpha_deg);
    for (std::size_t i = 0; i < engines_.size(); ++i) {
      Rotor& rotor = rotors_[i]->rotor;
      PistonEngine& engine = engines_[i]->engine;
      governors_[i]->governor.step(dt, rotor, throttles[i].propeller);
      rotor.airLoads(dt, air);
      const bool fuel = fuel_[i] > 0.0 && throttles[i].fault == 0;
      double torque = engine.torque(dt, rotor.omega, throttles[i].lever, throttles[i].mixture, air, fuel);
      if (throttles[i].fault == 2) torque = rotor.torque - rotor.inertia_kg_m2 * rotor.omega / dt;
      rotor.turn(dt, torque, air.rates);
      fuel_[i] = pythonMax(fuel_[i] - engine.fuel_flow * dt, 0.0);
    }
  }

  void applyLoads() {
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
      const double angle = surfaces_[i]->actuator.effective_deg;
      if (sameBits(angle, applied_deg_[i])) continue;
      surface_setters_[i].set(angle);
      applied_deg_[i] = angle;
    }
    std::array<double, 6> loads{};
    for (const auto& mirror : rotors_) {
      const Rotor& rotor = mirror->rotor;
      loads[0] += rotor.force.x;
      loads[1] += rotor.force.y;
      loads[2] += rotor.force.z;
      loads[3] += rotor.moment.x;
      loads[4] += rotor.moment.y;
      loads[5] += rotor.moment.z;
    }
    for (std::size_t axis = 0; axis < 3; ++axis) loads[axis] += gravity_[axis];
    for (std::size_t i = 0; i < loads.size(); ++i) load_setters_[i].setter.set(loads[i] * load_setters_[i].factor);
  }

  void step(double dt, const std::vector<SurfaceOrder>& orders, const std::vector<Throttle>& throttles) {
    if (turbulence_.dryden.intensity_mps > 0.0) updateGusts(dt);
    advance(dt, orders, throttles);
    applyLoads();
    const int runs = height_m_ > contact_height_ ? 1 : contact_runs_;
    if (std::fabs(dt / runs - fdm_step_) > 1e-12) {
      fdm_step_ = dt / runs;
      set_dt_.set(fdm_step_);
    }
    const bool tilted_near_ground =
        height_m_ < kCrashWatch && std::cos(roll_.get()) * std::cos(pitch_.get()) < kStrutsWorkCosine;
    const double extended = tilted_near_ground ? 0.0 : gear_position_;
    if (!sameBits(extended, extended_)) extend_gear_.set(extended_ = extended);
    for (int i = 0; i < runs; ++i) run_.call();
    height_m_ = agl_.get() * kFoot;
    if (height_m_ < kCrashWatch && !crashed_) {
      const Object hit = hit_.call();
      crashed_ = PyObject_IsTrue(hit.get()) == 1;
    }
  }

  const TwinFrame frame_;
  struct LoadSetter {
    Property setter;
    double factor;
  };
  std::vector<Property> air_, wind_, surface_setters_;
  std::vector<LoadSetter> load_setters_;
  Property alpha_, pressure_, temperature_, agl_, roll_, pitch_, heading_, airspeed_, extend_gear_, set_dt_, run_, hit_;
  Object gear_;
  Attribute gear_position_now_;
  const ModelNames names_;
  double contact_height_ = 0.0, density_unit_ = 1.0, pressure_unit_ = 1.0, temperature_unit_ = 1.0;
  int contact_runs_ = 1;
  std::vector<std::unique_ptr<SurfaceMirror>> surfaces_;  // pointers: the mirrors point into what they mirror
  std::vector<std::unique_ptr<RotorMirror>> rotors_;
  std::vector<std::unique_ptr<GovernorMirror>> governors_;
  std::vector<std::unique_ptr<EngineMirror>> engines_;
  TurbulenceMirror turbulence_;
  std::vector<double> fuel_, applied_deg_;
  std::array<double, 3> steady_wind_{}, gusts_{}, gravity_{};
  double gear_position_ = 0.0, extended_ = 0.0, fdm_step_ = 0.0, height_m_ = 0.0;
  bool crashed_ = false, blown_ = false;
};

PyObject* create(PyTypeObject* type, PyObject* arguments, PyObject* /*keywords*/) {
  return guarded([&]() -> PyObject* {
    PyObject* model = nullptr;
    if (!PyArg_ParseTuple(arguments, "O", &model)) throw PythonError{};
    return makeOwner(type, std::make_unique<Loop>(model));
  });
}

PyObject* fly(PyObject* object, PyObject* arguments) {
  return guarded([&]() -> PyObject* {
    PyObject *model = nullptr, *controls = nullptr;
    int count = 0;
    double substep = 0.0, dt = 0.0;
    if (!PyArg_ParseTuple(arguments, "OiddO", &model, &count, &substep, &dt, &controls)) throw PythonError{};
    ownedBy<Loop>(object).fly(model, count, substep, dt, controls);
    return none();
  });
}

PyObject* settle(PyObject* object, PyObject* arguments) {
  return guarded([&]() -> PyObject* {
    PyObject *model = nullptr, *controls = nullptr;
    int count = 0;
    double dt = 0.0;
    if (!PyArg_ParseTuple(arguments, "OidO", &model, &count, &dt, &controls)) throw PythonError{};
    ownedBy<Loop>(object).settle(model, count, dt, controls);
    return none();
  });
}

PyObject* fill(PyObject* object, PyObject* arguments) {
  return guarded([&]() -> PyObject* {
    PyObject *model = nullptr, *state = nullptr, *controls = nullptr;
    if (!PyArg_ParseTuple(arguments, "OOO", &model, &state, &controls)) throw PythonError{};
    ownedBy<Loop>(object).fill(model, state, controls);
    return none();
  });
}

PyMethodDef methods[] = {
    {"fly", method(fly), METH_VARARGS,
     "fly(model, count, substep, dt, controls): a frame of `dt` [s] in `count` JSBSim steps of `substep` [s]."},
    {"settle", method(settle), METH_VARARGS,
     "settle(model, count, dt, controls): the engines alone, in the air of now."},
    {"fill", method(fill), METH_VARARGS, "fill(model, state, controls): what the twin itself adds to a ModelState."},
    {nullptr, nullptr, 0, nullptr},
};

char description[] = "TwinLoop(model): the frames of a FixedWing, the same bits as in Python.";

PyType_Slot slots[] = {
    {Py_tp_new, reinterpret_cast<void*>(create)},
    {Py_tp_dealloc, reinterpret_cast<void*>(destroyOwner<Loop>)},
    {Py_tp_methods, methods},
    {Py_tp_doc, description},
    {0, nullptr},
};

PyType_Spec specification = {"xplane_bridge._core.TwinLoop", sizeof(Owner<Loop>), 0, Py_TPFLAGS_DEFAULT, slots};

}  // namespace

void addTwinLoop(PyObject* module) { addType(module, "TwinLoop", &specification); }

}  // namespace xplane_bridge::bindings
