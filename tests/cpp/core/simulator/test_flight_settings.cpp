#include "xplane_bridge/core/simulator/flight_settings.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

namespace xplane_bridge::core {
namespace {

std::map<std::string, float> asMap(const std::vector<DatarefWrite>& writes) {
  std::map<std::string, float> out;
  for (const DatarefWrite& write : writes) out[write.dataref] = write.value;
  EXPECT_EQ(out.size(), writes.size()) << "each once";
  return out;
}

TEST(UniformWind, GoesToEveryLayerOfXPlane11InKnots) {
  const auto writes = asMap(windWrites({10.0, 270.0, 0.3}, kXPlane11));
  ASSERT_EQ(writes.size(), 13u);
  EXPECT_EQ(writes.at("sim/weather/use_real_weather_bool"), 0.0F);
  for (const char* layer : {"[0]", "[1]", "[2]"}) {
    EXPECT_EQ(writes.at(std::string("sim/weather/wind_direction_degt") + layer), 270.0F);
    EXPECT_NEAR(writes.at(std::string("sim/weather/wind_speed_kt") + layer), 19.4384F, 1e-3F);  // 10 m/s
    EXPECT_EQ(writes.at(std::string("sim/weather/shear_speed_kt") + layer), 0.0F);
    EXPECT_NEAR(writes.at(std::string("sim/weather/turbulence") + layer), 3.0F, 1e-6F);
  }
}

TEST(UniformWind, GoesToEveryLayerOfXPlane12) {
  const auto writes = asMap(windWrites({10.0, 90.0, 1.0}, kXPlane12));
  ASSERT_EQ(writes.size(), 3u + 4u * 13u);
  EXPECT_EQ(writes.at("sim/weather/region/update_immediately"), 1.0F);
  EXPECT_EQ(writes.at("sim/weather/region/change_mode"), 3.0F);
  EXPECT_EQ(writes.at("sim/weather/region/variability_pct"), 0.0F);
  EXPECT_EQ(writes.at("sim/weather/region/wind_speed_msc[12]"), 10.0F);
  EXPECT_EQ(writes.at("sim/weather/region/wind_direction_degt[0]"), 90.0F);
  EXPECT_EQ(writes.at("sim/weather/region/turbulence[5]"), 10.0F);
}

TEST(UniformWind, GoesToTheOldNamesWhereThereAreNoRegionsYet) {
  const UniformWind wind{10.0, 90.0, 1.0};
  auto of11 = asMap(windWrites(wind, kXPlane11));
  EXPECT_EQ(of11.erase("sim/weather/use_real_weather_bool"), 1U) << "version 12.00 can only read it";
  EXPECT_EQ(asMap(windWrites(wind, SimulatorVersion{120000})), of11);
  EXPECT_EQ(asMap(windWrites(wind, SimulatorVersion{120800})), asMap(windWrites(wind, SimulatorVersion{122015})));
  EXPECT_EQ(shownWindDatarefs(SimulatorVersion{120000}), shownWindDatarefs(kXPlane11));
}

TEST(UniformWind, IsShownByTheAirAtTheAircraft) {
  const UniformWind north{10.0, 350.0, 0.0};
  EXPECT_TRUE(matches(north, {10.2F, 351.0F}));
  EXPECT_FALSE(matches(north, {10.0F, 20.0F}));
  EXPECT_FALSE(matches(north, {9.0F, 350.0F}));
  EXPECT_FALSE(matches(north, {10.0F, std::nullopt}));
  EXPECT_TRUE(matches({10.0, 360.0, 0.0}, {10.0F, 0.0F}));
  EXPECT_TRUE(matches({0.0, 90.0, 0.0}, {0.0F, 0.0F})) << "calm has no direction";
  EXPECT_TRUE(matches({10.0, 350.0, 0.2}, {12.0F, 340.0F})) << "gusts";
}

TEST(UniformWind, ImpossibleOnesAreNamed) {
  EXPECT_FALSE(check(UniformWind{10.0, 360.0, 1.0}));
  EXPECT_FALSE(check(UniformWind{0.0, 360.0, 0.0})) << "calm";
  EXPECT_EQ(check(UniformWind{}).value_or("").substr(0, 16), "nothing is given");
  EXPECT_EQ(check(UniformWind{-1.0, 0.0, 0.0}).value_or(""), "speed is -1: expected 0..100 [m/s]");
  EXPECT_EQ(check(UniformWind{1.0, 400.0, 0.0}).value_or(""), "from_deg is 400: expected 0..360 [deg true]");
  EXPECT_EQ(check(UniformWind{1.0, 0.0, std::nan("")}).value_or(""), "turbulence is nan: expected 0..1 [-]");
}

TEST(LoadingTest, WritesOnlyWhatIsGiven) {
  Loading loading;
  EXPECT_TRUE(check(loading)) << "nothing";
  loading.fuel_tank = {50.0, 60.0};
  EXPECT_FALSE(check(loading));
  auto writes = loadingWrites(loading);
  ASSERT_EQ(writes.size(), 2u);
  EXPECT_EQ(writes[1].dataref, "sim/flightmodel/weight/m_fuel[1]");
  EXPECT_EQ(writes[1].value, 60.0F);
  loading.payload_mass = 100.0;
  loading.cg_offset = 0.1;
  writes = loadingWrites(loading);
  ASSERT_EQ(writes.size(), 4u);
  EXPECT_EQ(writes[2].dataref, "sim/flightmodel/weight/m_fixed");
  EXPECT_EQ(writes[3].dataref, "sim/flightmodel/misc/cgz_ref_to_default") << "cg_offset_z has the fuel in it";
}

TEST(LoadingTest, SpreadsThePayloadOverStationsAsItIs) {
  EXPECT_TRUE(stationDatarefs(kXPlane11).empty());
  ASSERT_EQ(stationDatarefs(SimulatorVersion{120000}).size(), 9u);
  EXPECT_EQ(stationDatarefs(kXPlane12)[8], "sim/flightmodel/weight/m_stations[8]");
  Loading loading;
  loading.payload_mass = 200.0;
  loading.cg_offset = 0.1;
  std::vector<DatarefValue> stations(9, 0.0F);
  stations[1] = 30.0F;
  stations[4] = 10.0F;
  auto writes = loadingWrites(loading, stations);
  ASSERT_EQ(writes.size(), 10u);
  EXPECT_EQ(writes[0].value, 0.0F);
  EXPECT_EQ(writes[1].dataref, "sim/flightmodel/weight/m_stations[1]");
  EXPECT_EQ(writes[1].value, 150.0F) << "three quarters";
  EXPECT_EQ(writes[4].value, 50.0F);
  EXPECT_EQ(writes[9].dataref, "sim/flightmodel/misc/cgz_ref_to_default") << "last";
  writes = loadingWrites(loading, std::vector<DatarefValue>(9, 0.0F));
  EXPECT_EQ(writes[0].value, 200.0F) << "on the first one where none is loaded";
  EXPECT_EQ(writes[1].value, 0.0F);
  stations[8].reset();
  writes = loadingWrites(loading, stations);
  ASSERT_EQ(writes.size(), 2u);
  EXPECT_EQ(writes[0].dataref, "sim/flightmodel/weight/m_fixed") << "they are not known";
  const auto shown = loadingShown(loading);
  ASSERT_EQ(shown.size(), 2u);
  EXPECT_EQ(shown[0].dataref, "sim/flightmodel/weight/m_fixed");
  EXPECT_EQ(shown[0].value, 200.0F);
}

TEST(LoadingTest, ImpossibleOnesAreNamed) {
  Loading loading;
  loading.fuel_tank = {10.0, -1.0};
  EXPECT_EQ(check(loading).value_or(""), "fuel_tank[1] is -1: expected 0..1e+06 [kg]");
  loading.fuel_tank.assign(10, 1.0);
  EXPECT_EQ(check(loading).value_or("").substr(0, 24), "fuel_tank has 10 values:");
  loading.fuel_tank.clear();
  loading.payload_mass = std::nan("");
  EXPECT_TRUE(check(loading));
  loading.payload_mass.reset();
  loading.cg_offset = 21.0;
  EXPECT_TRUE(check(loading));
}

TEST(LoadingTest, IsShownWhileEnginesBurn) {
  const DatarefWrite fuel{"sim/flightmodel/weight/m_fuel[0]", 100.0F};
  EXPECT_TRUE(matches(fuel, 99.6));
  EXPECT_FALSE(matches(fuel, 99.0));
  const DatarefWrite cg{"sim/flightmodel/misc/cgz_ref_to_default", 0.05F};
  EXPECT_TRUE(matches(cg, 0.053));
  EXPECT_FALSE(matches(cg, 0.0));
}

TEST(XPlanePath, IsAFileBelowXPlanesFolder) {
  EXPECT_FALSE(checkXPlanePath("Aircraft/Extra/a.acf", ".acf"));
  EXPECT_FALSE(checkXPlanePath("Aircraft/Extra/A.ACF", ".acf"));
  for (const char* wrong : {"", "/Aircraft/a.acf", "C:\\a.acf", "Aircraft/a", ".acf"}) {
    const auto refusal = checkXPlanePath(wrong, ".acf");
    ASSERT_TRUE(refusal) << wrong;
    EXPECT_NE(refusal->find("expected a file relative to X-Plane's folder"), std::string::npos);
  }
  EXPECT_TRUE(checkXPlanePath(std::string(150, 'a') + ".acf", ".acf"));
  EXPECT_FALSE(checkXPlanePath(std::string(145, 'a') + ".acf", ".acf")) << "149 characters";
}

TEST(XPlanePath, IsReadCharacterByCharacter) {
  EXPECT_EQ(aircraftPathDatarefs(20, SimulatorVersion{120000}).size(), 20u);
  EXPECT_EQ(aircraftPathDatarefs(20, kXPlane12)[7], "sim/aircraft/view/acf_relative_path[7]");
  EXPECT_TRUE(aircraftPathDatarefs(20, kXPlane11).empty()) << "version 11 has no such dataref";
  EXPECT_EQ(textFrom({65.0F, 47.0F, 98.0F, 0.0F, 99.0F}), "A/b");
  EXPECT_EQ(textFrom({65.0F, std::nullopt}), "A");
  EXPECT_TRUE(isSamePath("Aircraft\\a\\B.acf", "Aircraft/a/b.acf"));
  EXPECT_FALSE(isSamePath("Aircraft/a/b.acf", "Aircraft/a/c.acf"));
  EXPECT_FALSE(isSamePath("Aircraft/a/b.acf", "Aircraft/a/b.acf2"));
}

}  // namespace
}  // namespace xplane_bridge::core
