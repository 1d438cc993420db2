#include "xplane_bridge/vision/picture_checks.hpp"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <utility>
#include <vector>

namespace vision = xplane_bridge::vision;

TEST(IsBlack, ToleratesNoiseAndAFewLitPixelsButNotANightSky) {
  EXPECT_TRUE(vision::isBlack(cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(0))));
  EXPECT_TRUE(vision::isBlack(cv::Mat(480, 640, CV_8UC4, cv::Scalar(15, 15, 15, 255))));
  cv::Mat message(480, 640, CV_8UC3, cv::Scalar::all(0));
  message(cv::Rect(0, 0, 30, 20)).setTo(255);
  EXPECT_TRUE(vision::isBlack(message));
  EXPECT_FALSE(vision::isBlack(cv::Mat(480, 640, CV_8UC3, cv::Scalar(30, 10, 10))));
  cv::Mat half(480, 640, CV_8UC3, cv::Scalar::all(0));
  half(cv::Rect(0, 240, 640, 240)).setTo(90);
  EXPECT_FALSE(vision::isBlack(half));
  EXPECT_FALSE(vision::isBlack(cv::Mat()));
}

TEST(SamePixels, ComparesSizeTypeAndEveryPixel) {
  cv::Mat a(48, 64, CV_8UC3, cv::Scalar::all(9));
  cv::Mat b = a.clone();
  EXPECT_TRUE(vision::samePixels(a, b));
  b.at<cv::Vec3b>(47, 63)[2] = 10;
  EXPECT_FALSE(vision::samePixels(a, b));
  EXPECT_FALSE(vision::samePixels(a, a(cv::Rect(0, 0, 63, 48))));
  EXPECT_FALSE(vision::samePixels(a, cv::Mat(48, 64, CV_8UC4, cv::Scalar::all(9))));
}

