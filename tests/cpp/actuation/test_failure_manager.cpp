#include "xplane_bridge/actuation/failure_manager.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "driven_surfaces_test.hpp"
#include "xplane_bridge/core/failures/failure_names.hpp"

namespace xplane_bridge {
namespace {

using core::FailureTrigger;
using core::FakeAirframe;
using core::kSurfaceOverride;
using core::LinkState;
using core::ResultCode;
using Names = std::vector<std::string>;

const std::string kLeft = FakeAirframe::dataref(FakeAirframe::kLeft);
const std::string kRight = FakeAirframe::dataref(FakeAirframe::kRight);
const std::string kEngine = "sim/operation/failures/rel_engfai0";
const std::string kPitot = "sim/operation/failures/rel_pitot";
const std::string kLock = "sim/operation/failures/rel_fcon_ailn_1_lft_lock";
constexpr const char* kWho = "node/set_failure";

core::FailureRequest failed(const std::string& name) { return {name, "failed", {}, 0, 0.0}; }
core::FailureRequest broken(const std::string& surface, const std::string& kind, std::optional<double> value = {}) {
  return {surface, kind, value, 0, 0.0};
}
core::FailureRequest triggered(const std::string& name, FailureTrigger trigger, double value) {
  return {name, "failed", {}, static_cast<int>(trigger), value};
}

/// Expectations are worked out by hand: X-Plane must show within 2 s what it is asked for, a failure is 6 while it is
/// set, and FakeAirframe's left aileron is at 20 deg a unit of roll.
class FailureManagerTest : public DrivenSurfacesTest {
 protected:
  explicit FailureManagerTest(core::SimulatorVersion version = core::kXPlane11) : DrivenSurfacesTest(version) {
    sim_.setAll(core::simulatorFailures(version), 0.0F);
    failures_.onLink(sim_.status());
    sim_.on_frame = [this] {
      watch_.sim_time = static_cast<double>(sim_.value("sim/time/total_running_time_sec"));
      for (auto& [time, event] : events_) {
        if (event && sim_.time() >= time) std::exchange(event, nullptr)();
      }
      if (sim_.status().state == LinkState::kConnected) failures_.onFrame(watch_);
      eachFrame();
      failures_.tick();
    };
    sim_.run(1.2);
    published_.clear();
    sim_.clearMessages();
  }

  void setLink(LinkState state) {
    DrivenSurfacesTest::setLink(state);
    failures_.onLink(sim_.status());
  }
  /// What happens while a call under test waits.
  void after(double seconds, const std::function<void()>& event) { events_.emplace_back(sim_.time() + seconds, event); }

  RequestResult set(const core::FailureRequest& request) { return failures_.set(request, kWho); }
  void require(const core::FailureRequest& request) {
    const RequestResult result = set(request);
    ASSERT_EQ(result.code, ResultCode::kOk) << result.text;
    ASSERT_EQ(result.text, "X-Plane shows it");
  }
  FailureManager::ClearResult clear(const Names& names = {}, bool include_simulator = false) {
    return failures_.clear(names, include_simulator, kWho);
  }
  void requireClear(const Names& names = {}, bool include_simulator = false) {
    const auto done = clear(names, include_simulator);
    ASSERT_EQ(done.result.code, ResultCode::kOk) << done.result.text;
  }
  void refused(const core::FailureRequest& request, ResultCode code, const std::string& text) {
    SCOPED_TRACE(request.name + " " + request.kind);
    const Names before = labelNames();
    const RequestResult result = set(request);
    EXPECT_EQ(result.code, code);
    EXPECT_NE(result.text.find(text), std::string::npos) << result.text;
    EXPECT_EQ(labelNames(), before);
  }

  core::FailureLabel label(const std::string& name) const {
    for (const core::FailureLabel& each : failures_.snapshot().labels) {
      if (each.name == name) return each;
    }
    ADD_FAILURE() << "no label " << name;
    return {};
  }
  Names labelNames() const {
    Names out;
    for (const core::FailureLabel& each : failures_.snapshot().labels) out.push_back(each.name);
    return out;
  }
  bool reported(const std::string& text, const std::string& who, bool success) const {
    return std::find(reported_.begin(), reported_.end(), std::make_tuple(text, who, success)) != reported_.end();
  }
  bool isInJournal(const std::string& dataref) {
    const auto entries = sim_.journal()->entries();
    return std::any_of(entries.begin(), entries.end(),
                       [&](const core::JournalEntry& entry) { return entry.id == "override:" + dataref; });
  }

