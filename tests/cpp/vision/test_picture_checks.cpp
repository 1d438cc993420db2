#include "xplane_bridge/vision/picture_checks.hpp"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

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

TEST(FrozenCheck, NeedsAStandingPictureAndAMovingState) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  vision::FrozenCheck check(kSecond);
  EXPECT_FALSE(check.frozen(10 * kSecond));  // no picture yet
  check.pictureChanged(10 * kSecond);
  EXPECT_FALSE(check.frozen(12 * kSecond));  // nothing moves: the picture may stand
  check.stateMoved(12 * kSecond);
  EXPECT_TRUE(check.frozen(12 * kSecond + 1));
  check.pictureChanged(12 * kSecond + 2);
  EXPECT_FALSE(check.frozen(12 * kSecond + 3));
  check.stateMoved(12 * kSecond + 4);
  EXPECT_FALSE(check.frozen(12 * kSecond + 5));  // not standing long enough
  EXPECT_FALSE(check.frozen(14 * kSecond));      // and the state stopped
  check.stateMoved(14 * kSecond);
  EXPECT_TRUE(check.frozen(14 * kSecond));
  check.interrupt();  // no subscriber
  EXPECT_FALSE(check.frozen(14 * kSecond));
}
