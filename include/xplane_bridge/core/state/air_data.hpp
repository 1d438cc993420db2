#pragma once

/// @file
/// Standard atmosphere (ICAO Doc 7488, up to 51 km) and compressible air data. SI units.

namespace xplane_bridge::core {

inline constexpr double kSeaLevelDensity = 1.225;       ///< [kg/m^3]
inline constexpr double kSeaLevelPressure = 101325.0;   ///< [Pa]
inline constexpr double kSeaLevelTemperature = 288.15;  ///< [K]
inline constexpr double kSeaLevelSoundSpeed = 340.294;  ///< [m/s]
inline constexpr double kAirGasConstant = 287.05287;    ///< [J/(kg K)]
inline constexpr double kHeatCapacityRatio = 1.4;

/// Geopotential altitude in the standard atmosphere that has this static pressure [m]. NaN for pressure <= 0.
double pressureAltitude(double static_pressure);

/// @param air_density [kg/m^3]
double equivalentAirspeed(double true_airspeed, double air_density);

/// Impact pressure (total - static) [Pa] from dynamic pressure rho/2 V^2 and Mach number; above Mach 1 behind a normal
/// shock, as a pitot tube has it.
double impactPressure(double dynamic_pressure, double mach);

/// Calibrated airspeed: what an error-free instrument calibrated to the standard sea level shows [m/s]; above Mach 1
/// there by the Rayleigh formula.
/// @param impact_pressure total - static [Pa]; negative gives the negative of the mirrored value
double calibratedAirspeed(double impact_pressure);

}  // namespace xplane_bridge::core
