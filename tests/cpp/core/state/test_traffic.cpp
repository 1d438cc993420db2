#include "xplane_bridge/core/state/traffic.hpp"

#include <gtest/gtest.h>

#include <map>

#include "datagram.hpp"
#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

constexpr SimulatorVersion kWithTargets{115501};

/// A sample of `values`; all else is 0.
TrafficState stateOf(TrafficAssembler* traffic, const std::map<std::string, float>& values) {
  Datagram d = Datagram::labelled("RREF,");
  for (std::size_t i = 0; i < traffic->requests().size(); ++i) {
    const auto found = values.find(traffic->requests()[i]);
    d.pair(static_cast<std::int32_t>(i), found == values.end() ? 0.0F : found->second);
  }
  EXPECT_TRUE(traffic->add(d.rref(), 1'000'000'000));
  return traffic->state();
}

std::map<std::string, float> scenery(float latitude, float longitude) {
  return {{"sim/time/total_running_time_sec", 12.5F},
          {"sim/flightmodel/position/lat_ref", latitude},
          {"sim/flightmodel/position/lon_ref", longitude}};
}

TEST(Traffic, AsksForWhatAVersionHas) {
  TrafficAssembler traffic({2, 10});
  EXPECT_EQ(traffic.requests().size(), 3U + 2U * 12U) << "unknown version: no targets";
  traffic.configure(kXPlane11);
  EXPECT_EQ(traffic.requests().size(), 3U + 2U * 12U);
  traffic.configure(kWithTargets);
  ASSERT_EQ(traffic.requests().size(), 3U + 2U * 14U);
  EXPECT_EQ(traffic.requests()[3], "sim/multiplayer/position/plane1_x");
  EXPECT_EQ(traffic.requests()[15], "sim/cockpit2/tcas/targets/modeS_id[1]");
  EXPECT_EQ(traffic.requests().back(), "sim/cockpit2/tcas/targets/modeC_code[2]");
}

TEST(Traffic, PlacesAnAircraftAboveTheOriginAndLeavesOutWhatIsNotThere) {
  TrafficAssembler traffic({3, 10});
  traffic.configure(kWithTargets);
  auto values = scenery(37.5F, 126.0F);
  const std::string plane = std::string("sim/multiplayer/position/") + "plane2_";
  values[plane + "y"] = 800.0F;
  values[plane + "psi"] = 350.0F;
  values[plane + "phi"] = -20.0F;
  values[plane + "the"] = 5.0F;
  values[plane + "v_x"] = 3.0F;    // east
  values[plane + "v_y"] = 2.0F;    // up
  values[plane + "v_z"] = -50.0F;  // north
  values["sim/cockpit2/tcas/indicators/relative_distance_mtrs[2]"] = 1234.0F;
  values["sim/cockpit2/tcas/targets/modeS_id[2]"] = 11259375.0F;  // 0xABCDEF, exact in float32
  values["sim/cockpit2/tcas/targets/modeC_code[2]"] = 1200.0F;
  const TrafficState state = stateOf(&traffic, values);
  EXPECT_EQ(state.sim_time, 12.5F);
  ASSERT_EQ(state.aircraft.size(), 1U);
  const OtherAircraft& other = state.aircraft[0];
  EXPECT_EQ(other.number, 2);
  EXPECT_NEAR(other.place.latitude_deg, 37.5, 1e-9);
  EXPECT_NEAR(other.place.longitude_deg, 126.0, 1e-9);
  EXPECT_NEAR(other.place.height, 800.0, 1e-6);
  EXPECT_NEAR(other.roll_deg, -20.0, 1e-4);
  EXPECT_NEAR(other.pitch_deg, 5.0, 1e-4);
  EXPECT_NEAR(other.heading_deg, 350.0, 1e-4);
  EXPECT_TRUE(other.velocity_ned.isApprox(Eigen::Vector3d(50.0, 3.0, -2.0), 1e-9));
  EXPECT_EQ(other.tcas_distance, 1234.0F);
  EXPECT_EQ(other.mode_s_id, 0xABCDEF);
  EXPECT_EQ(other.transponder_code, 1200);
}

// One degree of longitude east of the origin on the equator: the arc is R * pi / 180 = 111319.6 m, the chord's end lies
// R * sin(1 deg) = 111313.96 m east and R * (1 - cos(1 deg)) = 971.43 m below the tangent plane, whose up leans by 1
// deg.
TEST(Traffic, TurnsFromTheSceneryAxesToTheLocalLevel) {
  TrafficAssembler traffic({1, 10});
  auto values = scenery(0.0F, 10.0F);
  const std::string plane = std::string("sim/multiplayer/position/") + "plane1_";
  values[plane + "x"] = 111313.96F;
  values[plane + "y"] = -971.43F;
  values[plane + "psi"] = 0.0F;
  values[plane + "phi"] = 0.0F;
  values[plane + "v_y"] = 10.0F;
  const TrafficState state = stateOf(&traffic, values);
  ASSERT_EQ(state.aircraft.size(), 1U);
  const OtherAircraft& other = state.aircraft[0];
  EXPECT_NEAR(other.place.latitude_deg, 0.0, 1e-9);
  EXPECT_NEAR(other.place.longitude_deg, 11.0, 1e-6);
  EXPECT_NEAR(other.place.height, 0.0, 0.1);
  // Level in the scenery's axes and heading north: seen from the level there, which leans east, it banks left by 1 deg.
  EXPECT_NEAR(other.roll_deg, -1.0, 1e-4);
  EXPECT_NEAR(other.velocity_ned.y(), -10.0 * std::sin(kRadiansPerDegree), 1e-5);
  EXPECT_NEAR(other.velocity_ned.z(), -10.0 * std::cos(kRadiansPerDegree), 1e-5);
  EXPECT_EQ(other.mode_s_id, 0) << "not sent by a version without targets";
}

}  // namespace
}  // namespace xplane_bridge::core
