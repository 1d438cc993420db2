#pragma once

/// @file
/// Values of what is not known.

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <limits>

namespace xplane_bridge::core {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr float kNaNf = std::numeric_limits<float>::quiet_NaN();

/// A vector that is not filled yet.
inline Eigen::Vector3d nanVector() { return Eigen::Vector3d::Constant(kNaN); }

/// N values that are not filled yet.
template <std::size_t N>
constexpr std::array<float, N> nanArray() {
  std::array<float, N> a{};
  for (auto& x : a) x = kNaNf;
  return a;
}

}  // namespace xplane_bridge::core
