#include "xplane_bridge/actuation/control_path.hpp"

#include <gtest/gtest.h>

#include <algorithm>

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
  static constexpr const char* kRunningTime = "sim/time/total_running_time_sec";
  static constexpr const char* kRudderTrim = "sim/cockpit2/controls/rudder_trim";
  static constexpr const char* kFlightTime = "sim/time/total_flight_time_sec";

  /// Asks for the mode and flies in it, a quarter to the right.
  void fly(FlightMode mode, double seconds) {
    sim.set(kFlightTime, 50.0F);
    if (mode == FlightMode::kAuto) ask(mode);
    flyOn(mode, seconds);
    ASSERT_FLOAT_EQ(sim.value(kStickRoll), 0.25F);
    ASSERT_EQ(modes.back().mode, mode);
  }
  void flyOn(FlightMode mode, double seconds) {
    for (const double end = sim.time() + seconds - 1e-6; sim.time() < end;) {
      path->command(mode, rollCommand(0.25));
      frame();
    }
  }
  /// X-Plane ends and comes back with a flight of its own.
  void restartXPlane() {
    setState(LinkState::kLost);
    run(1.0);
    sim.set(kRunningTime, 1.0F);
    sim.set(kFlightTime, 1.0F);
    sim.set(kStickOverride, 0.0F);
    sim.set(kStickRoll, 0.0F);
    setState(LinkState::kConnected);
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
  EXPECT_TRUE(std::isnan(stick[1])) << "no source commands pitch";
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

TEST_F(ControlPathTest, ReadBackGoesWithTheChannelsThatAreCommanded) {
  start();
  runWith(rollCommand(0.25, 1), 0.1);
  core::ControlCommand pitch;
  pitch.sequence = 2;
  pitch.fields = core::kFieldPitch;
  pitch.pitch = -0.5;
  path->command(FlightMode::kManual, pitch);
  EXPECT_EQ(applied.back().sent_ns, sim.clock().system_ns());
  sim.frame();
  sim.frame();
  EXPECT_TRUE(applied.back().read_back);
  EXPECT_EQ(applied.back().controls.sequence, 2u);
}

TEST_F(ControlPathTest, WhatStoodThereBeforeTheCommandIsNoReadBack) {
  start();
  runWith(rollCommand(0.25, 1), 0.1);
  const float stands = sim.value(kRunningTime);
  sim.on_frame = [&] { sim.set(kRunningTime, stands); };  // what X-Plane has sent before the command reached it
  applied.clear();
  path->command(FlightMode::kManual, rollCommand(0.25, 2));
  sim.frame();
  ASSERT_EQ(applied.size(), 1u);
  EXPECT_FALSE(applied[0].read_back);
  sim.on_frame = nullptr;
  sim.frame();
  ASSERT_EQ(applied.size(), 2u);
  EXPECT_TRUE(applied[1].read_back);
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

TEST_F(ControlPathTest, AFailsafeBeginsAndEndsWithAnEventThatNamesItsCause) {
  start();
  path->command(FlightMode::kAuto, rollCommand(0.4));
  ask(FlightMode::kAuto);
  run(0.3);
  EXPECT_EQ(events, Texts{"AUTO: request (test)"});
  run(0.4);
  ASSERT_EQ(events.size(), 2u) << "once";
  EXPECT_EQ(events[1], "AUTO: failsafe: timeout of control/auto");
  path->command(FlightMode::kAuto, rollCommand(0.4));
  run(0.1);
  ASSERT_EQ(events.size(), 3u);
  EXPECT_EQ(events[2], "AUTO: the failsafe ends: control/auto is back");
}

TEST_F(ControlPathTest, ANewFlightEndsAutoUntilItIsAskedForAgain) {
  start();
  fly(FlightMode::kAuto, 0.3);
  path->onNewFlight("the flight began anew");
  const std::string reason = "the flight began anew; AUTO is off until it is asked for";
  EXPECT_EQ(events.back(), "MANUAL: " + reason + " (tx_node)");
  EXPECT_EQ(modes.back().mode, FlightMode::kManual);
  EXPECT_EQ(modes.back().reason, reason);
  flyOn(FlightMode::kAuto, 0.3);
  EXPECT_EQ(modes.back().mode, FlightMode::kManual) << "though its controller goes on";
  EXPECT_FLOAT_EQ(sim.value(kStickRoll), 0.0F) << "the failsafe of MANUAL";
  ask(FlightMode::kAuto);
  flyOn(FlightMode::kAuto, 0.1);
  EXPECT_FLOAT_EQ(sim.value(kStickRoll), 0.25F);
}

TEST_F(ControlPathTest, ANewFlightLeavesManualAsItIs) {
  start();
  fly(FlightMode::kManual, 0.3);
  path->onNewFlight("the flight began anew");
  EXPECT_TRUE(events.empty());
  EXPECT_EQ(modes.back().reason, "start");
}

TEST_F(ControlPathTest, OnABenchAutoGoesOn) {
  options.resume_auto = true;
  start();
  fly(FlightMode::kAuto, 0.3);
  path->onNewFlight("the flight began anew");
  restartXPlane();
  flyOn(FlightMode::kAuto, 0.3);
  EXPECT_EQ(modes.back().mode, FlightMode::kAuto);
  EXPECT_FLOAT_EQ(sim.value(kStickRoll), 0.25F);
}

TEST_F(ControlPathTest, AGapInTheSameFlightKeepsAuto) {
  start();
  fly(FlightMode::kAuto, 0.3);
  setState(LinkState::kLost);
  flyOn(FlightMode::kAuto, 20.0);
  sim.set(kRunningTime, sim.value(kRunningTime) + 19.0F);
  sim.set(kFlightTime, sim.value(kFlightTime) + 19.0F);
  setState(LinkState::kConnected);
  flyOn(FlightMode::kAuto, 0.3);
  EXPECT_EQ(modes.back().mode, FlightMode::kAuto);
  EXPECT_FLOAT_EQ(sim.value(kStickRoll), 0.25F);
}

TEST_F(ControlPathTest, ARestartedXPlaneEndsAutoAndIsLeftAlone) {
  start();
  fly(FlightMode::kAuto, 0.3);
  restartXPlane();
  sim.clearMessages();
  flyOn(FlightMode::kAuto, 1.0);
  EXPECT_EQ(events.back(), "MANUAL: X-Plane was restarted; AUTO is off until it is asked for (tx_node)");
  EXPECT_EQ(modes.back().mode, FlightMode::kManual);
  EXPECT_EQ(modes.back().reason, "X-Plane was restarted; AUTO is off until it is asked for; MANUAL is not commanded");
  EXPECT_TRUE(writesTo(kStickRoll).empty());
}

TEST_F(ControlPathTest, ARestartThatTookLongIsKnownByTheTimesOfTheFlight) {
  for (const bool by_running_time : {true, false}) {
    SCOPED_TRACE(by_running_time ? "total running time" : "total flight time");
    start();
    fly(FlightMode::kAuto, 1.0);
    setState(LinkState::kLost);
    flyOn(FlightMode::kAuto, 5.0);
    // Further than the gap was long, or back to the flight's beginning.
    sim.set(by_running_time ? kRunningTime : kFlightTime, by_running_time ? sim.value(kRunningTime) + 60.0F : 0.0F);
    setState(LinkState::kConnected);
    flyOn(FlightMode::kAuto, 0.3);
    EXPECT_EQ(modes.back().mode, FlightMode::kManual);
    ask(FlightMode::kManual);
    sim.set(kFlightTime, 50.0F);
  }
}

TEST_F(ControlPathTest, ARestartedXPlaneIsFlownOnByHand) {
  start();
  fly(FlightMode::kManual, 0.3);
  restartXPlane();
  flyOn(FlightMode::kManual, 0.3);
  EXPECT_FLOAT_EQ(sim.value(kStickRoll), 0.25F);
  EXPECT_TRUE(events.empty());
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

// --- DATA rows ---

class ControlPathRowsTest : public ControlPathTest {
 protected:
  ControlPathRowsTest() { options.rows = true; }
  /// Slot of a row in each DATA message since the last clearMessages() that has the row.
  Floats slotsOf(std::int32_t row, std::size_t slot) const {
    Floats out;
    for (const auto& message : sim.messages()) {
      if (message.label != "DATA") continue;
      for (std::size_t at = 0; at + 36 <= message.body.size(); at += 36) {
        if (core::loadLittleEndian<std::int32_t>(message.body.data() + at) != row) continue;
        out.push_back(core::loadLittleEndian<float>(message.body.data() + at + 4 + 4 * slot));
      }
    }
    return out;
  }
};

TEST_F(ControlPathRowsTest, CommandsGoAsRowsUnderTheSameOverrides) {
  start();
  path->command(FlightMode::kManual, rollCommand(0.4));
  EXPECT_EQ(slotsOf(8, 1), Floats{0.4F});
  EXPECT_EQ(slotsOf(11, 1), Floats{0.4F});
  EXPECT_EQ(slotsOf(8, 0), Floats{-999.0F});
  EXPECT_TRUE(writesTo(kStickRoll).empty());
  EXPECT_EQ(sim.value(kStickOverride), 1.0F);
  EXPECT_TRUE(inJournal("DATA row 8"));
  EXPECT_TRUE(inJournal("DATA row 11"));
}

TEST_F(ControlPathRowsTest, RowsAreGivenBackWithTheOverrides) {
  start();
  path->command(FlightMode::kManual, rollCommand(0.4));
  sim.clearMessages();
  path->suspend("another aircraft is being loaded");
  EXPECT_EQ(slotsOf(8, 1), Floats{-999.0F});
  EXPECT_EQ(slotsOf(11, 1), Floats{-999.0F});
  EXPECT_EQ(sim.value(kStickOverride), 0.0F);
}

TEST_F(ControlPathRowsTest, HandlesAreLeftToTheCockpitAfterAChange) {
  core::ControlCommand command;
  command.fields = core::kFieldFlaps;
  command.flaps = 0.5;
  start();
  runWith(command, 0.5);
  const Floats flaps = slotsOf(13, 3);
  EXPECT_EQ(flaps.front(), 0.5F);
  EXPECT_EQ(flaps.back(), -999.0F);
}

// --- test signals ---

TEST_F(ControlPathTest, AnExcitationGoesOutWithEveryFrameAndItsEndToo) {
  start();
  path->command(FlightMode::kManual, rollCommand(0.1));
  sim.frame(0.001);
  sim.clearMessages();
  excitation.channels.set(core::index(core::Channel::kRoll));
  excitation.values.fill(0.3);
  sim.frame(0.001);
  sim.frame(0.001);
  EXPECT_EQ(writesTo(kStickRoll), (Floats{0.4F, 0.4F}));
  excitation = {};
  sim.frame(0.001);
  sim.frame(0.001);
  EXPECT_EQ(writesTo(kStickRoll), (Floats{0.4F, 0.4F, 0.1F})) << "without it, once";
}

TEST_F(ControlPathTest, AnAxisWithoutCommandsIsTakenForASignalAndGivenBack) {
  start();
  excitation.channels.set(core::index(core::Channel::kRoll));
  excitation.values.fill(0.3);
  excitation.rest = 0.1;
  sim.frame(0.001);
  EXPECT_EQ(sim.value(kStickOverride), 1.0F);
  EXPECT_EQ(sim.value(kPitchOverride), 0.0F);
  EXPECT_EQ(writesTo(kStickRoll), Floats{0.4F});
  EXPECT_TRUE(excitation_ends.empty());
  excitation = {};
  sim.frame(0.001);
  EXPECT_EQ(sim.value(kStickOverride), 0.0F);
  EXPECT_EQ(writesTo(kStickRoll), Floats{0.4F});
}

TEST_F(ControlPathTest, AnExcitationOfSeveralAxesEndsWithTheFirstThatIsNotCommanded) {
  start();
  path->command(FlightMode::kManual, rollCommand(0.1));
  excitation.channels.set(core::index(core::Channel::kRoll));
  sim.frame(0.001);
  EXPECT_TRUE(excitation_ends.empty());
  excitation.channels.set(core::index(core::Channel::kPitch));
  sim.frame(0.001);
  EXPECT_EQ(excitation_ends, Texts{"the commands of the axis have ended"});
}

TEST_F(ControlPathTest, AnExcitationEndsWithTheSourceAndIsNotSentOnTheFailsafe) {
  start();
  path->command(FlightMode::kManual, rollCommand(0.1));
  excitation.channels.set(core::index(core::Channel::kRoll));
  excitation.values.fill(0.3);
  run(0.4);
  EXPECT_TRUE(excitation_ends.empty());
  run(0.2);
  EXPECT_EQ(excitation_ends, Texts{"the commands of the axis have ended"});
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

TEST_F(ControlPathTest, AfterALossWithoutCommandsXPlaneIsLeftAlone) {
  start();
  runWith(rollCommand(0.3), 0.2);
  setState(LinkState::kLost);
  run(0.6);
  sim.clearMessages();
  setState(LinkState::kConnected);
  run(3.0);
  EXPECT_EQ(path->standing(), Standing::kFlying);
  EXPECT_EQ(sim.writes(), (std::vector<std::pair<std::string, float>>{{kStickOverride, 0.0F}})) << "given back";
  EXPECT_EQ(modes.back().reason, "X-Plane came back; MANUAL is not commanded");
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

TEST_F(ControlPathTest, HitchOfXPlaneDoesNotStopTheStick) {
  options.arbiter.channels[core::index(core::Channel::kRoll)].slew = 0.5;  // [1/s]
  start();
  runWith(rollCommand(0.0), 0.2);
  setState(LinkState::kStale);
  runWith(rollCommand(1.0), 0.8);
  EXPECT_NEAR(writesTo(kStickRoll).back(), 0.4F, 0.06F);
  runWith(rollCommand(1.0), 1.0);
  EXPECT_NEAR(writesTo(kStickRoll).back(), 0.5F, 0.06F) << "from a second of silence on the arbiter stands still";
  setState(LinkState::kConnected);
  runWith(rollCommand(1.0), 0.4);
  EXPECT_NEAR(writesTo(kStickRoll).back(), 0.7F, 0.06F);
}

TEST_F(ControlPathTest, SourceThatIsSilentWithXPlaneIsWaitedFor) {
  start();
  runWith(rollCommand(0.3), 0.2);
  run(0.4);  // a controller that goes by X-Plane's frames; by 0.5 s it would be silent for too long
  setState(LinkState::kStale);
  run(0.9);
  EXPECT_FALSE(modes.back().failsafe);
  setState(LinkState::kConnected);
  runWith(rollCommand(0.3), 0.2);
  EXPECT_TRUE(std::none_of(modes.begin(), modes.end(), [](const auto& mode) { return mode.failsafe; }));
}

TEST_F(ControlPathTest, PausedXPlaneThatBecomesSilentStandsStill) {
  options.arbiter.channels[core::index(core::Channel::kRoll)].slew = 0.5;
  start();
  runWith(rollCommand(0.0), 0.2);
  sim.setState(LinkState::kPaused);
  path->onLink(sim.status());
  core::LinkStatus stale = sim.status();
  stale.state = LinkState::kStale;
  path->onLink(stale);
  runWith(rollCommand(1.0), 0.3);
  EXPECT_NEAR(writesTo(kStickRoll).back(), 0.0F, 0.02F);
}

constexpr const char* kMotorOverride = "sim/operation/override/override_throttles";

core::ControlCommand motorsCommand(double first, double second) {
  core::ControlCommand command;
  command.fields = core::kFieldMotors;
  command.engine_count = 2;
  command.motors = {first, second};
  return command;
}

/// Motors 0 and 1 with their levers.
class MotorsTest : public ControlPathTest {
 protected:
  MotorsTest() {
    options.arbiter.engines = 2;
    sim.set(kMotorOverride, 0.0F);
    for (const char* name :
         {"sim/flightmodel/engine/ENGN_thro_use[0]", "sim/flightmodel/engine/ENGN_thro_use[1]",
          "sim/cockpit2/engine/actuators/throttle_ratio[0]", "sim/cockpit2/engine/actuators/throttle_ratio[1]"}) {
      sim.set(name, 0.0F);
    }
  }
  float lever(int engine) {
    return sim.value("sim/cockpit2/engine/actuators/throttle_ratio[" + std::to_string(engine) + "]");
  }
};

TEST_F(MotorsTest, LeversAreWhereTheMotorsAreWhenTheirOverrideEnds) {
  std::vector<float> at_release;
  sim.on_message = [&](const core::FakeSimulator::Message& message) {
    if (message.path == kMotorOverride && message.value == 0.0F) at_release = {lever(0), lever(1)};
  };
  start();
  runWith(motorsCommand(0.6, 0.7), 0.5);
  EXPECT_FLOAT_EQ(lever(0), 0.0F) << "theirs is the cockpit";
  runWith(rollCommand(0.0), 0.02);
  path->suspend("loading");
  ASSERT_EQ(at_release.size(), 2U);
  EXPECT_FLOAT_EQ(at_release[0], 0.6F);
  EXPECT_FLOAT_EQ(at_release[1], 0.7F);
}

TEST_F(MotorsTest, LeverWithoutReverseIsNotBelowZero) {
  start();
  core::ControlCommand command = motorsCommand(-0.5, 0.7);
  if (path->command(FlightMode::kManual, command)) GTEST_SKIP() << "motors take no negative values";
  runWith(command, 0.5);
  path->suspend("loading");
  EXPECT_FLOAT_EQ(lever(0), 0.0F);
}

TEST_F(MotorsTest, JournalHasWhatIsToBeWrittenBeforeTheRelease) {
  start();
  runWith(motorsCommand(0.6, 0.7), 0.5);
  overrides.recordPreparations();
  ASSERT_EQ(sim.journal()->entries().size(), 1U);
  const std::vector<core::UndoOperation> undo = sim.journal()->entries()[0].undo;
  ASSERT_EQ(undo.size(), 3U);
  const auto& first = std::get<core::UndoDref>(undo[0]);
  EXPECT_EQ(first.path, "sim/cockpit2/engine/actuators/throttle_ratio[0]");
  EXPECT_FLOAT_EQ(first.value, 0.6F);
  EXPECT_FALSE(first.confirm) << "a throttle of X-Plane's own may move it again";
  EXPECT_EQ(std::get<core::UndoDref>(undo[2]).path, kMotorOverride) << "last";
}

TEST_F(ControlPathTest, WhatWasGivenBackWithoutItsDoingStopsItUntilAModeIsAskedFor) {
  start();
  ask(FlightMode::kAuto);
  runWith(rollCommand(0.3), 0.3);
  path->onGivenBack("tx_node hung");
  EXPECT_EQ(path->standing(), Standing::kWaitingForMode);
  EXPECT_EQ(modes.back().mode, FlightMode::kManual);
  EXPECT_EQ(modes.back().reason, "tx_node hung; nothing is sent until a mode is asked for");
  EXPECT_EQ(path->refusal(), "tx_node hung: ask for a mode to fly on");
  sim.clearMessages();
  runWith(rollCommand(0.3), 3.0);
  EXPECT_TRUE(writesTo(kStickRoll).empty());
  ask(FlightMode::kManual);
  runWith(rollCommand(0.3), 0.1);
  EXPECT_FLOAT_EQ(sim.value(kStickRoll), 0.3F);
}

TEST_F(ControlPathTest, AxesWithoutCommandsStayWithXPlane) {
  start();
  core::ControlCommand command = rollCommand(0.3);
  command.fields = core::kFieldRoll | core::kFieldPitch;
  command.pitch = -0.2;
  runWith(command, 0.5);
  EXPECT_FLOAT_EQ(sim.value(kStickOverride), 1.0F);
  EXPECT_FLOAT_EQ(sim.value(kPitchOverride), 1.0F);
  EXPECT_FLOAT_EQ(sim.value(kYawOverride), 0.0F) << "pedals, and X-Plane's auto-coordination";
  EXPECT_TRUE(writesTo(kStickYaw).empty());
  command.fields = core::kFieldRoll;
  runWith(command, 1.0);
  EXPECT_FLOAT_EQ(sim.value(kStickOverride), 1.0F);
  EXPECT_FLOAT_EQ(sim.value(kPitchOverride), 1.0F) << "given to its failsafe, not dropped";
}

TEST_F(ControlPathTest, AnXPlaneThatHasRunNoLongerThanTheGapIsAnotherOne) {
  sim.set("sim/time/total_running_time_sec", 1.0F);
  start();
  runWith(rollCommand(0.3), 1.0);  // it has run for 2 s, and shown its override
  setState(LinkState::kStale);
  runWith(rollCommand(0.3), 4.0);
  sim.set(kStickOverride, 0.0F);
  sim.set("sim/time/total_running_time_sec", 3.0F);  // started 1 s after the last frame: it seems to have run on
  setState(LinkState::kConnected);
  runWith(rollCommand(0.3), 2.0);
  EXPECT_EQ(path->standing(), Standing::kFlying) << path->refusal();
  EXPECT_FLOAT_EQ(sim.value(kStickOverride), 1.0F);
}

TEST_F(ControlPathTest, AnotherAircraftIsNotFlown) {
  start(LinkState::kConnected, "");
  EXPECT_EQ(path->standing(), Standing::kWrongAircraft);
  EXPECT_EQ(path->refusal(), "X-Plane has not reported which aircraft is loaded");
  path->onAircraft({"QUAD", "Quadrotor"});
  EXPECT_EQ(path->standing(), Standing::kWrongAircraft);
  EXPECT_EQ(path->refusal(),
            "the aircraft loaded is QUAD (Quadrotor), but config/aircraft/fixed_wing.yaml is for DA62; "
            "scripts/aircraft_config writes a file for the one that is loaded");
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

TEST_F(ControlPathTest, AnAircraftWithoutIcaoCodeIsKnownByItsDescription) {
  options.aircraft = {"Aerolite 103"};
  start(LinkState::kConnected, "");
  EXPECT_FALSE(path->fits({"", ""}));
  EXPECT_FALSE(path->fits({"", "Aerolite"}));
  path->onAircraft({"", "Aerolite 103"});
  EXPECT_EQ(path->standing(), Standing::kFlying);
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
      "another client has released sim/operation/override/override_joystick_roll: ask for a mode to fly on";
  EXPECT_EQ(path->refusal(), why);
  EXPECT_EQ(events.back(), "nothing is sent any more: " + why);
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
  path->onNewFlight("the flight began anew");
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

core::ControlCommand trimmedRoll() {
  core::ControlCommand command = rollCommand(0.3);
  command.fields |= core::kFieldTrimYaw;
  command.trim_yaw = 0.5;
  return command;
}

TEST_F(ControlPathTest, ATrimThatTheAircraftHasNotIsRefusedInWordsAndTheRestFlown) {
  sim.setAll(core::trimDatarefs(), 0.0F);
  sim.set(kRudderTrim, 0.0F);
  start();
  run(0.5);
  for (int i = 0; i < 3; ++i) {
    path->command(FlightMode::kManual, trimmedRoll());
    frame();
  }
  EXPECT_FLOAT_EQ(sim.value(kStickRoll), 0.3F);
  EXPECT_FLOAT_EQ(sim.value(kRudderTrim), 0.0F);
  ASSERT_FALSE(applied.empty());
  EXPECT_EQ(applied.back().controls.fields, core::kFieldRoll);
  EXPECT_EQ(path->commanded().count(), 1U);
  const auto reports = std::count_if(events.begin(), events.end(), [](const std::string& text) {
    return text.find("trim_yaw is not sent: this aircraft has no rudder trim") == 0;
  });
  EXPECT_EQ(reports, 1) << "once for an aircraft";

  // Another one, that has it.
  sim.set("sim/aircraft/controls/acf_max_trim_rudd", 0.4F);
  path->onAircraft({"DA62", "another"});
  run(0.5);
  path->command(FlightMode::kManual, trimmedRoll());
  frame();
  EXPECT_FLOAT_EQ(sim.value(kRudderTrim), 0.5F);
}

TEST_F(ControlPathTest, TrimsAreSentWhereXPlaneDoesNotReportThem) {
  sim.set(kRudderTrim, 0.0F);
  start();
  run(0.5);
  path->command(FlightMode::kManual, trimmedRoll());
  frame();
  EXPECT_FLOAT_EQ(sim.value(kRudderTrim), 0.5F);
}

TEST_F(ControlPathTest, ASecondBridgeIsNoCrash) {
  start();
  sim.journalOfAnother(true).record(std::string("override:") + kStickOverride, kOverridePurpose,
                                    {core::UndoDref{kStickOverride, 0.0F}});
  path->command(FlightMode::kManual, rollCommand(0.3));
  frame();
  EXPECT_TRUE(sim.writes().empty());
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].find("commands are not sent: another bridge is at this X-Plane: "), 0U);
  EXPECT_NE(warnings[0].find("belongs to /fake"), std::string::npos);
  EXPECT_EQ(warnings[0].find("crash"), std::string::npos);
}

TEST_F(ControlPathTest, WithoutTheJournalNothingIsTaken) {
  start();
  sim.breakJournal();
  path->command(FlightMode::kManual, rollCommand(0.3));
  path->command(FlightMode::kManual, rollCommand(0.3));
  frame();
  EXPECT_TRUE(sim.writes().empty());
  ASSERT_EQ(warnings.size(), 1u) << "warned of once";
  EXPECT_EQ(warnings[0].find("commands are not sent: it could not be given back after a crash, should there be one: "),
            0U);
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
