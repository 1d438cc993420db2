#include "xplane_bridge/vision/picture_scaler.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <stdexcept>

namespace vision = xplane_bridge::vision;
using vision::FitMode;
using vision::Intrinsics;
using vision::PictureScaler;

namespace {

// A dark picture with one bright square of 2 * half pixels around (x, y), in pixel-edge coordinates.
cv::Mat spotAt(cv::Size size, double x, double y, int half) {
  cv::Mat picture(size, CV_8UC4, cv::Scalar::all(0));
  picture(cv::Rect(static_cast<int>(x) - half, static_cast<int>(y) - half, 2 * half, 2 * half)).setTo(255);
  return picture;
}

// Centre of brightness; pixel centres at integers.
cv::Point2d brightest(const cv::Mat& bgr) {
  double x = 0.0;
  double y = 0.0;
  double sum = 0.0;
  for (int v = 0; v < bgr.rows; ++v) {
    for (int u = 0; u < bgr.cols; ++u) {
      const double weight = bgr.at<cv::Vec3b>(v, u)[1];
      x += weight * u;
      y += weight * v;
      sum += weight;
    }
  }
  return {x / sum, y / sum};
}

}  // namespace

TEST(PictureScaler, SixtyDegreesAt640x480) {
  // fx = 320 / tan(30 deg) = 554.256; the middle of 640 pixels lies between pixels 319 and 320.
  const Intrinsics camera = PictureScaler(640, 480, FitMode::kCrop).intrinsics({640, 480}, {60.0});
  EXPECT_NEAR(camera.fx, 554.256, 5e-4);
  EXPECT_NEAR(camera.fy, 554.256, 5e-4);
  EXPECT_DOUBLE_EQ(camera.cx, 319.5);
  EXPECT_DOUBLE_EQ(camera.cy, 239.5);
  EXPECT_NEAR(camera.horizontal_fov_deg, 60.0, 1e-9);
}

TEST(PictureScaler, CropOfAWideWindowNarrowsTheView) {
  // 1920x1080 at 60 deg: f = 960 / tan 30 = 1662.769; the crop is 1440x1080, scaled by 480/1080.
  const Intrinsics camera = PictureScaler(640, 480, FitMode::kCrop).intrinsics({1920, 1080}, {60.0});
  EXPECT_NEAR(camera.fx, 1662.7688 * 480.0 / 1080.0, 1e-3);
  EXPECT_NEAR(camera.fy, camera.fx, 1e-9);
  EXPECT_NEAR(camera.horizontal_fov_deg, 2.0 * std::atan(720.0 / 1662.7688) * 180.0 / M_PI, 1e-5);
  EXPECT_NEAR(camera.cx, 319.5, 1e-9);
}

TEST(PictureScaler, LetterboxKeepsTheWholeView) {
  const PictureScaler scaler(640, 480, FitMode::kLetterbox);
  const Intrinsics camera = scaler.intrinsics({1920, 1080}, {60.0});
  EXPECT_NEAR(camera.fx, 554.256, 5e-4);
  EXPECT_NEAR(camera.fy, camera.fx, 1e-9);
  EXPECT_NEAR(camera.cy, 239.5, 1e-9);
  EXPECT_EQ(scaler.shows({1920, 1080}), cv::Rect(0, 60, 640, 360));
  EXPECT_EQ(scaler.shows({480, 960}), cv::Rect(200, 0, 240, 480));
  EXPECT_EQ(PictureScaler(640, 480, FitMode::kCrop).shows({1920, 1080}), cv::Rect(0, 0, 640, 480));
}

TEST(PictureScaler, StretchShowsInTheFocalLengths) {
  const Intrinsics camera = PictureScaler(640, 480, FitMode::kStretch).intrinsics({1920, 1080}, {60.0});
  EXPECT_NEAR(camera.fx, 554.256, 5e-4);
  EXPECT_NEAR(camera.fy, 1662.7688 * 480.0 / 1080.0, 1e-3);
}

