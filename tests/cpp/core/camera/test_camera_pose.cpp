#include "xplane_bridge/core/camera/camera_pose.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace core = xplane_bridge::core;
using core::CameraSample;

namespace {

// An aircraft at (-25159.27, 226.10, 33689.81), theta 2.4, psi 53.7, phi -11; the pilot's head 0.42 m ahead of its
// reference, 0.31 m left, 0.98 m up, turned 20 deg left and 10 deg down. What X-Plane sends of it, in float32, was
// worked out apart from this code: Rz(heading) Ry(pitch) Rx(roll) and its Euler angles.
CameraSample workedExample() {
  CameraSample sample;
  sample.sim_time = 10.0;
  sample.view_type = 1026.0;
  sample.aircraft = {-11.0F, 2.4F, 53.7F};
  sample.aircraft_true = sample.aircraft;
  sample.aircraft_position = {-25159.27F, 226.10F, 33689.81F};
  sample.view = {-11.37819F, -11.28962F, 36.03974F};
  sample.view_position = {-25159.2539F, 227.0196F, 33689.1875F};
  sample.visual_offset = {0.0, 0.0, 0.0};
  sample.head = {0.0, -10.0, -20.0};
  return sample;
}

// world_matrix of the same camera, column by column.
Eigen::Matrix4d workedWorldMatrix() {
  Eigen::Matrix4d world;
  world << 0.8154401183128357F, 0.19346684217453003F, 0.5455529093742371F, 2092.70947265625F,  //
      -0.046609897166490555F, 0.9613767266273499F, -0.27126047015190125F, 7747.62353515625F,   //
      -0.5769618153572083F, 0.19576852023601532F, 0.7929626703262329F, -41274.640625F,         //
      0.0F, 0.0F, 0.0F, 1.0F;
  return world;
}

// Columns right, down, forward of that head in forward-left-up: Rz(-20) Ry(-10) by hand.
Eigen::Matrix3d workedAxes() {
  Eigen::Matrix3d axes;
  axes << 0.34202014, -0.16317591, 0.92541658,  //
      -0.93969262, -0.05939117, 0.33682409,     //
      0.0, -0.98480775, -0.17364818;
  return axes;
}

double turnedDeg(const core::CameraPose& pose, const Eigen::Matrix3d& axes) {
  return core::angleBetweenDeg(pose.orientation, Eigen::Quaterniond(axes).normalized());
}

}  // namespace

TEST(CameraPose, FromViewAnglesAndPositions) {
  const CameraSample sample = workedExample();
  const auto pose = core::measuredPose(sample, sample, {});
  ASSERT_TRUE(pose);
  EXPECT_LT(turnedDeg(*pose, workedAxes()), 1e-4);
  EXPECT_LT((pose->position - Eigen::Vector3d(0.4185, 0.3100, 0.9801)).norm(), 3e-4) << pose->position.transpose();
  // The truth is inside the bounds that the steps of float32 leave: 1/512 m at 25 km, 1/256 m at 34 km, half of each of
  // two values.
  EXPECT_NEAR(pose->position_uncertainty, std::hypot(1.0 / 512, 1.0 / 256), 1e-5);
  EXPECT_LT((pose->position - Eigen::Vector3d(0.42, 0.31, 0.98)).norm(), pose->position_uncertainty);
  EXPECT_GT(pose->angle_uncertainty_deg, 1e-6);
  EXPECT_LT(pose->angle_uncertainty_deg, 1e-4);
}

TEST(CameraPose, FromTheWorldMatrix) {
  CameraSample sample = workedExample();
  EXPECT_FALSE(core::worldMatrixPose(sample)) << "not answered";
  sample.world = workedWorldMatrix();
  const auto pose = core::worldMatrixPose(sample);
  ASSERT_TRUE(pose);
  EXPECT_LT(turnedDeg(*pose, workedAxes()), 1e-5);
  EXPECT_LT((pose->position - Eigen::Vector3d(0.4165, 0.3088, 0.9808)).norm(), 3e-4) << pose->position.transpose();
  EXPECT_LT((pose->position - Eigen::Vector3d(0.42, 0.31, 0.98)).norm(), pose->position_uncertainty);
  sample.world.setZero();
  EXPECT_FALSE(core::worldMatrixPose(sample)) << "X-Plane has not drawn yet";
}

TEST(CameraPose, OfTheFrameBeforeItLiesBehind) {
  const CameraSample sample = workedExample();
  CameraSample next = sample;
  // 70 m/s along the nose for 1/60 s: (cos 2.4 cos 53.7, cos 2.4 sin 53.7, -sin 2.4) north, east, down.
  const double way = 70.0 / 60.0;
  next.aircraft_position += way * Eigen::Vector3d(0.80521, 0.04188, -0.59149);
  const auto stale = core::measuredPose(sample, next, {});
  EXPECT_NEAR(stale->position.x(), 0.42 - way, 0.006);
  const auto right = core::measuredPose(sample, sample, {false, true, false});
  EXPECT_NEAR(right->position.x(), 0.42, 0.006);
}

TEST(CameraPose, VisualOffsetTurnsTheCameraInItsOwnAxes) {
  CameraSample sample = workedExample();
  sample.view = sample.aircraft;  // straight ahead, banked
  sample.visual_offset = {0.0, -90.0, 0.0};
  const auto apart = core::measuredPose(sample, sample, {});
  Eigen::Matrix3d down;  // right, down, forward: to the right, aft, downwards
  down << 0, -1, 0, -1, 0, 0, 0, 0, -1;
  EXPECT_LT(turnedDeg(*apart, down), 1e-4);
  const auto within = core::measuredPose(sample, sample, {false, false, true});
  Eigen::Matrix3d ahead;
  ahead << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  EXPECT_LT(turnedDeg(*within, ahead), 1e-4);
}

TEST(CameraPose, WhetherTheOffsetIsContainedIsSeenByTheView) {
  CameraSample sample = workedExample();
  sample.view_type = 1024.0;
  sample.view = sample.aircraft;
  EXPECT_EQ(core::offsetsWithin(sample, sample, {}), false) << "no offset at all";
  sample.visual_offset.heading = 180.0;
  EXPECT_EQ(core::offsetsWithin(sample, sample, {}), false);
  sample.view = {11.0, -2.4, 53.7 + 180.0};  // to the rear: pitch and roll turn about
  EXPECT_EQ(core::offsetsWithin(sample, sample, {}), true);
  sample.view_type = 1017.0;  // chase: nothing is known of it
  sample.external = true;
  EXPECT_FALSE(core::offsetsWithin(sample, sample, {}).has_value());
  sample.world = workedWorldMatrix();
  EXPECT_FALSE(core::offsetsWithin(sample, sample, {}).has_value()) << "the matrix speaks for neither";
}

TEST(CameraPose, NothingWhereXPlaneDoesNotAnswer) {
  CameraSample sample = workedExample();
  sample.view.heading = std::nan("");
  EXPECT_FALSE(core::measuredPose(sample, sample, {}));
  EXPECT_FALSE(sample.complete());
  EXPECT_FALSE(CameraSample().complete());
  sample = workedExample();
  sample.visual_offset = {};  // X-Plane without them: none
  ASSERT_TRUE(core::measuredPose(sample, sample, {}));
  EXPECT_LT(turnedDeg(*core::measuredPose(sample, sample, {}), workedAxes()), 1e-4);
}
