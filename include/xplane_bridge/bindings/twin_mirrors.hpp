#pragma once

/// The parts of the light twin that live in Python objects, and in C++ while a frame is flown.

#include "xplane_bridge/bindings/python_attribute.hpp"

#include <cmath>
#include <cstring>
#include <optional>
#include <vector>

#include "xplane_bridge/bindings/python_object.hpp"
#include "xplane_bridge/bindings/python_property.hpp"
#include "xplane_bridge/bindings/twin_physics.hpp"

namespace xplane_bridge::bindings {

/// Unlike ==, false for zeros of two signs.
inline bool sameBits(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

/// A double that lives in an attribute of a Python object while no frame is flown.
struct Field {
  Attribute attribute;
  double* value;
  double read = 0.0;  // what Python's object has
};

/// A Python object and the numbers that it shares with a C++ one.
struct Mirror {
  Object object;
  std::vector<Field> fields;

  explicit Mirror(Object owner) : object(std::move(owner)) {}
  void add(const char* name, double& value) { fields.push_back({Attribute(object.get(), name), &value}); }
  void read() {
    for (Field& field : fields) *field.value = field.read = field.attribute.getNumber();
  }
  /// To be called after `read`: writes what has changed since.
  void write() const {
    for (const Field& field : fields) {
      if (!sameBits(field.read, *field.value)) field.attribute.set(makeNumber(*field.value));
    }
  }
};

struct RotorMirror {
  Rotor rotor;
  Mirror mirror;

  explicit RotorMirror(const Object& object) : mirror(object) {
    const Object spec = attribute(object.get(), "spec");
    rotor.direction = constant(spec, "direction") > 0.0 ? 1 : -1;
    rotor.radius_m = constant(spec, "radius_m");
    rotor.blade_area_m2 = constant(spec, "blade_area_m2");
    rotor.inertia_kg_m2 = constant(spec, "inertia_kg_m2");
    rotor.lift_slope = constant(spec, "lift_slope");
    rotor.max_lift = constant(spec, "max_lift");
    rotor.profile_drag = constant(spec, "profile_drag");
    rotor.zero_lift_deg = constant(spec, "zero_lift_deg");
    rotor.edgewise_drag = constant(spec, "edgewise_drag");
    mirror.add("omega", rotor.omega);
    mirror.add("blade_rad", rotor.blade_rad);
    mirror.add("inflow", rotor.inflow);
    mirror.add("thrust", rotor.thrust);
    mirror.add("torque", rotor.torque);
    mirror.add("shaft_torque", rotor.shaft_torque);
    mirror.add("axis_x", rotor.axis_x);
    mirror.add("axis_z", rotor.axis_z);
    mirror.add("x", rotor.x);
    mirror.add("y", rotor.y);
    mirror.add("z", rotor.z);
    mirror.add("force_x", rotor.force.x);
    mirror.add("force_y", rotor.force.y);
    mirror.add("force_z", rotor.force.z);
    mirror.add("moment_x", rotor.moment.x);
    mirror.add("moment_y", rotor.moment.y);
    mirror.add("moment_z", rotor.moment.z);
  }
};

struct GovernorMirror {
  Governor governor;
  Mirror mirror;

  explicit GovernorMirror(const Object& object) : mirror(object) {
    const Object spec = attribute(object.get(), "spec");
    governor.minimum_rpm = constant(spec, "minimum_rpm");
    governor.maximum_rpm = constant(spec, "maximum_rpm");
    governor.fine_deg = constant(spec, "fine_deg");
    governor.coarse_deg = constant(spec, "coarse_deg");
    governor.rate_deg_s = constant(spec, "rate_deg_s");
    governor.proportional = constant(spec, "proportional");
    governor.integral = constant(spec, "integral");
    mirror.add("integral_deg", governor.integral_deg);
  }
};

struct EngineMirror {
  PistonEngine engine;
  Mirror mirror;
  Attribute running, ignition;

  explicit EngineMirror(const Object& object)
      : mirror(object), running(object.get(), "running"), ignition(object.get(), "ignition") {
    const Object spec = attribute(object.get(), "spec");
    engine.rated_power_w = constant(spec, "rated_power_w");
    engine.rated_rpm = constant(spec, "rated_rpm");
    engine.fuel_kg_per_joule = constant(spec, "fuel_kg_per_joule");
    engine.closed_throttle = constant(spec, "closed_throttle");
    engine.open_throttle = constant(spec, "open_throttle");
    engine.friction = constant(spec, "friction");
    mirror.add("manifold_pa", engine.manifold_pa);
    mirror.add("egt_k", engine.egt_k);
    mirror.add("cht_k", engine.cht_k);
    mirror.add("oil_k", engine.oil_k);
    mirror.add("oil_pa", engine.oil_pa);
    mirror.add("fuel_flow", engine.fuel_flow);
    mirror.add("power", engine.power);
  }
  void read() {
    mirror.read();
    engine.running = PyObject_IsTrue(running.get().get()) == 1;
    engine.ignition = PyObject_IsTrue(ignition.get().get()) == 1;
  }
  void write() const {
    mirror.write();
    running.set(Object::borrowed(engine.running ? Py_True : Py_False));
  }
};

struct SurfaceMirror {
  SurfaceActuator actuator;
  Mirror mirror;
  Attribute stuck;

  explicit SurfaceMirror(const Object& object) : mirror(object), stuck(object.get(), "_stuck_deg") {
    const Object spec = attribute(object.get(), "spec");
    actuator.minimum_deg = constant(spec, "minimum_deg");
    actuator.maximum_deg = constant(spec, "maximum_deg");
    actuator.rate_deg_s = constant(spec, "rate_deg_s");
    actuator.up_sign = constant(spec, "up_sign");
    actuator.fully_up_deg = constant(spec, "fully_up_deg");
    actuator.fully_down_deg = constant(spec, "fully_down_deg");
    const Object kind = attribute(spec.get(), "kind");
    actuator.rudder = text(attribute(kind.get(), "value").get()) == "rudder";
    mirror.add("position_deg", actuator.position_deg);
    mirror.add("effective_deg", actuator.effective_deg);
  }
  void read() {
    mirror.read();
    const Object angle = stuck.get();
    actuator.stuck_deg.reset();
    if (angle.get() != Py_None) actuator.stuck_deg = number(angle.get());
  }
  void write() const {
    mirror.write();
    stuck.set(actuator.stuck_deg ? makeNumber(*actuator.stuck_deg) : Object::borrowed(Py_None));
  }
};

/// DrydenTurbulence, with Python's own generator: random.Random.gauss() on its random().
struct TurbulenceMirror {
  Dryden dryden;
  Object object;
  Attribute intensity, states, source;
  Object generator;
  Property random;
  std::optional<double> next;

  TurbulenceMirror() = default;
  explicit TurbulenceMirror(const Object& owner)
      : object(owner),
        intensity(owner.get(), "intensity_mps"),
        states(owner.get(), "_state"),
        source(owner.get(), "_random"),
        generator(source.get()),
        random(attribute(generator.get(), "random")),
        kept_(generator.get(), "gauss_next") {}

  void read() {
    dryden.intensity_mps = intensity.getNumber();
    if (!(dryden.intensity_mps > 0.0)) return;
    readNumbers(states.get().get(), dryden.state.data(), dryden.state.size());
    const Object kept = kept_.get();
    next.reset();
    if (kept.get() != Py_None) next = number(kept.get());
  }
  void write() const {
    if (!(dryden.intensity_mps > 0.0)) return;
    writeNumbers(states.get().get(), dryden.state.data(), dryden.state.size());
    kept_.set(next ? makeNumber(*next) : Object::borrowed(Py_None));
  }
  double gauss() {
    double z = 0.0;
    if (next) {
      z = *next;
      next.reset();
    } else {
      const double angle = random.get() * (2.0 * kPi);
      const double radius = std::sqrt(-2.0 * std::log(1.0 - random.get()));
      z = std::cos(angle) * radius;
      next = std::sin(angle) * radius;
    }
    return 0.0 + z * 1.0;
  }

 private:
  Attribute kept_;
};

}  // namespace xplane_bridge::bindings
