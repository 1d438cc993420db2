#pragma once

/// Dryden turbulence of MIL-F-8785C (3.7.1.2, 3.7.3.4), low-altitude form.

#include <array>
#include <cstdint>
#include <random>

#include <Eigen/Core>

namespace xplane_bridge::core {

/// Along the wind, across it, vertical.
struct DrydenScales {
  Eigen::Array3d length{1.0, 1.0, 1.0};  ///< [m]
  Eigen::Array3d sigma{0.0, 0.0, 0.0};   ///< [m/s] root mean square
};

/// From 10 to 1000 ft above ground as the specification has it, below 10 ft as at 10 ft. Above 1000 ft the lengths rise
/// to 1750 ft at 2000 ft, as there; the intensity stays what it is at 1000 ft, where the specification has a table by
/// probability.
/// @param height [m] above ground
/// @param wind [m/s] at 20 ft
DrydenScales drydenScales(double height, double wind);

/// One realisation. The discretisation is exact for any step: what is drawn has the variance and the autocorrelation of
/// the continuous spectrum however long the steps are. It begins calm, and is stationary after about three lengths of
/// flight. The same seed and the same steps give the same turbulence on every machine.
class DrydenTurbulence {
 public:
  explicit DrydenTurbulence(std::uint32_t seed) : random_(seed) {}

  /// Flies on through it.
  /// @param distance [m] flown through the air since the last step
  /// @return [m/s] velocity of the air along the wind, across it (to the right of where it goes), down
  Eigen::Vector3d step(double distance, const DrydenScales& scales);

 private:
  double normal();

  std::mt19937 random_;
  double along_ = 0.0;  // of variance 1
  std::array<Eigen::Vector2d, 2> across_down_ = {Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
};

}  // namespace xplane_bridge::core