TEST(PictureScaler, NonProportionalAndShiftedFrustum) {
  // 90 deg across, 2 atan(0.65) upwards; the middle a quarter of the width left and a tenth of the height above the
  // line of sight: the principal point lies right of the middle and below it.
  const double upwards = 2.0 * std::atan(0.65) * 180.0 / M_PI;
  const xplane_bridge::vision::FieldOfView shown{90.0, upwards, -0.25, 0.1};
  const Intrinsics camera = PictureScaler(320, 240, FitMode::kCrop).intrinsics({640, 480}, shown);
  EXPECT_NEAR(camera.fx, 160.0, 1e-9);
  EXPECT_NEAR(camera.fy, 120.0 / 0.65, 1e-9);
  EXPECT_NEAR(camera.cx, 239.5, 1e-9);
  EXPECT_NEAR(camera.cy, 143.5, 1e-9);
}

TEST(PictureScaler, PixelsAreWhereTheIntrinsicsSayTheyAre) {
  // A point of the source at pixel-edge coordinates (x, y) lies on the ray ((x - w/2) / f, (y - h/2) / f) and must come
  // out where the output's camera projects that ray to.
  for (const FitMode mode : {FitMode::kCrop, FitMode::kLetterbox, FitMode::kStretch}) {
    for (const cv::Size source : {cv::Size(1920, 1080), cv::Size(800, 900), cv::Size(320, 240), cv::Size(641, 479)}) {
      PictureScaler scaler(640, 480, mode);
      const Intrinsics camera = scaler.intrinsics(source, {70.0});
      const double f = 0.5 * source.width / std::tan(35.0 * M_PI / 180.0);
      const double x = std::floor(0.61 * source.width);
      const double y = std::floor(0.38 * source.height);
      cv::Mat output;
      scaler.scale(spotAt(source, x, y, 12), output);
      ASSERT_EQ(output.size(), cv::Size(640, 480));
      ASSERT_EQ(output.type(), CV_8UC3);
      const cv::Point2d found = brightest(output);
      EXPECT_NEAR(found.x, camera.fx * (x - 0.5 * source.width) / f + camera.cx, 0.1) << source;
      EXPECT_NEAR(found.y, camera.fy * (y - 0.5 * source.height) / f + camera.cy, 0.1) << source;
    }
  }
}

TEST(PictureScaler, LetterboxBordersAreBlackAlsoAfterAnotherPicture) {
  PictureScaler scaler(640, 480, FitMode::kLetterbox);
  cv::Mat output;
  scaler.scale(cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(200)), output);
  scaler.scale(cv::Mat(1080, 1920, CV_8UC3, cv::Scalar::all(200)), output);
  EXPECT_EQ(output.at<cv::Vec3b>(10, 300), cv::Vec3b(0, 0, 0));
  EXPECT_EQ(output.at<cv::Vec3b>(240, 300), cv::Vec3b(200, 200, 200));
  EXPECT_EQ(output.at<cv::Vec3b>(470, 300), cv::Vec3b(0, 0, 0));
}

TEST(PictureScaler, RefusesWhatItCannotDo) {
  EXPECT_THROW(PictureScaler(15, 480, FitMode::kCrop), std::invalid_argument);
  EXPECT_THROW(PictureScaler(640, 9000, FitMode::kCrop), std::invalid_argument);
  EXPECT_THROW((void)vision::fitModeFromName("zoom"), std::invalid_argument);
  const PictureScaler scaler(640, 480, FitMode::kCrop);
  EXPECT_THROW((void)scaler.intrinsics({640, 480}, {180.0}), std::invalid_argument);
  EXPECT_THROW((void)scaler.intrinsics({640, 480}, {std::nan("")}), std::invalid_argument);
  EXPECT_THROW((void)scaler.intrinsics({0, 480}, {60.0}), std::invalid_argument);
}
