#include "xplane_bridge/core/camera/camera_view.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace core = xplane_bridge::core;
using core::CameraView;

namespace {

void expectAxis(CameraView view, const Eigen::Vector3d& optical, const Eigen::Vector3d& flu) {
  const Eigen::Vector3d got = core::opticalOrientation(view) * optical;
  EXPECT_NEAR((got - flu).norm(), 0.0, 1e-12) << core::toString(view) << ": " << got.transpose();
}

// RREF pairs as on the wire: index, value, both little-endian 32 bits.
std::vector<std::uint8_t> pairs(const std::vector<float>& values) {
  std::vector<std::uint8_t> bytes(values.size() * 8);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto index = static_cast<std::int32_t>(i);
    std::memcpy(bytes.data() + 8 * i, &index, 4);
    std::memcpy(bytes.data() + 8 * i + 4, &values[i], 4);
  }
  return bytes;
}

}  // namespace

TEST(ClassifyView, KnowsTheThreeViewsAndSaysWhenItIsNone) {
  EXPECT_EQ(core::classifyView(0.0, 0.0, 5.0), CameraView::kForward);
  EXPECT_EQ(core::classifyView(359.0, -3.0, 5.0), CameraView::kForward);
  EXPECT_EQ(core::classifyView(-360.0, 0.0, 5.0), CameraView::kForward);
  EXPECT_EQ(core::classifyView(180.0, 0.0, 5.0), CameraView::kRear);
  EXPECT_EQ(core::classifyView(-178.0, 2.0, 5.0), CameraView::kRear);
  EXPECT_EQ(core::classifyView(0.0, -90.0, 5.0), CameraView::kDown);
  EXPECT_EQ(core::classifyView(2.0, -87.0, 5.0), CameraView::kDown);
  EXPECT_EQ(core::classifyView(90.0, 0.0, 5.0), CameraView::kUnknown);
  EXPECT_EQ(core::classifyView(0.0, -30.0, 5.0), CameraView::kUnknown);
  EXPECT_EQ(core::classifyView(0.0, 90.0, 5.0), CameraView::kUnknown);
  // Straight down, but turned: the top of the picture is not ahead.
  EXPECT_EQ(core::classifyView(90.0, -90.0, 5.0), CameraView::kUnknown);
  EXPECT_EQ(core::classifyView(std::nan(""), 0.0, 5.0), CameraView::kUnknown);
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

TEST(ViewStream, FitsOneDatagramAndDecodesByName) {
  core::ViewStream stream;
  const core::RrefGroup group = stream.group();
  ASSERT_EQ(group.datarefs.size(), 9U);
  EXPECT_EQ(stream.fieldOfViewDataref(), "sim/graphics/view/field_of_view_deg");
  std::vector<float> values;
  for (const std::string& path : group.datarefs) {
    float value = -1.0F;
    if (path == "sim/time/total_running_time_sec") value = 123.5F;
    if (path == "sim/operation/misc/frame_rate_period") value = 0.02F;
    if (path == "sim/time/sim_speed") value = 2.0F;
    if (path == "sim/time/paused") value = 1.0F;
    if (path == "sim/time/is_in_replay") value = 0.0F;
    if (path == "sim/graphics/view/view_is_external") value = 0.0F;
    if (path == "sim/graphics/view/pilots_head_psi") value = 180.0F;
    if (path == "sim/graphics/view/pilots_head_the") value = 3.0F;
    if (path == "sim/graphics/view/field_of_view_deg") value = 60.0F;
    EXPECT_NE(value, -1.0F) << path;
    values.push_back(value);
  }
  const std::vector<std::uint8_t> bytes = pairs(values);
  ASSERT_TRUE(stream.add(core::RrefView(bytes.data(), values.size()), 42));
  EXPECT_EQ(stream.status().sim_time, 123.5F);
  EXPECT_TRUE(stream.status().paused);
  EXPECT_FALSE(stream.status().replay);
  EXPECT_EQ(stream.status().view_heading_deg, 180.0F);
  EXPECT_EQ(stream.status().view_pitch_deg, 3.0F);
  EXPECT_EQ(stream.status().field_of_view_deg, 60.0F);
  EXPECT_FLOAT_EQ(stream.simulatedFramePeriod(), 0.04F);  // two simulated seconds a second
  EXPECT_EQ(stream.receiveTime(), 42);
}

TEST(ViewStream, WhatXPlaneDoesNotAnswerIsNaN) {
  core::ViewStream stream;
  const std::size_t count = stream.group().datarefs.size();
  const std::vector<std::uint8_t> bytes = pairs(std::vector<float>(count - 1, 1.0F));  // the last one never comes
  bool complete = false;
  for (int frame = 0; frame < 10; ++frame) {
    complete = stream.add(core::RrefView(bytes.data(), count - 1), frame * 16'000'000LL) || complete;
  }
  EXPECT_TRUE(complete);
  EXPECT_TRUE(std::isnan(stream.status().field_of_view_deg));
}
