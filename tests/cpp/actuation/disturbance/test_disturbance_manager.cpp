#include "xplane_bridge/actuation/disturbance/disturbance_manager.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "fake_simulator.hpp"
#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/core/simulator/flight_settings.hpp"

namespace xplane_bridge {
namespace {

const std::string kSpeed11 = std::string("sim/weather/") + "wind_speed_kt[2]";
const std::string kFrom11 = std::string("sim/weather/") + "wind_direction_degt[2]";
const std::string kSpeed12 = std::string("sim/weather/region/") + "wind_speed_msc[12]";
constexpr float kTurbulence = 2.0F;

/// An aircraft at 50 m/s in a wind of 6 m/s from the west, that X-Plane shows in its layers as 3 m/s from 90 deg.
class DisturbanceManagerTest : public testing::Test {
 protected:
  void begin(core::SimulatorVersion version = core::kXPlane11) {
    sim_.setVersion(version);
    for (const core::DatarefWrite& each : core::windWrites({3.0, 90.0, 0.2}, version))
      sim_.set(each.dataref, each.value);
    sim_.set(core::shownWindDatarefs(version)[0], 6.0F);
    sim_.set(core::shownWindDatarefs(version)[1], 270.0F);
    before_ = weather();
    manager_.onLink(sim_.status());
    sim_.frame();
  }
  std::vector<float> weather() const {
    std::vector<float> out;
    for (const core::DatarefWrite& each : core::windWrites({}, sim_.status().version)) {
      out.push_back(sim_.value(each.dataref));
    }
    return out;
  }
  void fly(double seconds) {
    for (int i = 0; i < std::lround(seconds / core::FakeSimulator::kFrame); ++i) {
      sim_.frame();
      watch_.sim_time = static_cast<double>(*sim_.status().sim_time_s);
      manager_.onFrame(watch_);
    }
  }
  /// A second of it.
  void flyGust() {
    begin();
    EXPECT_EQ(manager_.begin(gust(), "/test"), "");
    fly(1.0);
  }
  /// Until the weather has been put back for good.
  void settle() {
    fly(1.1);
    manager_.watch();
  }
  static core::FlightWatch level() {
    core::FlightWatch out;
    out.true_airspeed = 50.0;
    out.height_agl = 100.0;
    out.latitude_deg = 37.0;
    out.longitude_deg = 127.0;
    return out;
  }
  /// From the west, 8 m/s, for four seconds.
  static core::DisturbanceSpec gust() {
    core::DisturbanceSpec spec;
    spec.from_deg = 270.0;
    spec.speed = 8.0;
    spec.duration = 4.0;
    return spec;
  }
  std::vector<core::JournalEntry> journal() { return sim_.journal()->entries(); }
  double seen(const std::string& dataref) const { return static_cast<double>(sim_.value(dataref)); }

