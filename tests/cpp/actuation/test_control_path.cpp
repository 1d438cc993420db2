#include "xplane_bridge/actuation/control_path.hpp"

#include <gtest/gtest.h>

#include "flown_path.hpp"

namespace xplane_bridge {
namespace {

using core::FlightMode;
using core::LinkState;
using Floats = std::vector<float>;
using Texts = std::vector<std::string>;

class ControlPathTest : public testing::Test, protected FlownPath {
 protected:
  bool inJournal(const std::string& dataref) const {
    for (const core::JournalEntry& entry : sim.journal()->entries()) {
      if (entry.id == "override:" + dataref) return true;
    }
    return false;
  }
  /// Another client, or the panic tool, takes the override back, and X-Plane shows it for the half second it takes to
  /// believe it.
  void releaseByAnother() {
    run(0.3);
    sim.set(kStickOverride, 0.0F);
    run(0.7);
  }
};

// --- down ---

TEST_F(ControlPathTest, SendsNothingBeforeTheFirstCommand) {
  start();
  run(2.0);
  EXPECT_EQ(path->standing(), Standing::kFlying);
  EXPECT_EQ(path->refusal(), "");
  EXPECT_TRUE(sim.writes().empty());
  ASSERT_EQ(modes.size(), 1u);
  EXPECT_EQ(modes[0].reason, "start");
}

TEST_F(ControlPathTest, ACommandGoesDownOnceAfterItsOverride) {
  start();
  bool recorded = false;
  sim.on_message = [&](const core::FakeSimulator::Message& message) {
    if (message.path == kStickOverride) recorded = inJournal(kStickOverride);
  };
  EXPECT_FALSE(path->command(FlightMode::kManual, rollCommand(0.25, 7)));
  const std::vector<std::pair<std::string, float>> expected = {{kStickOverride, 1.0F}, {kStickRoll, 0.25F}};
  EXPECT_EQ(sim.writes(), expected);
  EXPECT_TRUE(recorded) << "in the journal before it is sent";
  ASSERT_EQ(applied.size(), 1u);
  EXPECT_EQ(applied[0].controls.sequence, 7u);
  EXPECT_FALSE(applied[0].read_back);
  EXPECT_DOUBLE_EQ(stick[0], 0.25);
  EXPECT_TRUE(std::isnan(stick[1])) << "nobody commands pitch";
}

TEST_F(ControlPathTest, ReadBackComesHomeOnceWithTheFrameThatShowsIt) {
  start();
  path->command(FlightMode::kManual, rollCommand(0.25, 7));
  const double sent_at = applied.at(0).sim_time;
  sim.frame();
  sim.frame();
  ASSERT_EQ(applied.size(), 2u);
  EXPECT_TRUE(applied[1].read_back);
  EXPECT_EQ(applied[1].controls.sequence, 7u);
  EXPECT_EQ(applied[1].sent_ns, applied[0].sent_ns);
  EXPECT_NEAR(applied[1].read_back_sim_time, sent_at + 0.02, 1e-4);
  EXPECT_NEAR(applied[1].read_back_frames, 1.0, 0.01);
}

TEST_F(ControlPathTest, OfCommandsWithinOneFrameTheNewestIsReadBackAndNoneTwice) {
  options.max_rate = 2000.0;
  start();
  path->command(FlightMode::kManual, rollCommand(0.1, 1));
  sim.frame();
  sim.frame(0.001);
  applied.clear();
  path->command(FlightMode::kManual, rollCommand(0.2, 2));
  sim.frame(0.0005);
  path->command(FlightMode::kManual, rollCommand(0.3, 3));
  applied.clear();
  sim.frame();
  sim.frame();
  ASSERT_EQ(applied.size(), 1u);
  EXPECT_EQ(applied[0].controls.sequence, 3u);
}

TEST_F(ControlPathTest, WhatXPlaneDoesNotShowIsNamed) {
  sim.setReadOnly(kStickRoll);
  start();
  core::ControlCommand command = rollCommand(0.5);
  command.fields |= core::kFieldPitch;
  command.pitch = -0.25;
  runWith(command, 0.5);
  EXPECT_EQ(path->notFollowed(), Texts{}) << "it is given a second";
  runWith(command, 1.0);
  EXPECT_EQ(path->notFollowed(), Texts{"roll"});
  sim.setReadOnly(kStickRoll, false);
  runWith(command, 0.1);
  EXPECT_EQ(path->notFollowed(), Texts{});
}

TEST_F(ControlPathTest, ARefusedCommandChangesNothing) {
  start();
  const auto refusal = path->command(FlightMode::kManual, rollCommand(1.5));
  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->reason, core::Refusal::kOutOfRange);
  EXPECT_TRUE(sim.writes().empty());
  EXPECT_EQ(path->statistics(FlightMode::kManual).refusedTotal(), 1u);
}

TEST_F(ControlPathTest, TheSourceThatDoesNotFlyIsHeardButNotSent) {
  start();
  path->command(FlightMode::kAuto, rollCommand(0.25));
  run(0.1);
  EXPECT_TRUE(sim.writes().empty());
  EXPECT_TRUE(modes.back().auto_alive);
}

TEST_F(ControlPathTest, HandlesAreSentForAMomentAfterAChangeOnly) {
  start();
  core::ControlCommand command;
  command.fields = core::kFieldFlaps;
  command.flaps = 0.5;
  runWith(command, 0.4);
  EXPECT_GE(writesTo(kFlapHandle).size(), 10u) << "one may be lost";
  sim.clearMessages();
  sim.set(kFlapHandle, 0.25F);  // moved in the cockpit
  runWith(command, 1.0);
  EXPECT_TRUE(writesTo(kFlapHandle).empty());
  command.flaps = 1.0;
  path->command(FlightMode::kManual, command);
  EXPECT_EQ(writesTo(kFlapHandle), Floats{1.0F});
}

TEST_F(ControlPathTest, XPlane12GetsItsOwnNames) {
  const char* const handle = "sim/cockpit2/controls/flap_handle_request_ratio";
  sim.set(handle, 0.0F);
  sim.setVersion({122015});
  start();
  core::ControlCommand command;
  command.fields = core::kFieldFlaps;
  command.flaps = 0.5;
  path->command(FlightMode::kManual, command);
  EXPECT_EQ(writesTo(handle), Floats{0.5F});
  sim.frame();
  sim.frame();
  EXPECT_TRUE(applied.back().read_back);
}

// --- when ---

TEST_F(ControlPathTest, ACommandNeverWaitsForARefresh) {
  start();
  path->command(FlightMode::kManual, rollCommand(0.1));
  sim.clearMessages();
  frame();  // a refresh, 20 ms later
  ASSERT_EQ(writesTo(kStickRoll), Floats{0.1F});
  sim.frame(0.001);
  path->command(FlightMode::kManual, rollCommand(0.2));
  EXPECT_EQ(writesTo(kStickRoll), (Floats{0.1F, 0.2F})) << "within the same call";
  EXPECT_FALSE(path->deadline());
}

TEST_F(ControlPathTest, ACommandThatMustWaitIsSentWhenItMay) {
  options.max_rate = 200.0;
  start();
  path->command(FlightMode::kManual, rollCommand(0.1));
  const std::int64_t first = sim.clock().steady_ns();
  sim.clearMessages();
  sim.frame(0.001);
  path->command(FlightMode::kManual, rollCommand(0.2));
  sim.frame(0.001);
  path->command(FlightMode::kManual, rollCommand(0.3));  // takes the place of the one that waits
  EXPECT_TRUE(writesTo(kStickRoll).empty());
  ASSERT_TRUE(path->deadline());
  EXPECT_EQ(*path->deadline(), first + 5'000'000);
  sim.frame(0.0029);
  path->tick();
  EXPECT_TRUE(writesTo(kStickRoll).empty()) << "not before it may";
  sim.frame(0.0001);
  path->tick();
  EXPECT_EQ(writesTo(kStickRoll), Floats{0.3F});
  EXPECT_FALSE(path->deadline());
  sim.frame(0.004);
  path->command(FlightMode::kManual, rollCommand(0.4));
  ASSERT_TRUE(path->deadline()) << "the one that waited counts from when it was sent";
  EXPECT_EQ(*path->deadline(), first + 10'000'000);
}

TEST_F(ControlPathTest, AStreamAtTheHighestRateIsSentAtThatRate) {
  options.max_rate = 100.0;
  start();
  sim.clearMessages();
  for (int i = 0; i < 1000; ++i) {  // a second of a command each millisecond
    path->command(FlightMode::kManual, rollCommand(i * 1e-3));
    const auto wait = path->deadline();
    sim.frame(0.001);
    if (wait && sim.clock().steady_ns() >= *wait) path->tick();
  }
  EXPECT_NEAR(static_cast<double>(writesTo(kStickRoll).size()), 100.0, 1.0);
}

TEST_F(ControlPathTest, ALostCommandIsRepeatedByTheRefresh) {
  start();
  path->command(FlightMode::kManual, rollCommand(0.1));
  sim.loseMessages(1);
  frame();
  path->command(FlightMode::kManual, rollCommand(0.5));
  sim.loseMessages(1);
  sim.clearMessages();
  frame();
  EXPECT_EQ(writesTo(kStickRoll), Floats{0.5F}) << "this one is lost";
  frame();
  EXPECT_FLOAT_EQ(sim.value(kStickRoll), 0.5F);
}

TEST_F(ControlPathTest, ALostOverrideIsSetAgainWithinASecond) {
  start();
  sim.loseMessages(1);
  path->command(FlightMode::kManual, rollCommand(0.1));
  EXPECT_FLOAT_EQ(sim.value(kStickOverride), 0.0F);
  runWith(rollCommand(0.1), 1.1);
  EXPECT_FLOAT_EQ(sim.value(kStickOverride), 1.0F);
}

// --- modes ---

TEST_F(ControlPathTest, AModeIsAskedForAndChangesWhatIsSent) {
  start();
  path->command(FlightMode::kManual, rollCommand(0.1));
  path->command(FlightMode::kAuto, rollCommand(-0.2));
  sim.frame(0.001);
  sim.clearMessages();
  EXPECT_EQ(ask(FlightMode::kAuto), core::RequestOutcome::kChanged);
  EXPECT_EQ(writesTo(kStickRoll), Floats{-0.2F});
  EXPECT_EQ(events, Texts{"AUTO: request (test)"});
  EXPECT_EQ(modes.back().mode, FlightMode::kAuto);
  EXPECT_EQ(ask(FlightMode::kAuto), core::RequestOutcome::kUnchanged);
  EXPECT_EQ(events.size(), 1u);
  EXPECT_EQ(modes.back().reason, "request (already in this mode)") << "answered all the same";
}

TEST_F(ControlPathTest, TheStickTakesOverInTheSameCall) {
  start();
  path->command(FlightMode::kManual, rollCommand(0.1));
  path->command(FlightMode::kAuto, rollCommand(-0.2));
  ask(FlightMode::kAuto);
  excitation.channels.set(core::index(core::Channel::kRoll));
  sim.frame(0.01);
  sim.clearMessages();
  path->command(FlightMode::kManual, rollCommand(0.6));
  EXPECT_EQ(writesTo(kStickRoll), Floats{0.6F});
  EXPECT_EQ(modes.back().mode, FlightMode::kManual);
  EXPECT_EQ(events.back(), "MANUAL: stick take-over: roll moved by 0.50 since AUTO was engaged (control/manual)");
  EXPECT_EQ(excitation_ends, Texts{"the mode changed"});
}

TEST_F(ControlPathTest, ASilentStickGoesToItsFailsafe) {
  start();
  path->command(FlightMode::kManual, rollCommand(0.4));
  run(0.48);
  EXPECT_FALSE(modes.back().failsafe);
  run(0.06);
  EXPECT_TRUE(modes.back().failsafe);
  EXPECT_EQ(modes.back().reason, "timeout of control/manual");
  EXPECT_FLOAT_EQ(sim.value(kStickRoll), 0.0F);
  EXPECT_TRUE(path->commanded().none());
}

TEST_F(ControlPathTest, WhilePausedNoTimeOutAdvances) {
  start();
  path->command(FlightMode::kManual, rollCommand(0.4));
  frame();
  setState(LinkState::kPaused);
  run(5.0);
  EXPECT_EQ(path->standing(), Standing::kFlying);
  EXPECT_FALSE(modes.back().failsafe);
  EXPECT_FLOAT_EQ(sim.value(kStickRoll), 0.4F);
}

// --- test signals ---

TEST_F(ControlPathTest, AnExcitationGoesOutWithEveryFrameAndItsEndToo) {
  start();
  path->command(FlightMode::kManual, rollCommand(0.1));
  sim.frame(0.001);
  sim.clearMessages();
  excitation.channels.set(core::index(core::Channel::kRoll));
  excitation.value = 0.3;
  sim.frame(0.001);
  sim.frame(0.001);
  EXPECT_EQ(writesTo(kStickRoll), (Floats{0.4F, 0.4F}));
  excitation = {};
  sim.frame(0.001);
  sim.frame(0.001);
  EXPECT_EQ(writesTo(kStickRoll), (Floats{0.4F, 0.4F, 0.1F})) << "without it, once";
}

TEST_F(ControlPathTest, AnExcitationEndsWithTheSourceAndIsNotSentOnTheFailsafe) {
  start();
  path->command(FlightMode::kManual, rollCommand(0.1));
  excitation.channels.set(core::index(core::Channel::kRoll));
  excitation.value = 0.3;
  run(0.4);
  EXPECT_TRUE(excitation_ends.empty());
  run(0.2);
  EXPECT_EQ(excitation_ends, Texts{"nobody commands the axis any more"});
  const Floats rolls = writesTo(kStickRoll);
  EXPECT_EQ(rolls.back(), 0.0F);
  EXPECT_EQ(std::count(rolls.begin(), rolls.end(), 0.3F), 0) << "the signal on the failsafe's 0";
}

TEST_F(ControlPathTest, CommandedAreTheChannelsOfALivingSource) {
  start();
  EXPECT_TRUE(path->commanded().none());
  path->command(FlightMode::kManual, rollCommand(0.1));
  core::ChannelSet roll;
  roll.set(core::index(core::Channel::kRoll));
  EXPECT_EQ(path->commanded(), roll);
  path->suspend("loading");
  EXPECT_TRUE(path->commanded().none());
}

// --- standings ---

TEST_F(ControlPathTest, NotConnectedUntilXPlaneAnswers) {
  sim.setState(LinkState::kSearching);
  start(LinkState::kSearching);
  EXPECT_EQ(path->standing(), Standing::kNotConnected);
  EXPECT_EQ(path->refusal(), "X-Plane is not connected");
  path->command(FlightMode::kManual, rollCommand(0.1));
  path->command(FlightMode::kManual, rollCommand(0.1));
  EXPECT_TRUE(sim.writes().empty());
  EXPECT_EQ(warnings, Texts{"commands are not sent: X-Plane is not connected"}) << "once";
  EXPECT_TRUE(std::isnan(stick[0]));
  setState(LinkState::kConnected);
  frame();
  EXPECT_EQ(path->standing(), Standing::kFlying);
  path->command(FlightMode::kManual, rollCommand(0.1));
  EXPECT_FLOAT_EQ(sim.value(kStickRoll), 0.1F);
}

TEST_F(ControlPathTest, StaleKeepsEverything) {
  start();
  runWith(rollCommand(0.3), 0.1);
  setState(LinkState::kStale);
  EXPECT_EQ(path->standing(), Standing::kFlying);
  sim.clearMessages();
  path->command(FlightMode::kManual, rollCommand(0.3));
  EXPECT_EQ(writesTo(kStickRoll), Floats{0.3F});
  setState(LinkState::kConnected);
  frame();
  EXPECT_EQ(path->standing(), Standing::kFlying);
  EXPECT_TRUE(inJournal(kStickOverride));
  EXPECT_TRUE(events.empty());
}

TEST_F(ControlPathTest, AfterALossItWaitsForAFrameAndTakesTheOverrideAgain) {
  start();
  runWith(rollCommand(0.3), 0.2);
  excitation.channels.set(core::index(core::Channel::kRoll));
  setState(LinkState::kLost);
  EXPECT_EQ(path->standing(), Standing::kNotConnected);
  EXPECT_EQ(excitation_ends, Texts{"nothing is sent: X-Plane is not connected"});
  sim.set(kStickOverride, 0.0F);  // X-Plane was restarted meanwhile
  path->command(FlightMode::kManual, rollCommand(0.3));
  setState(LinkState::kConnected);
  EXPECT_EQ(path->standing(), Standing::kNotConnected);
  EXPECT_EQ(path->refusal(), "X-Plane is back, but has not shown its flight yet");
  sim.clearMessages();
  path->command(FlightMode::kManual, rollCommand(0.3));
  EXPECT_TRUE(sim.writes().empty());
  frame();
  EXPECT_EQ(path->standing(), Standing::kFlying);
  runWith(rollCommand(0.3), 0.1);
  EXPECT_FLOAT_EQ(sim.value(kStickOverride), 1.0F);
  EXPECT_FLOAT_EQ(sim.value(kStickRoll), 0.3F);
}

TEST_F(ControlPathTest, AfterALossNobodyFliesXPlaneIsLeftAlone) {
  start();
  runWith(rollCommand(0.3), 0.2);
  setState(LinkState::kLost);
  run(0.6);
  sim.clearMessages();
  setState(LinkState::kConnected);
  run(3.0);
  EXPECT_EQ(path->standing(), Standing::kFlying);
  EXPECT_EQ(sim.writes(), (std::vector<std::pair<std::string, float>>{{kStickOverride, 0.0F}})) << "given back";
  EXPECT_EQ(modes.back().reason, "X-Plane came back and nobody commanded it");
  EXPECT_FALSE(modes.back().failsafe);
}

TEST_F(ControlPathTest, ARestartWithoutASilenceIsSeenByItsTime) {
  start();
  core::ControlCommand command = rollCommand(0.3);
  command.fields |= core::kFieldFlaps;
  command.flaps = 0.5;
  runWith(command, 1.0);
  sim.set(kFlapHandle, 0.0F);
  sim.set(kStickOverride, 0.0F);
  sim.set("sim/time/total_running_time_sec", 1.0F);
  runWith(command, 0.1);
  EXPECT_FLOAT_EQ(sim.value(kStickOverride), 1.0F);
  EXPECT_FLOAT_EQ(sim.value(kFlapHandle), 0.5F) << "another X-Plane does not know where the handles are";
}

TEST_F(ControlPathTest, AnotherAircraftIsNotFlown) {
  start(LinkState::kConnected, "");
  EXPECT_EQ(path->standing(), Standing::kWrongAircraft);
  EXPECT_EQ(path->refusal(), "X-Plane has not told which aircraft is loaded");
  path->onAircraft({"QUAD", "Quadrotor"});
  EXPECT_EQ(path->standing(), Standing::kWrongAircraft);
  EXPECT_EQ(path->refusal(),
            "the aircraft loaded is QUAD (Quadrotor), but config/aircraft/fixed_wing.yaml is for DA62");
  path->command(FlightMode::kManual, rollCommand(0.3));
  EXPECT_TRUE(sim.writes().empty());
  EXPECT_FALSE(path->fits({"QUAD", ""}));
  EXPECT_TRUE(path->fits({"DA62", "Twin Star"}));
  path->onAircraft({"DA62", ""});
  EXPECT_EQ(path->standing(), Standing::kFlying);
}

TEST_F(ControlPathTest, OverridesAreGivenBackWhenAnotherAircraftComes) {
  start();
  runWith(rollCommand(0.3), 0.2);
  path->onAircraft({"QUAD", ""});
  path->command(FlightMode::kManual, rollCommand(0.3));
  EXPECT_FLOAT_EQ(sim.value(kStickOverride), 0.0F);
  EXPECT_EQ(path->standing(), Standing::kWrongAircraft);
}

TEST_F(ControlPathTest, WithoutAListAnyAircraftIsFlown) {
  options.aircraft.clear();
  start(LinkState::kConnected, "");
  EXPECT_EQ(path->standing(), Standing::kFlying);
}

TEST_F(ControlPathTest, SuspendedNothingIsFlownAndEverythingGivenBack) {
  start();
  runWith(rollCommand(0.3), 0.2);
  excitation.channels.set(core::index(core::Channel::kRoll));
  path->suspend("another aircraft is being loaded");
  EXPECT_EQ(path->standing(), Standing::kSuspended);
  EXPECT_EQ(path->refusal(), "another aircraft is being loaded");
  EXPECT_FLOAT_EQ(sim.value(kStickOverride), 0.0F);
  EXPECT_EQ(excitation_ends, Texts{"another aircraft is being loaded"});
  EXPECT_EQ(surface_releases, Texts{"another aircraft is being loaded"});
  sim.clearMessages();
  path->command(FlightMode::kManual, rollCommand(0.3));
  EXPECT_TRUE(writesTo(kStickRoll).empty());
  path->resume();
  EXPECT_EQ(path->standing(), Standing::kFlying);
  frame();
  EXPECT_FLOAT_EQ(sim.value(kStickOverride), 1.0F);
}

TEST_F(ControlPathTest, AnOverrideReleasedByAnotherStopsItUntilAModeIsAskedFor) {
  start();
  runWith(rollCommand(0.3), 0.3);
  releaseByAnother();
  EXPECT_EQ(path->standing(), Standing::kWaitingForMode);
  const std::string why =
      "another client has released sim/operation/override/override_joystick: ask for a mode to fly on";
  EXPECT_EQ(path->refusal(), why);
  EXPECT_EQ(events, Texts{"nothing is sent any more: " + why});
  EXPECT_EQ(surface_releases, Texts{why});
  EXPECT_FALSE(inJournal(kStickOverride));
  sim.clearMessages();
  runWith(rollCommand(0.3), 3.0);
  EXPECT_TRUE(sim.writes().empty());

  EXPECT_EQ(path->requestMode({0, 5, "test", 0.0}), core::RequestOutcome::kRefused);
  EXPECT_EQ(path->standing(), Standing::kWaitingForMode) << "no such mode";
  path->requestMode({8, 1, "counted", 1.0});
  EXPECT_EQ(path->standing(), Standing::kFlying);
  runWith(rollCommand(0.3), 0.1);
  EXPECT_FLOAT_EQ(sim.value(kStickOverride), 1.0F);
  EXPECT_TRUE(inJournal(kStickOverride));
}

TEST_F(ControlPathTest, ARepeatedRequestDoesNotEndTheWaiting) {
  start();
  path->requestMode({8, 1, "counted", 1.0});
  runWith(rollCommand(0.3), 0.3);
  releaseByAnother();
  ASSERT_EQ(path->standing(), Standing::kWaitingForMode);
  EXPECT_EQ(path->requestMode({8, 1, "counted", 1.0}), core::RequestOutcome::kIgnored);
  EXPECT_EQ(path->standing(), Standing::kWaitingForMode);
  path->requestMode({9, 1, "counted", 2.0});
  EXPECT_EQ(path->standing(), Standing::kFlying);
}

TEST_F(ControlPathTest, WhatXPlaneReleasesWithANewFlightIsTakenAgain) {
  start();
  runWith(rollCommand(0.3), 0.3);
  path->onNewFlight();
  sim.set(kStickOverride, 0.0F);
  runWith(rollCommand(0.3), 2.0);
  EXPECT_EQ(path->standing(), Standing::kFlying);
  EXPECT_FLOAT_EQ(sim.value(kStickOverride), 1.0F);
}

TEST_F(ControlPathTest, TheStandingsRankAndEachSurvivesTheOther) {
  start();
  runWith(rollCommand(0.3), 0.3);
  releaseByAnother();
  ASSERT_EQ(path->standing(), Standing::kWaitingForMode);
  path->onAircraft({"QUAD", ""});
  EXPECT_EQ(path->standing(), Standing::kWaitingForMode);
  path->suspend("loading");
  EXPECT_EQ(path->standing(), Standing::kSuspended);
  setState(LinkState::kLost);
  EXPECT_EQ(path->standing(), Standing::kNotConnected);
  setState(LinkState::kConnected);
  frame();
  EXPECT_EQ(path->standing(), Standing::kSuspended);
  path->resume();
  EXPECT_EQ(path->standing(), Standing::kWaitingForMode);
  ask(FlightMode::kManual);
  EXPECT_EQ(path->standing(), Standing::kWrongAircraft);
  path->onAircraft({"DA62", ""});
  EXPECT_EQ(path->standing(), Standing::kFlying);
}

TEST_F(ControlPathTest, SuspendedDuringALossItGivesBackAfterwards) {
  start();
  runWith(rollCommand(0.3), 0.3);
  setState(LinkState::kLost);
  path->suspend("loading");
  EXPECT_FLOAT_EQ(sim.value(kStickOverride), 1.0F) << "X-Plane does not answer";
  setState(LinkState::kConnected);
  runWith(rollCommand(0.3), 0.1);
  EXPECT_EQ(path->standing(), Standing::kSuspended);
  EXPECT_FLOAT_EQ(sim.value(kStickOverride), 0.0F);
}

TEST_F(ControlPathTest, WithoutTheJournalNothingIsTaken) {
  start();
  sim.breakJournal();
  path->command(FlightMode::kManual, rollCommand(0.3));
  path->command(FlightMode::kManual, rollCommand(0.3));
  frame();
  EXPECT_TRUE(sim.writes().empty());
  ASSERT_EQ(warnings.size(), 1u) << "warned of once";
  EXPECT_NE(warnings[0].find("commands are not sent, because overrides could not be given back"), std::string::npos);
  sim.breakJournal(false);
  path->command(FlightMode::kManual, rollCommand(0.3));
  frame();
  EXPECT_FLOAT_EQ(sim.value(kStickRoll), 0.3F);
}

TEST(Standing, EachHasAName) {
  for (const Standing standing : {Standing::kFlying, Standing::kWrongAircraft, Standing::kWaitingForMode,
                                  Standing::kSuspended, Standing::kNotConnected}) {
    EXPECT_STRNE(toString(standing), "");
  }
}

}  // namespace
}  // namespace xplane_bridge
