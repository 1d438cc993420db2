#include "xplane_bridge/core/simulator/dryden_turbulence.hpp"

#include <algorithm>
#include <cmath>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

constexpr double kLow = 10.0, kTop = 1000.0, kHigh = 2000.0;  // [ft]
constexpr double kHighLength = 1750.0;                        // [ft]
constexpr double kUnit = 4294967296.0;                        // 2^32
const double kRoot3 = std::sqrt(3.0);

/// One step of the pair x1 = n / (1 + tau s), x2 = x1 / (1 + tau s) with x1 of variance 1; x2 then has 1/2, and so has
/// their covariance. (1 + sqrt(3) tau s) / (1 + tau s)^2 of the specification is sqrt(3) x1 + (1 - sqrt(3)) x2, of
/// variance 2.
double stepTransverse(double share, const std::array<double, 2>& normal, Eigen::Vector2d* state) {
  const double a = std::exp(-share);
  // Covariance that the step adds: what is stationary less what is left of it.
  const double q11 = -std::expm1(-2.0 * share);
  const double q12 = 0.5 - a * a * (share + 0.5);
  const double q22 = 0.5 - a * a * (share * share + share + 0.5);
  const double l11 = std::sqrt(q11);
  const double l21 = l11 > 0.0 ? q12 / l11 : 0.0;
  const double l22 = std::sqrt(std::max(0.0, q22 - l21 * l21));
  const double first = a * state->x() + l11 * normal[0];
  state->y() = a * (share * state->x() + state->y()) + l21 * normal[0] + l22 * normal[1];
  state->x() = first;
  return (kRoot3 * state->x() + (1.0 - kRoot3) * state->y()) / std::sqrt(2.0);
}

}  // namespace

DrydenScales drydenScales(double height, double wind) {
  const double feet = std::max(height / kMetersPerFoot, kLow);
  const double low = std::min(feet, kTop);
  const double base = 0.177 + 0.000823 * low;
  const double above = kMetersPerFoot * (kHighLength - kTop) * std::clamp((feet - kTop) / (kHigh - kTop), 0.0, 1.0);
  const double level = kMetersPerFoot * low / std::pow(base, 1.2) + above;
  const double vertical = 0.1 * wind;
  const double horizontal = vertical / std::pow(base, 0.4);
  return {{level, level, kMetersPerFoot * low + above}, {horizontal, horizontal, vertical}};
}

/// Box and Muller's: the standard library's distributions differ between vendors.
double DrydenTurbulence::normal() {
  const double radius = std::sqrt(-2.0 * std::log((static_cast<double>(random_()) + 1.0) / kUnit));
  return radius * std::cos(2.0 * kPi * static_cast<double>(random_()) / kUnit);
}

Eigen::Vector3d DrydenTurbulence::step(double distance, const DrydenScales& scales) {
  const Eigen::Array3d share = std::max(0.0, distance) / scales.length;
  along_ = std::exp(-share[0]) * along_ + std::sqrt(-std::expm1(-2.0 * share[0])) * normal();
  Eigen::Vector3d out(along_, 0.0, 0.0);
  for (std::size_t i = 0; i < across_down_.size(); ++i) {
    const auto axis = static_cast<Eigen::Index>(i) + 1;
    const double first = normal(), second = normal();
    out[axis] = stepTransverse(share[axis], {first, second}, &across_down_[i]);
  }
  return out.cwiseProduct(scales.sigma.matrix());
}

}  // namespace xplane_bridge::core
