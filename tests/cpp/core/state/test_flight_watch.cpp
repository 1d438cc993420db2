#include "xplane_bridge/core/state/flight_watch.hpp"

#include <gtest/gtest.h>

#include <cstring>

namespace xplane_bridge::core {
namespace {

std::vector<std::uint8_t> pairs(std::initializer_list<std::pair<std::int32_t, float>> values) {
  std::vector<std::uint8_t> out;
  for (const auto& [index, value] : values) {
    out.resize(out.size() + 8);
    std::memcpy(&out[out.size() - 8], &index, 4);
    std::memcpy(&out[out.size() - 4], &value, 4);
  }
  return out;
}

TEST(FlightWatch, TakesWhatADatagramCarriesInSiUnits) {
  const auto& names = flightWatchDatarefs();
  ASSERT_EQ(names.size(), 20u);
  EXPECT_EQ(names[3], "sim/flightmodel/position/indicated_airspeed");
  EXPECT_EQ(names[8], "sim/time/total_flight_time_sec");
  EXPECT_EQ(names[13], "sim/flightmodel/position/Prad");
  EXPECT_EQ(names[16], "sim/flightmodel/position/true_airspeed");
  EXPECT_EQ(names[17], "sim/flightmodel2/misc/has_crashed");
  EXPECT_EQ(names[18], "sim/flightmodel/failures/onground_any");
  EXPECT_EQ(names[19], "sim/time/is_in_replay");
  FlightWatch watch;
  const auto bytes = pairs(
      {{0, 100.5f}, {3, 100.0f}, {4, -30.0f}, {15, 0.5f}, {16, 55.0f}, {17, 1.0f}, {19, 1.0f}, {-1, 5.0f}, {77, 5.0f}});
  updateFlightWatch(RrefView(bytes.data(), 9), &watch);
  EXPECT_DOUBLE_EQ(watch.sim_time, 100.5);
  EXPECT_NEAR(watch.indicated_airspeed, 51.4444, 1e-4);  // 100 kt
  EXPECT_DOUBLE_EQ(watch.roll_deg, -30.0);
  EXPECT_NEAR(watch.yaw_rate_deg_s, 28.6479, 1e-4);  // half a radian a second
  EXPECT_DOUBLE_EQ(watch.true_airspeed, 55.0);
  EXPECT_TRUE(watch.crashed);
  EXPECT_TRUE(watch.replay);
  EXPECT_FALSE(watch.on_ground);
  EXPECT_TRUE(std::isnan(watch.pitch_deg)) << "not carried yet";
  const auto more = pairs({{5, 4.0f}, {17, 0.0f}, {18, 1.0f}});
  updateFlightWatch(RrefView(more.data(), 3), &watch);
  EXPECT_DOUBLE_EQ(watch.pitch_deg, 4.0);
  EXPECT_DOUBLE_EQ(watch.sim_time, 100.5) << "stays";
  EXPECT_FALSE(watch.crashed);
  EXPECT_TRUE(watch.on_ground);
}

}  // namespace
}  // namespace xplane_bridge::core
