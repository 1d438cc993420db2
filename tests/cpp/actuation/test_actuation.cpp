#include "xplane_bridge/actuation/actuation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "actuation/actuation_rig.hpp"

namespace xplane_bridge {
namespace {

using core::EventKind;

constexpr const char* kRollOverride = "sim/operation/override/override_joystick_roll";
constexpr const char* kEngineFailure = "sim/operation/failures/rel_engfai0";

class ActuationTest : public testing::Test, protected ActuationRig {
 protected:
  /// Excites roll by a tenth; what then happens is to end it.
  void excite() {
    fly(0.2);
    ExcitationRequest request;
    request.kind = "doublet";
    request.target = "roll";
    request.amplitude = 0.1;
    request.duration = 20.0;
    EXPECT_EQ(actuation_->inject(request, "test").result.code, core::ResultCode::kAccepted);
    fly(0.2);
    EXPECT_NEAR(sim_.value(kRoll), 0.35F, 1e-6);
    EXPECT_EQ(labels_.back().result, "running");
    EXPECT_EQ(eventsOf(EventKind::kExcitation).back().who, "test");
  }
  /// Lost for so long; what it is then, the test sets.
  void beSilent(double seconds) {
    sim_.setState(core::LinkState::kLost);
    actuation_->onLink(sim_.status());
    for (double end = sim_.time() + seconds - 1e-6; sim_.time() < end;) sim_.frame(1.0);
  }
  /// Begins a gust.
  void disturb() {
    core::DisturbanceSpec spec;
    spec.from_deg = 270.0;
    spec.speed = 8.0;
    spec.duration = 20.0;
    EXPECT_EQ(actuation_->disturb("gust", spec, "test").result.code, core::ResultCode::kAccepted);
    run(2.0);
  }
  /// Breaks engine 1; X-Plane's frames go on while that is waited for.
  void failEngine() {
    sim_.set(kEngineFailure, 0.0F);
    sim_.on_frame = [this] { actuation_->tick(); };
    EXPECT_TRUE(actuation_->failures().set({"engine_1", "failed", {}, 0, 0.0}, "test").success());
    EXPECT_FLOAT_EQ(sim_.value(kEngineFailure), 6.0F);
  }
};

TEST_F(ActuationTest, AircraftThatXPlaneShowsIsFlownAndReported) {
  ASSERT_EQ(eventsOf(EventKind::kAircraft).size(), 1U);
  EXPECT_EQ(eventsOf(EventKind::kAircraft)[0].text, "aircraft: DA62 (Twin)");
  EXPECT_EQ(actuation_->control().aircraft, "DA62");
  fly(0.5);
  EXPECT_FLOAT_EQ(sim_.value(kRoll), 0.25F);
  EXPECT_TRUE(applied_.back().read_back || applied_[applied_.size() - 2].read_back);
  EXPECT_EQ(actuation_->control().received[0].accepted, 25U);
}

TEST_F(ActuationTest, AnotherAircraftIsReportedAndNotFlown) {
  fly(0.2);
  showAircraft("QUAD");
  fly(2.0);
  EXPECT_EQ(eventsOf(EventKind::kAircraft).back().text, "aircraft: QUAD (Twin); not the one of the configuration");
  EXPECT_EQ(actuation_->control().standing, Standing::kWrongAircraft);
  EXPECT_TRUE(actuation_->control().overrides.empty());
}

TEST_F(ActuationTest, ARestartedXPlaneIsNotFlownBeforeItHasShownItsAircraft) {
  fly(0.2);
  showAircraft("QUAD");
  sim_.restart();
  sim_.set(kFlightTime, 1.0F);
  sim_.clearMessages();
  actuation_->onLink(sim_.status());
  fly(2.0);
  for (const auto& [name, value] : sim_.writes()) EXPECT_NE(name, kRoll) << value;
  EXPECT_EQ(eventsOf(EventKind::kAircraft).back().text, "aircraft: QUAD (Twin); not the one of the configuration");
}

TEST_F(ActuationTest, ARestartedXPlaneWithTheSameAircraftIsFlownOn) {
  fly(0.2);
  sim_.restart();
  sim_.set(kFlightTime, 1.0F);
  sim_.set(kRoll, 0.0F);
  actuation_->onLink(sim_.status());
  fly(1.0);
  EXPECT_FLOAT_EQ(sim_.value(kRoll), 0.25F);
}

TEST_F(ActuationTest, AnotherXPlaneIsNotLeftWithTheTrafficOfTheLast) {
  const std::string override_name = core::trafficOverride(3);
  sim_.set(override_name, 0.0F);
  core::TrafficPose pose;
  pose.number = 3;
  pose.place = {37.46, 126.44, 500.0};
  for (const bool bridged : {false, true}) {  // by the link: it is seen by its time alone
    ASSERT_EQ(actuation_->traffic().command({pose}, actuation_->simTime()), "");
    ASSERT_FLOAT_EQ(sim_.value(override_name), 1.0F);
    bridged ? sim_.set("sim/time/total_running_time_sec", 1.0F) : sim_.restart();
    sim_.set(override_name, 0.0F);
    actuation_->onLink(sim_.status());
    run(3.0);
    EXPECT_FLOAT_EQ(sim_.value(override_name), 0.0F);
    EXPECT_TRUE(actuation_->control().overrides.empty());
  }
}

TEST_F(ActuationTest, AnotherXPlaneIsNotLeftWithTheWindOfTheLast) {
  const auto winds = core::windWrites({}, sim_.status().version);
  const auto seen = [&] { return sim_.value(winds[0].dataref); };
  for (const core::DatarefWrite& each : winds) sim_.set(each.dataref, 3.0F);
  sim_.setAll(core::shownWindDatarefs(sim_.status().version), 3.0F);
  disturb();
  ASSERT_NE(seen(), 3.0F);
  beSilent(15.0);
  ASSERT_EQ(sim_.journal()->entries().size(), 1U);
  for (const core::DatarefWrite& each : winds) sim_.set(each.dataref, 7.0F);
  sim_.restart();
  actuation_->onLink(sim_.status());
  EXPECT_TRUE(actuation_->windRefusal()) << "which X-Plane it is, its first frame shows";
  run(3.0);
  EXPECT_FLOAT_EQ(seen(), 7.0F);
  EXPECT_TRUE(sim_.journal()->entries().empty());
  EXPECT_FALSE(actuation_->windRefusal());
  // One that is seen by its time, while a disturbance runs.
  disturb();
  ASSERT_NE(seen(), 7.0F);
  for (const core::DatarefWrite& each : winds) sim_.set(each.dataref, 9.0F);
  sim_.restart();
  actuation_->onLink(sim_.status());
  run(3.0);
  EXPECT_FLOAT_EQ(seen(), 9.0F);
  EXPECT_TRUE(sim_.journal()->entries().empty());
}

TEST_F(ActuationTest, AnXPlaneThatIsBackGetsTheWindOfBeforeADisturbance) {
  const auto winds = core::windWrites({}, sim_.status().version);
  for (const core::DatarefWrite& each : winds) sim_.set(each.dataref, 3.0F);
  sim_.setAll(core::shownWindDatarefs(sim_.status().version), 3.0F);
  // A paused one may be away for longer than it has run.
  for (const auto& [seconds, state] :
       {std::pair(15.0, core::LinkState::kConnected), {600.0, core::LinkState::kPaused}}) {
    disturb();
    SCOPED_TRACE(seconds);
    const float flight_time = sim_.value(kFlightTime);
    beSilent(seconds);
    if (state == core::LinkState::kPaused) sim_.set(kFlightTime, flight_time);
    sim_.setState(state);
    actuation_->onLink(sim_.status());
    EXPECT_EQ(actuation_->disturb("stop", {}, "test").result.text, "no disturbance runs");
    run(0.5);
    for (const core::DatarefWrite& each : winds) EXPECT_FLOAT_EQ(sim_.value(each.dataref), 3.0F) << each.dataref;
    EXPECT_FALSE(actuation_->windRefusal());
    EXPECT_TRUE(sim_.journal()->entries().empty());
  }
}

TEST_F(ActuationTest, AFailureThatIsArmedEndsWithItsXPlaneHoweverLongTheNextOneHasRun) {
  const std::string time = "sim/time/total_running_time_sec";
  sim_.set(kEngineFailure, 0.0F);
  sim_.set(time, 20.0F);
  actuation_->onLink(sim_.status());
  run(3.0);
  ASSERT_TRUE(actuation_->failures().set({"engine_1", "failed", {}, 1, 100.0}, "test").code ==
              core::ResultCode::kAccepted);
  sim_.setState(core::LinkState::kLost);
  actuation_->onLink(sim_.status());
  for (int i = 0; i < 90; ++i) sim_.frame(1.0);
  sim_.set(time, 60.0F);  // more than the last one's, which ran for 90 s meanwhile
  sim_.set(kFlightTime, 0.5F);
  sim_.setState(core::LinkState::kConnected);
  actuation_->onLink(sim_.status());
  run(0.5);
  EXPECT_TRUE(actuation_->failures().snapshot().labels.empty());
  EXPECT_EQ(eventsOf(EventKind::kFailure).back().text, "failure of engine_1 has ended: X-Plane was restarted");
}

TEST_F(ActuationTest, ALoadThatIsSilentForLongIsANewFlightOfTheSameXPlane) {
  const std::string zulu = "sim/time/zulu_time_sec";
  sim_.setAll({kEngineFailure, "sim/time/use_system_time", zulu}, 0.0F);
  sim_.set("sim/time/total_running_time_sec", 1000.0F);
  run(0.2);
  ASSERT_EQ(actuation_->failures().set({"engine_1", "failed", {}, 1, 2000.0}, "test").code,
            core::ResultCode::kAccepted);
  core::TimeSetting time;
  time.zulu_time = 3600.0;
  time.restore_on_exit = true;
  actuation_->jobs().setTime(time, 1, "test");
  while (actuation_->jobs().busy()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  ASSERT_EQ(sim_.journal()->entries().size(), 1U);
  beSilent(15.0);
  sim_.set(kFlightTime, 0.3F);
  sim_.setState(core::LinkState::kConnected);
  actuation_->onLink(sim_.status());
  run(0.5);
  ASSERT_EQ(actuation_->failures().snapshot().labels.size(), 1U) << "still armed";
  ASSERT_EQ(eventsOf(EventKind::kReset).size(), 1U);
  EXPECT_EQ(eventsOf(EventKind::kReset)[0].text, "the flight began anew");
  EXPECT_EQ(sim_.journal()->entries().size(), 1U);
  EXPECT_TRUE(actuation_->undo(1.0));
  EXPECT_FLOAT_EQ(sim_.value(zulu), 0.0F);
}

TEST_F(ActuationTest, AFlightThatGoesOnThroughALongSilenceIsNoNewOne) {
  const float time = sim_.value("sim/time/total_running_time_sec");
  beSilent(60.0);
  sim_.set("sim/time/total_running_time_sec", time + 60.0F);
  sim_.set(kFlightTime, sim_.value(kFlightTime) + 60.0F);
  sim_.set("sim/flightmodel/position/latitude", 37.49F);  // 3.3 km on, from standing
  sim_.setState(core::LinkState::kConnected);
  sim_.frame();  // may come before the link's news
  actuation_->onLink(sim_.status());
  run(0.5);
  EXPECT_TRUE(eventsOf(EventKind::kReset).empty());
}

TEST_F(ActuationTest, ALoadThatIsSilentForLongerThanXPlaneHadRunIsANewFlight) {
  sim_.set("sim/time/total_running_time_sec", 5.0F);
  sim_.set(kFlightTime, 4.0F);
  actuation_->onLink(sim_.status());
  run(0.2);
  const std::size_t before = eventsOf(EventKind::kReset).size();
  sim_.setState(core::LinkState::kStale);
  actuation_->onLink(sim_.status());
  for (int i = 0; i < 8; ++i) sim_.frame(1.0);
  sim_.set(kFlightTime, 0.3F);
  sim_.setState(core::LinkState::kConnected);
  actuation_->onLink(sim_.status());
  run(0.2);
  ASSERT_EQ(eventsOf(EventKind::kReset).size(), before + 1);
  EXPECT_EQ(eventsOf(EventKind::kReset).back().text, "the flight began anew");
}

TEST_F(ActuationTest, NewFlightIsReportedAndEndsAuto) {
  actuation_->path().requestMode({1, 2, "test", 0.0});
  ASSERT_EQ(actuation_->control().mode.mode, core::FlightMode::kAuto);
  sim_.set(kFlightTime, 0.0F);
  run(0.1);
  ASSERT_EQ(eventsOf(EventKind::kReset).size(), 1U);
  EXPECT_EQ(actuation_->control().mode.mode, core::FlightMode::kManual);
  EXPECT_EQ(eventsOf(EventKind::kMode).back().who, "tx_node");
  EXPECT_EQ(eventsOf(EventKind::kReset)[0].sim_time, eventsOf(EventKind::kMode).back().sim_time);
}

TEST_F(ActuationTest, CrashIsReportedOnce) {
  sim_.set("sim/flightmodel2/misc/has_crashed", 1.0F);
  run(0.2);
  EXPECT_EQ(eventsOf(EventKind::kCrash).size(), 1U);
}

TEST_F(ActuationTest, PauseIsReportedWithWhoAskedForIt) {
  setPaused(true);
  setPaused(false);
  ASSERT_EQ(eventsOf(EventKind::kPause).size(), 2U);
  EXPECT_EQ(eventsOf(EventKind::kPause)[0].text, "paused");
  EXPECT_EQ(eventsOf(EventKind::kPause)[1].text, "resumed");
  EXPECT_EQ(eventsOf(EventKind::kPause)[0].who, "") << "by the user of X-Plane";
  sim_.on_message = [this](const core::FakeSimulator::Message& message) {
    if (message.path == "sim/operation/pause_toggle") setPaused(true);
  };
  EXPECT_TRUE(actuation_->setPaused(true, "test").success());
  EXPECT_EQ(eventsOf(EventKind::kPause).back().who, "test");
  EXPECT_TRUE(actuation_->setPaused(true, "another").success());
  setPaused(false);
  EXPECT_EQ(eventsOf(EventKind::kPause).back().who, "") << "what was paused already leaves no name";
}

TEST_F(ActuationTest, PauseIsRefusedWhileAResetRuns) {
  sim_.set(kFlightTime, 0.0F);  // waited for, so that X-Plane's frames go on, on the thread of the jobs
  sim_.frame();
  sim_.breakJournal();  // which ends the reset before it pauses X-Plane
  std::vector<RequestResult> answers;
  sim_.on_frame = [&] {
    sim_.set(kFlightTime, sim_.value(kFlightTime) + 0.02F);
    if (!answers.empty()) return;
    answers.resize(1);
    answers = {actuation_->setPaused(true, "test"), actuation_->setPaused(false, "test")};
  };
  core::FlightStart start;
  start.latitude_deg = 47.0;
  actuation_->jobs().reset(start, 1, "test");
  while (actuation_->jobs().busy()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  ASSERT_EQ(answers.size(), 2U);
  for (const RequestResult& answer : answers) {
    EXPECT_EQ(answer.code, core::ResultCode::kRefused);
    EXPECT_EQ(answer.text, "reset_flight runs: wait for its event");
  }
  EXPECT_EQ(actuation_->setPaused(false, "test").code, core::ResultCode::kOk);
}

TEST_F(ActuationTest, AnotherXPlaneIsNotGivenTheViewOfTheLast) {
  sim_.journal()->record("view:camera", kOverridePurpose, {core::UndoDref{kRoll, 0.7F}});
  sim_.restart();
  sim_.set(kFlightTime, 1.0F);
  actuation_->onLink(sim_.status());
  run(0.5);
  EXPECT_TRUE(sim_.journal()->entries().empty());
}

TEST_F(ActuationTest, AnIdentificationGoesByWhatIsNowNotByTheLastTick) {
  sim_.set(core::flightWatchDatarefs().end()[-2], 1.0F);  // a wheel is on the ground
  sim_.setState(core::LinkState::kLost);
  actuation_->onLink(sim_.status());
  run(0.5);
  const auto asked = [this] { return actuation_->identifySurfaces({}, "test", [] { return 1U; }).result; };
  ASSERT_EQ(asked().code, core::ResultCode::kNoLink);
  sim_.setState(core::LinkState::kConnected);
  actuation_->onLink(sim_.status());
  sim_.run(2.0);
  const std::string first = asked().text;
  EXPECT_EQ(asked().code, core::ResultCode::kRefused) << first;
  actuation_->tick();
  EXPECT_EQ(first, asked().text);
}

TEST_F(ActuationTest, DatarefIsWrittenAndShown) {
  const auto written = actuation_->settings().setDataref(kRoll, {0.5F}, "test");
  EXPECT_EQ(eventsOf(EventKind::kSetting).back().who, "test");
  EXPECT_EQ(written.result.code, core::ResultCode::kOk);
  EXPECT_EQ(written.values, std::vector<float>{0.5F});
  EXPECT_EQ(eventsOf(EventKind::kSetting).back().text, std::string("set_dataref ") + kRoll + ": X-Plane shows it");
  const auto unknown = actuation_->settings().setDataref("sim/no/such", {0.5F}, "test");
  EXPECT_EQ(unknown.result.code, core::ResultCode::kTimeout);
  EXPECT_TRUE(std::isnan(unknown.values[0]));
  EXPECT_FALSE(eventsOf(EventKind::kSetting).back().success);
  EXPECT_EQ(actuation_->settings().setDataref(kRoll, {}, "test").result.code, core::ResultCode::kRefused);
}

TEST_F(ActuationTest, DatarefThatIsShownOnlyNearlyIsNotSet) {
  sim_.set(kRoll, 0.49F);
  sim_.setReadOnly(kRoll);
  const auto written = actuation_->settings().setDataref(kRoll, {0.5F}, "test");
  EXPECT_EQ(written.result.code, core::ResultCode::kTimeout);
  EXPECT_EQ(written.result.text, std::string(kRoll) + " shows 0.490000, not 0.500000");
  EXPECT_EQ(actuation_->settings().setDataref(kRoll, {std::nanf("")}, "test").result.code, core::ResultCode::kRefused);
  const auto too_long = actuation_->settings().setDataref("sim/" + std::string(600, 'a'), {0.5F}, "test");
  EXPECT_EQ(too_long.result.code, core::ResultCode::kRefused) << too_long.result.text;
}

TEST_F(ActuationTest, OverrideOfAServiceIsHeldUntilItGivesItBack) {
  const std::string name = "sim/operation/override/override_joystick_roll";
  EXPECT_TRUE(actuation_->settings().setDataref(name, {1.0F}, "test").result.success());
  EXPECT_EQ(actuation_->control().overrides, std::vector<std::string>{name});
  EXPECT_EQ(sim_.journal()->entries().size(), 1U);
  EXPECT_TRUE(actuation_->settings().setDataref(name, {0.0F}, "test").result.success());
  EXPECT_TRUE(actuation_->control().overrides.empty());
  EXPECT_FLOAT_EQ(sim_.value(name), 0.0F);
}

TEST_F(ActuationTest, CommandIsSentOrRefused) {
  EXPECT_EQ(actuation_->settings().runCommand("sim/lights/landing_lights_on").code, core::ResultCode::kAccepted);
  EXPECT_EQ(sim_.commands().back(), "sim/lights/landing_lights_on");
  EXPECT_EQ(actuation_->settings().runCommand(std::string(2000, 'a')).code, core::ResultCode::kRefused);
  EXPECT_EQ(actuation_->settings().runCommand("").code, core::ResultCode::kRefused);
  sim_.setState(core::LinkState::kLost);
  EXPECT_EQ(actuation_->settings().runCommand("sim/lights/landing_lights_on").code, core::ResultCode::kNoLink);
}

TEST_F(ActuationTest, FailsafeIsAWarning) {
  fly(0.2);
  run(2.0);
  const ActuationEvent reported = eventsOf(EventKind::kMode).back();
  EXPECT_TRUE(reported.warning);
  EXPECT_EQ(reported.text, "MANUAL: failsafe: timeout of control/manual");
  EXPECT_TRUE(modes_.back().failsafe);
}

TEST_F(ActuationTest, LinkIsReportedWithItsReason) {
  sim_.setState(core::LinkState::kLost);
  actuation_->onLink(sim_.status());
  EXPECT_EQ(eventsOf(EventKind::kLink).back().text.substr(0, 6), "LOST: ");
  EXPECT_EQ(actuation_->setPaused(true, "test").code, core::ResultCode::kNoLink);
  EXPECT_EQ(actuation_->settings().setDataref(kRoll, {0.5F}, "test").result.code, core::ResultCode::kNoLink);
  EXPECT_EQ(actuation_->jobs().refusal()->code, core::ResultCode::kNoLink);
}

TEST_F(ActuationTest, ANewFlightEndsATestSignal) {
  excite();
  sim_.set(kFlightTime, 0.0F);
  fly(0.2);
  EXPECT_EQ(labels_.back().result, "aborted: the flight was reset");
}

TEST_F(ActuationTest, ACrashEndsATestSignal) {
  excite();
  sim_.set("sim/flightmodel2/misc/has_crashed", 1.0F);
  fly(0.2);
  EXPECT_EQ(labels_.back().result, "aborted: the aircraft has crashed");
}

TEST_F(ActuationTest, AnotherAircraftEndsATestSignal) {
  excite();
  showAircraft("QUAD");
  fly(3.0);
  EXPECT_EQ(labels_.back().result.find("aborted: "), 0U) << labels_.back().result;
  EXPECT_EQ(eventsOf(EventKind::kExcitation).back().success, false);
}

TEST_F(ActuationTest, TheEndEndsATestSignal) {
  excite();
  actuation_->stop();
  EXPECT_EQ(labels_.back().result, "aborted: tx_node ends");
}

TEST_F(ActuationTest, FailureIsReportedPublishedAndRepairedAgain) {
  failEngine();
  ASSERT_EQ(eventsOf(EventKind::kFailure).size(), 1U);
  EXPECT_EQ(eventsOf(EventKind::kFailure)[0].text, "failure: engine_1 failed");
  EXPECT_EQ(eventsOf(EventKind::kFailure)[0].who, "test");
  run(1.5);
  ASSERT_EQ(broken_.back().labels.size(), 1U);
  EXPECT_EQ(broken_.back().labels[0].name, "engine_1");
  EXPECT_TRUE(broken_.back().labels[0].confirmed);
  EXPECT_TRUE(actuation_->undo(1.0));
  EXPECT_FLOAT_EQ(sim_.value(kEngineFailure), 0.0F);
  EXPECT_TRUE(actuation_->failures().snapshot().labels.empty());
}

TEST_F(ActuationTest, AfterAHangNothingIsBrokenOrFlownUntilAModeIsAskedFor) {
  failEngine();
  fly(0.2);
  EXPECT_FLOAT_EQ(sim_.value(kRollOverride), 1.0F);
  actuation_->onHang();
  EXPECT_TRUE(actuation_->control().overrides.empty());
  EXPECT_TRUE(actuation_->failures().snapshot().labels.empty());
  EXPECT_FLOAT_EQ(sim_.value(kRollOverride), 0.0F);
  EXPECT_FLOAT_EQ(sim_.value(kEngineFailure), 0.0F);
  fly(0.5);
  EXPECT_FLOAT_EQ(sim_.value(kRollOverride), 0.0F) << "the stick alone does not take it again";
  actuation_->path().requestMode({1, 1, "test", 0.0});
  fly(0.5);
  EXPECT_FLOAT_EQ(sim_.value(kRollOverride), 1.0F);
}

TEST_F(ActuationTest, PauseThatXPlaneDoesNotFollowIsReported) {
  EXPECT_EQ(actuation_->setPaused(true, "test").code, core::ResultCode::kTimeout);
  ASSERT_EQ(eventsOf(EventKind::kPause).size(), 1U);
  EXPECT_EQ(eventsOf(EventKind::kPause)[0].text, "pause asked for: X-Plane did not follow in time");
  EXPECT_EQ(eventsOf(EventKind::kPause)[0].who, "test");
  EXPECT_FALSE(eventsOf(EventKind::kPause)[0].success);
  setPaused(true);
  EXPECT_EQ(eventsOf(EventKind::kPause).back().who, "") << "that is another's";
}

TEST_F(ActuationTest, SurfacesThatAreNotKnownAreNotCommanded) {
  fly(0.2);
  EXPECT_NE(actuation_->commandSurfaces({"aileron1_wing2_left"}, {5.0F}, 1), "");
  EXPECT_EQ(actuation_->commandSurfaces({}, {}, 2), "") << "nothing is to be driven";
  setPaused(true);
  const auto identifying = actuation_->identifySurfaces({}, "test", [] { return 1U; });
  EXPECT_EQ(identifying.result.text, "X-Plane is paused: let it run first");
  EXPECT_EQ(identifying.event_number, 0U);
}

TEST_F(ActuationTest, FlightIsKnownOnceXPlaneHasShownIt) {
  EXPECT_TRUE(actuation_->knowsFlight());
  EXPECT_GT(actuation_->framesFlown(), 0U);
  sim_.setVersion({});
  actuation_->onLink(sim_.status());
  EXPECT_FALSE(actuation_->knowsFlight());
}

TEST_F(ActuationTest, WhatXPlaneDoesNotShowGivenBackStaysInTheJournal) {
  fly(0.2);
  sim_.setReadOnly(kRollOverride);
  actuation_->stop();
  EXPECT_FALSE(actuation_->undo(0.5));
  EXPECT_FALSE(sim_.journal()->entries().empty());
}

TEST_F(ActuationTest, EverythingIsGivenBackInTheEnd) {
  fly(0.2);
  ASSERT_FALSE(actuation_->control().overrides.empty());
  const std::string override_name = actuation_->control().overrides.front();
  actuation_->stop();
  EXPECT_TRUE(actuation_->undo(1.0));
  EXPECT_FLOAT_EQ(sim_.value(override_name), 0.0F);
  EXPECT_TRUE(sim_.journal()->entries().empty());
}

}  // namespace
}  // namespace xplane_bridge
