#include "xplane_bridge/core/simulator/world_settings.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

namespace xplane_bridge::core {
namespace {

const SimulatorVersion k1200{120000}, k1208{120800};

std::map<std::string, float> asMap(const std::vector<SettingWrite>& settings) {
  std::map<std::string, float> out;
  for (const SettingWrite& each : settings) out[each.write.dataref] = each.write.value;
  EXPECT_EQ(out.size(), settings.size()) << "each once";
  return out;
}

Weather someWeather() {
  Weather weather;
  weather.wind = {{300.0, 270.0, 10.0, 2.0, 0.3}, {3000.0, 300.0, 25.0, 0.0, 0.0}};
  weather.clouds = {{1000.0, 1800.0, 0.5, 2}};
  weather.visibility = 8046.72;  // five statute miles
  weather.precipitation = 0.25;
  weather.sea_level_temperature = -5.0;
  weather.sea_level_pressure = 99898.4755;  // 29.5 inHg
  return weather;
}

TEST(Weather, OfXPlane11IsInItsUnits) {
  const auto writes = asMap(weatherWrites(someWeather(), kXPlane11));
  ASSERT_EQ(writes.size(), 1U + 5U * 3U + 4U * 3U + 4U);
  EXPECT_EQ(writes.at("sim/weather/use_real_weather_bool"), 0.0F);
  EXPECT_EQ(writes.at("sim/weather/wind_altitude_msl_m[0]"), 300.0F);
  EXPECT_EQ(writes.at("sim/weather/wind_direction_degt[1]"), 300.0F);
  EXPECT_NEAR(writes.at("sim/weather/wind_speed_kt[0]"), 19.4384F, 1e-3F);  // 10 m/s
  EXPECT_NEAR(writes.at("sim/weather/shear_speed_kt[0]"), 3.8877F, 1e-3F);  // 2 m/s
  EXPECT_NEAR(writes.at("sim/weather/turbulence[0]"), 3.0F, 1e-6F);
  EXPECT_EQ(writes.at("sim/weather/wind_altitude_msl_m[2]"), 4000.0F) << "the highest layer blows on above";
  EXPECT_EQ(writes.at("sim/weather/wind_direction_degt[2]"), 300.0F);
  EXPECT_EQ(writes.at("sim/weather/cloud_coverage[0]"), 3.0F);  // half of 6
  EXPECT_EQ(writes.at("sim/weather/cloud_tops_msl_m[0]"), 1800.0F);
  EXPECT_EQ(writes.at("sim/weather/cloud_type[0]"), 2.0F);
  EXPECT_EQ(writes.at("sim/weather/cloud_coverage[1]"), 0.0F) << "what is not given is clear";
  EXPECT_NEAR(writes.at("sim/weather/visibility_reported_m"), 8046.72F, 0.01F);
  EXPECT_EQ(writes.at("sim/weather/rain_percent"), 0.25F);
  EXPECT_EQ(writes.at("sim/weather/temperature_sealevel_c"), -5.0F);
  EXPECT_NEAR(writes.at("sim/weather/barometer_sealevel_inhg"), 29.5F, 1e-4F);
}

TEST(Weather, FromXPlane1208OnIsOfRegions) {
  const auto writes = asMap(weatherWrites(someWeather(), k1208));
  ASSERT_EQ(writes.size(), 3U + 5U * 13U + 4U * 3U + 4U);
  const std::string at = "sim/weather/region/";
  EXPECT_EQ(writes.at(at + "change_mode"), 3.0F);
  EXPECT_EQ(writes.at(at + "wind_speed_msc[0]"), 10.0F);
  EXPECT_EQ(writes.at(at + "wind_speed_msc[12]"), 25.0F);
  EXPECT_EQ(writes.at(at + "wind_altitude_msl_m[12]"), 14000.0F);
  EXPECT_EQ(writes.at(at + "cloud_coverage_percent[0]"), 0.5F);
  EXPECT_NEAR(writes.at(at + "visibility_reported_sm"), 5.0F, 1e-5F);
  EXPECT_NEAR(writes.at(at + "sealevel_pressure_pas"), 99898.48F, 0.01F);
  EXPECT_EQ(writes.at(at + "sealevel_temperature_c"), -5.0F);
}

TEST(Weather, BetweenGoesToTheOldNames) {
  auto of11 = asMap(weatherWrites(someWeather(), kXPlane11));
  EXPECT_EQ(of11.erase("sim/weather/use_real_weather_bool"), 1U) << "version 12.00 can only read it";
  EXPECT_EQ(asMap(weatherWrites(someWeather(), k1200)), of11);
}

TEST(Weather, OnlyWhatIsGivenIsSent) {
  Weather calm;
  calm.sea_level_temperature = 20.0;
  EXPECT_EQ(weatherWrites(calm, kXPlane11).size(), 2U);
  Weather clear;
  EXPECT_FALSE(cloudCommand(clear, SimulatorVersion{121000})) << "no clouds are asked for";
  clear.clouds.emplace();
  EXPECT_EQ(cloudCommand(clear, SimulatorVersion{121000}).value_or(""), "sim/operation/regen_weather");
  EXPECT_FALSE(cloudCommand(clear, kXPlane11)) << "they follow at once";
  const auto writes = asMap(weatherWrites(clear, k1208));
  for (const char* layer : {"[0]", "[1]", "[2]"}) {
    EXPECT_EQ(writes.at(std::string("sim/weather/region/cloud_coverage_percent") + layer), 0.0F);
  }
}

TEST(Weather, RefusesWhatCannotBe) {
  EXPECT_FALSE(check(someWeather()));
  EXPECT_NE(check(Weather{})->find("nothing is given"), std::string::npos);
  Weather wrong = someWeather();
  (*wrong.wind)[1].altitude = 200.0;
  EXPECT_EQ(*check(wrong), "wind layer 1: altitude is 200: expected above the layer before it, 300 [m]");
  wrong = someWeather();
  (*wrong.clouds)[0].top = 500.0;
  EXPECT_EQ(*check(wrong), "cloud layer 0: top is 500: expected 1000..30000 [m, not below its base]");
  wrong = someWeather();
  wrong.visibility = std::nan("");
  EXPECT_EQ(*check(wrong), "visibility is nan: expected 10..200000 [m]");
  wrong = someWeather();
  wrong.sea_level_pressure = 1013.0;  // hPa
  EXPECT_EQ(*check(wrong), "sea_level_pressure is 1013: expected 85000..110000 [Pa]");
  wrong = someWeather();
  wrong.wind->clear();
  EXPECT_NE(check(wrong)->find("wind_layer_altitude is empty"), std::string::npos);
}

TEST(Weather, OfAnotherVersionIsRefusedInWords) {
  Weather weather;
  weather.wind.emplace();
  for (int i = 0; i < 4; ++i) weather.wind->push_back({1000.0 * i, 0.0, 5.0, 0.0, 0.0});
  EXPECT_EQ(*refusalBy(kXPlane11, weather), "X-Plane before 12.08 has 3 layers of wind: 4 are given");
  EXPECT_FALSE(refusalBy(k1208, weather));
  weather.clouds = {{1000.0, 2000.0, 1.0, 5}};
  EXPECT_EQ(*refusalBy(k1208, weather), "cloud type 5 is none of X-Plane from 12.08 on: expected 0 to 3");
  weather.wind.reset();
  EXPECT_FALSE(refusalBy(kXPlane11, weather));
}

TEST(TimeSetting, GoesWhereEveryVersionHasIt) {
  TimeSetting time;
  time.zulu_time = 43200.0;
  time.date_days = 20;
  time.time_ratio = 4;
  const auto writes = asMap(timeWrites(time));
  EXPECT_EQ(writes, (std::map<std::string, float>{{"sim/time/use_system_time", 0.0F},
                                                  {"sim/time/local_date_days", 20.0F},
                                                  {"sim/time/zulu_time_sec", 43200.0F},
                                                  {"sim/time/sim_speed", 4.0F}}));
  EXPECT_EQ(shownDatarefs(timeWrites(time)).size(), 3U) << "whether the system's time rules is not read back";
  TimeSetting ratio;
  ratio.time_ratio = 2;
  EXPECT_EQ(timeWrites(ratio).size(), 1U);
}

TEST(TimeSetting, IsShownAlsoOverMidnight) {
  TimeSetting time;
  time.zulu_time = 86399.0;
  EXPECT_EQ(differenceOf(timeWrites(time), {86399.5F}), "");
  EXPECT_EQ(differenceOf(timeWrites(time), {4.0F}), "") << "five seconds later";
  EXPECT_EQ(differenceOf(timeWrites(time), {43200.0F}), "sim/time/zulu_time_sec is 43200, not 86399");
  EXPECT_EQ(differenceOf(timeWrites(time), {std::nullopt}), "sim/time/zulu_time_sec does not answer");
}

TEST(TimeSetting, RefusesWhatCannotBe) {
  EXPECT_NE(check(TimeSetting{})->find("nothing is given"), std::string::npos);
  TimeSetting time;
  time.zulu_time = 90000.0;
  EXPECT_EQ(*check(time), "zulu_time is 90000: expected 0..86400 [s since midnight UTC]");
  time.zulu_time = 60.0;
  time.date_days = 366;
  EXPECT_EQ(*check(time), "date_days is 366: expected 0..365 [d since 1 January]");
  time.date_days.reset();
  time.time_ratio = 0;
  EXPECT_EQ(*check(time), "time_ratio is 0: expected 1..16 [-, a whole number; the service `pause` stops time]");
}

}  // namespace
}  // namespace xplane_bridge::core
