#include "xplane_bridge/core/simulator/traffic_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

// A degree of latitude at the height of 800 m: (6378145 + 800) * pi / 180.
constexpr double kDegree = 111333.6;  // [m]

TrafficPose poseAt(double latitude, double longitude) {
  TrafficPose pose;
  pose.number = 2;
  pose.place = {latitude, longitude, 800.0};
  return pose;
}

TEST(TrafficMotion, GoesOnWithItsVelocity) {
  TrafficMotion motion;
  TrafficPose pose = poseAt(0.0, 10.0);
  pose.velocity_ned = {50.0, -20.0, -3.0};
  motion.command(pose, 100.0);
  const TrafficPose later = motion.at(102.0);
  EXPECT_NEAR(later.place.latitude_deg, 100.0 / kDegree, 1e-7);
  EXPECT_NEAR(later.place.longitude_deg, 10.0 - 40.0 / kDegree, 1e-7);
  EXPECT_NEAR(later.place.height, 806.0, 1e-6);
  EXPECT_EQ(motion.at(99.0).place.height, 800.0) << "never back in time";
}

TEST(TrafficMotion, TakesACorrectionSteadilyWithinItsTime) {
  TrafficMotion motion;
  TrafficPose pose = poseAt(0.0, 0.0);
  pose.attitude.heading = 3.1;
  motion.command(pose, 0.0);
  pose.place.latitude_deg = 10.0 / kDegree;  // 10 m north
  pose.attitude.heading = -3.1;              // over south, by 2 pi - 6.2
  motion.command(pose, 1.0);
  EXPECT_NEAR(motion.at(1.0).place.latitude_deg * kDegree, 0.0, 1e-3) << "no step";
  EXPECT_NEAR(motion.at(1.05).place.latitude_deg * kDegree, 2.5, 1e-3);
  EXPECT_NEAR(motion.at(1.2).place.latitude_deg * kDegree, 10.0, 1e-3);
  EXPECT_NEAR(motion.at(2.0).place.latitude_deg * kDegree, 10.0, 1e-3);
  EXPECT_NEAR(motion.at(1.1).attitude.heading, -kPi, 1e-6) << "half of the short way round";
  EXPECT_NEAR(motion.at(1.2).attitude.heading, -3.1, 1e-9);
}

TEST(TrafficMotion, IsElsewhereAtOnceBeyondAJump) {
  TrafficMotion motion;
  motion.command(poseAt(0.0, 0.0), 0.0);
  motion.command(poseAt(1.0, 0.0), 1.0);
  EXPECT_NEAR(motion.at(1.0).place.latitude_deg, 1.0, 1e-9);
}

TEST(TrafficMotion, ChecksAList) {
  TrafficPose pose = poseAt(45.0, 7.0);
  EXPECT_FALSE(check({pose}));
  EXPECT_FALSE(check({}));
  EXPECT_EQ(check({pose, pose}).value_or(""), "number 2 is given twice: expected each once");
  pose.number = 20;
  EXPECT_EQ(check({pose}).value_or(""),
            "number is 20: expected 1..19; 0 is the user's aircraft, which reset_flight places");
  pose.number = 19;
  pose.place.latitude_deg = std::nan("");
  EXPECT_EQ(check({pose}).value_or(""), "aircraft 19: latitude is nan: expected -90..90");
  pose = poseAt(45.0, 7.0);
  pose.velocity_ned.z() = 601.0;
  EXPECT_EQ(check({pose}).value_or(""), "aircraft 2: velocity_down is 601: expected -600..600");
}

// At the scenery's origin its axes are the level's: x east, y up, z south.
TEST(TrafficMotion, WritesInTheAxesOfTheSceneryOrigin) {
  TrafficPose pose = poseAt(0.0, 10.0);
  pose.attitude = {-20.0 * kRadiansPerDegree, 5.0 * kRadiansPerDegree, -10.0 * kRadiansPerDegree};
  pose.velocity_ned = {50.0, 3.0, -2.0};
  const auto writes = trafficWrites(pose, TangentFrame({0.0, 10.0, 0.0}));
  ASSERT_EQ(writes.size(), 9U);
  const std::string plane = std::string("sim/multiplayer/position/") + "plane2_";
  const std::pair<const char*, double> expected[] = {{"x", 0.0},   {"y", 800.0},   {"z", 0.0},
                                                     {"the", 5.0}, {"phi", -20.0}, {"psi", 350.0},
                                                     {"v_x", 3.0}, {"v_y", 2.0},   {"v_z", -50.0}};
  for (std::size_t i = 0; i < writes.size(); ++i) {
    EXPECT_EQ(writes[i].dataref, plane + expected[i].first);
    EXPECT_NEAR(static_cast<double>(writes[i].value), expected[i].second, 1e-4) << expected[i].first;
  }
  // One degree further east it stands 1 deg askew in them: what is level there banks right, x is R' sin(1 deg).
  pose = poseAt(0.0, 11.0);
  const auto askew = trafficWrites(pose, TangentFrame({0.0, 10.0, 0.0}));
  EXPECT_NEAR(static_cast<double>(askew[0].value), (6378145.0 + 800.0) * std::sin(kRadiansPerDegree), 0.1);
  EXPECT_NEAR(static_cast<double>(askew[4].value), 1.0, 1e-4);
}

}  // namespace
}  // namespace xplane_bridge::core
