#pragma once

#include <Eigen/Core>
#include <limits>

namespace xplane_bridge::core {

/// What X-Plane says of its field of view, as float32 from the wire. NaN: not answered.
struct FrustumSample {
  double horizontal_deg = std::numeric_limits<double>::quiet_NaN();    ///< `field_of_view_deg`
  double vertical_deg = std::numeric_limits<double>::quiet_NaN();      ///< `vertical_field_of_view_deg`
  double non_proportional = std::numeric_limits<double>::quiet_NaN();  ///< whether `vertical_deg` counts
  double shift_right = std::numeric_limits<double>::quiet_NaN();       ///< `field_of_view_horizontal_ratio`
  double shift_up = std::numeric_limits<double>::quiet_NaN();          ///< `field_of_view_vertical_ratio`, from 12
  Eigen::Matrix4d projection =
      Eigen::Matrix4d::Constant(std::numeric_limits<double>::quiet_NaN());  ///< `projection_matrix_3d`
  double width = std::numeric_limits<double>::quiet_NaN();                  ///< [px] of the window
  double height = std::numeric_limits<double>::quiet_NaN();
};

/// The pyramid that the whole window shows.
struct Frustum {
  double horizontal_deg = 0.0;  ///< from the left edge to the right one, before the shift
  double vertical_deg = 0.0;    ///< from the lower edge to the upper one, before the shift; 0: pixels are square
  double shift_right = 0.0;     ///< [widths of the window] that the picture's middle lies right of the line of sight
  double shift_up = 0.0;        ///< [heights of the window] likewise, above it
  double width = 0.0;           ///< [px] of the window; 0: not known
  double height = 0.0;          ///< [px] likewise
  bool known = false;           ///< X-Plane says it, and its projection matrix, where that answers, agrees
};

/// Farthest that field of view and projection matrix may be apart, as a part of the focal length or of a side.
inline constexpr double kFrustumTolerance = 0.005;

/// The frustum of a sample.
/// @param assumed_deg horizontal field of view where X-Plane does not say it
Frustum frustumOf(const FrustumSample& sample, double assumed_deg);

/// Whether a picture of this size [px] can be of the whole window that a frustum is of; true where the window's size is
/// not known.
/// @param is_region of the screen: a part of a window may have its shape, so only the window's very size will do
bool canShowWhole(const Frustum& frustum, int width, int height, bool is_region);

}  // namespace xplane_bridge::core
