#include "xplane_bridge/bindings/twin_frame.hpp"

#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "xplane_bridge/bindings/names.hpp"

namespace xplane_bridge::bindings {
namespace {

constexpr double kStallSpeed = 15.0;  // [m/s] below which nothing warns

Object item(PyObject* sequence, std::size_t index) {
  return Object(PySequence_GetItem(sequence, static_cast<Py_ssize_t>(index)));
}

/// actuators.asymmetric.
double asymmetric(double command, double up_deg, double down_deg) {
  return command * (command > 0.0 ? down_deg : up_deg);
}

/// What a dictionary has under a name.
std::optional<Object> found(PyObject* dictionary, PyObject* name) {
  PyObject* const value = PyDict_GetItemWithError(dictionary, name);
  if (value) return Object::borrowed(value);
  if (PyErr_Occurred()) throw PythonError{};
  return std::nullopt;
}

/// Members of an enumeration, in their order.
std::vector<Object> members(const Object& enumeration) {
  const Object list(PySequence_List(enumeration.get()));
  return items(list.get());
}

int placeOf(const std::vector<Object>& members, PyObject* member) {
  for (std::size_t i = 0; i < members.size(); ++i) {
    if (members[i].get() == member) return static_cast<int>(i);
  }
  throw std::invalid_argument("expected a member of EngineFault, or of SurfaceFaultKind, as a fault");
}

struct Wheel {
  Property wow, compression, rate;
  double spring, damping, max_steer_deg;
};

/// Where a value of an EngineState is copied from.
struct Copied {
  Name to;
  Attribute from;
};

struct EngineParts {
  Object engine, rotor;
  Attribute running, omega, blade_rad;
  std::vector<Copied> copied;
};

/// What is looked up in the model, the controls and the state each time.
struct FrameNames {
  Name state{"state"}, fuel{"_fuel_kg"}, payload{"_payload_kg"}, payload_aft{"_payload_aft_m"},
      gravity{"_gravity_force"}, commands{"_commands"};
  Name roll{"roll"}, pitch{"pitch"}, yaw{"yaw"}, trim_roll{"trim_roll"}, trim_pitch{"trim_pitch"}, trim_yaw{"trim_yaw"},
      flap_request{"flap_request"}, speedbrake{"speedbrake"}, gear_down{"gear_down"}, brake_left{"brake_left"},
      brake_right{"brake_right"}, parking_brake{"parking_brake"}, throttle{"throttle"}, throttle_use{"throttle_use"},
      propeller{"propeller"}, mixture{"mixture"}, engine_faults{"engine_faults"}, surface_faults{"surface_faults"},
      surface_deg{"surface_deg"}, kind{"kind"}, value{"value"}, override_surfaces{"override_surfaces"},
      override_throttles{"override_throttles"}, gear_fault{"gear_fault"};
  Name v_north{"v_north_mps"}, v_east{"v_east_mps"}, alpha{"alpha_rad"}, airspeed{"true_airspeed_mps"},
      surfaces{"surfaces_deg"}, fuel_kg{"fuel_kg"}, gear{"gear"}, engines{"engines"}, on_ground_any{"on_ground_any"},
      on_ground_all{"on_ground_all"}, roll_ratio{"roll_ratio"}, pitch_ratio{"pitch_ratio"}, yaw_ratio{"yaw_ratio"},
      flap_ratio{"flap_ratio"}, speed_brake_ratio{"speed_brake_ratio"}, thrust_vector_ratio{"thrust_vector_ratio"},
      stall_warning{"stall_warning"};
  Name extended{"extended"}, on_ground{"on_ground"}, compression{"compression_m"}, force{"vertical_force_n"},
      steer{"steer_deg"};
  Name running{"running"}, throttle_now{"throttle"}, rpm{"rpm"}, prop_rpm{"prop_rpm"}, blade_pitch{"blade_pitch_deg"};
};

}  // namespace

struct TwinFrame::Parts {
  explicit Parts(PyObject* model) : gear(attribute(model, "_gear")), gear_position(gear.get(), "position") {
    gear_steering = Attribute(gear.get(), "steering");
    gear_travel_s = constant(gear, "_travel_s");
    set_extension = property(gear.get(), "_set_extension");
    set_steering = property(gear.get(), "_set_steering");
    set_brakes = properties(gear.get(), "_set_brakes");
    if (set_brakes.size() != 2) throw std::invalid_argument("_set_brakes: expected 2 of them");
    height = property(model, "_height");
    mass = property(model, "_mass");
    roll = property(model, "_roll");
    pitch = property(model, "_pitch");
    set_masses = properties(model, "_mass_setters");
    set_payload_aft = property(model, "_payload_aft_setter");
    hypot = property(Object(PyImport_ImportModule("math")).get(), "hypot");

    const Object contacts = attribute(model, "_contacts");
    for (const Object& contact : items(attribute(contacts.get(), "_gear").get())) {
      wheels.push_back({property(contact.get(), "wow"), property(contact.get(), "compression"),
                        property(contact.get(), "compression_rate"), constant(contact, "spring"),
                        constant(contact, "damping"), constant(contact, "max_steer_deg")});
    }
    const Object surface_set = attribute(model, "_surface_set");
    for (const Object& actuator : items(attribute(surface_set.get(), "actuators").get())) {
      surfaces.push_back(actuator);
      surface_positions.emplace_back(actuator.get(), "position_deg");
      surface_names.push_back(attribute(attribute(actuator.get(), "spec").get(), "name"));
    }
    if (surfaces.size() != kSurfaces) throw std::invalid_argument("_surface_set: expected 9 surfaces");
    const std::vector<Object> python_engines = items(attribute(model, "_engines").get());
    const std::vector<Object> rotors = items(attribute(model, "_rotors").get());
    for (std::size_t i = 0; i < python_engines.size(); ++i) addEngine(python_engines[i], rotors.at(i));

    // Not worked out anew: Python's ** rounds otherwise than a product.
    const Object units(PyImport_ImportModule("xplane_bridge.emulator.flight.jsbsim_state"));
    foot = constant(units, "FOOT_M");
    slug = constant(units, "SLUG_KG");
    pound = constant(units, "POUND_KG");
    inch = constant(units, "INCH_M");
    earth_radius = constant(units, "EARTH_RADIUS_M");
    earth_gravity = constant(units, "GRAVITY_MPS2");
    const Object twin(PyImport_ImportModule("xplane_bridge.emulator.aircraft.fixed_wing.fixed_wing"));
    aileron_up = constant(twin, "AILERON_UP_DEG");
    aileron_down = constant(twin, "AILERON_DOWN_DEG");
    elevator_up = constant(twin, "ELEVATOR_UP_DEG");
    elevator_down = constant(twin, "ELEVATOR_DOWN_DEG");
    rudder_deg = constant(twin, "RUDDER_DEG");
    flap_deg = constant(twin, "FLAP_DEG");
    speed_brake_deg = constant(twin, "SPEED_BRAKE_DEG");
    aileron_trim = constant(twin, "AILERON_TRIM_DEG");
    elevator_trim = constant(twin, "ELEVATOR_TRIM_DEG");
    rudder_trim = constant(twin, "RUDDER_TRIM_DEG");
    stall_warning_rad = constant(twin, "STALL_WARNING_RAD");
    const Object kinds(PyImport_ImportModule("xplane_bridge.emulator.flight.flight_model"));
    engine_faults = members(attribute(kinds.get(), "EngineFault"));
    surface_faults = members(attribute(kinds.get(), "SurfaceFaultKind"));
  }

