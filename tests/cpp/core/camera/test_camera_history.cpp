#include "xplane_bridge/core/camera/camera_history.hpp"

#include <gtest/gtest.h>

namespace xplane_bridge::core {
namespace {

constexpr std::int64_t kPeriod = 50'000'000;  // [ns]

FrameCamera zoomed(double horizontal_deg, bool external = false) {
  FrameCamera camera;
  camera.frustum.horizontal_deg = horizontal_deg;
  camera.frustum.known = true;
  camera.external = external;
  return camera;
}

/// Frames 0..9 at 20 Hz from 100 s on, heard as they come: 60 degrees, from frame 5 on 90 degrees and from outside.
CameraHistory zooming() {
  CameraHistory history;
  for (int k = 0; k < 10; ++k) history.add(k * kPeriod, 100.0 + 0.05 * k, zoomed(k < 5 ? 60.0 : 90.0, k >= 5));
  return history;
}

TEST(CameraHistory, KnowsTheCameraOfAFrameByItsTime) {
  const CameraHistory history = zooming();
  for (const std::int64_t moment : {std::int64_t{0}, 5 * kPeriod, 99 * kPeriod}) {  // however late it is seen
    EXPECT_EQ(history.ofFrame(100.0 + 0.05 * 4, moment)->frustum.horizontal_deg, 60.0);
    EXPECT_TRUE(history.ofFrame(100.0 + 0.05 * 4, moment)->frustum.known);
    EXPECT_FALSE(history.ofFrame(100.0 + 0.05 * 4, moment)->external);
    EXPECT_EQ(history.ofFrame(100.0 + 0.05 * 5, moment)->frustum.horizontal_deg, 90.0);
    EXPECT_FALSE(history.ofFrame(100.01, moment).has_value());
  }
}

TEST(CameraHistory, KnowsAPoseByTheFrameThatItIsOf) {
  CameraHistory history;
  for (int k = 0; k < 5; ++k) {
    FrameCamera camera = zoomed(60.0);
    if (k > 0) camera.pose.emplace().sim_time = 100.0 + k - 1;  // of the frame before
    history.add(k * kPeriod, 100.0 + k, camera);
  }
  EXPECT_EQ(history.poseOf(102.0)->sim_time, 102.0);
  EXPECT_FALSE(history.poseOf(104.0).has_value());
  EXPECT_FALSE(history.ofFrame(100.0, 0)->pose.has_value());
}

TEST(CameraHistory, OfTwoFlightsWithTheSameTimesTheMomentDecides) {
  CameraHistory history = zooming();
  history.add(10 * kPeriod, 100.0, zoomed(45.0));  // a flight that began anew
  EXPECT_EQ(history.ofFrame(100.0, 10 * kPeriod)->frustum.horizontal_deg, 45.0);
  EXPECT_EQ(history.ofFrame(100.0, 0)->frustum.horizontal_deg, 60.0);
}

/// The view changes in frame 10 of a pause, in which all frames have one time.
TEST(CameraHistory, InAPauseTheMomentDecidesAndWhatChangesAboutThenIsNotSure) {
  CameraHistory history;
  for (int k = 0; k < 20; ++k) {
    FrameCamera camera = zoomed(k < 10 ? 60.0 : 90.0);
    camera.pose.emplace();
    camera.pose->pose.position.x() = k < 10 ? 0.0 : 5.0;
    camera.pose->sure = true;
    history.add(k * kPeriod, 100.0, camera);
  }
  for (const int k : {3, 7, 8, 9, 10, 11, 12, 16}) {
    const auto camera = history.ofFrame(100.0, k * kPeriod + kPeriod / 5);
    EXPECT_EQ(camera->frustum.horizontal_deg, k < 10 ? 60.0 : 90.0) << k;
    EXPECT_EQ(camera->pose->pose.position.x(), k < 10 ? 0.0 : 5.0) << k;
    const bool sure = k < 8 || k > 11;
    EXPECT_EQ(camera->frustum.known, sure) << k;
    EXPECT_EQ(camera->pose->sure, sure) << k;
  }
}

TEST(CameraHistory, TakesTheFrameHeardNearestToAMoment) {
  const CameraHistory history = zooming();
  for (const std::int64_t off : {-kPeriod * 2 / 5, std::int64_t{0}, kPeriod * 2 / 5}) {
    EXPECT_EQ(history.at(2 * kPeriod + off)->frustum.horizontal_deg, 60.0);
    EXPECT_TRUE(history.at(2 * kPeriod + off)->frustum.known);
    EXPECT_EQ(history.at(7 * kPeriod + off)->frustum.horizontal_deg, 90.0);
    EXPECT_TRUE(history.at(7 * kPeriod + off)->frustum.known);
  }
  EXPECT_EQ(history.at(-kPeriod)->frustum.horizontal_deg, 60.0);
  EXPECT_EQ(history.at(99 * kPeriod)->frustum.horizontal_deg, 90.0);
}

TEST(CameraHistory, IsNotSureBesideAChange) {
  const CameraHistory history = zooming();
  for (const int frame : {4, 5}) {
    EXPECT_FALSE(history.at(frame * kPeriod)->frustum.known) << frame;
    EXPECT_TRUE(history.at(frame * kPeriod)->external) << frame;
  }
  EXPECT_FALSE(history.at(3 * kPeriod)->external);
}

TEST(CameraHistory, KnowsNothingBeforeTheFirstFrameAndWhenCleared) {
  CameraHistory history;
  EXPECT_FALSE(history.at(0).has_value());
  EXPECT_FALSE(history.ofFrame(0.0, 0).has_value());
  history = zooming();
  history.clear();
  EXPECT_FALSE(history.at(0).has_value());
}

TEST(CameraHistory, KeepsFramesForLongerThanAPictureMayWait) {
  CameraHistory history;
  for (int k = 0; k < 10000; ++k) history.add(k * kPeriod, k, zoomed(k));
  EXPECT_TRUE(history.ofFrame(10000.0 - 10.0 * 200.0, 0).has_value());  // the longest max_wait, of a fast simulator
  EXPECT_FALSE(history.ofFrame(1.0, 0).has_value());
}

}  // namespace
}  // namespace xplane_bridge::core
