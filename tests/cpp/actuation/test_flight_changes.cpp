#include "xplane_bridge/actuation/flight_changes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "fake_flight.hpp"

namespace xplane_bridge {
namespace {

using core::EventKind;
using core::FakeFlight;
using core::LinkState;
using Names = std::vector<std::string>;

constexpr const char* kToggle = "sim/operation/pause_toggle";
const std::string kPosition = "sim/flightmodel/position/";

/// At the origin of FakeFlight's scenery, level, towards the east, with 70 m/s.
core::FlightStart here() {
  core::FlightStart out;
  out.latitude_deg = FakeFlight::kLatitude;
  out.longitude_deg = FakeFlight::kLongitude;
  out.altitude_msl = FakeFlight::kHeight;
  out.heading_true_deg = 90.0;
  out.true_airspeed = 70.0;
  return out;
}

/// Expectations are worked out by hand from the axes of FakeFlight. A placement of which nothing is seen is sent again
/// after 3 s, a setting must be shown within 2 s, a place or a file within 20 s.
class FlightChangesTest : public testing::Test {
 protected:
  explicit FlightChangesTest(core::SimulatorVersion version = core::kXPlane11) : sim_(version) {
    sim_.on_frame = [this] {
      for (auto& [time, event] : events_) {
        if (event && sim_.time() >= time) std::exchange(event, nullptr)();
      }
      flight_.move();
    };
    sim_.run(0.1);
  }

  FlightChangeHooks hooks() {
    FlightChangeHooks out;
    out.watch = [this] { return flight_.watch(); };
    out.resets = [this] { return flight_.resets(); };
    out.identities = [this] { return flight_.identities; };
    out.aircraft = [this] { return flight_.aircraft; };
    out.suspend_control = [this](const std::string& reason) { suspensions_.push_back(reason); };
    out.pausing = [this](const std::string& who) { pausing_ = who; };
    return out;
  }
  void after(double seconds, const std::function<void()>& event) { events_.emplace_back(sim_.time() + seconds, event); }

  void expect(const FlightChangeOutcome& outcome, EventKind kind, const std::string& text) {
    EXPECT_EQ(outcome.kind, kind);
    EXPECT_EQ(outcome.text, text);
    EXPECT_TRUE(outcome.success);
  }
  void expectFailure(const FlightChangeOutcome& outcome, EventKind kind, const std::string& text) {
    EXPECT_EQ(outcome.kind, kind);
    EXPECT_NE(outcome.text.find(text), std::string::npos) << outcome.text;
    EXPECT_FALSE(outcome.success);
  }
  void expectPlaced(const FlightChangeOutcome& outcome) {
    expect(outcome, EventKind::kReset, "the flight goes on at the place, attitude and speed asked for");
    EXPECT_EQ(at("local_x"), 0.0F);
    EXPECT_EQ(at("local_y"), 1000.0F);
    // 90 deg to the right about the axis down: a half turn's sine and cosine of 45 deg.
    EXPECT_NEAR(at("q[0]"), 0.70711, 1e-4);
    EXPECT_NEAR(at("q[3]"), 0.70711, 1e-4);
    EXPECT_NEAR(at("local_vx"), 70.0, 1e-3);
    EXPECT_NEAR(at("local_vz"), 0.0, 1e-3);
    EXPECT_EQ(at("Prad"), 0.0F);
  }
  /// A tenth of a second ago: a beginning now does not show in the flight's time.
  void justBegun() {
    sim_.set("sim/time/total_flight_time_sec", 0.1F);
    sim_.frame();
  }
  float at(const std::string& leaf) const { return sim_.value(kPosition + leaf); }
  FlightChangeOutcome place() { return changes_.place(here(), "node/reset_flight"); }

