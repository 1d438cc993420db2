#include "xplane_bridge/bindings/twin_physics.hpp"

namespace xplane_bridge::bindings {
namespace {

constexpr double kSectionArea = (1.0 / 3.0) / (0.75 * 0.75);
constexpr double kInflowLag = 0.04;  // [s]
constexpr double kFloatPerAlpha = 0.5;
constexpr double kFloatRate = 90.0;  // [deg/s]
constexpr double kStandardPa = 101325.0;
constexpr double kFiresAbove = 0.1;  // of the rated speed

double lagged(double value, double target, double dt, double time_constant) {
  return value + (target - value) * pythonMin(dt / time_constant, 1.0);
}

}  // namespace

void Rotor::airLoads(double dt, const Air& air) {
  const double ax = axis_x, az = axis_z, density = air.density;
  const double p = air.rates.x, q = air.rates.y, r = air.rates.z;
  const double u = air.velocity.x + q * z - r * y;
  const double v = air.velocity.y + r * x - p * z;
  const double w = air.velocity.z + p * y - q * x;
  const double axial = u * ax + w * az;
  const double plane_x = u - axial * ax, plane_z = w - axial * az;
  const double plane_square = plane_x * plane_x + v * v + plane_z * plane_z;
  const double through = axial + inflow;
  const double section = 0.75 * radius_m * omega;
  const double phi = std::atan2(through, section + 1e-3);
  const double speed_square = section * section + through * through + 0.5 * plane_square;
  const double alpha = blade_rad - phi - radians(zero_lift_deg);
  const double sine = std::sin(alpha), cosine = std::cos(alpha);
  const double lift = max_lift * std::tanh(lift_slope * sine * cosine / max_lift);
  const double drag = profile_drag + 1.2 * std::pow(sine, 4.0) + 0.02 * lift * lift;
  const double section_force = 0.5 * density * speed_square * blade_area_m2 * kSectionArea;
  const double sin_phi = std::sin(phi), cos_phi = std::cos(phi);
  thrust = section_force * (lift * cos_phi - drag * sin_phi);
  torque = 0.75 * radius_m * section_force * (lift * sin_phi + drag * cos_phi);

  const double disc = kPi * radius_m * radius_m;
  const double hover_square = std::fabs(thrust) / (2.0 * density * disc);
  const double passing = std::sqrt(plane_square + through * through + 0.1 * hover_square + 0.01);
  const double induced = thrust / (2.0 * density * disc * passing);
  inflow += (induced - inflow) * pythonMin(dt / kInflowLag, 1.0);

  const double along = edgewise_drag * density * blade_area_m2 * radius_m * omega;
  const double fx = thrust * ax - along * plane_x, fy = -along * v, fz = thrust * az - along * plane_z;
  force = {fx, fy, fz};
  moment = {y * fz - z * fy, z * fx - x * fz, x * fy - y * fx};
}

void Rotor::turn(double dt, double torque_on_shaft, const Vector& rates) {
  shaft_torque = torque_on_shaft;
  omega = pythonMax(omega + (torque_on_shaft - torque) / inertia_kg_m2 * dt, 0.0);
  const double p = rates.x, q = rates.y, r = rates.z;
  const double reaction = static_cast<double>(-direction) * torque_on_shaft;
  const double spin = static_cast<double>(direction) * inertia_kg_m2 * omega;
  const double hx = spin * axis_x, hz = spin * axis_z;
  moment.x += reaction * axis_x - q * hz;
  moment.y += -(r * hx - p * hz);
  moment.z += reaction * axis_z + q * hx;
}

void Governor::step(double dt, Rotor& rotor, double lever) {
  const double wanted = minimum_rpm + (maximum_rpm - minimum_rpm) * clip(lever, 0.0, 1.0);
  const double error = rotor.omega - wanted * (kPi / 30.0);
  integral_deg = clip(integral_deg + integral * error * dt, fine_deg, coarse_deg);
  const double blade = degrees(rotor.blade_rad);
  const double target = clip(integral_deg + proportional * error, fine_deg, coarse_deg);
  const double reach = rate_deg_s * dt;
  rotor.blade_rad = radians(blade + clip(target - blade, -reach, reach));
}

double PistonEngine::torque(double dt, double omega, double throttle, double mixture, const Air& air, bool fuel) {
  const double opening = clip(throttle, 0.0, 1.0);
  const double rated_omega = rated_rpm * (kPi / 30.0);
  const double rated_torque = rated_power_w / rated_omega;
  const double speed = omega / rated_omega;
  if (!fuel || mixture < 0.05 || !ignition) {
    running = false;
  } else if (speed > kFiresAbove) {
    running = true;
  }
  const double ratio = closed_throttle + (open_throttle - closed_throttle) * opening;
  manifold_pa = air.pressure * (1.0 - (1.0 - ratio) * pythonMin(speed / 0.2, 1.0));
  const double rubbing = friction * (0.6 + 0.4 * speed);
  const double drag = -rubbing * rated_torque * pythonMin(omega / 2.0, 1.0);
  double indicated = 0.0;
  if (running) {
    const double charge = manifold_pa / kStandardPa * std::sqrt(288.15 / air.temperature);
    const double richness = 1.0 - 2.0 * std::pow(pythonMin(mixture, 1.0) - 0.8, 2.0);
    indicated = 1.235 * rated_torque * charge * pythonMax(richness, 0.0);
  }
  const double total = indicated + drag;
  power = total * omega;
  fuel_flow = running ? indicated * omega * fuel_kg_per_joule * (0.7 + 0.375 * pythonMin(mixture, 1.0)) : 0.0;
  const double load = pythonMax(power / rated_power_w, 0.0);
  const double hot = running ? 1.0 : 0.0;
  egt_k = lagged(egt_k, air.temperature + hot * (560.0 + 340.0 * load + 80.0 * (0.8 - mixture)), dt, 3.0);
  cht_k = lagged(cht_k, air.temperature + hot * (70.0 + 95.0 * load), dt, 90.0);
  oil_k = lagged(oil_k, air.temperature + hot * (45.0 + 35.0 * load), dt, 200.0);
  oil_pa = 414e3 * pythonMin(speed / 0.6, 1.0) * (1.0 + 0.002 * (358.0 - oil_k));
  return total;
}

void SurfaceActuator::step(const SurfaceOrder& order, double dt, double alpha_deg) {
  const double target = order.target_deg.value_or(position_deg);
  if (order.fault != SurfaceFault::kHealthy) {
    stepBroken(order, target, dt, alpha_deg);
    return;
  }
  if (order.overridden) {
    position_deg = target;
  } else {
    approach(clip(target, minimum_deg, maximum_deg), rate_deg_s * dt);
  }
  effective_deg = position_deg;
  stuck_deg.reset();
}

void SurfaceActuator::stepBroken(const SurfaceOrder& order, double target_deg, double dt, double alpha_deg) {
  if (order.fault != SurfaceFault::kStuck) stuck_deg.reset();
  switch (order.fault) {
    case SurfaceFault::kStuck:
      if (!stuck_deg || order.value) stuck_deg = order.value.value_or(position_deg);
      approach(*stuck_deg, rate_deg_s * dt);
      break;
    case SurfaceFault::kCentred:
      approach(0.0, rate_deg_s * dt);
      break;
    case SurfaceFault::kFullUp:
      approach(fully_up_deg, rate_deg_s * dt);
      break;
    case SurfaceFault::kFullDown:
      approach(fully_down_deg, rate_deg_s * dt);
      break;
    case SurfaceFault::kFloating: {
      const double trailing = rudder ? 0.0 : kFloatPerAlpha * up_sign * alpha_deg;
      approach(clip(trailing, minimum_deg, maximum_deg), kFloatRate * dt);
      break;
    }
    case SurfaceFault::kGone:
      position_deg = 0.0;
      break;
    case SurfaceFault::kHealthy:
    case SurfaceFault::kReduced:
    case SurfaceFault::kSlow:
      if (order.overridden) {
        position_deg = target_deg;
      } else {
        const double rate = rate_deg_s * (order.fault == SurfaceFault::kSlow ? order.value.value_or(1.0) : 1.0);
        approach(clip(target_deg, minimum_deg, maximum_deg), rate * dt);
      }
      break;
  }
  effective_deg = position_deg * (order.fault == SurfaceFault::kReduced ? order.value.value_or(1.0) : 1.0);
}

void SurfaceActuator::approach(double target_deg, double reach_deg) {
  position_deg += clip(target_deg - position_deg, -reach_deg, reach_deg);
}

}  // namespace xplane_bridge::bindings