  void addEngine(const Object& engine, const Object& rotor) {
    EngineParts parts{engine,
                      rotor,
                      Attribute(engine.get(), "running"),
                      Attribute(rotor.get(), "omega"),
                      Attribute(rotor.get(), "blade_rad"),
                      {}};
    const auto copy = [&parts](const char* to, const Object& from, const char* name) {
      parts.copied.push_back({Name(to), Attribute(from.get(), name)});
    };
    copy("power_w", engine, "power");
    copy("torque_nm", rotor, "shaft_torque");
    copy("thrust_n", rotor, "thrust");
    copy("fuel_flow_kg_s", engine, "fuel_flow");
    copy("manifold_pressure_pa", engine, "manifold_pa");
    copy("exhaust_gas_temperature_k", engine, "egt_k");
    copy("cylinder_head_temperature_k", engine, "cht_k");
    copy("oil_temperature_k", engine, "oil_k");
    copy("oil_pressure_pa", engine, "oil_pa");
    engines.push_back(std::move(parts));
  }

  static constexpr std::size_t kSurfaces = 9;  // of FixedWing._mix
  enum Surface : std::size_t { kLeftFlap = 5, kRightFlap, kLeftBrake, kRightBrake };

  FrameNames names;
  Object gear;
  Attribute gear_position, gear_steering;
  double gear_travel_s = 0.0;
  Property set_extension, set_steering, height, mass, roll, pitch, set_payload_aft, hypot;
  std::vector<Property> set_brakes, set_masses;
  std::vector<Wheel> wheels;
  std::vector<Object> surfaces, surface_names, engine_faults, surface_faults;
  std::vector<Attribute> surface_positions;
  std::vector<EngineParts> engines;
  double foot = 0.0, slug = 0.0, pound = 0.0, inch = 0.0, earth_radius = 0.0, earth_gravity = 0.0, aileron_up = 0.0,
         aileron_down = 0.0, elevator_up = 0.0, elevator_down = 0.0, rudder_deg = 0.0, flap_deg = 0.0,
         speed_brake_deg = 0.0, aileron_trim = 0.0, elevator_trim = 0.0, rudder_trim = 0.0, stall_warning_rad = 0.0;
};

TwinFrame::TwinFrame(PyObject* model) : parts_(std::make_unique<Parts>(model)) {}

TwinFrame::~TwinFrame() = default;

void TwinFrame::begin(PyObject* model, double dt, PyObject* controls) const {
  const Parts& p = *parts_;
  const FrameNames& names = p.names;
  if (p.gear_travel_s > 0.0 && !names.gear_fault.trueFor(controls)) {
    const double wanted = names.gear_down.trueFor(controls) ? 1.0 : 0.0, reach = dt / p.gear_travel_s;
    const double position = p.gear_position.getNumber();
    p.gear_position.set(makeNumber(position + pythonMin(pythonMax(wanted - position, -reach), reach)));
  }
  const double parking = names.parking_brake.numberOf(controls);
  const std::array<double, 2> brakes{names.brake_left.numberOf(controls), names.brake_right.numberOf(controls)};
  for (std::size_t i = 0; i < brakes.size(); ++i) {
    p.set_brakes[i].set(pythonMin(pythonMax(pythonMax(brakes[i], parking), 0.0), 1.0));
  }
  const Object state = names.state.of(model);
  // Python's own: no other hypot() rounds as it does.
  const Object north = names.v_north.of(state.get()), east = names.v_east.of(state.get());
  const double ground_speed = number(p.hypot.call(north.get(), east.get()).get());
  const double steering = clip(names.yaw.numberOf(controls), -1.0, 1.0) / (1.0 + std::pow(ground_speed / 12.0, 2.0));
  p.gear_steering.set(makeNumber(steering));
  p.set_steering.set(steering);

  const double height = p.height.get() * p.foot, mass = p.mass.get();
  const double roll = p.roll.get(), pitch = p.pitch.get();
  const double missing = p.earth_gravity * (1.0 - std::pow(p.earth_radius / (p.earth_radius + height), 2.0));
  const double force = missing * mass * p.slug;
  const double cosine = std::cos(pitch);
  const Object gravity(Py_BuildValue("(ddd)", -force * std::sin(pitch), force * std::sin(roll) * cosine,
                                     force * std::cos(roll) * cosine));
  names.gravity.set(model, gravity.get());
}

std::vector<SurfaceOrder> TwinFrame::orders(PyObject* model, PyObject* controls) const {
  const Parts& p = *parts_;
  const FrameNames& names = p.names;
  const double roll = clip(names.roll.numberOf(controls), -1.0, 1.0);
  const double pitch = clip(names.pitch.numberOf(controls), -1.0, 1.0);
  const double yaw = clip(names.yaw.numberOf(controls), -1.0, 1.0);
  const Object commands(Py_BuildValue("(ddd)", roll, pitch, yaw));
  names.commands.set(model, commands.get());
  const double aileron_trim = p.aileron_trim * names.trim_roll.numberOf(controls);
  const double elevator_trim = p.elevator_trim * names.trim_pitch.numberOf(controls);
  const double rudder_trim = p.rudder_trim * names.trim_yaw.numberOf(controls);
  const double elevator = asymmetric(-pitch, p.elevator_up, p.elevator_down) - elevator_trim;
  const double flap = p.flap_deg * names.flap_request.numberOf(controls);
  const double brake = p.speed_brake_deg * names.speedbrake.numberOf(controls);
  const std::array<double, Parts::kSurfaces> targets{asymmetric(roll, p.aileron_up, p.aileron_down) + aileron_trim,
                                                     asymmetric(-roll, p.aileron_up, p.aileron_down) - aileron_trim,
                                                     elevator,
                                                     elevator,
                                                     p.rudder_deg * yaw + rudder_trim,
                                                     flap,
                                                     flap,
                                                     brake,
                                                     brake};
  std::vector<SurfaceOrder> orders(targets.size());
  for (std::size_t i = 0; i < targets.size(); ++i) orders[i].target_deg = targets[i];
  const Object faults = names.surface_faults.of(controls);
  const bool overridden = names.override_surfaces.trueFor(controls);
  if (overridden) {
    const Object written = names.surface_deg.of(controls);
    for (std::size_t i = 0; i < orders.size(); ++i) {
      orders[i].overridden = true;
      orders[i].target_deg.reset();
      if (const auto angle = found(written.get(), p.surface_names[i].get()))
        orders[i].target_deg = number(angle->get());
    }
  }
  if (PyObject_Size(faults.get()) == 0) return orders;
  for (std::size_t i = 0; i < orders.size(); ++i) {
    const auto fault = found(faults.get(), p.surface_names[i].get());
    if (!fault) continue;
    orders[i].fault = static_cast<SurfaceFault>(placeOf(p.surface_faults, names.kind.of(fault->get()).get()));
    const Object value = names.value.of(fault->get());
    if (value.get() != Py_None) orders[i].value = number(value.get());
  }
  return orders;
}

std::vector<Throttle> TwinFrame::throttles(PyObject* controls) const {
  const Parts& p = *parts_;
  const FrameNames& names = p.names;
  const bool overridden = names.override_throttles.trueFor(controls);
  const Object levers = (overridden ? names.throttle_use : names.throttle).of(controls);
  const Object propellers = names.propeller.of(controls), mixtures = names.mixture.of(controls);
  const Object faults = names.engine_faults.of(controls);
  std::vector<Throttle> out;
  for (std::size_t i = 0; i < p.engines.size(); ++i) {
    out.push_back({number(item(levers.get(), i).get()), number(item(propellers.get(), i).get()),
                   number(item(mixtures.get(), i).get()), placeOf(p.engine_faults, item(faults.get(), i).get())});
  }
  return out;
}

void TwinFrame::load(PyObject* model) const {
  const Parts& p = *parts_;
  const std::vector<Object> fuel = items(p.names.fuel.of(model).get());
  if (fuel.size() + 1 != p.set_masses.size()) throw std::invalid_argument("_fuel_kg: expected one for each tank");
  for (std::size_t i = 0; i < fuel.size(); ++i) p.set_masses[i].set(number(fuel[i].get()) / p.pound);
  p.set_masses.back().set(p.names.payload.numberOf(model) / p.pound);
  p.set_payload_aft.set(p.names.payload_aft.numberOf(model) / p.inch);
}

void TwinFrame::fill(PyObject* model, PyObject* state, PyObject* controls) const {
  const Parts& p = *parts_;
  const FrameNames& names = p.names;
  const Object surfaces = names.surfaces.of(state);
  std::array<double, Parts::kSurfaces> angles{};
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const Object angle = p.surface_positions[i].get();
    check(PyObject_SetItem(surfaces.get(), p.surface_names[i].get(), angle.get()));
    angles[i] = number(angle.get());
  }
  const Object fuel(PySequence_List(names.fuel.of(model).get()));
  names.fuel_kg.set(state, fuel.get());

