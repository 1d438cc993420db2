#pragma once

#include <cmath>
#include <cstdint>

/// @file
/// Every unit factor of the bridge, named by both ends: `kMetersPerFoot` turns feet into metres. Exact where the unit
/// is defined exactly (foot, nautical mile, pound, standard gravity: international definitions of 1959 and CGPM 1901).

namespace xplane_bridge::core {

inline constexpr double kPi = 3.14159265358979323846;

// Time.
inline constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;
inline constexpr std::int64_t kNanosecondsPerMillisecond = 1'000'000;

inline double toSeconds(std::int64_t nanoseconds) {
  return static_cast<double>(nanoseconds) / static_cast<double>(kNanosecondsPerSecond);
}

/// The nearest nanosecond.
/// @param seconds within +-9.2e9, beyond which 64 bits do not hold it
inline std::int64_t toNanoseconds(double seconds) {
  return std::llround(seconds * static_cast<double>(kNanosecondsPerSecond));
}

// Angles.
inline constexpr double kRadiansPerDegree = kPi / 180.0;
inline constexpr double kDegreesPerRadian = 180.0 / kPi;

// Lengths and speeds.
inline constexpr double kMetersPerFoot = 0.3048;
inline constexpr double kMetersPerNauticalMile = 1852.0;
inline constexpr double kMetersPerSecondPerKnot = kMetersPerNauticalMile / 3600.0;
inline constexpr double kMetersPerSecondPerMph = 0.44704;
inline constexpr double kMetersPerSecondPerFootPerMinute = kMetersPerFoot / 60.0;
inline constexpr double kRadiansPerSecondPerRpm = 2.0 * kPi / 60.0;
inline constexpr double kSecondsPerHour = 3600.0;

// Mass, force, moment, power.
inline constexpr double kStandardGravity = 9.80665;  ///< [m/s^2]
inline constexpr double kKilogramsPerPound = 0.45359237;
inline constexpr double kNewtonsPerPoundForce = kKilogramsPerPound * kStandardGravity;
inline constexpr double kNewtonMetersPerFootPound = kNewtonsPerPoundForce * kMetersPerFoot;
inline constexpr double kWattsPerHorsepower = 550.0 * kNewtonMetersPerFootPound;  ///< mechanical horsepower
inline constexpr double kKilogramsPerSecondPerPoundPerHour = kKilogramsPerPound / kSecondsPerHour;

// Pressure and temperature.
inline constexpr double kPascalsPerPoundPerSquareFoot = kNewtonsPerPoundForce / (kMetersPerFoot * kMetersPerFoot);
inline constexpr double kPascalsPerPsi = 144.0 * kPascalsPerPoundPerSquareFoot;
inline constexpr double kPascalsPerInchOfMercury = 3386.389;  ///< conventional mercury at 0 degC (ICAO Doc 7488)
inline constexpr double kKelvinAtZeroCelsius = 273.15;
inline constexpr double kKelvinPerFahrenheit = 5.0 / 9.0;
inline constexpr double kKelvinAtZeroFahrenheit = kKelvinAtZeroCelsius - 32.0 * kKelvinPerFahrenheit;
inline constexpr double kCelsiusAtZeroFahrenheit = -32.0 * kKelvinPerFahrenheit;

// Electricity.
inline constexpr double kJoulesPerWattHour = kSecondsPerHour;

}  // namespace xplane_bridge::core
