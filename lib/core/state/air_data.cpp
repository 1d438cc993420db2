#include "xplane_bridge/core/state/air_data.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

/// A layer of the standard atmosphere, from its base up to the next one.
struct Layer {
  double base;   // [m] geopotential
  double lapse;  // [K/m] by which it gets colder with height
};
constexpr std::array<Layer, 5> kLayers{
    {{0.0, 0.0065}, {11000.0, 0.0}, {20000.0, -0.001}, {32000.0, -0.0028}, {47000.0, 0.0}}};

/// Impact pressure over static pressure at a Mach number; above 1 behind the shock ahead of the tube (Rayleigh).
double impactRatio(double mach) {
  const double m2 = mach * mach;
  if (mach <= 1.0) return std::pow(1.0 + 0.2 * m2, 3.5) - 1.0;
  return std::pow(1.2 * m2, 3.5) * std::pow(6.0 / (7.0 * m2 - 1.0), 2.5) - 1.0;
}

}  // namespace

double pressureAltitude(double static_pressure) {
  if (!(static_pressure > 0.0)) return std::numeric_limits<double>::quiet_NaN();
  double temperature = kSeaLevelTemperature;  // [K] and [Pa] at the base of the layer
  double pressure = kSeaLevelPressure;
  for (std::size_t k = 0;; ++k) {
    const auto [base, lapse] = kLayers.at(k);
    const double exponent = lapse == 0.0 ? 0.0 : kStandardGravity / (kAirGasConstant * lapse);
    const double scale_height = kAirGasConstant * temperature / kStandardGravity;  // [m] where lapse is 0
    if (k + 1 < kLayers.size()) {
      const double thickness = kLayers.at(k + 1).base - base;
      const double above = temperature - lapse * thickness;
      const double pressure_above = lapse == 0.0 ? pressure * std::exp(-thickness / scale_height)
                                                 : pressure * std::pow(above / temperature, exponent);
      if (static_pressure < pressure_above) {
        temperature = above;
        pressure = pressure_above;
        continue;
      }
    }
    if (lapse == 0.0) return base + scale_height * std::log(pressure / static_pressure);
    return base + temperature / lapse * (1.0 - std::pow(static_pressure / pressure, 1.0 / exponent));
  }
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
