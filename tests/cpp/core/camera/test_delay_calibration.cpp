#include "xplane_bridge/core/camera/delay_calibration.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

namespace xplane_bridge::core {
namespace {

constexpr std::int64_t kPeriod = 20'000'000;  // [ns]

/// Ten steps at these frames; the first `unseen` of them do not show.
DelayCalibration recorded(const std::vector<int>& steps, std::int64_t delay_ns, int unseen = 0, bool moving = false) {
  DelayCalibration calibration;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> motion(moving ? 9.0 : 0.5, moving ? 10.0 : 2.0);
  double angle = 60.0;
  int seen = 0;
  for (int number = 0; number < steps.back() + 40; ++number) {
    const bool zooms = std::find(steps.begin(), steps.end(), number) != steps.end();
    if (zooms) angle = angle > 64.0 ? 60.0 : 68.0;
    const bool shows = zooms && seen++ >= unseen;
    calibration.addFrame(number * kPeriod, angle);
    calibration.addPicture(number * kPeriod + delay_ns, shows ? 20.0 : motion(random));
  }
  return calibration;
}

std::vector<int> atRandom() {
  std::mt19937 random(3);
  std::vector<int> steps;
  int at = 20;
  for (int i = 0; i < DelayCalibration::kSteps; ++i) {
    at += std::uniform_int_distribution<int>(8, 15)(random);
    steps.push_back(at);
  }
  return steps;
}

TEST(DelayCalibration, RegularFramesDoNotHideWholePeriods) {
  for (const std::int64_t delay_ms : {0, 5, 40, 58, 200, 380}) {
    std::string why;
    const auto found = recorded(atRandom(), delay_ms * 1'000'000).settle(&why);
    ASSERT_TRUE(found.has_value()) << delay_ms << " ms: " << why;
    EXPECT_NEAR(found->delay, 1e-3 * static_cast<double>(delay_ms), 1e-9);
    EXPECT_EQ(found->steps, 10);
    EXPECT_EQ(found->spread, 0.0);
  }
}

/// common.yaml's `display_delay` takes no less than -0.02, and 0 as not measured.
TEST(DelayCalibration, WhatIsAdvisedIsAcceptedAndCountsAsMeasured) {
  std::string why;
  EXPECT_NEAR(recorded(atRandom(), -19'000'000).settle(&why)->delay, -0.019, 1e-9) << why;
  // One step at -20 ms, and nine at -24 ms, within half a frame of it.
  DelayCalibration calibration;
  double angle = 60.0;
  const std::vector<int> steps = atRandom();
  for (int number = 0; number < steps.back() + 40; ++number) {
    const bool zooms = std::find(steps.begin(), steps.end(), number) != steps.end();
    if (zooms) angle = angle > 64.0 ? 60.0 : 68.0;
    calibration.addFrame(number * kPeriod, angle);
    const std::int64_t early = number == steps.front() ? 20'000'000 : 24'000'000;
    calibration.addPicture(number * kPeriod - early, zooms ? 20.0 : 1.0);
  }
  const auto found = calibration.settle(&why);
  ASSERT_TRUE(found.has_value()) << why;
  EXPECT_EQ(found->delay, DelayCalibration::kLeastDelay);
  EXPECT_EQ(delayToKeep(0.0583), 0.0583);
  EXPECT_EQ(delayToKeep(-0.003), -0.003);
  EXPECT_EQ(delayToKeep(0.00006), 0.00006);  // prints as 0.0001
  for (const double delay : {0.0, 0.00004, -0.00004}) EXPECT_EQ(delayToKeep(delay), 0.0001) << delay;
}

TEST(DelayCalibration, StepsThatWereMissedDoNoHarmAndTooManyAreSaid) {
  std::string why;
  const auto found = recorded(atRandom(), 58'000'000, 4).settle(&why);
  ASSERT_TRUE(found.has_value()) << why;
  EXPECT_NEAR(found->delay, 0.058, 1e-9);
  EXPECT_FALSE(recorded(atRandom(), 58'000'000, 9).settle(&why).has_value());
  EXPECT_NE(why.find("were seen in the pictures"), std::string::npos) << why;
}

TEST(DelayCalibration, AViewThatMovesMuchHidesNoSteps) {
  std::string why;
  const auto found = recorded(atRandom(), 58'000'000, 0, true).settle(&why);
  ASSERT_TRUE(found.has_value()) << why;
  EXPECT_NEAR(found->delay, 0.058, 1e-9);
}

TEST(DelayCalibration, StepsThatFitSeveralDelaysAreNoMeasurement) {
  std::vector<int> steps;
  for (int at = 20; at < 120; at += 10) steps.push_back(at);  // nine of ten fit a delay that is one step longer
  std::string why;
  EXPECT_FALSE(recorded(steps, 0).settle(&why).has_value());
  EXPECT_NE(why.find("more than one delay (10 and 9 of 10)"), std::string::npos) << why;
}

TEST(DelayCalibration, AnXPlaneThatDoesNotChangeItsViewIsSaid) {
  DelayCalibration calibration;
  std::string why;
  EXPECT_FALSE(calibration.settle(&why).has_value());
  for (int number = 0; number < 100; ++number) calibration.addFrame(number * kPeriod, 60.0);
  EXPECT_FALSE(calibration.settle(&why).has_value());
  EXPECT_NE(why.find("reports 0 of 10 steps"), std::string::npos) << why;
}

}  // namespace
}  // namespace xplane_bridge::core
