#include "xplane_bridge/core/state/air_data.hpp"

#include <cmath>
#include <limits>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

constexpr double kTroposphereLapse = 0.0065;  // [K/m]
constexpr double kTropopause = 11000.0;       // [m]
constexpr double kTropopauseTemperature = kSeaLevelTemperature - kTroposphereLapse * kTropopause;

}  // namespace

double pressureAltitude(double static_pressure) {
  if (!(static_pressure > 0.0)) return std::numeric_limits<double>::quiet_NaN();
  const double exponent = kStandardGravity / (kAirGasConstant * kTroposphereLapse);
  const double tropopause_pressure =
      kSeaLevelPressure * std::pow(kTropopauseTemperature / kSeaLevelTemperature, exponent);
  if (static_pressure >= tropopause_pressure) {
    return kSeaLevelTemperature / kTroposphereLapse *
           (1.0 - std::pow(static_pressure / kSeaLevelPressure, 1.0 / exponent));
  }
  return kTropopause +
         kAirGasConstant * kTropopauseTemperature / kStandardGravity * std::log(tropopause_pressure / static_pressure);
}

double equivalentAirspeed(double true_airspeed, double air_density) {
  return true_airspeed * std::sqrt(air_density / kSeaLevelDensity);
}

double impactPressure(double dynamic_pressure, double mach) {
  // qc = p ((1 + M^2/5)^3.5 - 1) with p = q / (0.7 M^2); towards M = 0 the series avoids 0/0.
  const double m2 = mach * mach;
  if (m2 < 1e-3) return dynamic_pressure * (1.0 + m2 / 4.0 + m2 * m2 / 40.0);
  return dynamic_pressure * (std::pow(1.0 + 0.2 * m2, 3.5) - 1.0) / (0.5 * kHeatCapacityRatio * m2);
}

double calibratedAirspeed(double impact_pressure) {
  const double speed =
      kSeaLevelSoundSpeed *
      std::sqrt(5.0 * (std::pow(std::abs(impact_pressure) / kSeaLevelPressure + 1.0, 2.0 / 7.0) - 1.0));
  return std::copysign(speed, impact_pressure);
}

}  // namespace xplane_bridge::core
