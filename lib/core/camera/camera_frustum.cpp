#include "xplane_bridge/core/camera/camera_frustum.hpp"

#include <cmath>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

constexpr double kSameShape = 0.01;  // of the aspect ratio: rounding to pixels, also of a sender that scales
constexpr double kNarrowestDeg = 1.0, kWidestDeg = 170.0;

bool isAngle(double degrees) { return degrees > kNarrowestDeg && degrees < kWidestDeg; }

double cotangentOfHalf(double degrees) { return 1.0 / std::tan(0.5 * degrees * kRadiansPerDegree); }

bool near(double a, double b, double scale) { return std::abs(a - b) <= kFrustumTolerance * scale; }

/// Takes the sign from the matrix where the size is the same: the lists do not say which way is positive.
bool takeShift(double in_matrix, double* shift) {
  if (near(in_matrix, -*shift, 1.0)) *shift = in_matrix;
  return near(in_matrix, *shift, 1.0);
}

/// Whether the projection matrix, which must be there, shows the frustum.
bool agrees(const FrustumSample& sample, Frustum* frustum) {
  const Eigen::Matrix4d& p = sample.projection;
  const double across = p(0, 0), up = std::abs(p(1, 1));
  const double flipped = p(1, 1) < 0.0 ? -1.0 : 1.0;
  bool same = near(across, cotangentOfHalf(frustum->horizontal_deg), across);
  if (frustum->vertical_deg > 0.0) {
    same = near(up, cotangentOfHalf(frustum->vertical_deg), up) && same;
  } else if (sample.width > 0.0 && sample.height > 0.0) {
    same = near(up, across * sample.width / sample.height, up) && same;
  }
  // The middle of the picture lies at p(0, 2) of the half width right of the line of sight.
  same = takeShift(0.5 * p(0, 2), &frustum->shift_right) && same;
  return takeShift(0.5 * flipped * p(1, 2), &frustum->shift_up) && same;
}

}  // namespace

Frustum frustumOf(const FrustumSample& sample, double assumed_deg) {
  Frustum frustum;
  if (sample.width > 0.0 && sample.height > 0.0) {
    frustum.width = sample.width;
    frustum.height = sample.height;
  }
  frustum.known = isAngle(sample.horizontal_deg);
  frustum.horizontal_deg = frustum.known ? sample.horizontal_deg : assumed_deg;
  if (!frustum.known) return frustum;
  if (sample.non_proportional > 0.5 && isAngle(sample.vertical_deg)) frustum.vertical_deg = sample.vertical_deg;
  if (std::isfinite(sample.shift_right)) frustum.shift_right = sample.shift_right;
  if (std::isfinite(sample.shift_up)) frustum.shift_up = sample.shift_up;
  const bool projects =
      sample.projection.allFinite() && sample.projection(0, 0) > 0.0 && sample.projection(1, 1) != 0.0;
  if (projects) frustum.known = agrees(sample, &frustum);
  return frustum;
}

bool canShowWhole(const Frustum& frustum, int width, int height, bool is_region) {
  if (!(frustum.width > 0.0)) return true;
  if (is_region) return width == frustum.width && height == frustum.height;
  return std::abs(width * frustum.height / (height * frustum.width) - 1.0) <= kSameShape;
}

}  // namespace xplane_bridge::core
