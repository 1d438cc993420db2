#include "xplane_bridge/core/simulator/wind_fields.hpp"

#include <algorithm>
#include <cmath>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

constexpr double kLowest = 3.0 * kMetersPerFoot;      // [m] of the logarithmic profile
constexpr double kHighest = 1000.0 * kMetersPerFoot;  // [m]
// Of TM-100632: the height of the strongest outflow in the lengths by which it fades upwards and towards the ground.
constexpr double kHeightAloft = 0.22;
constexpr double kHeightAtGround = 2.75;
constexpr double kOutflowShare = 0.2357;  // strongest outflow over lambda R

}  // namespace

double oneMinusCosine(double at, double length) {
  if (!(at > 0.0) || at >= length) return 0.0;
  return 0.5 * (1.0 - std::cos(2.0 * kPi * at / length));
}

double logarithmicShear(double speed, double roughness, double height) {
  const double lowest = std::max(kLowest, roughness);  // below it, the logarithm blows the other way
  return speed * std::log(std::clamp(height, lowest, kHighest) / roughness) / std::log(kWindHeight / roughness);
}

double linearShear(double speed, double gradient, double height) { return speed + gradient * (height - kWindHeight); }

Eigen::Vector3d microburstWind(const Microburst& microburst, double north, double east, double height) {
  const double radius = microburst.radius;
  const double aloft = microburst.height / kHeightAloft;         // z*
  const double at_ground = microburst.height / kHeightAtGround;  // epsilon
  const double lambda = microburst.outflow / (kOutflowShare * radius);
  const double z = std::max(0.0, height);
  const double squared = (north * north + east * east) / (radius * radius);
  const double fades = std::exp(-squared);
  // (1 - exp(-x)) / x, which is 1 in the centre.
  const double spread = squared < 1e-9 ? 1.0 : -std::expm1(-squared) / squared;
  const double outflow = 0.5 * lambda * spread * (std::exp(-z / aloft) - std::exp(-z / at_ground));  // [1/s] per metre
  const double down = lambda * fades * (at_ground * std::expm1(-z / at_ground) - aloft * std::expm1(-z / aloft));
  return {outflow * north, outflow * east, down};
}

}  // namespace xplane_bridge::core
