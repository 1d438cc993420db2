#pragma once

#include <Eigen/Geometry>

#include "xplane_bridge/core/base/message_constants.hpp"

namespace xplane_bridge::core {

/// Which of the three views a camera's orientation is.
/// @param orientation turns optical vectors (right, down, forward) into base_link
/// @param tolerance_deg farthest it may be turned from the view's
/// @return kUnknown when it is none of them, or not finite
CameraView classifyView(const Eigen::Quaterniond& orientation, double tolerance_deg);

/// Rotation from a view's optical frame (right, down, forward; REP 103) to base_link (FLU).
/// @throws std::invalid_argument for kUnknown
Eigen::Quaterniond opticalOrientation(CameraView view);

/// Rotation from the optical frame of a camera turned in the aircraft to base_link.
/// @param roll_deg right +, about the line of sight
/// @param pitch_deg up +
/// @param heading_deg right +
Eigen::Quaterniond opticalOrientation(double roll_deg, double pitch_deg, double heading_deg);

}  // namespace xplane_bridge::core
