#pragma once

/// The light twin's surfaces, engines, propellers and gusts, operation by operation as the emulator's Python does them
/// (src/xplane_bridge/emulator/flight: actuators.py, rotors.py, turbulence.py): the same bits come out of both.
///
/// So nothing here may be reordered or simplified, and the files are compiled without contraction and without the
/// compiler's own versions of the mathematical functions. SI units but for `_deg`; axes FRD.

#include <array>
#include <cmath>
#include <optional>

namespace xplane_bridge::bindings {

/// Python's max() and min(): the first of two equals.
inline double pythonMax(double a, double b) { return b > a ? b : a; }
inline double pythonMin(double a, double b) { return b < a ? b : a; }
inline double clip(double value, double low, double high) { return pythonMin(pythonMax(value, low), high); }

/// As Python's math module has them.
inline constexpr double kPi = 3.14159265358979323846;
inline double degrees(double radians) { return radians * (180.0 / kPi); }
inline double radians(double degrees) { return degrees * (kPi / 180.0); }

struct Vector {
  double x = 0.0, y = 0.0, z = 0.0;
};

/// What the air is doing to the aircraft now.
struct Air {
  Vector velocity;  ///< of the aircraft through the air [m/s]
  Vector rates;     ///< p, q, r [rad/s]
  double density = 0.0, pressure = 0.0, temperature = 0.0;
};

/// rotors.Rotor and its RotorSpec.
struct Rotor {
  // specification
  int direction = 1;
  double radius_m = 0.0, blade_area_m2 = 0.0, inertia_kg_m2 = 0.0, lift_slope = 0.0, max_lift = 0.0, profile_drag = 0.0,
         zero_lift_deg = 0.0, edgewise_drag = 0.0;
  // state
  double omega = 0.0, blade_rad = 0.0, inflow = 0.0, thrust = 0.0, torque = 0.0, shaft_torque = 0.0, axis_x = 1.0,
         axis_z = 0.0, x = 0.0, y = 0.0, z = 0.0;
  Vector force, moment;

  void airLoads(double dt, const Air& air);
  void turn(double dt, double torque_on_shaft, const Vector& rates);
};

/// rotors.Governor.
struct Governor {
  double minimum_rpm = 0.0, maximum_rpm = 0.0, fine_deg = 0.0, coarse_deg = 0.0, rate_deg_s = 0.0, proportional = 0.0,
         integral = 0.0;
  double integral_deg = 0.0;

  void step(double dt, Rotor& rotor, double lever);
};

/// rotors.PistonEngine.
struct PistonEngine {
  double rated_power_w = 0.0, rated_rpm = 0.0, fuel_kg_per_joule = 0.0, closed_throttle = 0.0, open_throttle = 0.0,
         friction = 0.0;
  bool ignition = false, running = false;
  double manifold_pa = 0.0, egt_k = 0.0, cht_k = 0.0, oil_k = 0.0, oil_pa = 0.0, fuel_flow = 0.0, power = 0.0;

  double torque(double dt, double omega, double throttle, double mixture, const Air& air, bool fuel);
};

/// In the order of flight_model.SurfaceFaultKind; kHealthy for none.
enum class SurfaceFault { kHealthy = -1, kStuck, kCentred, kFullUp, kFullDown, kGone, kFloating, kReduced, kSlow };

/// What a surface is to do in this frame.
struct SurfaceOrder {
  SurfaceFault fault = SurfaceFault::kHealthy;
  std::optional<double> value;       ///< of the fault
  std::optional<double> target_deg;  ///< none: where it is
  bool overridden = false;           ///< the target was written by a client and acts at once
};

/// actuators.SurfaceActuator.
struct SurfaceActuator {
  double minimum_deg = 0.0, maximum_deg = 0.0, rate_deg_s = 0.0;
  double up_sign = 0.0, fully_up_deg = 0.0, fully_down_deg = 0.0;
  bool rudder = false;
  double position_deg = 0.0, effective_deg = 0.0;
  std::optional<double> stuck_deg;

  void step(const SurfaceOrder& order, double dt, double alpha_deg);

 private:
  void stepBroken(const SurfaceOrder& order, double target_deg, double dt, double alpha_deg);
  void approach(double target_deg, double reach_deg);
};

/// turbulence.DrydenTurbulence; `gauss()` gives the next number of its generator.
struct Dryden {
  double intensity_mps = 0.0;
  std::array<double, 5> state{};

  struct Gusts {
    double along, across, down;
  };
  template <typename Gauss>
  Gusts step(double dt, double speed_mps, double agl_m, Gauss&& gauss) {
    const double speed = pythonMax(speed_mps, 5.0);
    const double height_ft = clip(agl_m / 0.3048, 10.0, 1000.0);
    const double shape = 0.177 + 0.000823 * height_ft;
    const double scale_w = height_ft * 0.3048;
    const double scale_u = scale_w / std::pow(shape, 1.2);
    const double sigma_w = intensity_mps;
    const double sigma_u = sigma_w / std::pow(shape, 0.4);
    double decay = std::exp(-speed * dt / scale_u);
    state[0] = decay * state[0] + sigma_u * std::sqrt(1.0 - decay * decay) * gauss();
    double root = std::sqrt(1.0 - decay * decay);
    state[1] = decay * state[1] + root * gauss();
    state[2] = decay * state[2] + (1.0 - decay) * state[1];
    const double across = sigma_u * (1.7320508 * state[1] - 0.7320508 * state[2]) / 1.4142136;
    decay = std::exp(-speed * dt / scale_w);
    root = std::sqrt(1.0 - decay * decay);
    state[3] = decay * state[3] + root * gauss();
    state[4] = decay * state[4] + (1.0 - decay) * state[3];
    const double down = sigma_w * (1.7320508 * state[3] - 0.7320508 * state[4]) / 1.4142136;
    return {state[0], across, down};
  }
};

}  // namespace xplane_bridge::bindings
