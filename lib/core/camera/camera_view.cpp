#include "xplane_bridge/core/camera/camera_view.hpp"

#include <stdexcept>

#include "xplane_bridge/core/camera/camera_pose.hpp"

namespace xplane_bridge::core {

CameraView classifyView(const Eigen::Quaterniond& orientation, double tolerance_deg) {
  if (!orientation.coeffs().allFinite()) return CameraView::kUnknown;
  for (const CameraView view : {CameraView::kForward, CameraView::kRear, CameraView::kDown}) {
    if (angleBetweenDeg(orientation, opticalOrientation(view)) <= tolerance_deg) return view;
  }
  return CameraView::kUnknown;
}

Eigen::Quaterniond opticalOrientation(CameraView view) {
  switch (view) {
    case CameraView::kForward:
      return opticalOrientation(0.0, 0.0, 0.0);
    case CameraView::kRear:
      return opticalOrientation(0.0, 0.0, 180.0);
    case CameraView::kDown:
      return opticalOrientation(0.0, -90.0, 0.0);
    case CameraView::kUnknown:
      break;
  }
  throw std::invalid_argument("an unknown view has no optical frame");
}

Eigen::Quaterniond opticalOrientation(double roll_deg, double pitch_deg, double heading_deg) {
  return orientationInBase({roll_deg, pitch_deg, heading_deg});
}

}  // namespace xplane_bridge::core