  core::FlightWatch watch_;
  std::vector<std::pair<double, std::function<void()>>> events_;  // [s] of the fake clock
  std::vector<FailureSnapshot> published_;
  std::vector<std::tuple<std::string, std::string, bool>> reported_;  // text, who, success
  FailureManager failures_{&sim_,
                           &overrides_,
                           &surfaces_,
                           2.0,
                           [this](const FailureSnapshot& snapshot) { published_.push_back(snapshot); },
                           [this](const std::string& text, const std::string& who, bool success) {
                             reported_.emplace_back(text, who, success);
                           }};
};

class FailureManagerTest12 : public FailureManagerTest {
 protected:
  FailureManagerTest12() : FailureManagerTest(core::kXPlane12) {}
};

// ------------------------------------------------------------------------------------------ X-Plane's own failures

TEST_F(FailureManagerTest, FailureIsSetWrittenDownSeenAndLabelled) {
  bool in_journal = false;
  sim_.on_message = [&](const core::FakeSimulator::Message& message) {
    if (message.path == kEngine) in_journal = isInJournal(kEngine);
  };
  const double begin = watch_.sim_time;
  require(failed("engine_1"));
  EXPECT_TRUE(in_journal) << "before it is sent";
  EXPECT_EQ(sim_.value(kEngine), 6.0F);
  EXPECT_EQ(written(kEngine), std::vector<float>{6.0F});
  const core::FailureLabel engine = label("engine_1");
  EXPECT_EQ(engine.kind, "failed");
  EXPECT_TRUE(engine.by_bridge);
  EXPECT_TRUE(engine.active);
  EXPECT_TRUE(engine.confirmed);
  EXPECT_NEAR(engine.since_sim_time, begin, 0.05);
  EXPECT_TRUE(reported("failure: engine_1 failed", kWho, true));
  sim_.frame();
  ASSERT_FALSE(published_.empty());
  EXPECT_TRUE(published_.back().labels.at(0).confirmed);
  EXPECT_FALSE(published_.back().surrogate_mixing);
  EXPECT_NEAR(published_.back().sim_time, watch_.sim_time, 0.03);
}

struct SystemCase {
  std::string name;
  Names leaves;  // of its datarefs
};

TEST_F(FailureManagerTest, EachSystemIsBrokenAndRepaired) {
  const std::vector<SystemCase> cases{
      {"engine_1", {"rel_engfai0"}},    {"engine_8", {"rel_engfai7"}},
      {"bus_1", {"rel_esys"}},          {"bus_6", {"rel_esys6"}},
      {"generator_1", {"rel_genera0"}}, {"battery_2", {"rel_batter1"}},
      {"pitot_1", {"rel_pitot"}},       {"pitot_2", {"rel_pitot2"}},
      {"static_1", {"rel_static"}},     {"gyro_1", {"rel_ss_ahz", "rel_ss_dgy"}},
      {"rel_vacuum", {"rel_vacuum"}},   {"gyro_2", {"rel_cop_ahz", "rel_cop_dgy"}},
  };
  for (const SystemCase& each : cases) {
    SCOPED_TRACE(each.name);
    require(failed(each.name));
    EXPECT_EQ(labelNames(), Names{each.name});
    for (const std::string& leaf : each.leaves) EXPECT_EQ(sim_.value("sim/operation/failures/" + leaf), 6.0F) << leaf;
    requireClear({each.name});
    for (const std::string& leaf : each.leaves) EXPECT_EQ(sim_.value("sim/operation/failures/" + leaf), 0.0F) << leaf;
    EXPECT_TRUE(labelNames().empty());
  }
}

TEST_F(FailureManagerTest, FullDatarefIsLabelledWithoutItsFolder) {
  require(failed(kPitot));
  EXPECT_EQ(labelNames(), Names{"rel_pitot"});
  requireClear({kPitot});
  EXPECT_TRUE(reported("cleared: rel_pitot", kWho, true));
}

TEST_F(FailureManagerTest, LostDatagramIsSentAgain) {
  sim_.loseMessages(1);
  require(failed("engine_1"));
  EXPECT_EQ(written(kEngine), (std::vector<float>{6.0F, 6.0F}));
}

TEST_F(FailureManagerTest, WhatXPlaneDoesNotShowIsGivenUp) {
  sim_.setReadOnly(kEngine);
  const double begin = sim_.time();
  const RequestResult result = set(failed("engine_1"));
  EXPECT_EQ(result.code, ResultCode::kTimeout);
  EXPECT_EQ(result.text, "X-Plane does not show it");
  EXPECT_NEAR(sim_.time() - begin, 2.0, 0.1);
  std::vector<float> sent = written(kEngine);
  ASSERT_GE(sent.size(), 6U);
  EXPECT_EQ(std::count(sent.begin(), sent.end(), 6.0F), 7) << "at once and six times at 0.3 s";
  EXPECT_EQ(sent.back(), 0.0F);
  EXPECT_TRUE(labelNames().empty());
  EXPECT_TRUE(reported("failure of engine_1 is given up: X-Plane does not show it", kWho, false));
  EXPECT_TRUE(overrides_.releasesPending());
}

TEST_F(FailureManagerTest, AllDatarefsOfAFailureMustBeShown) {
  sim_.setReadOnly("sim/operation/failures/rel_ss_dgy");
  EXPECT_EQ(set(failed("gyro_1")).code, ResultCode::kTimeout);
  EXPECT_EQ(sim_.value("sim/operation/failures/rel_ss_ahz"), 0.0F) << "the other one is repaired";
}

TEST_F(FailureManagerTest, WithoutTheJournalNothingIsBroken) {
  sim_.breakJournal();
  const RequestResult result = set(failed("engine_1"));
  EXPECT_EQ(result.code, ResultCode::kTimeout);
  EXPECT_EQ(result.text.find("it could not be given back after a crash, should there be one: "), 0U) << result.text;
  EXPECT_EQ(sim_.value(kEngine), 0.0F);
  EXPECT_TRUE(labelNames().empty());
  const auto sent = written(kEngine);
  EXPECT_EQ(std::count(sent.begin(), sent.end(), 6.0F), 0);
}

// ------------------------------------------------------------------------------------------------ refusals

TEST_F(FailureManagerTest, RefusesWhatCannotBeBroken) {
  refused(failed("wing_9"), ResultCode::kRefused, "name is \"wing_9\": expected a surface (docs/surfaces.md)");
  refused(failed("engine_9"), ResultCode::kRefused, "name is \"engine_9\": expected engine_1 to engine_8");
  refused(broken("engine_1", "stuck"), ResultCode::kRefused, "kind is \"stuck\": expected failed for engine_1");
  refused(broken(FakeAirframe::kLeft, "bent"), ResultCode::kRefused, "kind is \"bent\": expected stuck");
  refused(broken(FakeAirframe::kLeft, "stuck", 100.0), ResultCode::kRefused, "value is 100, expected -90..90 deg");
  refused(broken(FakeAirframe::kLeft, "reduced"), ResultCode::kRefused, "value is missing, expected 0..1");
  refused(broken(FakeAirframe::kLeft, "slow", 0.0), ResultCode::kRefused, "value is 0, expected a rate above 0");
  refused(broken(FakeAirframe::kLeft, "gone"), ResultCode::kNotSupported, "cannot be expressed by X-Plane 11");
  refused(triggered("engine_1", static_cast<FailureTrigger>(6), 1.0), ResultCode::kRefused, "trigger is 6");
  refused(triggered("engine_1", FailureTrigger::kAtSpeedAbove, std::nan("")), ResultCode::kRefused, "trigger_value");
  refused(triggered("engine_1", FailureTrigger::kAtSimTime, -1.0), ResultCode::kRefused, "expected 0 s or more");
  refused(failed("rel_nothing"), ResultCode::kNotSupported,
          "this X-Plane does not answer to sim/operation/failures/rel_nothing: is the name right?");
  refused(broken("flap1_wing1_left", "stuck"), ResultCode::kRefused,
          "flap1_wing1_left cannot be broken now: flap1_wing1_left has not been seen to move");
  blocked_ = "the aircraft is another one";
  sim_.frame();
  refused(broken(FakeAirframe::kLeft, "stuck"), ResultCode::kRefused,
          "aileron1_wing2_left cannot be broken now: the aircraft is another one");
  EXPECT_TRUE(sim_.messages().empty());
}

TEST_F(FailureManagerTest, OneThingIsNotBrokenUnderTwoNames) {
  require(failed("engine_1"));
  refused(failed("rel_engfai0"), ResultCode::kRefused, "rel_engfai0 is broken already as engine_1: clear that first");
}

TEST_F(FailureManagerTest, NothingIsBrokenWithoutALink) {
  for (const LinkState state : {LinkState::kSearching, LinkState::kStale, LinkState::kLost}) {
    setLink(state);
    refused(failed("engine_1"), ResultCode::kNoLink, "X-Plane is not connected");
  }
}

TEST_F(FailureManagerTest, TimeThatIsNotKnownIsNoTrigger) {
  FailureManager fresh(
      &sim_, &overrides_, &surfaces_, 2.0, [](const FailureSnapshot&) {},
      [](const std::string&, const std::string&, bool) {});
  fresh.onLink(sim_.status());
  const RequestResult result = fresh.set(triggered("engine_1", FailureTrigger::kAtSimTime, 1.0), kWho);
  EXPECT_EQ(result.code, ResultCode::kNoLink);
  EXPECT_EQ(result.text, "X-Plane has not shown its time yet");
}

// ------------------------------------------------------------------------------------------------ losses in between

TEST_F(FailureManagerTest, WhilePausedItIsAcceptedAndActsLater) {
  setLink(LinkState::kPaused);
  const RequestResult result = set(failed("engine_1"));
  EXPECT_EQ(result.code, ResultCode::kAccepted);
  EXPECT_EQ(result.text, "X-Plane is paused: it acts when it goes on");
  EXPECT_TRUE(result.success());
  sim_.run(10.0);
  setLink(LinkState::kConnected);
  sim_.run(0.1);
  EXPECT_TRUE(label("engine_1").confirmed) << "time stood still for what X-Plane has to show";
}

TEST_F(FailureManagerTest, ShortSilenceIsWaitedThrough) {
  sim_.setReadOnly(kEngine);
  after(0.1, [this] { setLink(LinkState::kStale); });
  after(3.0, [this] {
    sim_.set(kEngine, 6.0F);
    setLink(LinkState::kConnected);
  });
  require(failed("engine_1"));
}

TEST_F(FailureManagerTest, LostLinkEndsTheWait) {
  sim_.setReadOnly(kEngine);
  after(0.1, [this] { setLink(LinkState::kLost); });
  const RequestResult result = set(failed("engine_1"));
  EXPECT_EQ(result.code, ResultCode::kNoLink);
  EXPECT_EQ(result.text, "X-Plane is not connected any more");
}

TEST_F(FailureManagerTest, EndOfTheNodeEndsTheWait) {
  sim_.setReadOnly(kEngine);
  after(0.1, [this] { failures_.stop(); });
  const double begin = sim_.time();
  EXPECT_EQ(set(failed("engine_1")).code, ResultCode::kNoLink);
  EXPECT_NEAR(sim_.time() - begin, 0.1, 0.05);
}

TEST_F(FailureManagerTest, RestartedXPlaneHasNothingBroken) {
  require(failed("engine_1"));
  require(broken(FakeAirframe::kLeft, "stuck", 6.0));
  sim_.restart();
  sim_.setAll({kEngine, kSurfaceOverride}, 0.0F);
  failures_.onLink(sim_.status());
  surfaces_.onLink(sim_.status());
  sim_.run(0.1);
  EXPECT_TRUE(labelNames().empty());
  EXPECT_TRUE(reported("failure of engine_1 has ended: X-Plane was restarted", "", true));
  EXPECT_TRUE(reported("failure of aileron1_wing2_left has ended: X-Plane was restarted", "", true));
  EXPECT_EQ(state(), SurfaceControlState::kIdle);
}

TEST_F(FailureManagerTest, AnotherAircraftEndsWhatIsDriven) {
  require(failed("engine_1"));
  require(broken(FakeAirframe::kLeft, "stuck", 6.0));
  surfaces_.onAircraft("OTHER");
  sim_.run(0.1);
  EXPECT_EQ(labelNames(), Names{"engine_1"}) << "X-Plane keeps its own";
  EXPECT_TRUE(reported("failure of aileron1_wing2_left has ended: another aircraft was loaded", "", true));
  EXPECT_EQ(state(), SurfaceControlState::kIdle);
}

TEST_F(FailureManagerTest, SurfaceOverrideReleasedByAnotherClientEndsWhatIsDriven) {
  require(broken(FakeAirframe::kLeft, "stuck", 6.0));
  sim_.set(kSurfaceOverride, 0.0F);
  sim_.run(0.1);
  EXPECT_TRUE(labelNames().empty());
  sim_.clearMessages();
  sim_.run(10.0);
  EXPECT_TRUE(sim_.messages().empty()) << "it is not taken again";
}

TEST_F(FailureManagerTest, RepairedByTheOverrideManagerNothingIsLabelled) {
  require(failed("engine_1"));
  failures_.stop();
  ASSERT_TRUE(overrides_.releaseAll(1.0));
  failures_.repaired();
  published_.clear();
  failures_.publish();
  ASSERT_EQ(published_.size(), 1U);
  EXPECT_TRUE(published_[0].labels.empty());
}

// ------------------------------------------------------------------------------------------------ triggers

struct TriggerCase {
  FailureTrigger trigger;
  double core::FlightWatch::*member;
  double value, before, after;
};

TEST_F(FailureManagerTest, ArmedFailureComesTrueAtItsTrigger) {
  const std::vector<TriggerCase> cases{
      {FailureTrigger::kAtAltitudeAbove, &core::FlightWatch::height_agl, 300.0, 299.0, 300.5},
      {FailureTrigger::kAtAltitudeBelow, &core::FlightWatch::height_agl, 300.0, 301.0, 299.5},
      {FailureTrigger::kAtSpeedAbove, &core::FlightWatch::indicated_airspeed, 50.0, 49.0, 50.5},
      {FailureTrigger::kAtSpeedBelow, &core::FlightWatch::indicated_airspeed, 50.0, 51.0, 49.5},
  };
  for (const TriggerCase& each : cases) {
    SCOPED_TRACE(static_cast<int>(each.trigger));
    reported_.clear();
    watch_.*each.member = each.before;
    const RequestResult result = set(triggered("engine_1", each.trigger, each.value));
    EXPECT_EQ(result.code, ResultCode::kAccepted);
    EXPECT_EQ(result.text, "armed; published on events and failures/state when it comes true");
    EXPECT_TRUE(reported("failure armed: engine_1 failed", kWho, true));
    watch_.*each.member = std::nan("");
    sim_.run(0.5);
    watch_.*each.member = each.before;
    sim_.run(0.5);
    EXPECT_FALSE(label("engine_1").active);
    EXPECT_TRUE(std::isnan(label("engine_1").since_sim_time));
    EXPECT_EQ(sim_.value(kEngine), 0.0F);
    watch_.*each.member = each.after;
    sim_.run(0.2);
    EXPECT_TRUE(label("engine_1").active);
    EXPECT_TRUE(label("engine_1").confirmed);
    EXPECT_EQ(sim_.value(kEngine), 6.0F);
    EXPECT_TRUE(reported("failure: engine_1 failed", kWho, true));
    requireClear();
  }
}

TEST_F(FailureManagerTest, TimeTriggerCountsFromTheRequest) {
  ASSERT_EQ(set(triggered("engine_1", FailureTrigger::kAtSimTime, 5.0)).code, ResultCode::kAccepted);
  sim_.run(4.9);
  EXPECT_EQ(sim_.value(kEngine), 0.0F);
  sim_.run(0.2);
  EXPECT_EQ(sim_.value(kEngine), 6.0F);
}

TEST_F(FailureManagerTest, ArmedFailureThatIsClearedNeverComes) {
  ASSERT_EQ(set(triggered("engine_1", FailureTrigger::kAtSimTime, 1.0)).code, ResultCode::kAccepted);
  const auto done = clear({"engine_1"});
  EXPECT_EQ(done.result.code, ResultCode::kOk);
  EXPECT_EQ(done.cleared, Names{"engine_1"});
  sim_.run(2.0);
  EXPECT_EQ(sim_.value(kEngine), 0.0F);
}

TEST_F(FailureManagerTest, NothingComesTrueOnceTheNodeEnds) {
  ASSERT_EQ(set(triggered("engine_1", FailureTrigger::kAtSimTime, 1.0)).code, ResultCode::kAccepted);
  failures_.stop();
  sim_.run(2.0);
  EXPECT_EQ(sim_.value(kEngine), 0.0F);
}

// ------------------------------------------------------------------------------------------------ clear()

TEST_F(FailureManagerTest, ClearRepairsAllOfTheBridges) {
  require(failed("engine_1"));
  require(failed("pitot_1"));
  const auto done = clear();
  EXPECT_EQ(done.result.code, ResultCode::kOk);
  EXPECT_EQ(done.result.text, "repaired");
  EXPECT_EQ(done.cleared, (Names{"engine_1", "pitot_1"}));
  EXPECT_EQ(sim_.value(kEngine), 0.0F);
  EXPECT_EQ(sim_.value(kPitot), 0.0F);
  overrides_.confirmReleases(1.0);
  EXPECT_FALSE(isInJournal(kEngine));
  const auto again = clear();
  EXPECT_EQ(again.result.text, "nothing was broken");
  EXPECT_TRUE(again.cleared.empty());
}

TEST_F(FailureManagerTest, ClearByNameLeavesTheOthers) {
  require(failed("engine_1"));
  require(failed("pitot_1"));
  requireClear({"pitot_1"});
  EXPECT_EQ(labelNames(), Names{"engine_1"});
  EXPECT_EQ(sim_.value(kEngine), 6.0F);
}

TEST_F(FailureManagerTest, ClearRefusesWhatIsNotBroken) {
  auto done = clear({"engine_2"});
  EXPECT_EQ(done.result.code, ResultCode::kRefused);
  EXPECT_EQ(done.result.text, "\"engine_2\" is not broken: expected nothing, all is well");
  require(failed("engine_1"));
  done = clear({"engine_1", "engine_2"});
  EXPECT_EQ(done.result.text, "\"engine_2\" is not broken: expected engine_1");
  EXPECT_EQ(sim_.value(kEngine), 6.0F) << "nothing is done by half";
}

TEST_F(FailureManagerTest, RepairThatIsNotShownTimesOut) {
  require(failed("engine_1"));
  sim_.setReadOnly(kEngine);
  const auto done = clear();
  EXPECT_EQ(done.result.code, ResultCode::kTimeout);
  EXPECT_EQ(done.result.text, "X-Plane still shows " + kEngine);
}

TEST_F(FailureManagerTest, RepairWithoutALinkSaysSo) {
  require(failed("engine_1"));
  setLink(LinkState::kLost);
  const auto done = clear();
  EXPECT_EQ(done.result.code, ResultCode::kNoLink);
  EXPECT_EQ(done.cleared, Names{"engine_1"});
  EXPECT_TRUE(overrides_.releasesPending()) << "it is repaired when X-Plane comes back";
}

// ------------------------------------------------------------------------------------------------ the simulator's menu

TEST_F(FailureManagerTest, FailureOfTheMenuIsNoticedAndSoIsItsRepair) {
  sim_.set(kPitot, 6.0F);
  sim_.run(1.1);
  EXPECT_FALSE(label("rel_pitot").by_bridge);
  EXPECT_TRUE(label("rel_pitot").active);
  EXPECT_TRUE(label("rel_pitot").confirmed);
  EXPECT_TRUE(reported("rel_pitot was failed in the simulator", "", true));
  sim_.set(kPitot, 0.0F);
  sim_.run(1.1);
  EXPECT_TRUE(labelNames().empty());
  EXPECT_TRUE(reported("rel_pitot was repaired in the simulator", "", true));
  EXPECT_TRUE(sim_.messages().empty());
}

TEST_F(FailureManagerTest, FailureOfTheMenuIsClearedOnRequestOnly) {
  sim_.set(kPitot, 6.0F);
  sim_.run(1.1);
  EXPECT_EQ(clear().result.text, "nothing was broken");
  const auto done = clear({"rel_pitot"});
  EXPECT_EQ(done.result.code, ResultCode::kRefused);
  EXPECT_EQ(done.result.text, "rel_pitot was failed in the simulator: set include_simulator");
  EXPECT_EQ(sim_.value(kPitot), 6.0F);
  requireClear({}, true);
  EXPECT_EQ(sim_.value(kPitot), 0.0F);
}

TEST_F(FailureManagerTest, ValuesFromBeforeARepairAreIgnored) {
  sim_.set(kPitot, 6.0F);
  sim_.run(1.1);
  reported_.clear();
  sim_.setReadOnly(kPitot);
  after(0.3, [this] { sim_.set(kPitot, 0.0F); });
  requireClear({}, true);
  sim_.run(2.0);
  EXPECT_TRUE(labelNames().empty());
  EXPECT_FALSE(reported("rel_pitot was failed in the simulator", "", true));
}

TEST_F(FailureManagerTest, FailureOfTheMenuGivesWayToOneOfTheBridge) {
  sim_.set(kEngine, 6.0F);
  sim_.run(1.1);
  ASSERT_EQ(labelNames(), Names{"rel_engfai0"});
  require(failed("engine_1"));
  EXPECT_EQ(labelNames(), Names{"engine_1"});
  requireClear();
  EXPECT_EQ(sim_.value(kEngine), 0.0F);
}

TEST_F(FailureManagerTest, OursThatIsRepairedInTheSimulatorIsLetGo) {
  require(failed("engine_1"));
  sim_.set(kEngine, 0.0F);
  sim_.run(0.4);
  EXPECT_FALSE(label("engine_1").confirmed);
  sim_.run(0.3);
  EXPECT_TRUE(labelNames().empty());
  EXPECT_TRUE(reported("engine_1 was repaired in the simulator", "", true));
  EXPECT_TRUE(overrides_.releasesPending()) << "its journal entry goes";
}

TEST_F(FailureManagerTest, ShortDropOfAValueIsNoRepair) {
  require(failed("engine_1"));
  sim_.set(kEngine, 0.0F);
  sim_.run(0.3);
  sim_.set(kEngine, 6.0F);
  sim_.run(1.0);
  EXPECT_TRUE(label("engine_1").confirmed);
}

TEST_F(FailureManagerTest, NoMixingIsLearnedFromBrokenControls) {
  sim_.set("sim/operation/failures/rel_conlock", 6.0F);
  sim_.run(1.1);
  const std::size_t samples = surfaces_.status().samples;
  sim_.run(2.0);
  EXPECT_EQ(surfaces_.status().samples, samples);
  sim_.set("sim/operation/failures/rel_conlock", 0.0F);
  sim_.run(3.0);
  EXPECT_GT(surfaces_.status().samples, samples);
}

// ------------------------------------------------------------------------------------------------ driven surfaces

struct SurfaceCase {
  std::string kind;
  std::optional<double> value;
  double shown;  // [deg] after a second with the stick at half, from a quarter
};

TEST_F(FailureManagerTest, EachKindOfASurfaceIsDriven) {
  const std::vector<SurfaceCase> cases{
      {"stuck", {}, 5.0},   {"stuck", 8.0, 8.0},   {"hard_over_up", {}, -20.0}, {"hard_over_down", {}, 20.0},
      {"centred", {}, 0.0}, {"reduced", 0.4, 4.0}, {"slow", 60.0, 10.0},
  };
  for (const SurfaceCase& each : cases) {
    SCOPED_TRACE(each.kind);
    airframe_.setStick(0.25);
    sim_.run(1.2);
    require(broken(FakeAirframe::kLeft, each.kind, each.value));
    EXPECT_TRUE(label(FakeAirframe::kLeft).confirmed);
    EXPECT_EQ(label(FakeAirframe::kLeft).kind, each.kind);
    airframe_.setStick(0.5);
    sim_.run(1.0);
    EXPECT_NEAR(sim_.value(kLeft), each.shown, 1e-4);
    EXPECT_NEAR(sim_.value(kRight), -10.0, 1e-4) << "the others fly on";
    EXPECT_TRUE(failures_.snapshot().surrogate_mixing);
    EXPECT_TRUE(published_.back().surrogate_mixing);
    EXPECT_NEAR(failures_.snapshot().surrogate_lag_frames, 1.0, 0.01);
    requireClear();
    EXPECT_EQ(sim_.value(kSurfaceOverride), 0.0F);
    EXPECT_EQ(state(), SurfaceControlState::kIdle);
  }
}

TEST_F(FailureManagerTest, LabelShowsWhereASurfaceGotStuck) {
  airframe_.setStick(0.25);
  sim_.run(0.1);
  require(broken(FakeAirframe::kLeft, "stuck"));
  EXPECT_NEAR(label(FakeAirframe::kLeft).value, 5.0, 1e-4);
  require(broken(FakeAirframe::kLeft, "stuck", 8.0));
  EXPECT_EQ(label(FakeAirframe::kLeft).value, 8.0) << "one of the same name is replaced";
  sim_.run(0.2);
  EXPECT_FLOAT_EQ(sim_.value(kLeft), 8.0F);
}

TEST_F(FailureManagerTest, SurfacesThatCannotBeTakenGiveTheFailureUp) {
  sim_.setReadOnly(kSurfaceOverride);
  const RequestResult result = set(broken(FakeAirframe::kLeft, "stuck", 6.0));
  EXPECT_EQ(result.code, ResultCode::kTimeout);
  EXPECT_EQ(result.text, "X-Plane did not let the surfaces be taken over a moment ago");
  EXPECT_TRUE(labelNames().empty());
  sim_.setReadOnly(kSurfaceOverride, false);
  sim_.run(6.0);
  EXPECT_EQ(state(), SurfaceControlState::kIdle) << "nothing needs them any more";
}

TEST_F(FailureManagerTest, SurfaceThatDoesNotFollowGivesTheFailureUp) {
  airframe_.hold(FakeAirframe::kLeft, 0.0);
  const RequestResult result = set(broken(FakeAirframe::kLeft, "stuck", 6.0));
  EXPECT_EQ(result.code, ResultCode::kTimeout);
  EXPECT_EQ(result.text, "X-Plane does not show what is sent to the surface");
}

TEST_F(FailureManagerTest, RepairWaitsUntilXPlaneDrivesTheSurfaces) {
  require(broken(FakeAirframe::kLeft, "stuck", 6.0));
  sim_.setReadOnly(kSurfaceOverride);
  const auto done = clear();
  EXPECT_EQ(done.result.code, ResultCode::kTimeout);
  EXPECT_EQ(done.result.text, std::string("X-Plane still shows ") + kSurfaceOverride);
}

TEST_F(FailureManagerTest, SecondFailureKeepsTheSurfacesDriven) {
  require(broken(FakeAirframe::kLeft, "stuck", 6.0));
  require(broken(FakeAirframe::kRudder, "stuck", 3.0));
  requireClear({FakeAirframe::kLeft});
  EXPECT_EQ(state(), SurfaceControlState::kDriving);
  EXPECT_EQ(sim_.value(kSurfaceOverride), 1.0F);
}

// ------------------------------------------------------------------------------- X-Plane 12's own failures of surfaces

TEST_F(FailureManagerTest12, XPlanesOwnFailureOfASurfaceIsUsedWhereItActs) {
  airframe_.setStick(0.25);
  sim_.run(0.1);
  sim_.on_message = [this](const core::FakeSimulator::Message& message) {
    if (message.path == kLock && message.value == 6.0F) airframe_.hold(FakeAirframe::kLeft, 5.5);
  };
  after(0.2, [this] { airframe_.setStick(0.5); });
  require(broken(FakeAirframe::kLeft, "stuck"));
  EXPECT_EQ(sim_.value(kLock), 6.0F);
  EXPECT_EQ(state(), SurfaceControlState::kIdle);
  EXPECT_NEAR(label(FakeAirframe::kLeft).value, 5.5, 1e-4) << "where it got stuck";
  requireClear();
  EXPECT_EQ(sim_.value(kLock), 0.0F);
}

TEST_F(FailureManagerTest12, DriverTakesOverWhereXPlanesOwnFailureDoesNotAct) {
  airframe_.setStick(0.25);
  sim_.run(0.1);
  after(0.3, [this] { airframe_.setStick(0.5); });
  const double begin = sim_.time();
  require(broken(FakeAirframe::kLeft, "stuck"));
  EXPECT_TRUE(
      reported("aileron1_wing2_left: X-Plane's own failure does not act as it says, so that tx_node drives the "
               "surfaces",
               kWho, true));
  EXPECT_GE(sim_.time() - begin, 1.0) << "it is given a second";
  EXPECT_EQ(sim_.value(kLock), 0.0F) << "it is repaired";
  EXPECT_EQ(state(), SurfaceControlState::kDriving);
  sim_.run(0.5);
  EXPECT_NEAR(sim_.value(kLeft), 5.0, 1e-4) << "where it was when it was to get stuck";
  EXPECT_NEAR(sim_.value(kRight), -10.0, 1e-4);
  EXPECT_TRUE(label(FakeAirframe::kLeft).confirmed);
}

TEST_F(FailureManagerTest12, DriverTakesOverWhereXPlaneDoesNotShowItsFailure) {
  sim_.setReadOnly(kLock);
  const double begin = sim_.time();
  require(broken(FakeAirframe::kLeft, "stuck"));
  EXPECT_NEAR(sim_.time() - begin, 2.1, 0.15);
  EXPECT_EQ(state(), SurfaceControlState::kDriving);
  requireClear();
  EXPECT_EQ(state(), SurfaceControlState::kIdle);
}

TEST_F(FailureManagerTest12, DriverThatCannotTakeOverGivesTheFailureUp) {
  airframe_.setStick(0.25);
  sim_.run(0.1);
  after(0.2, [this] { airframe_.setStick(0.5); });
  after(0.3, [this] { blocked_ = "the aircraft is another one"; });
  const RequestResult result = set(broken(FakeAirframe::kLeft, "stuck"));
  EXPECT_EQ(result.code, ResultCode::kTimeout);
  EXPECT_EQ(result.text, "the aircraft is another one");
  EXPECT_TRUE(labelNames().empty());
}

TEST_F(FailureManagerTest12, HardOverOfXPlanesMustReachTheEndOfTheTravel) {
  sim_.on_message = [this](const core::FakeSimulator::Message& message) {
    if (message.path.find("ailn_1_lft_mxup") != std::string::npos && message.value == 6.0F) {
      airframe_.hold(FakeAirframe::kLeft, -19.0);
    }
  };
  require(broken(FakeAirframe::kLeft, "hard_over_up"));
  EXPECT_EQ(state(), SurfaceControlState::kIdle) << "within 2 deg";
}

struct OwnCase {
  std::string kind;
  std::string event;  // the end of X-Plane's own name
  double shown;       // [deg] where X-Plane brings the left aileron, from 5
};
const std::vector<OwnCase> kOwnCases{{"stuck", "lock", 5.0},
                                     {"hard_over_up", "mxup", -20.0},
                                     {"hard_over_down", "mxdn", 20.0},
                                     {"centred", "cntr", 0.0}};

TEST_F(FailureManagerTest12, EachOwnFailureIsBelievedWhereTheSurfaceGoesAsItSays) {
  for (const OwnCase& each : kOwnCases) {
    SCOPED_TRACE(each.kind);
    airframe_.letGo(FakeAirframe::kLeft);
    airframe_.setStick(0.25);
    sim_.run(1.2);
    const std::string own = "sim/operation/failures/rel_fcon_ailn_1_lft_" + each.event;
    sim_.on_message = [&](const core::FakeSimulator::Message& message) {
      if (message.path == own && message.value == 6.0F) airframe_.hold(FakeAirframe::kLeft, each.shown);
    };
    after(0.2, [this] { airframe_.setStick(-0.25); });
    require(broken(FakeAirframe::kLeft, each.kind));
    EXPECT_EQ(sim_.value(own), 6.0F);
    EXPECT_EQ(state(), SurfaceControlState::kIdle);
    requireClear();
    EXPECT_EQ(sim_.value(own), 0.0F);
  }
}

TEST_F(FailureManagerTest12, EachOwnFailureGivesWayToTheDriverWhereTheSurfaceDoesNotGoThere) {
  for (const OwnCase& each : kOwnCases) {
    SCOPED_TRACE(each.kind);
    airframe_.setStick(0.25);
    sim_.run(1.2);
    after(0.2, [this] { airframe_.setStick(-0.25); });
    require(broken(FakeAirframe::kLeft, each.kind));
    EXPECT_EQ(sim_.value("sim/operation/failures/rel_fcon_ailn_1_lft_" + each.event), 0.0F);
    EXPECT_EQ(state(), SurfaceControlState::kDriving);
    sim_.run(1.0);
    EXPECT_NEAR(sim_.value(kLeft), each.shown, 1e-4);
    EXPECT_NEAR(sim_.value(kRight), 5.0, 1e-4);
    requireClear();
  }
}

TEST_F(FailureManagerTest12, LostSurfaceIsXPlanesAlone) {
  require(broken(FakeAirframe::kLeft, "gone"));
  EXPECT_EQ(sim_.value("sim/operation/failures/rel_fcon_ailn_1_lft_gone"), 6.0F);
  requireClear();
  sim_.setReadOnly("sim/operation/failures/rel_fcon_ailn_1_lft_gone");
  const RequestResult result = set(broken(FakeAirframe::kLeft, "gone"));
  EXPECT_EQ(result.code, ResultCode::kTimeout);
  EXPECT_EQ(result.text, "X-Plane does not show it");
}

TEST_F(FailureManagerTest12, WhatXPlaneCannotExpressIsDrivenAtOnce) {
  require(broken(FakeAirframe::kLeft, "reduced", 0.5));
  EXPECT_EQ(state(), SurfaceControlState::kDriving);
}

// ------------------------------------------------------------------------------------------------ publishing

TEST_F(FailureManagerTest, SnapshotIsPublishedOnEveryChangeAndOnceASecond) {
  sim_.run(3.0);
  EXPECT_EQ(published_.size(), 3U);
  published_.clear();
  sim_.set(kPitot, 6.0F);
  sim_.run(1.1);
  EXPECT_TRUE(std::any_of(published_.begin(), published_.end(),
                          [](const FailureSnapshot& snapshot) { return snapshot.labels.size() == 1; }));
}

TEST_F(FailureManagerTest, LaterVersionsFailuresAreWatchedOnceItIsKnown) {
  sim_.setVersion(core::kXPlane12);
  sim_.setAll(core::simulatorFailures(core::kXPlane12), 0.0F);
  failures_.onLink(sim_.status());
  sim_.set(kLock, 6.0F);
  sim_.run(1.1);
  EXPECT_EQ(labelNames(), Names{"rel_fcon_ailn_1_lft_lock"});
}

}  // namespace
}  // namespace xplane_bridge
