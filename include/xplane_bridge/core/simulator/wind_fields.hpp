#pragma once

/// Wind as a function of distance, height or place: 1-cosine gust, shear with height, microburst.

#include <Eigen/Core>

namespace xplane_bridge::core {

/// Height [m] of the wind by which turbulence and shear are given: 20 ft.
inline constexpr double kWindHeight = 6.096;

/// The 1-cosine gust (CS 25.341): 0 where it begins, 1 in its middle, 0 at its end and outside.
/// @param at,length of the same unit, m or s; `at` is counted from the beginning
double oneMinusCosine(double at, double length);

/// Wind [m/s] at a height above ground that rises with its logarithm, as over open country (MIL-F-8785C, 3.7.3.1).
/// Below 3 ft as there, above 1000 ft as there; 0 below the roughness where that is higher than 3 ft.
/// @param speed [m/s] at kWindHeight
/// @param roughness [m] length of the ground's roughness; 0.15 ft for approach and landing, 2 ft for other phases
double logarithmicShear(double speed, double roughness, double height);

/// Wind [m/s] that rises by `gradient` [1/s] with each metre above kWindHeight, and falls below it.
double linearShear(double speed, double gradient, double height);

/// Downburst of Oseguera and Bowles: "A simple, analytic 3-dimensional downburst model based on boundary layer
/// stagnation flow", NASA TM-100632, 1988. Air sinks in a shaft and flows out along the ground; no divergence.
struct Microburst {
  double radius = 1000.0;  ///< [m] R of the shaft; the outflow is strongest at 1.1212 R from the centre
  double outflow = 15.0;   ///< [m/s] strongest
  double height = 60.0;    ///< [m] above ground where that is
};

/// Velocity of the air, NED [m/s].
/// @param north,east [m] from the centre to the place
/// @param height [m] above ground
Eigen::Vector3d microburstWind(const Microburst& microburst, double north, double east, double height);

}  // namespace xplane_bridge::core
