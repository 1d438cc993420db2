#pragma once

/// What a frame of the light twin is but for the flight model's steps: legs and brakes, the mixing of its surfaces,
/// gravity and loading before and after them, and its own part of the state.

#include <memory>
#include <vector>

#include "xplane_bridge/bindings/python_attribute.hpp"
#include "xplane_bridge/bindings/python_object.hpp"
#include "xplane_bridge/bindings/python_property.hpp"
#include "xplane_bridge/bindings/twin_physics.hpp"

namespace xplane_bridge::bindings {

/// Levers of an engine, and what it suffers from.
struct Throttle {
  double lever, propeller, mixture;
  int fault;  ///< as flight_model.EngineFault: 0 none, 1 stopped, 2 seized
};

/// Operation by operation as the emulator's Python does it (contacts.LandingGear.move, jsbsim_state.missing_gravity,
/// FixedWing._mix and _fill_parts, JsbsimModel._apply_loading). It keeps the parts of a FixedWing, not the model
/// itself, which has the loop that has this.
class TwinFrame {
 public:
  explicit TwinFrame(PyObject* model);
  ~TwinFrame();
  TwinFrame(const TwinFrame&) = delete;
  TwinFrame& operator=(const TwinFrame&) = delete;

  /// Legs, brakes and steering for `dt` [s], and the force that JSBSim's gravity lacks.
  void begin(PyObject* model, double dt, PyObject* controls) const;
  /// Where the surfaces are to go; the sticks that reach them are kept in the model.
  std::vector<SurfaceOrder> orders(PyObject* model, PyObject* controls) const;
  std::vector<Throttle> throttles(PyObject* controls) const;
  /// Gives JSBSim fuel and payload.
  void load(PyObject* model) const;
  /// Surfaces, tanks, wheels, engines, ratios and the stall warning.
  void fill(PyObject* model, PyObject* state, PyObject* controls) const;

 private:
  struct Parts;
  std::unique_ptr<const Parts> parts_;
};

}  // namespace xplane_bridge::bindings
