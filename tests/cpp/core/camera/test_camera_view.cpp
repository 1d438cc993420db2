#include "xplane_bridge/core/camera/camera_view.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>

namespace core = xplane_bridge::core;
using core::CameraView;

namespace {

void expectAxis(CameraView view, const Eigen::Vector3d& optical, const Eigen::Vector3d& flu) {
  const Eigen::Vector3d got = core::opticalOrientation(view) * optical;
  EXPECT_NEAR((got - flu).norm(), 0.0, 1e-12) << core::toString(view) << ": " << got.transpose();
}

}  // namespace

TEST(ClassifyView, KnowsTheThreeViewsAndSaysWhenItIsNone) {
  const auto classify = [](double heading_deg, double pitch_deg, double roll_deg = 0.0) {
    return core::classifyView(core::opticalOrientation(roll_deg, pitch_deg, heading_deg), 5.0);
  };
  EXPECT_EQ(classify(0.0, 0.0), CameraView::kForward);
  EXPECT_EQ(classify(359.0, -3.0), CameraView::kForward);
  EXPECT_EQ(classify(-360.0, 0.0), CameraView::kForward);
  EXPECT_EQ(classify(180.0, 0.0), CameraView::kRear);
  EXPECT_EQ(classify(-178.0, 2.0), CameraView::kRear);
  EXPECT_EQ(classify(0.0, -90.0), CameraView::kDown);
  EXPECT_EQ(classify(2.0, -87.0), CameraView::kDown);
  EXPECT_EQ(classify(90.0, 0.0), CameraView::kUnknown);
  EXPECT_EQ(classify(0.0, -30.0), CameraView::kUnknown);
  EXPECT_EQ(classify(0.0, 90.0), CameraView::kUnknown);
  EXPECT_EQ(classify(0.0, 0.0, 20.0), CameraView::kUnknown) << "rolled";
  // Straight down, but turned: the top of the picture is not ahead.
  EXPECT_EQ(classify(90.0, -90.0), CameraView::kUnknown);
  EXPECT_EQ(classify(std::nan(""), 0.0), CameraView::kUnknown);
}

TEST(OpticalOrientation, AxesByHand) {
  const Eigen::Vector3d right(1, 0, 0);
  const Eigen::Vector3d down(0, 1, 0);
  const Eigen::Vector3d ahead(0, 0, 1);
  expectAxis(CameraView::kForward, ahead, {1, 0, 0});
  expectAxis(CameraView::kForward, right, {0, -1, 0});
  expectAxis(CameraView::kForward, down, {0, 0, -1});
  expectAxis(CameraView::kRear, ahead, {-1, 0, 0});
  expectAxis(CameraView::kRear, right, {0, 1, 0});
  expectAxis(CameraView::kRear, down, {0, 0, -1});
  expectAxis(CameraView::kDown, ahead, {0, 0, -1});
  expectAxis(CameraView::kDown, right, {0, -1, 0});
  expectAxis(CameraView::kDown, down, {-1, 0, 0});  // the top of the picture is ahead
  EXPECT_THROW((void)core::opticalOrientation(CameraView::kUnknown), std::invalid_argument);
}
