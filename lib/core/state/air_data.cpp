#include "xplane_bridge/core/state/air_data.hpp"

#include <cmath>
#include <limits>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

constexpr double kTroposphereLapse = 0.0065;  // [K/m]
constexpr double kTropopause = 11000.0;       // [m]
constexpr double kTropopauseTemperature = kSeaLevelTemperature - kTroposphereLapse * kTropopause;

/// Impact pressure over static pressure at a Mach number; above 1 behind the shock ahead of the tube (Rayleigh).
double impactRatio(double mach) {
  const double m2 = mach * mach;
  if (mach <= 1.0) return std::pow(1.0 + 0.2 * m2, 3.5) - 1.0;
  return std::pow(1.2 * m2, 3.5) * std::pow(6.0 / (7.0 * m2 - 1.0), 2.5) - 1.0;
}

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
  // The static pressure is q / (0.7 M^2); towards M = 0 the series avoids 0/0.
  const double m2 = mach * mach;
  if (m2 < 1e-3) return dynamic_pressure * (1.0 + m2 / 4.0 + m2 * m2 / 40.0);
  return dynamic_pressure * impactRatio(std::abs(mach)) / (0.5 * kHeatCapacityRatio * m2);
}

double calibratedAirspeed(double impact_pressure) {
  const double ratio = std::abs(impact_pressure) / kSeaLevelPressure;
  double mach = std::sqrt(5.0 * (std::pow(ratio + 1.0, 2.0 / 7.0) - 1.0));
  // The Rayleigh formula solved for the Mach number outside: each step divides the error by 2.4 or more. Of NaN
  // there is none.
  for (double last = 0.0; mach > 1.0 && std::abs(mach - last) > 1e-12;) {
    last = mach;
    mach =
        std::sqrt((ratio + 1.0) * std::pow(7.0 - 1.0 / (mach * mach), 2.5) / (std::pow(1.2, 3.5) * std::pow(6.0, 2.5)));
  }
  return std::copysign(kSeaLevelSoundSpeed * mach, impact_pressure);
}

}  // namespace xplane_bridge::core