  const Object extended = p.gear_position.get();
  const double steering = p.gear_steering.getNumber();
  const std::vector<Object> legs = items(names.gear.of(state).get());
  std::size_t standing = 0;
  for (std::size_t i = 0; i < p.wheels.size(); ++i) {
    const Wheel& wheel = p.wheels[i];
    PyObject* const leg = legs.at(i).get();
    const bool on_ground = wheel.wow.get() > 0.5;
    const double compression = on_ground ? wheel.compression.get() * p.foot : 0.0;
    const double rate = wheel.rate.get() * p.foot;
    names.extended.set(leg, extended.get());
    names.on_ground.set(leg, on_ground);
    names.compression.set(leg, compression);
    names.force.set(leg, on_ground ? pythonMax(wheel.spring * compression + wheel.damping * rate, 0.0) : 0.0);
    names.steer.set(leg, wheel.max_steer_deg * steering);
    standing += on_ground ? 1 : 0;
  }
  names.on_ground_any.set(state, standing > 0);
  names.on_ground_all.set(state, standing == p.wheels.size());

  const Object commands = names.commands.of(model);
  names.roll_ratio.set(state, item(commands.get(), 0).get());
  names.pitch_ratio.set(state, item(commands.get(), 1).get());
  names.yaw_ratio.set(state, item(commands.get(), 2).get());
  names.flap_ratio.set(state, 0.5 * (angles[Parts::kLeftFlap] + angles[Parts::kRightFlap]) / p.flap_deg);
  names.speed_brake_ratio.set(state,
                              0.5 * (angles[Parts::kLeftBrake] + angles[Parts::kRightBrake]) / p.speed_brake_deg);
  names.thrust_vector_ratio.set(state, 0.0);
  names.stall_warning.set(
      state, names.alpha.numberOf(state) > p.stall_warning_rad && names.airspeed.numberOf(state) > kStallSpeed);

  const Object levers = (names.override_throttles.trueFor(controls) ? names.throttle_use : names.throttle).of(controls);
  const std::vector<Object> shown = items(names.engines.of(state).get());
  for (std::size_t i = 0; i < p.engines.size(); ++i) {
    const EngineParts& engine = p.engines[i];
    PyObject* const out = shown.at(i).get();
    names.running.set(out, engine.running.get().get());
    names.throttle_now.set(out, item(levers.get(), i).get());
    const Object rpm = makeNumber(engine.omega.getNumber() * 30.0 / kPi);
    names.rpm.set(out, rpm.get());
    names.prop_rpm.set(out, rpm.get());
    for (const Copied& value : engine.copied) value.to.set(out, value.from.get().get());
    names.blade_pitch.set(out, degrees(engine.blade_rad.getNumber()));
  }
}

}  // namespace xplane_bridge::bindings