  core::FakeSimulator sim_;
  core::FlightWatch watch_ = level();
  std::vector<DisturbanceLabel> labels_;
  std::vector<std::string> reports_;
  std::vector<float> before_;
  DisturbanceManager manager_{&sim_, "override", [this](const DisturbanceLabel& label) { labels_.push_back(label); },
                              [this](const std::string& text, const std::string&, bool) { reports_.push_back(text); }};
};

TEST_F(DisturbanceManagerTest, WritesTheWindItFoundAndTheGustAndPutsTheWeatherBack) {
  begin();
  EXPECT_EQ(manager_.begin(gust(), "/test"), "");
  EXPECT_TRUE(journal().empty()) << "X-Plane has shown nothing yet";
  fly(0.1);
  ASSERT_EQ(journal().size(), 1U);
  EXPECT_EQ(journal()[0].purpose, "override");
  fly(2.0);  // the frame of the peak is near: (1 - cos) / 2 is above 0.99 for 0.25 s
  EXPECT_NEAR(seen(kSpeed11) * core::kMetersPerSecondPerKnot, 14.0, 0.08) << "6 + 8 m/s";
  EXPECT_NEAR(seen(kFrom11), 270.0, 0.01);
  EXPECT_EQ(sim_.value("sim/weather/turbulence[0]"), 0.0F) << "X-Plane's own is off";
  const DisturbanceLabel peak = labels_.back();
  EXPECT_TRUE(peak.active);
  EXPECT_NEAR(peak.steady.y(), 6.0, 1e-6);
  EXPECT_NEAR(peak.commanded.y(), 8.0, 0.08);
  EXPECT_NEAR(peak.wind_speed, seen(kSpeed11) * core::kMetersPerSecondPerKnot, 1e-5) << "the truth is what is sent";
  fly(2.0);
  EXPECT_EQ(weather(), before_);
  EXPECT_FALSE(labels_.back().active);
  EXPECT_EQ(labels_.back().result, "done");
  EXPECT_NEAR(labels_.back().end_sim_time - labels_.back().start_sim_time, 4.0, 0.03);
  EXPECT_EQ(reports_, (std::vector<std::string>{"disturbance 1, gust: begins", "disturbance 1, gust: done"}));
  EXPECT_EQ(journal().size(), 1U) << "a datagram may have been lost";
  sim_.set(kSpeed11, 20.0F);
  fly(0.5);
  manager_.watch();
  EXPECT_NE(weather(), before_) << "once more, but a second later";
  settle();
  EXPECT_EQ(weather(), before_);
  EXPECT_TRUE(journal().empty());
  sim_.clearMessages();
  settle();
  EXPECT_TRUE(sim_.messages().empty());
}

TEST_F(DisturbanceManagerTest, PutsTheWeatherBackTwiceAtOnceWhereItIsStoppedForGood) {
  begin();
  EXPECT_EQ(manager_.begin(gust(), "/test"), "");
  fly(1.0);
  sim_.clearMessages();
  manager_.stop("tx_node ends");
  EXPECT_EQ(sim_.messages().size(), 2 * before_.size());
  EXPECT_EQ(weather(), before_);
  EXPECT_TRUE(journal().empty());
  EXPECT_EQ(manager_.begin(gust(), "/test"), "tx_node ends");
}

TEST_F(DisturbanceManagerTest, NothingIsPutBackOverAWindThatIsSetAfterIt) {
  begin();
  EXPECT_EQ(manager_.begin(gust(), "/test"), "");
  fly(1.0);
  manager_.abort("stopped by /test");
  EXPECT_EQ(manager_.windRefusal(), "");
  EXPECT_TRUE(journal().empty());
  sim_.set(kSpeed11, 20.0F);
  settle();
  EXPECT_EQ(sim_.value(kSpeed11), 20.0F);
}

TEST_F(DisturbanceManagerTest, WritesTheRegionsOfTwelve) {
  begin(core::kXPlane12);
  EXPECT_EQ(manager_.begin(gust(), "/test"), "");
  fly(2.1);
  EXPECT_NEAR(seen(kSpeed12), 14.0, 0.08);
  EXPECT_EQ(sim_.value("sim/weather/region/update_immediately"), 1.0F);
  sim_.clearMessages();
  manager_.abort("stopped by /test");
  EXPECT_EQ(weather(), before_);
  EXPECT_EQ(sim_.writes().back().first, "sim/weather/region/update_immediately") << "the rest must act at once";
  EXPECT_EQ(labels_.back().result, "aborted: stopped by /test");
}

TEST_F(DisturbanceManagerTest, SendsWhatChangesAndAllOnceASecond) {
  begin(core::kXPlane12);
  core::DisturbanceSpec shear;
  shear.kind = core::DisturbanceKind::kShear;
  shear.speed = 5.0;
  shear.gradient = 0.01;
  EXPECT_EQ(manager_.begin(shear, "/test"), "");
  fly(0.1);
  sim_.clearMessages();
  fly(0.5);
  EXPECT_TRUE(sim_.messages().empty()) << "the height does not change";
  fly(0.5);
  EXPECT_EQ(sim_.messages().size(), core::windWrites({}, core::kXPlane12).size());
  sim_.clearMessages();
  watch_.height_agl = 110.0;
  fly(0.02);
  EXPECT_EQ(sim_.messages().size(), 26U) << "direction and speed of 13 layers, but";
}

TEST_F(DisturbanceManagerTest, LeavesTheVerticalPartOutOfWhatItCommands) {
  begin();
  core::DisturbanceSpec spec = gust();
  spec.vertical_speed = 5.0;
  spec.horizontal_only = true;
  EXPECT_EQ(manager_.begin(spec, "/test"), "");
  fly(2.1);
  EXPECT_NEAR(labels_.back().model.z(), -5.0, 0.05);
  EXPECT_EQ(labels_.back().commanded.z(), 0.0);
}

TEST_F(DisturbanceManagerTest, NeverCommandsMoreThanAHundredMetersASecond) {
  begin();
  core::DisturbanceSpec shear;
  shear.kind = core::DisturbanceKind::kShear;
  shear.from_deg = 270.0;
  shear.gradient = 1.0;
  watch_.height_agl = 1000.0;
  EXPECT_EQ(manager_.begin(shear, "/test"), "");
  fly(0.1);
  EXPECT_NEAR(labels_.back().wind_speed, 100.0, 1e-6);
  EXPECT_NEAR(labels_.back().commanded.y(), 94.0, 1e-5) << "the truth says so";
  EXPECT_NEAR(labels_.back().model.y(), 993.9, 0.1);
}

TEST_F(DisturbanceManagerTest, RunsOneAtATime) {
  begin();
  EXPECT_EQ(manager_.windRefusal(), "");
  EXPECT_EQ(manager_.begin(gust(), "/test"), "");
  EXPECT_NE(manager_.begin(gust(), "/test"), "") << "while it asks";
  fly(1.0);
  EXPECT_EQ(manager_.begin(gust(), "/test"), "disturbance 1, gust, runs; one at a time: wait for its end, or stop it");
  EXPECT_NE(manager_.windRefusal(), "");
  fly(4.0);
  EXPECT_EQ(manager_.begin(gust(), "/test"), "");
  EXPECT_EQ(manager_.label().id, 2U);
}

TEST_F(DisturbanceManagerTest, ChangesNothingThatItCouldNotPutBack) {
  begin();
  sim_.breakJournal();
  EXPECT_EQ(manager_.begin(gust(), "/test"), "");
  fly(1.0);
  EXPECT_EQ(weather(), before_);
  EXPECT_EQ(labels_.back().result.rfind("refused: ", 0), 0U) << labels_.back().result;
  sim_.breakJournal(false);
  sim_.setVersion(core::kXPlane12);  // whose weather this X-Plane does not show
  EXPECT_EQ(manager_.begin(gust(), "/test"), "");
  fly(4.0);
  EXPECT_NE(labels_.back().result.find("does not show sim/weather/region/update_immediately"), std::string::npos);
  EXPECT_TRUE(sim_.messages().empty());
}

TEST_F(DisturbanceManagerTest, PutsTheWeatherBackWhenALostXPlaneIsThereAgain) {
  begin();
  EXPECT_EQ(manager_.begin(gust(), "/test"), "");
  fly(1.0);
  sim_.setState(core::LinkState::kStale);
  manager_.onLink(sim_.status());
  EXPECT_TRUE(labels_.back().active) << "a frame that is late";
  sim_.setState(core::LinkState::kLost);
  manager_.onLink(sim_.status());
  EXPECT_EQ(labels_.back().result, "aborted: X-Plane is lost");
  ASSERT_EQ(journal().size(), 1U);
  EXPECT_EQ(journal()[0].left, "X-Plane went first");
  sim_.setState(core::LinkState::kConnected);
  manager_.onLink(sim_.status());
  EXPECT_NE(manager_.windRefusal(), "") << "which X-Plane it is, its first frame shows";
  EXPECT_NE(manager_.begin(gust(), "/test"), "");
  manager_.watch();
  EXPECT_NE(weather(), before_);
  fly(0.02);
  EXPECT_EQ(weather(), before_);
  settle();
  EXPECT_TRUE(journal().empty());
}

TEST_F(DisturbanceManagerTest, EndsWhereXPlaneDoesNotShowWhereTheAircraftIs) {
  begin();
  core::DisturbanceSpec shear;
  shear.kind = core::DisturbanceKind::kShear;
  shear.speed = 5.0;
  shear.gradient = 0.01;
  watch_.height_agl = std::nan("");
  EXPECT_EQ(manager_.begin(shear, "/test"), "");
  fly(0.1);
  EXPECT_EQ(labels_.back().result, "aborted: X-Plane does not show place or airspeed");
  EXPECT_EQ(weather(), before_);
}

TEST_F(DisturbanceManagerTest, EndsWhenAnotherClientHasPutTheWindBack) {
  begin();
  EXPECT_EQ(manager_.begin(gust(), "/test"), "");
  fly(1.0);
  manager_.watch();
  EXPECT_TRUE(labels_.back().active);
  sim_.journal()->remove({journal()[0].id});  // as scripts/release_overrides does
  sim_.clearMessages();
  fly(0.5);
  manager_.watch();
  EXPECT_TRUE(labels_.back().active) << "once a second";
  fly(0.6);
  sim_.clearMessages();
  manager_.watch();
  EXPECT_EQ(labels_.back().result, "aborted: another client has put the wind back");
  settle();
  EXPECT_EQ(weather(), before_) << "frames since then have changed it again";
}

TEST_F(DisturbanceManagerTest, KeepsAWindThatIsSetWhereNoFrameHasChangedItSinceItWasPutBack) {
  flyGust();
  manager_.watch();  // the entry is there, and X-Plane is paused from here on
  sim_.journal()->remove({journal()[0].id});
  sim_.set(kSpeed11, 40.0F);
  for (int i = 0; i < 30; ++i) {
    sim_.frame(0.1);
    manager_.watch();
  }
  EXPECT_EQ(labels_.back().result, "aborted: another client has put the wind back");
  EXPECT_EQ(sim_.value(kSpeed11), 40.0F);
}

TEST_F(DisturbanceManagerTest, PutsTheWeatherBackWhereAHitchHidesThatFramesHaveChangedIt) {
  flyGust();
  sim_.journal()->remove({journal()[0].id});
  fly(0.2);
  sim_.frame(0.6);
  fly(0.2);
  EXPECT_EQ(labels_.back().result, "aborted: another client has put the wind back");
  settle();
  EXPECT_EQ(weather(), before_);
}

/// The guardian has put the weather back while this process stood, and the user has set a wind since.
class DisturbanceManagerHang : public DisturbanceManagerTest {
 protected:
  void hang() {
    sim_.frame(3.0);
    sim_.journal()->remove({journal()[0].id});
    sim_.set(kSpeed11, 40.0F);
    sim_.clearMessages();
  }
  void expectTheUsersWindIsKept() {
    settle();
    EXPECT_EQ(sim_.value(kSpeed11), 40.0F);
    EXPECT_TRUE(sim_.messages().empty());
    EXPECT_EQ(manager_.windRefusal(), "");
    EXPECT_EQ(manager_.begin(gust(), "/test"), "");
  }
};

TEST_F(DisturbanceManagerHang, KeepsTheWindThatWasSetAfterTheGuardianHasPutItBack) {
  flyGust();
  hang();
  manager_.onHang();
  EXPECT_EQ(labels_.back().result, "aborted: tx_node hung");
  expectTheUsersWindIsKept();
}

TEST_F(DisturbanceManagerHang, KeepsItAlsoWhereAFrameComesFirst) {
  flyGust();
  hang();
  fly(0.1);
  EXPECT_EQ(labels_.back().result, "aborted: another client has put the wind back");
  manager_.onHang();
  expectTheUsersWindIsKept();
}

TEST_F(DisturbanceManagerHang, KeepsItAlsoWhereItIsWatchedFirst) {
  flyGust();
  hang();
  manager_.watch();
  EXPECT_EQ(labels_.back().result, "aborted: another client has put the wind back");
  manager_.onHang();
  expectTheUsersWindIsKept();
}

TEST_F(DisturbanceManagerHang, KeepsItAlsoWhereItWasPutBackOnce) {
  flyGust();
  manager_.abort("stopped by /test");
  hang();
  manager_.onHang();
  expectTheUsersWindIsKept();
}

TEST_F(DisturbanceManagerHang, PutsTheWeatherBackWhereTheGuardianHasNot) {
  flyGust();
  sim_.frame(3.0);
  manager_.onHang();
  EXPECT_EQ(weather(), before_);
  settle();
  EXPECT_TRUE(journal().empty());
}

TEST_F(DisturbanceManagerHang, PutsTheWeatherBackWhereFramesHaveChangedItSince) {
  flyGust();
  sim_.frame(1.0);
  fly(0.1);
  sim_.journal()->remove({journal()[0].id});  // the guardian is late
  fly(0.1);
  manager_.onHang();
  EXPECT_EQ(weather(), before_);
}

TEST_F(DisturbanceManagerTest, StandsWhileSimulatorTimeDoes) {
  begin();
  EXPECT_EQ(manager_.begin(gust(), "/test"), "");
  fly(1.0);
  const double wind = labels_.back().wind_speed;
  sim_.setState(core::LinkState::kPaused);
  fly(10.0);
  EXPECT_EQ(labels_.back().wind_speed, wind);
  EXPECT_TRUE(labels_.back().active);
}

}  // namespace
}  // namespace xplane_bridge
