#include "xplane_bridge/vision/pixel_format.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <opencv2/core.hpp>
#include <stdexcept>
#include <vector>

namespace vision = xplane_bridge::vision;
using vision::PixelFormat;

namespace {

// One pixel written at (1, 1) of a 3x2 picture; the colour wanted is blue 0x40, green 0x80, red 0xf8.
cv::Vec3b convertOne(const PixelFormat& format, std::uint32_t pixel) {
  const std::size_t stride = vision::rowBytes(format, 3);
  std::vector<std::uint8_t> data(2 * stride, 0);
  const auto bytes = static_cast<std::size_t>(format.bits_per_pixel / 8);
  std::memcpy(data.data() + stride + bytes, &pixel, bytes);
  cv::Mat scratch;
  const cv::Mat picture = vision::toBgr(format, data.data(), 3, 2, scratch);
  EXPECT_EQ(picture.size(), cv::Size(3, 2));
  const std::uint8_t* at = picture.ptr<std::uint8_t>(1) + picture.channels();
  return {at[0], at[1], at[2]};
}

}  // namespace

TEST(PixelFormat, ConvertsEveryTrueColourLayout) {
  const cv::Vec3b wanted(0x40, 0x80, 0xf8);
  EXPECT_EQ(convertOne({24, 32, 32, false, 0xff0000, 0xff00, 0xff}, 0x00f88040), wanted);
  EXPECT_EQ(convertOne({32, 32, 32, false, 0xff0000, 0xff00, 0xff}, 0xfff88040), wanted);
  EXPECT_EQ(convertOne({24, 32, 32, false, 0xff, 0xff00, 0xff0000}, 0x004080f8), wanted);
  EXPECT_EQ(convertOne({24, 24, 32, false, 0xff0000, 0xff00, 0xff}, 0x00f88040), wanted);
  // 10 bits each: 0xf8 << 2 | 3, 0x80 << 2, 0x40 << 2
  EXPECT_EQ(convertOne({30, 32, 32, false, 0x3ff00000, 0xffc00, 0x3ff}, (0x3e3U << 20U) | (0x200U << 10U) | 0x100U),
            wanted);
  // 5, 6, 5 bits: 31, 32, 8; and 5, 5, 5: 31, 16, 8
  EXPECT_EQ(convertOne({16, 16, 32, false, 0xf800, 0x7e0, 0x1f}, (31U << 11U) | (32U << 5U) | 8U), wanted);
  EXPECT_EQ(convertOne({15, 16, 32, false, 0x7c00, 0x3e0, 0x1f}, (31U << 10U) | (16U << 5U) | 8U), wanted);
}

TEST(PixelFormat, RowsArePadded) {
  EXPECT_EQ(vision::rowBytes({16, 16, 32, false, 0, 0, 0}, 3), 8U);
  EXPECT_EQ(vision::rowBytes({24, 24, 32, false, 0, 0, 0}, 3), 12U);
  EXPECT_EQ(vision::rowBytes({24, 32, 32, false, 0, 0, 0}, 3), 12U);
}

TEST(PixelFormat, RefusesTheRestInWords) {
  const PixelFormat palette{8, 8, 32, false, 0, 0, 0};
  EXPECT_NE(vision::unsupportedReason(palette).find("depth 8"), std::string::npos);
  std::vector<std::uint8_t> data(64);
  cv::Mat scratch;
  EXPECT_THROW((void)vision::toBgr(palette, data.data(), 2, 2, scratch), std::invalid_argument);
  EXPECT_NE(vision::unsupportedReason({24, 32, 32, true, 0xff0000, 0xff00, 0xff}), "");
  EXPECT_EQ(vision::unsupportedReason({24, 32, 32, false, 0xff0000, 0xff00, 0xff}), "");
}
