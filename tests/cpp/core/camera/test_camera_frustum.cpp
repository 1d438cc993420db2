#include "xplane_bridge/core/camera/camera_frustum.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace core = xplane_bridge::core;

namespace {

core::FrustumSample proportional() {
  core::FrustumSample sample;
  sample.horizontal_deg = 90.0;
  sample.vertical_deg = 50.0;  // not obeyed
  sample.non_proportional = 0.0;
  sample.shift_right = 0.0;
  sample.width = 640.0;
  sample.height = 480.0;
  return sample;
}

// OpenGL's frustum with these edges at unit distance.
Eigen::Matrix4d projection(double left, double right, double bottom, double top) {
  Eigen::Matrix4d p = Eigen::Matrix4d::Zero();
  p(0, 0) = 2.0 / (right - left);
  p(1, 1) = 2.0 / (top - bottom);
  p(0, 2) = (right + left) / (right - left);
  p(1, 2) = (top + bottom) / (top - bottom);
  p(2, 2) = p(3, 2) = -1.0;
  return p;
}

}  // namespace

TEST(Frustum, ProportionalHasSquarePixels) {
  const core::Frustum frustum = core::frustumOf(proportional(), 60.0);
  EXPECT_TRUE(frustum.known);
  EXPECT_EQ(frustum.horizontal_deg, 90.0);
  EXPECT_EQ(frustum.vertical_deg, 0.0);
  EXPECT_EQ(frustum.width, 640.0);
  EXPECT_EQ(frustum.height, 480.0);
  EXPECT_EQ(core::frustumOf(core::FrustumSample(), 60.0).width, 0.0);
}

TEST(Frustum, APictureOfTheWholeWindowHasItsShape) {
  const core::Frustum frustum = core::frustumOf(proportional(), 60.0);
  EXPECT_TRUE(core::canShowWhole(frustum, 640, 480, false));
  EXPECT_TRUE(core::canShowWhole(frustum, 320, 241, false)) << "scaled by a sender";
  EXPECT_FALSE(core::canShowWhole(frustum, 320, 400, false));
  EXPECT_TRUE(core::canShowWhole({}, 320, 400, false)) << "of a window that is not known";
}

TEST(Frustum, ARegionOfTheScreenIsTheWholeWindowOnlyInItsVerySize) {
  const core::Frustum frustum = core::frustumOf(proportional(), 60.0);
  EXPECT_TRUE(core::canShowWhole(frustum, 640, 480, true));
  EXPECT_FALSE(core::canShowWhole(frustum, 320, 240, true)) << "a part that has its shape";
  EXPECT_FALSE(core::canShowWhole(frustum, 640, 479, true));
  EXPECT_TRUE(core::canShowWhole({}, 320, 240, true)) << "of a window that is not known";
}

TEST(Frustum, AssumedWhereXPlaneDoesNotAnswer) {
  const core::Frustum frustum = core::frustumOf({}, 60.0);
  EXPECT_FALSE(frustum.known);
  EXPECT_EQ(frustum.horizontal_deg, 60.0);
}

TEST(Frustum, ProjectionMatrixIsComparedWithIt) {
  core::FrustumSample sample = proportional();
  sample.projection = projection(-1.0, 1.0, -0.75, 0.75);
  EXPECT_TRUE(core::frustumOf(sample, 60.0).known);
  sample.projection = projection(-1.006, 1.006, -0.7545, 0.7545);  // 0.6 % wider
  EXPECT_FALSE(core::frustumOf(sample, 60.0).known);
  sample.projection = projection(-1.0, 1.0, -0.65, 0.65);  // pixels are not square although X-Plane says so
  EXPECT_FALSE(core::frustumOf(sample, 60.0).known);
  sample.non_proportional = 1.0;
  sample.vertical_deg = 2.0 * std::atan(0.65) * 180.0 / M_PI;
  EXPECT_TRUE(core::frustumOf(sample, 60.0).known);
  EXPECT_EQ(core::frustumOf(sample, 60.0).vertical_deg, sample.vertical_deg);
  sample.projection.setZero();  // nothing drawn yet: no witness
  EXPECT_TRUE(core::frustumOf(sample, 60.0).known);
}

TEST(Frustum, ShiftsTakeTheMatrixsSign) {
  core::FrustumSample sample = proportional();
  sample.shift_right = 0.25;
  sample.shift_up = 0.1;
  EXPECT_EQ(core::frustumOf(sample, 60.0).shift_right, 0.25);
  // A quarter of the width to the left, a tenth of the height up.
  sample.projection = projection(-1.5, 0.5, -0.6, 0.9);
  const core::Frustum frustum = core::frustumOf(sample, 60.0);
  EXPECT_TRUE(frustum.known);
  EXPECT_NEAR(frustum.shift_right, -0.25, 1e-12);
  EXPECT_NEAR(frustum.shift_up, 0.1, 1e-12);
  // With y downwards.
  sample.projection.row(1) *= -1.0;
  EXPECT_NEAR(core::frustumOf(sample, 60.0).shift_up, 0.1, 1e-12);
  sample.shift_right = 0.1;
  EXPECT_FALSE(core::frustumOf(sample, 60.0).known);
}
