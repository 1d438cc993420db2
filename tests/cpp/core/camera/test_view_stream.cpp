#include "xplane_bridge/core/camera/view_stream.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace core = xplane_bridge::core;

namespace {

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

TEST(ViewStream, FitsOneDatagramAndDecodesByName) {
  core::ViewStream stream;
  const core::RrefGroup group = stream.group();
  EXPECT_LE(group.datarefs.size(), 183U) << "pairs that fit one datagram";
  EXPECT_EQ(std::set<std::string>(group.datarefs.begin(), group.datarefs.end()).size(), group.datarefs.size());
  EXPECT_EQ(stream.fieldOfViewDataref(), "sim/graphics/view/field_of_view_deg");
  const std::map<std::string, float> known{
      {"sim/time/total_running_time_sec", 123.5F},
      {"sim/operation/misc/frame_rate_period", 0.02F},
      {"sim/time/sim_speed", 2.0F},
      {"sim/time/paused", 1.0F},
      {"sim/time/is_in_replay", 0.0F},
      {"sim/graphics/view/view_is_external", 0.0F},
      {"sim/graphics/view/view_type", 1026.0F},
      {"sim/graphics/view/field_of_view_deg", 60.0F},
      {"sim/graphics/view/vertical_field_of_view_deg", 46.0F},
      {"sim/graphics/settings/non_proportional_vertical_FOV", 1.0F},
      {"sim/graphics/view/field_of_view_horizontal_ratio", 0.25F},
      {"sim/graphics/view/window_width", 640.0F},
      {"sim/graphics/view/window_height", 480.0F},
      {"sim/graphics/view/view_roll", 1.0F},
      {"sim/graphics/view/view_pitch", 2.0F},
      {"sim/graphics/view/view_heading", 3.0F},
      {"sim/graphics/view/view_x", 4.0F},
      {"sim/graphics/view/view_y", 5.0F},
      {"sim/graphics/view/view_z", 6.0F},
      {"sim/graphics/view/field_of_view_roll_deg", 7.0F},
      {"sim/graphics/view/field_of_view_vertical_deg", 8.0F},
      {"sim/graphics/view/field_of_view_horizontal_deg", 9.0F},
      {"sim/graphics/view/pilots_head_phi", 10.0F},
      {"sim/graphics/view/pilots_head_the", 11.0F},
      {"sim/graphics/view/pilots_head_psi", 12.0F},
      {"sim/graphics/view/pilots_head_x", 13.0F},
      {"sim/graphics/view/pilots_head_y", 14.0F},
      {"sim/graphics/view/pilots_head_z", 15.0F},
      {"sim/flightmodel/position/phi", 16.0F},
      {"sim/flightmodel/position/theta", 17.0F},
      {"sim/flightmodel/position/psi", 18.0F},
      {"sim/flightmodel/position/local_x", 19.0F},
      {"sim/flightmodel/position/local_y", 20.0F},
      {"sim/flightmodel/position/local_z", 21.0F},
      {"sim/flightmodel/position/true_phi", 22.0F},
      {"sim/flightmodel/position/true_theta", 23.0F},
      {"sim/flightmodel/position/true_psi", 24.0F},
      {"sim/aircraft/view/acf_peX", 25.0F},
      {"sim/aircraft/view/acf_peY", 26.0F},
      {"sim/aircraft/view/acf_peZ", 27.0F},
      {"sim/graphics/view/world_matrix[1]", 28.0F},   // column 0, row 1
      {"sim/graphics/view/world_matrix[12]", 29.0F},  // column 3, row 0
      {"sim/graphics/view/projection_matrix_3d[8]", 30.0F},
  };
  std::vector<float> values;
  std::size_t found = 0;
  for (const std::string& path : group.datarefs) {
    const auto entry = known.find(path);
    if (entry != known.end()) ++found;
    const bool element = path.find("_matrix") != std::string::npos;
    EXPECT_TRUE(entry != known.end() || element) << path;
    values.push_back(entry != known.end() ? entry->second : 0.0F);
  }
  EXPECT_EQ(found, known.size());
  const std::vector<std::uint8_t> bytes = pairs(values);
  ASSERT_TRUE(stream.add(core::RrefView(bytes.data(), values.size()), 42));
  EXPECT_EQ(stream.status().sim_time, 123.5F);
  EXPECT_TRUE(stream.status().paused);
  EXPECT_FALSE(stream.status().replay);
  EXPECT_EQ(stream.status().field_of_view_deg, 60.0F);
  EXPECT_FLOAT_EQ(stream.simulatedFramePeriod(), 0.04F);  // two simulated seconds a second
  EXPECT_EQ(stream.receiveTime(), 42);
  const core::CameraSample& camera = stream.camera();
  EXPECT_EQ(camera.sim_time, 123.5);
  EXPECT_TRUE(camera.paused);
  EXPECT_TRUE(camera.isView(core::ViewType::kCockpit3d));
  EXPECT_FALSE(camera.external);
  EXPECT_EQ(camera.view.heading, 3.0);
  EXPECT_EQ(camera.view_position, Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(camera.visual_offset.pitch, 8.0);
  EXPECT_EQ(camera.head.heading, 12.0);
  EXPECT_EQ(camera.head_position, Eigen::Vector3d(13, 14, 15));
  EXPECT_EQ(camera.aircraft.roll, 16.0);
  EXPECT_EQ(camera.aircraft_position, Eigen::Vector3d(19, 20, 21));
  EXPECT_EQ(camera.aircraft_true.heading, 24.0);
  EXPECT_EQ(camera.eye_position, Eigen::Vector3d(25, 26, 27));
  EXPECT_EQ(camera.world(1, 0), 28.0);
  EXPECT_EQ(camera.world(0, 3), 29.0);
  const core::FrustumSample& frustum = stream.frustum();
  EXPECT_EQ(frustum.horizontal_deg, 60.0);
  EXPECT_EQ(frustum.vertical_deg, 46.0);
  EXPECT_EQ(frustum.non_proportional, 1.0);
  EXPECT_EQ(frustum.shift_right, 0.25);
  EXPECT_EQ(frustum.projection(0, 2), 30.0);
  EXPECT_EQ(frustum.width, 640.0);
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
  EXPECT_TRUE(std::isnan(stream.frustum().projection(3, 3)));
  EXPECT_FALSE(std::isnan(stream.frustum().projection(2, 3)));
}