  core::FakeSimulator sim_;
  FakeFlight flight_{&sim_};
  std::vector<std::pair<double, std::function<void()>>> events_;  // [s] of the fake clock
  std::vector<std::string> suspensions_;
  std::string pausing_;
  FlightChanges changes_{&sim_, {2.0, 20.0}, hooks()};
};

class FlightChangesTest12 : public FlightChangesTest {
 protected:
  FlightChangesTest12() : FlightChangesTest(core::kXPlane12) {}
};

class FlightChangesTestWithoutVehs : public FlightChangesTest {
 protected:
  FlightChangesTestWithoutVehs()
      : FlightChangesTest({core::kXPlane12.number, static_cast<std::uint32_t>(core::Otherwise::kVehs)}) {}
};

// ------------------------------------------------------------------------------------------------ placing, version 11

TEST_F(FlightChangesTest, PlacesByANewFlightWhileItIsPaused) {
  expectPlaced(place());
  EXPECT_EQ(flight_.messages, (Names{kToggle, "PREL", kToggle}));
  EXPECT_FALSE(flight_.paused()) << "as it was";
}

TEST_F(FlightChangesTest, PausedFlightStaysPaused) {
  flight_.setPaused(true);
  sim_.run(0.1);
  expectPlaced(place());
  EXPECT_EQ(flight_.messages, Names{"PREL"});
  EXPECT_TRUE(flight_.paused());
}

TEST_F(FlightChangesTest, ItsPauseIsInTheJournalWhileItLasts) {
  std::size_t while_paused = 0, before_pause = 0;
  const auto entries = [this] { return sim_.journal()->entries(); };
  const auto on_frame = sim_.on_frame;
  sim_.on_frame = [&] {
    on_frame();
    if (flight_.paused() && !entries().empty()) ++while_paused;
    if (flight_.messages.empty()) before_pause += entries().size();
  };
  expectPlaced(place());
  EXPECT_EQ(before_pause, 0U);
  EXPECT_GT(while_paused, 0U);
  EXPECT_TRUE(entries().empty());
}

TEST_F(FlightChangesTest, PauseOfTheUsersIsNotInTheJournal) {
  flight_.setPaused(true);
  sim_.run(0.1);
  std::size_t seen = 0;
  const auto on_frame = sim_.on_frame;
  sim_.on_frame = [&] {
    on_frame();
    seen += sim_.journal()->entries().size();
  };
  expectPlaced(place());
  EXPECT_EQ(seen, 0U);
}

TEST_F(FlightChangesTest, WhatThePauseIsForIsSaid) {
  std::vector<std::string> pausing;
  FlightChangeHooks own = hooks();
  own.pausing = [&pausing](const std::string& who) { pausing.push_back(who); };
  FlightChanges changes(&sim_, {2.0, 20.0}, own);
  changes.place(here(), "node/reset_flight");
  EXPECT_EQ(pausing, (Names{"node/reset_flight", "node/reset_flight", "", "node/reset_flight"}))
      << "the second one was so already";
}

TEST_F(FlightChangesTest, LoadingIsWaitedForAndNothingIsSentMeanwhile) {
  flight_.load_time = 8.0;
  const double begin = sim_.time();
  expectPlaced(place());
  EXPECT_GE(sim_.time() - begin, 8.0);
  EXPECT_EQ(flight_.sent("PREL"), 1U) << "each one begins the flight once more";
  sim_.run(2.0);
  EXPECT_EQ(flight_.beginnings, 1U);
  EXPECT_EQ(at("local_vx"), 70.0F);
}

TEST_F(FlightChangesTest, LostDatagramIsSentOnceMore) {
  flight_.lose_prel = 1;
  const double begin = sim_.time();
  expectPlaced(place());
  EXPECT_EQ(flight_.sent("PREL"), 2U);
  EXPECT_NEAR(sim_.time() - begin, 3.1, 0.3);
}

TEST_F(FlightChangesTest, ThirdOneIsNotSent) {
  flight_.ignores_prel = true;
  const double begin = sim_.time();
  expectFailure(place(), EventKind::kReset, " m away, its altitude is ");
  EXPECT_EQ(flight_.sent("PREL"), 2U);
  EXPECT_NEAR(sim_.time() - begin, 20.1, 0.5);
  EXPECT_FALSE(flight_.paused()) << "it flies on";
}

TEST_F(FlightChangesTest, PlaceNearbyIsNotTakenForTheNewOne) {
  flight_.put(500.0, 1000.0);  // it looks as if it had been placed
  flight_.lose_prel = 1;
  expectPlaced(place());
  EXPECT_EQ(flight_.sent("PREL"), 2U);
  EXPECT_EQ(flight_.beginnings, 1U);
}

TEST_F(FlightChangesTest, PlaceNearbyWithoutANewFlightIsAFailure) {
  flight_.put(500.0, 1000.0);
  flight_.ignores_prel = true;
  expectFailure(place(), EventKind::kReset, "the flight has not begun anew (it is paused)");
}

TEST_F(FlightChangesTest, FlightThatHasOnlyJustBegunIsLeftToRunUntilItsBeginningIsVisible) {
  flight_.put(50.0, 1000.0);  // too near to be seen by its place
  justBegun();
  const double begin = sim_.time();
  expectPlaced(place());
  EXPECT_NEAR(sim_.time() - begin, 0.5, 0.2);
}

TEST_F(FlightChangesTest, PausedFlightThatHasOnlyJustBegunIsBelievedAfterTheTimeOfOneAttempt) {
  flight_.put(50.0, 1000.0);
  flight_.setPaused(true);
  justBegun();
  const double begin = sim_.time();
  expectPlaced(place());
  EXPECT_NEAR(sim_.time() - begin, 3.1, 0.3);
}

TEST_F(FlightChangesTest, SilentXPlaneIsWaitedForBeforeAnythingIsSent) {
  sim_.setState(LinkState::kStale);
  bool silent = true;
  sim_.on_frame = [&] {
    if (sim_.time() > 5004.0) silent = false;
    if (!silent) {
      if (sim_.status().state == LinkState::kStale) sim_.setState(LinkState::kConnected);
      flight_.move();
    } else {
      EXPECT_EQ(flight_.sent("PREL"), 0U);
    }
  };
  place();
  EXPECT_EQ(flight_.sent("PREL"), 1U);
  EXPECT_EQ(at("local_x"), 0.0F);
}

TEST_F(FlightChangesTest, FlightThatBeginsRunningIsPausedForItsMotion) {
  flight_.resumes = true;
  expectPlaced(place());
  EXPECT_EQ(flight_.messages, (Names{kToggle, "PREL", kToggle, kToggle}));
  EXPECT_FALSE(flight_.paused());
}

TEST_F(FlightChangesTest, FlightThatBeginsPausedIsResumed) {
  flight_.pauses = true;
  expectPlaced(place());
  EXPECT_FALSE(flight_.paused());
}

TEST_F(FlightChangesTest, FlightThatBeginsRunningIsPausedAgainWhereItWasPaused) {
  flight_.setPaused(true);
  sim_.run(0.1);
  flight_.resumes = true;
  expectPlaced(place());
  EXPECT_TRUE(flight_.paused());
}

TEST_F(FlightChangesTest, PlaceIsTakenAlsoWhereXPlaneDoesNotPause) {
  flight_.ignores_pause = true;
  expectPlaced(place());
  EXPECT_EQ(pausing_, "") << "it did not come to that";
}

TEST_F(FlightChangesTest, AttitudeThatIsNotTakenIsReported) {
  sim_.setReadOnly(kPosition + "q[3]");
  const double begin = sim_.time();
  expectFailure(place(), EventKind::kReset, "did not place the aircraft: its attitude is 90 deg off");
  EXPECT_NEAR(sim_.time() - begin, 2.1, 0.3);
}

TEST_F(FlightChangesTest, PlaceThatIsNotShownIsReported) {
  FlightChanges changes(&sim_, {2.0, 20.0}, hooks());
  sim_.setState(LinkState::kLost);
  expectFailure(changes.place(here(), "node/reset_flight"), EventKind::kReset,
                "it does not show where it is (the link is LOST)");
  EXPECT_EQ(flight_.sent("PREL"), 0U);
}

TEST_F(FlightChangesTest, StopEndsItAndLetsTheFlightGoOn) {
  flight_.ignores_prel = true;
  after(1.0, [this] { changes_.stop(); });
  const double begin = sim_.time();
  EXPECT_FALSE(place().success);
  EXPECT_LT(sim_.time() - begin, 1.5);
  EXPECT_FALSE(flight_.paused());
}

// ------------------------------------------------------------------------------------------------ placing, version 12

TEST_F(FlightChangesTest12, MovesAnAircraftThatFlies) {
  expectPlaced(place());
  EXPECT_EQ(flight_.messages, (Names{kToggle, "VEHS", "VEHS", kToggle}));
  EXPECT_EQ(flight_.beginnings, 0U) << "the flight goes on";
}

TEST_F(FlightChangesTest12, PlaceNearbyIsNotTakenForTheNewOne) {
  flight_.put(500.0, 1000.0);
  flight_.ignores_vehs = true;
  after(2.0, [this] { flight_.ignores_vehs = false; });
  expectPlaced(place());
  EXPECT_EQ(flight_.sent("VEHS"), 4U);
}

TEST_F(FlightChangesTest12, BeginsANewFlightWhereMovingFailsTwice) {
  flight_.ignores_vehs = true;
  const double begin = sim_.time();
  expectPlaced(place());
  EXPECT_EQ(flight_.messages, (Names{kToggle, "VEHS", "VEHS", "VEHS", "VEHS", "PREL", kToggle}));
  EXPECT_NEAR(sim_.time() - begin, 6.1, 0.4);
}

TEST_F(FlightChangesTestWithoutVehs, BeginsANewFlightAtOnce) {
  flight_.ignores_vehs = true;
  expectPlaced(place());
  EXPECT_EQ(flight_.messages, (Names{kToggle, "PREL", kToggle}));
}

TEST_F(FlightChangesTest12, BeginsANewFlightAfterACrash) {
  flight_.crashed = true;
  expectPlaced(place());
  EXPECT_EQ(flight_.messages, (Names{kToggle, "PREL", kToggle}));
}

// ------------------------------------------------------------------------------------------------ wind

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

TEST_F(FlightChangesTest, SettingsThatEndWithTheNodeAreInTheJournalAndComeBack) {
  const std::string name = "sim/weather/temperature_sealevel_c", real = "sim/weather/use_real_weather_bool";
  sim_.set(name, 15.0F);
  sim_.set(real, 1.0F);
  core::Weather weather;
  weather.sea_level_temperature = 30.0;
  weather.restore_on_exit = true;
  expect(changes_.applyWeather(weather), EventKind::kSetting, "the weather is set as asked for");
  weather.sea_level_temperature = 35.0;  // what was there before the first of them counts
  expect(changes_.applyWeather(weather), EventKind::kSetting, "the weather is set as asked for");
  EXPECT_EQ(sim_.value(name), 35.0F);
  ASSERT_EQ(sim_.journal()->entries().size(), 1U);
  EXPECT_EQ(sim_.journal()->entries()[0].undo.size(), 2U);
  changes_.restoreSettings();
  sim_.run(0.1);
  EXPECT_EQ(sim_.value(name), 15.0F);
  EXPECT_EQ(sim_.value(real), 1.0F);
  EXPECT_TRUE(sim_.journal()->entries().empty());
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

TEST_F(FlightChangesTest, WhatCouldNotBePutBackIsNotChanged) {
  core::Weather weather;
  weather.sea_level_temperature = 30.0;
  weather.restore_on_exit = true;
  expectFailure(changes_.applyWeather(weather), EventKind::kSetting,
                "set_weather: X-Plane does not report sim/weather/temperature_sealevel_c, which could not be put back "
                "on exit");
  EXPECT_TRUE(sim_.writes().empty());
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

TEST_F(FlightChangesTest12, AircraftIsLoadedWhileNothingIsFlown) {
  flight_.load_time = 5.0;
  after(2.0, [this] { EXPECT_EQ(suspensions_, Names{"another aircraft is being loaded"}); });
  expect(changes_.applyAircraft("Aircraft/Other/other.acf", 0), EventKind::kAircraft,
         "loaded Aircraft/Other/other.acf: HERE");
  EXPECT_EQ(suspensions_, (Names{"another aircraft is being loaded", ""}));
  EXPECT_EQ(flight_.messages, Names{"ACFN"});
}

TEST_F(FlightChangesTest12, SameAircraftIsLoadedAnew) {
  expect(changes_.applyAircraft(FakeFlight::kAircraftPath, 0), EventKind::kAircraft,
         std::string("loaded ") + FakeFlight::kAircraftPath + ": HERE");
  EXPECT_EQ(flight_.beginnings, 1U);
}

TEST_F(FlightChangesTest12, AircraftThatIsNotThereIsReported) {
  flight_.has_files = false;
  for (const std::string path : {"Aircraft/Other/other.acf", FakeFlight::kAircraftPath}) {
    const double begin = sim_.time();
    expectFailure(changes_.applyAircraft(path, 0), EventKind::kAircraft,
                  "load_aircraft " + path + ": X-Plane does not show it; is the path that of a file below its folder?");
    EXPECT_NEAR(sim_.time() - begin, 20.0, 0.5);
    EXPECT_EQ(suspensions_.back(), "") << "the present one is flown on";
  }
}

TEST_F(FlightChangesTest12, AircraftThatXPlaneDoesNotReportIsAFailure) {
  flight_.shows_aircraft = false;
  expectFailure(changes_.applyAircraft("Aircraft/Other/other.acf", 0), EventKind::kAircraft,
                "X-Plane has loaded it, but does not report which aircraft it is");
}

TEST_F(FlightChangesTest, Version11ShowsALoadedAircraftByANewFlight) {
  flight_.load_time = 2.0;
  const double begin = sim_.time();
  expect(changes_.applyAircraft("Aircraft/Other/other.acf", 0), EventKind::kAircraft,
         "loaded Aircraft/Other/other.acf: HERE");
  EXPECT_LT(sim_.time() - begin, 3.0);
  flight_.has_files = false;
  expectFailure(changes_.applyAircraft("Aircraft/Other/other.acf", 0), EventKind::kAircraft,
                "X-Plane does not show it");
}

TEST_F(FlightChangesTest, AircraftOfAFlightThatHasOnlyJustBegunIsSeenToLoad) {
  justBegun();
  expect(changes_.applyAircraft("Aircraft/Other/other.acf", 0), EventKind::kAircraft,
         "loaded Aircraft/Other/other.acf: HERE");
}

TEST_F(FlightChangesTest, AnotherAircraftIsSeenToBeLoaded) {
  flight_.setPaused(true);
  justBegun();
  after(1.0, [this] { flight_.aircraft = "OTHER"; });
  expect(changes_.applyAircraft("Aircraft/Other/other.acf", 0), EventKind::kAircraft,
         "loaded Aircraft/Other/other.acf: OTHER");
}

TEST_F(FlightChangesTest12, StopEndsTheWaitForAnAircraft) {
  flight_.has_files = false;
  after(1.0, [this] { changes_.stop(); });
  const double begin = sim_.time();
  EXPECT_FALSE(changes_.applyAircraft("Aircraft/Other/other.acf", 0).success);
  EXPECT_LT(sim_.time() - begin, 1.5);
  EXPECT_EQ(suspensions_.back(), "");
}

TEST_F(FlightChangesTest, NothingIsSentToAnXPlaneThatHasNotBeenFound) {
  sim_.forgetPeer();
  expectFailure(changes_.applyAircraft("Aircraft/Other/other.acf", 0), EventKind::kAircraft,
                "it could not be sent (the link is SEARCHING)");
  expectFailure(changes_.saveSituation("Output/a.sit"), EventKind::kSituation, "it could not be sent");
  expectFailure(changes_.applySituation("Output/a.sit"), EventKind::kSituation, "(the link is SEARCHING)");
}

// ------------------------------------------------------------------------------------------------ situations

TEST_F(FlightChangesTest, SavingASituationCannotBeSeen) {
  expect(changes_.saveSituation("Output/a.sit"), EventKind::kSituation,
         "asked X-Plane to save the situation as Output/a.sit; it does not show whether it did");
  EXPECT_EQ(flight_.beginnings, 0U);
}

TEST_F(FlightChangesTest, LoadedSituationBeginsAFlight) {
  expect(changes_.applySituation("Output/a.sit"), EventKind::kSituation, "the situation Output/a.sit is loaded");
  EXPECT_EQ(flight_.beginnings, 1U);
}

TEST_F(FlightChangesTest, SituationLoadedIntoAFlightThatHasOnlyJustBegunIsSeen) {
  justBegun();
  expect(changes_.applySituation("Output/a.sit"), EventKind::kSituation, "the situation Output/a.sit is loaded");
}

TEST_F(FlightChangesTest, SituationThatIsNotThereIsReported) {
  flight_.has_files = false;
  const double begin = sim_.time();
  expectFailure(changes_.applySituation("Output/a.sit"), EventKind::kSituation,
                "load_state Output/a.sit: the flight goes on as it was; is there such a file below X-Plane's folder?");
  EXPECT_NEAR(sim_.time() - begin, 20.0, 0.1);
}

}  // namespace
}  // namespace xplane_bridge
