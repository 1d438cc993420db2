#include <limits>

#include "fixture.hpp"

namespace xplane_bridge {
namespace {

TEST_F(FlightChangesTest, WindIsWrittenUntilTheAirShowsIt) {
  const auto shown = core::shownWindDatarefs(core::kXPlane11);
  after(1.5, [&] {
    sim_.set(shown[0], 12.0F);
    sim_.set(shown[1], 250.0F);
  });
  expect(changes_.applyWind({12.0, 250.0, 0.0}), EventKind::kSetting, "the wind blows as asked for");
  const std::size_t once = core::windWrites({12.0, 250.0, 0.0}, core::kXPlane11).size();
  EXPECT_EQ(sim_.writes().size(), 2 * once) << "again after a second";
}

TEST_F(FlightChangesTest, WindThatDoesNotBlowIsReported) {
  const auto shown = core::shownWindDatarefs(core::kXPlane11);
  sim_.set(shown[0], 3.0F);
  sim_.set(shown[1], 90.0F);
  flight_.setPaused(true);
  const double begin = sim_.time();
  expectFailure(changes_.applyWind({12.0, 250.0, 0.0}), EventKind::kSetting,
                "set_wind: the air at the aircraft does not show it, but 3.000000 m/s from 90.000000 deg (it is "
                "paused)");
  EXPECT_NEAR(sim_.time() - begin, 2.0, 0.3);
}

// ------------------------------------------------------------------------------------------------ loading

TEST_F(FlightChangesTest, LoadingIsShown) {
  sim_.setAll({"sim/flightmodel/weight/m_fuel[0]", "sim/flightmodel/weight/m_fixed"}, 0.0F);
  sim_.loseMessages(1);
  expect(changes_.applyLoading({{80.0}, 100.0, {}}), EventKind::kSetting, "the aircraft is loaded as asked for");
  EXPECT_EQ(sim_.value("sim/flightmodel/weight/m_fuel[0]"), 80.0F);
  EXPECT_EQ(sim_.value("sim/flightmodel/weight/m_fixed"), 100.0F);
}

TEST_F(FlightChangesTest12, PayloadGoesByTheStations) {
  const auto stations = core::stationDatarefs(sim_.status().version);
  sim_.setAll(stations, 0.0F);
  sim_.set(stations[2], 40.0F);
  sim_.set(stations[3], 10.0F);
  sim_.set("sim/flightmodel/weight/m_fixed", 50.0F);
  sim_.setReadOnly("sim/flightmodel/weight/m_fixed");  // it is their sum, whatever is written
  const auto before = sim_.on_frame;
  sim_.on_frame = [this, before, stations] {
    if (before) before();
    float sum = 0.0F;
    for (const std::string& name : stations) sum += sim_.value(name);
    sim_.set("sim/flightmodel/weight/m_fixed", sum);
  };
  expect(changes_.applyLoading({{}, 100.0, {}}), EventKind::kSetting, "the aircraft is loaded as asked for");
  EXPECT_EQ(sim_.value(stations[2]), 80.0F);
  EXPECT_EQ(sim_.value(stations[3]), 20.0F);
}

TEST_F(FlightChangesTest12, PayloadOfAnAircraftWithoutStationsGoesAsASum) {
  sim_.set("sim/flightmodel/weight/m_fixed", 0.0F);
  expect(changes_.applyLoading({{}, 100.0, {}}), EventKind::kSetting, "the aircraft is loaded as asked for");
  // The same where there are stations that do nothing.
  sim_.setAll(core::stationDatarefs(sim_.status().version), 0.0F);
  expect(changes_.applyLoading({{}, 120.0, {}}), EventKind::kSetting, "the aircraft is loaded as asked for");
  EXPECT_EQ(sim_.value("sim/flightmodel/weight/m_fixed"), 120.0F);
}

TEST_F(FlightChangesTest, LoadingThatIsNotTakenIsReported) {
  sim_.set("sim/flightmodel/weight/m_fuel[0]", 5.0F);
  sim_.setReadOnly("sim/flightmodel/weight/m_fuel[0]");
  expectFailure(changes_.applyLoading({{80.0}, 100.0, {}}), EventKind::kSetting,
                "set_loading: sim/flightmodel/weight/m_fuel[0] is 5.000000, not 80.000000, "
                "sim/flightmodel/weight/m_fixed does not answer");
}

// ------------------------------------------------------------------------------------------------ time and weather

TEST_F(FlightChangesTest, TimeIsShown) {
  sim_.setAll({"sim/time/use_system_time", "sim/time/zulu_time_sec"}, 1.0F);
  sim_.loseMessages(2);
  core::TimeSetting time;
  time.zulu_time = 43200.0;
  expect(changes_.applyTime(time), EventKind::kSetting, "it is the time that was asked for");
  EXPECT_EQ(sim_.value("sim/time/use_system_time"), 0.0F);
  EXPECT_EQ(sim_.value("sim/time/zulu_time_sec"), 43200.0F);
}

const std::string kTemperature = "sim/weather/temperature_sealevel_c";
const std::string kRealWeather = "sim/weather/use_real_weather_bool";

/// It is 15 degrees of real weather, and to be 30 until the node ends.
class BorrowedWeatherTest : public FlightChangesTest {
 protected:
  core::Weather warmerUntilTheEnd() {
    sim_.set(kTemperature, 15.0F);
    sim_.set(kRealWeather, 1.0F);
    core::Weather out;
    out.sea_level_temperature = 30.0;
    out.restore_on_exit = true;
    return out;
  }
};

TEST_F(BorrowedWeatherTest, SettingsThatEndWithTheNodeAreInTheJournalAndComeBack) {
  core::Weather weather = warmerUntilTheEnd();
  expect(changes_.applyWeather(weather), EventKind::kSetting, "the weather is set as asked for");
  weather.sea_level_temperature = 35.0;  // what was there before the first of them counts
  expect(changes_.applyWeather(weather), EventKind::kSetting, "the weather is set as asked for");
  EXPECT_EQ(sim_.value(kTemperature), 35.0F);
  ASSERT_EQ(sim_.journal()->entries().size(), 1U);
  EXPECT_EQ(sim_.journal()->entries()[0].undo.size(), 2U);
  changes_.restoreSettings();
  sim_.run(0.1);
  EXPECT_EQ(sim_.value(kTemperature), 15.0F);
  EXPECT_EQ(sim_.value(kRealWeather), 1.0F);
  EXPECT_TRUE(sim_.journal()->entries().empty());
}

TEST_F(BorrowedWeatherTest, SettingsOfTheLastXPlaneAreNotPutIntoAnotherOne) {
  core::Weather weather = warmerUntilTheEnd();
  expect(changes_.applyWeather(weather), EventKind::kSetting, "the weather is set as asked for");
  changes_.forgetSettings();
  EXPECT_TRUE(sim_.journal()->entries().empty());
  sim_.set(kTemperature, -5.0F);
  changes_.restoreSettings();
  sim_.run(0.1);
  EXPECT_EQ(sim_.value(kTemperature), -5.0F) << "its own user's";
}

TEST_F(BorrowedWeatherTest, SettingsThatAnotherHasPutBackAreNotSentAgain) {
  core::Weather weather = warmerUntilTheEnd();
  expect(changes_.applyWeather(weather), EventKind::kSetting, "the weather is set as asked for");
  ASSERT_EQ(sim_.journal()->entries().size(), 1U);
  sim_.journal()->removeUndone(sim_.journal()->entries());  // by the guardian in a hang, or scripts/release_overrides
  sim_.set(kTemperature, -5.0F);                            // the user's own, since
  changes_.restoreSettings();
  sim_.run(0.1);
  EXPECT_EQ(sim_.value(kTemperature), -5.0F);
  // And what is there now counts for the next one.
  expect(changes_.applyWeather(weather), EventKind::kSetting, "the weather is set as asked for");
  changes_.restoreSettings();
  sim_.run(0.1);
  EXPECT_EQ(sim_.value(kTemperature), -5.0F);
}

TEST_F(FlightChangesTest, SettingsStayWithoutRestoreOnExit) {
  const std::string name = "sim/weather/temperature_sealevel_c";
  sim_.set(name, 15.0F);
  core::Weather weather;
  weather.sea_level_temperature = 30.0;
  expect(changes_.applyWeather(weather), EventKind::kSetting, "the weather is set as asked for");
  changes_.restoreSettings();
  sim_.run(0.1);
  EXPECT_EQ(sim_.value(name), 30.0F);
}

TEST_F(FlightChangesTest12, CloudsAreMadeAnewOnceTheyAreShown) {
  const core::CloudLayer layer{1000.0, 1800.0, 0.5, 2};
  core::Weather weather;
  weather.clouds = {layer, layer, layer};
  for (const auto& each : core::weatherWrites(weather, core::kXPlane12)) sim_.set(each.write.dataref, 0.0F);
  expect(changes_.applyWeather(weather), EventKind::kSetting, "the weather is set as asked for");
  EXPECT_EQ(sim_.commands(), Names{"sim/operation/regen_weather"});
  EXPECT_EQ(sim_.value("sim/weather/region/cloud_type[2]"), 2.0F) << "before that";
}

TEST_F(FlightChangesTest12, WhatHasWeatherActAtOnceGoesBackLast) {
  core::Weather warmer, denser;
  warmer.sea_level_temperature = 30.0;
  denser.sea_level_pressure = 100000.0;
  for (core::Weather* weather : {&warmer, &denser}) {
    weather->restore_on_exit = true;
    for (const auto& each : core::weatherWrites(*weather, core::kXPlane12)) sim_.set(each.write.dataref, 0.0F);
  }
  for (const core::Weather& weather : {warmer, denser}) {
    expect(changes_.applyWeather(weather), EventKind::kSetting, "the weather is set as asked for");
  }
  sim_.clearMessages();
  changes_.restoreSettings();
  sim_.run(0.1);
  ASSERT_EQ(sim_.writes().size(), 5U);
  EXPECT_EQ(sim_.writes().back().first, "sim/weather/region/update_immediately");
}

TEST_F(FlightChangesTest, WhatCouldNotBePutBackIsNotChanged) {
  core::Weather weather;
  weather.sea_level_temperature = 30.0;
  weather.restore_on_exit = true;
  expectFailure(changes_.applyWeather(weather), EventKind::kSetting,
                "set_weather: X-Plane does not report sim/weather/temperature_sealevel_c, which could not be put back "
                "on exit");
  EXPECT_TRUE(sim_.writes().empty());
}

TEST_F(FlightChangesTest, StopEndsTheWaitForWhatIsToBePutBack) {
  const std::string name = "sim/weather/temperature_sealevel_c";
  core::Weather weather;
  weather.sea_level_temperature = 30.0;
  weather.restore_on_exit = true;
  FlightChanges changes(&sim_, {300.0, 20.0}, hooks());
  after(0.9, [&] {
    sim_.set(name, 15.0F);  // too late
    changes.stop();
  });
  const double begin = sim_.time();
  expectFailure(changes.applyWeather(weather), EventKind::kSetting, "set_weather: nothing was set");
  EXPECT_LT(sim_.time() - begin, 1.5);
  EXPECT_TRUE(sim_.writes().empty());
  EXPECT_TRUE(sim_.journal()->entries().empty());
}

TEST_F(FlightChangesTest, WhatIsNoNumberCouldNotBePutBack) {
  const std::string name = "sim/weather/temperature_sealevel_c";
  sim_.set("sim/weather/use_real_weather_bool", 1.0F);
  core::Weather weather;
  weather.sea_level_temperature = 30.0;
  weather.restore_on_exit = true;
  for (const float value : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    sim_.set(name, value);
    expectFailure(changes_.applyWeather(weather), EventKind::kSetting,
                  "set_weather: X-Plane does not report " + name + ", which could not be put back on exit");
  }
  EXPECT_TRUE(sim_.writes().empty());
  EXPECT_TRUE(sim_.journal()->entries().empty());
  sim_.set(name, 15.0F);
  expect(changes_.applyWeather(weather), EventKind::kSetting, "the weather is set as asked for");
}

TEST_F(FlightChangesTest, WeatherThatIsNotTakenIsReported) {
  const std::string name = "sim/weather/temperature_sealevel_c";
  sim_.set(name, 15.0F);
  sim_.setReadOnly(name);
  core::Weather weather;
  weather.sea_level_temperature = 30.0;
  expectFailure(changes_.applyWeather(weather), EventKind::kSetting, "set_weather: " + name + " is 15, not 30");
}

TEST_F(FlightChangesTest, WeatherThatXPlaneDoesNotHaveIsRefused) {
  core::Weather weather;
  weather.clouds.emplace(4);
  expectFailure(changes_.applyWeather(weather), EventKind::kSetting,
                "set_weather: X-Plane before 12.08 has 3 layers of clouds: 4 are given");
  EXPECT_TRUE(sim_.writes().empty());
}

// ------------------------------------------------------------------------------------------------ aircraft

}  // namespace
}  // namespace xplane_bridge