TEST(PeriodMeter, ReportsMeanTheLongestOf99PercentAndTheWorst) {
  constexpr std::int64_t kMillisecond = 1'000'000;
  vision::PeriodMeter meter;
  EXPECT_EQ(meter.summary().count, 0U);
  std::int64_t now = 5'000 * kMillisecond;
  meter.add(now);
  EXPECT_EQ(meter.summary().count, 0U) << "one picture has no period";
  for (int i = 0; i < 200; ++i) meter.add(now += (i == 70 ? 500 : i == 120 || i == 130 ? 60 : 20) * kMillisecond);
  const vision::PeriodMeter::Summary all = meter.summary();
  EXPECT_EQ(all.count, 200U);
  EXPECT_NEAR(all.mean, (197 * 0.02 + 2 * 0.06 + 0.5) / 200.0, 1e-6);
  EXPECT_NEAR(all.p99, 0.06, 1e-6);  // the 198th of 200
  EXPECT_NEAR(all.worst, 0.5, 1e-6);
  meter.add(now);  // the same picture again
  meter.interrupt();
  meter.add(now += 60'000 * kMillisecond);
  EXPECT_EQ(meter.summary().count, 200U);
  for (int i = 0; i < 1024; ++i) meter.add(now += 30 * kMillisecond);
  EXPECT_EQ(meter.summary().count, 1024U);
  EXPECT_NEAR(meter.summary().worst, 0.03, 1e-6) << "older ones have left";
}

TEST(StandingCheck, IsDueOnceForThoseWhoSeeNothingChange) {
  vision::StandingCheck check(100);
  EXPECT_FALSE(check.due(false, 1000));
  EXPECT_FALSE(check.due(true, 2000)) << "they have just come";
  EXPECT_FALSE(check.due(true, 2099));
  EXPECT_TRUE(check.due(true, 2100));
  EXPECT_FALSE(check.due(true, 9000)) << "once";
  EXPECT_FALSE(check.due(false, 9001));
  EXPECT_FALSE(check.due(true, 9002)) << "others";
  check.pictureTaken();
  EXPECT_FALSE(check.due(true, 9500)) << "they have seen one";
}

constexpr std::int64_t kTenth = 100'000'000;  // [ns]

/// A state that moves ten times a second, from `from` to `to` [0.1 s], and no new picture.
void moveState(vision::FrozenCheck& check, std::int64_t from, std::int64_t to) {
  for (std::int64_t at = from; at <= to; ++at) check.stateMoved(at * kTenth);
}

TEST(FrozenCheck, NeedsAPictureThatStandsForTheTimeThatTheStateMoves) {
  vision::FrozenCheck check(10 * kTenth);
  moveState(check, 80, 99);
  EXPECT_FALSE(check.frozen(100 * kTenth)) << "no picture yet";
  check.pictureChanged();
  EXPECT_FALSE(check.frozen(120 * kTenth)) << "nothing moves: the picture may stand";
  moveState(check, 121, 132);
  EXPECT_FALSE(check.frozen(132 * kTenth)) << "not longer than the limit";
  moveState(check, 133, 133);
  EXPECT_TRUE(check.frozen(133 * kTenth));
  EXPECT_FALSE(check.frozen(153 * kTenth)) << "the state has stopped";
  moveState(check, 134, 140);
  EXPECT_TRUE(check.frozen(141 * kTenth));
  check.pictureChanged();
  EXPECT_FALSE(check.frozen(141 * kTenth + 1));
  moveState(check, 142, 153);
  EXPECT_FALSE(check.frozen(153 * kTenth)) << "not standing long enough";
  moveState(check, 154, 154);
  EXPECT_TRUE(check.frozen(154 * kTenth));
  check.interrupt();  // no subscriber
  EXPECT_FALSE(check.frozen(154 * kTenth));
}

TEST(FrozenCheck, APictureThatStandsOverAnInterruptionIsFoundFrozenAgain) {
  vision::FrozenCheck check(10 * kTenth);
  check.beginAnew(0);
  moveState(check, 1, 30);
  EXPECT_FALSE(check.frozen(30 * kTenth)) << "there was no picture ever";
  check.pictureChanged();
  moveState(check, 31, 50);
  EXPECT_TRUE(check.frozen(50 * kTenth));
  check.interrupt();  // the sender is gone
  moveState(check, 51, 80);
  EXPECT_FALSE(check.frozen(80 * kTenth));
  check.beginAnew(95 * kTenth);  // it is back, and has not said yet whether it has pictures
  moveState(check, 81, 106);
  EXPECT_FALSE(check.frozen(106 * kTenth)) << "movements before that do not count";
  moveState(check, 107, 107);
  EXPECT_TRUE(check.frozen(107 * kTenth));
  check.interrupt();
  check.beginAnew(200 * kTenth);
  check.pictureChanged();
  moveState(check, 110, 122);
  EXPECT_TRUE(check.frozen(122 * kTenth)) << "a picture says as much as its sender";
}

TEST(FrozenCheck, FindsAFrozenPictureHoweverSlowlyTheStateMoves) {
  constexpr std::int64_t kMillisecond = 1'000'000;
  const std::vector<std::pair<std::int64_t, std::int64_t>> cases{{50, 40},    {50, 50},     {50, 60},     {200, 250},
                                                                 {1000, 900}, {1000, 1000}, {1000, 1100}, {3000, 2500}};
  for (const auto& [after, period] : cases) {  // [ms]
    vision::FrozenCheck check(after * kMillisecond);
    check.pictureChanged();
    for (int i = 0; i < 2; ++i) check.stateMoved(i * period * kMillisecond);
    EXPECT_FALSE(check.frozen(period * kMillisecond)) << after << ' ' << period << ": may be a short pause";
    for (int i = 2; i < 60; ++i) check.stateMoved(i * period * kMillisecond);
    for (std::int64_t at = 59 * period; at < 60 * period; at += 5) {
      EXPECT_TRUE(check.frozen(at * kMillisecond)) << after << ' ' << period << " at " << at;
    }
  }
}

TEST(FrozenCheck, AMovementThatHasJustBegunIsNotInThePictureYet) {
  vision::FrozenCheck check(10 * kTenth);
  check.pictureChanged();
  moveState(check, 1, 1);  // the last frame before a pause
  EXPECT_FALSE(check.frozen(12 * kTenth)) << "it has not moved since";
  for (std::int64_t resumed = 50; resumed < 250; resumed += 50) {  // or an aircraft that is placed
    moveState(check, resumed, resumed + 2);
    EXPECT_FALSE(check.frozen((resumed + 3) * kTenth)) << "after " << resumed;
  }
  check.pictureChanged();
  moveState(check, 299, 299);
  moveState(check, 314, 316);
  EXPECT_FALSE(check.frozen(316 * kTenth)) << "after a pause of 1.5 s";
  moveState(check, 317, 325);
  EXPECT_TRUE(check.frozen(325 * kTenth)) << "it lasts, and the picture still stands";
}
