#include "xplane_bridge/core/control/control_arbiter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "arbiter_commands.hpp"

namespace xplane_bridge::core {
namespace {

TEST(ControlArbiter, SendsNothingBeforeTheFirstCommand) {
  ControlArbiter arbiter(direct(), 10.0);
  EXPECT_TRUE(arbiter.step(10.1).active.none());
  arbiter.onModeRequest(request(2, 1), 10.2);
  const auto& out = arbiter.step(10.3);
  EXPECT_TRUE(out.active.none());
  EXPECT_EQ(out.source, CommandSource::kNone);
  EXPECT_FALSE(arbiter.status().failsafe);
}

TEST(ControlArbiter, PassesTheActiveSourceAndOnlyWhatItCommands) {
  ControlArbiter arbiter(direct(), 0.0);
  EXPECT_FALSE(arbiter.onCommand(kManual, stick(0.4, -0.2, 7), 1.0));
  EXPECT_FALSE(arbiter.onCommand(kAuto, stick(-0.9), 1.0));
  const auto& out = arbiter.step(1.125);
  EXPECT_DOUBLE_EQ(roll(out), 0.4);
  EXPECT_DOUBLE_EQ(out.values[index(Channel::kPitch)], -0.2);
  EXPECT_EQ(out.active.count(), 2u);
  EXPECT_EQ(out.fields, 3u);
  EXPECT_EQ(out.limited, 0u);
  EXPECT_EQ(out.source, CommandSource::kManual);
  EXPECT_EQ(out.sequence, 7u);
  EXPECT_DOUBLE_EQ(out.source_age, 0.125);
}

TEST(ControlArbiter, RefusedMessageIsCountedAndTheLastGoodOneGoesOnUntilItsTimeout) {
  ControlArbiter arbiter(direct(), 0.0);
  arbiter.onCommand(kManual, stick(0.4), 1.0);
  ControlCommand bad = stick(std::numeric_limits<double>::quiet_NaN());
  const auto refusal = arbiter.onCommand(kManual, bad, 1.4);
  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->reason, Refusal::kNotFinite);
  EXPECT_DOUBLE_EQ(roll(arbiter.step(1.49)), 0.4);
  EXPECT_DOUBLE_EQ(roll(arbiter.step(1.51)), 0.0) << "a refused message must not keep the source alive";
  const auto& statistics = arbiter.statistics(kManual);
  EXPECT_EQ(statistics.accepted, 1u);
  EXPECT_EQ(statistics.refused[static_cast<std::size_t>(Refusal::kNotFinite)], 1u);
  EXPECT_EQ(statistics.refusedTotal(), 1u);
  EXPECT_EQ(statistics.last_refusal.find("roll is"), 0u);
  EXPECT_EQ(arbiter.statistics(kAuto).refusedTotal(), 0u);
}

TEST(ControlArbiter, AutoWithoutASourceGivesZeros) {
  ControlArbiter arbiter(direct(), 0.0);
  arbiter.onCommand(kManual, stick(0.4, 0.1), 1.0);
  arbiter.step(1.0);
  EXPECT_EQ(arbiter.onModeRequest(request(2, 1), 1.1), RequestOutcome::kChanged);
  const auto& out = arbiter.step(1.1);
  EXPECT_EQ(out.active.count(), 2u);
  EXPECT_DOUBLE_EQ(roll(out), 0.0);
  EXPECT_DOUBLE_EQ(out.values[index(Channel::kPitch)], 0.0);
  EXPECT_EQ(out.source, CommandSource::kFailsafe);
  EXPECT_DOUBLE_EQ(out.source_age, 0.0);
  EXPECT_TRUE(arbiter.status().failsafe);
  EXPECT_FALSE(arbiter.status().auto_alive);
  EXPECT_TRUE(arbiter.status().manual_alive);
}

TEST(ControlArbiter, HoldKeepsTheLastOutputAndManualFollowsTheStick) {
  ArbiterOptions options = direct();
  options.channels[index(Channel::kRoll)].failsafe = Failsafe::kHold;
  options.channels[index(Channel::kPitch)].failsafe = Failsafe::kManual;
  options.channels[index(Channel::kPitch)].neutral = 0.05;
  options.takeover_threshold = 0.0;
  ControlArbiter arbiter(options, 0.0);
  arbiter.onModeRequest(request(2, 1), 0.0);
  arbiter.onCommand(kAuto, stick(0.3, 0.2), 0.0);
  arbiter.step(0.1);
  arbiter.onCommand(kManual, stick(-0.7, -0.6), 0.5);
  const auto& silent = arbiter.step(0.6);
  EXPECT_DOUBLE_EQ(roll(silent), 0.3);
  EXPECT_DOUBLE_EQ(silent.values[index(Channel::kPitch)], -0.6);
  EXPECT_EQ(arbiter.status().mode, kAuto);
  EXPECT_EQ(arbiter.status().reason, "timeout of control/auto");
  // The stick falls silent too: pitch goes to its neutral.
  EXPECT_DOUBLE_EQ(arbiter.step(1.2).values[index(Channel::kPitch)], 0.05);
  arbiter.onCommand(kAuto, stick(0.1, 0.15), 1.3);
  EXPECT_DOUBLE_EQ(arbiter.step(1.3).values[index(Channel::kPitch)], 0.15);
  EXPECT_FALSE(arbiter.status().failsafe);
  EXPECT_EQ(arbiter.status().reason, "control/auto is back");
}

TEST(ControlArbiter, AChannelNoLongerCommandedFallsToItsFailsafeAlone) {
  ControlArbiter arbiter(direct(), 0.0);
  ControlCommand both = stick(0.4, 0.4);
  both.fields |= kFieldFlaps;
  both.flaps = 0.5;
  arbiter.onCommand(kManual, both, 0.0);
  arbiter.step(0.0);
  for (int i = 1; i <= 6; ++i) arbiter.onCommand(kManual, only(kFieldRoll, &ControlCommand::roll, 0.4), 0.1 * i);
  const auto& out = arbiter.step(0.6);
  EXPECT_DOUBLE_EQ(roll(out), 0.4);
  EXPECT_DOUBLE_EQ(out.values[index(Channel::kPitch)], 0.0);
  EXPECT_DOUBLE_EQ(out.values[index(Channel::kFlaps)], 0.5) << "handles hold";
  EXPECT_EQ(out.source, CommandSource::kManual);
  EXPECT_FALSE(arbiter.status().failsafe);
}

TEST(ControlArbiter, TransitionIsBumplessAndThenFollowsDirectly) {
  ArbiterOptions options;
  options.transition_rate = 2.0;
  options.takeover_threshold = 0.0;
  ControlArbiter arbiter(options, 0.0);
  arbiter.onCommand(kManual, stick(0.8), 0.0);
  EXPECT_DOUBLE_EQ(roll(arbiter.step(0.0)), 0.8) << "the first command is sent as it is";
  arbiter.onCommand(kAuto, stick(-0.2), 0.0);
  arbiter.onModeRequest(request(2, 1), 0.0);
  const auto& first = arbiter.step(0.1);
  EXPECT_NEAR(roll(first), 0.6, 1e-12);  // 0.8 - 2/s * 0.1 s
  EXPECT_EQ(first.limited, static_cast<std::uint32_t>(kFieldRoll));
  EXPECT_NEAR(roll(arbiter.step(0.4)), 0.0, 1e-12);
  EXPECT_NEAR(roll(arbiter.step(0.49)), -0.18, 1e-12);
  EXPECT_NEAR(roll(arbiter.step(0.499)), -0.198, 1e-12);
  arbiter.onCommand(kAuto, stick(-0.2), 0.499);
  EXPECT_DOUBLE_EQ(roll(arbiter.step(0.55)), -0.2);
  arbiter.onCommand(kAuto, stick(0.9), 0.56);
  const auto& after = arbiter.step(0.56);
  EXPECT_DOUBLE_EQ(roll(after), 0.9) << "no slew configured: only the change of hands is slow";
  EXPECT_EQ(after.limited, 0u);
}

TEST(ControlArbiter, LimitsAndSlewCutAndAreSaid) {
  ArbiterOptions options = direct();
  auto& channel = options.channels[index(Channel::kRoll)];
  channel.low = -0.5;
  channel.high = 0.6;
  channel.slew = 1.0;
  ControlArbiter arbiter(options, 0.0);
  arbiter.onCommand(kManual, stick(0.0), 0.0);
  arbiter.step(0.0);
  arbiter.onCommand(kManual, stick(1.0), 0.1);
  EXPECT_NEAR(roll(arbiter.step(0.1)), 0.1, 1e-12);
  EXPECT_EQ(arbiter.step(0.1).limited, static_cast<std::uint32_t>(kFieldRoll));
  arbiter.onCommand(kManual, stick(1.0), 0.5);
  const auto& out = arbiter.step(0.9);
  EXPECT_NEAR(roll(out), 0.6, 1e-12);
  EXPECT_EQ(out.limited, static_cast<std::uint32_t>(kFieldRoll)) << "at the limit";
}

TEST(ControlArbiter, TimersStandStillWhilePausedAndGraceFollows) {
  ArbiterOptions options = direct();
  options.resume_grace = 1.0;
  ControlArbiter arbiter(options, 0.0);
  arbiter.onCommand(kManual, stick(0.4), 0.0);
  arbiter.step(0.3);
  arbiter.setTimeRunning(false, 0.3);
  EXPECT_DOUBLE_EQ(roll(arbiter.step(100.0)), 0.4);
  EXPECT_TRUE(arbiter.status().manual_alive);
  arbiter.setTimeRunning(true, 200.0);
  EXPECT_DOUBLE_EQ(roll(arbiter.step(200.99)), 0.4);
  EXPECT_DOUBLE_EQ(roll(arbiter.step(201.01)), 0.0);
}

TEST(ControlArbiter, GraceDoesNotReviveWhatWasSilentBeforeThePause) {
  ControlArbiter arbiter(direct(), 0.0);
  arbiter.onCommand(kManual, stick(0.4), 0.0);
  arbiter.step(0.0);
  EXPECT_DOUBLE_EQ(roll(arbiter.step(0.6)), 0.0);
  arbiter.setTimeRunning(false, 0.6);
  arbiter.setTimeRunning(true, 0.7);
  EXPECT_DOUBLE_EQ(roll(arbiter.step(0.8)), 0.0);
  EXPECT_FALSE(arbiter.status().manual_alive);
}

TEST(ControlArbiter, SlewStandsStillWhilePaused) {
  ArbiterOptions options = direct();
  options.channels[index(Channel::kRoll)].slew = 1.0;
  ControlArbiter arbiter(options, 0.0);
  arbiter.onCommand(kManual, stick(0.0), 0.0);
  arbiter.step(0.0);
  arbiter.setTimeRunning(false, 0.0);
  arbiter.onCommand(kManual, stick(1.0), 1.0);
  EXPECT_DOUBLE_EQ(roll(arbiter.step(5.0)), 0.0);
  arbiter.setTimeRunning(true, 5.0);
  EXPECT_NEAR(roll(arbiter.step(5.2)), 0.2, 1e-12);
}

TEST(ControlArbiter, ModeRequestsAreAbsoluteAndDuplicatesIgnored) {
  ControlArbiter arbiter(direct(), 0.0);
  EXPECT_EQ(arbiter.onModeRequest(request(2, 5), 1.0), RequestOutcome::kChanged);
  EXPECT_EQ(arbiter.status().mode, kAuto);
  EXPECT_EQ(arbiter.status().previous, kManual);
  EXPECT_EQ(arbiter.status().requested_by, "joystick");
  EXPECT_EQ(arbiter.status().reason, "request");
  EXPECT_EQ(arbiter.status().request_sequence, 5u);
  EXPECT_DOUBLE_EQ(arbiter.status().since, 1.0);
  const auto revision = arbiter.status().revision;

  EXPECT_EQ(arbiter.onModeRequest(request(1, 5), 2.0), RequestOutcome::kIgnored);
  EXPECT_EQ(arbiter.onModeRequest(request(1, 4), 2.0), RequestOutcome::kIgnored);
  EXPECT_EQ(arbiter.status().revision, revision);
  EXPECT_EQ(arbiter.onModeRequest(request(2, 6), 3.0), RequestOutcome::kUnchanged);
  EXPECT_EQ(arbiter.status().request_sequence, 6u);
  EXPECT_GT(arbiter.status().revision, revision);
  EXPECT_DOUBLE_EQ(arbiter.status().since, 1.0) << "since the change, not since the repetition";

  // Sequences are counted by requester.
  EXPECT_EQ(arbiter.onModeRequest(request(1, 1, "operator"), 4.0), RequestOutcome::kChanged);
  EXPECT_EQ(arbiter.status().mode, kManual);
}

TEST(ControlArbiter, RestartedRequesterIsHeardAndUncountedRequestsAlwaysAre) {
  ControlArbiter arbiter(direct(), 0.0);
  arbiter.onModeRequest(request(2, 50, "joystick", 100.0), 1.0);
  EXPECT_EQ(arbiter.onModeRequest(request(1, 1, "joystick", 90.0), 1.1), RequestOutcome::kIgnored);
  EXPECT_EQ(arbiter.onModeRequest(request(1, 1, "joystick", 110.0), 1.2), RequestOutcome::kChanged);
  EXPECT_EQ(arbiter.onModeRequest(request(2, 0, "terminal"), 1.3), RequestOutcome::kChanged);
  EXPECT_EQ(arbiter.onModeRequest(request(1, 0, "terminal"), 1.4), RequestOutcome::kChanged);
}

TEST(ControlArbiter, RemembersTheLastHundredRequesters) {
  ControlArbiter arbiter(direct(), 0.0);
  for (int i = 0; i < 101; ++i) {
    arbiter.onModeRequest(request(2, 1, "node_" + std::to_string(i), 100.0 + i), 1.0);
  }
  EXPECT_EQ(arbiter.onModeRequest(request(2, 1, "node_1", 101.0), 2.0), RequestOutcome::kIgnored);
  EXPECT_EQ(arbiter.onModeRequest(request(2, 1, "node_100", 200.0), 2.0), RequestOutcome::kIgnored);
  EXPECT_EQ(arbiter.onModeRequest(request(2, 1, "node_0", 100.0), 2.0), RequestOutcome::kUnchanged) << "forgotten";
}

TEST(ControlArbiter, UnknownModeIsRefusedInWords) {
  ControlArbiter arbiter(direct(), 0.0);
  EXPECT_EQ(arbiter.onModeRequest(request(3, 1), 1.0), RequestOutcome::kRefused);
  EXPECT_FALSE(arbiter.status().accepted);
  EXPECT_NE(arbiter.status().reason.find("mode is 3"), std::string::npos);
  EXPECT_EQ(arbiter.status().mode, kManual);
}

TEST(ControlArbiter, StickTakesOverRelativeToWhereItWasAtEngagement) {
  ArbiterOptions options = direct();
  options.takeover_threshold = 0.3;
  ControlArbiter arbiter(options, 0.0);
  arbiter.onCommand(kManual, stick(0.5), 0.0);
  arbiter.onModeRequest(request(2, 1), 0.1);
  arbiter.onCommand(kManual, stick(0.75), 0.2);
  EXPECT_EQ(arbiter.status().mode, kAuto) << "0.25 from where it was";
  arbiter.onCommand(kManual, stick(0.19), 0.3);
  EXPECT_EQ(arbiter.status().mode, kManual) << "0.31 from where it was";
  EXPECT_EQ(arbiter.status().reason.find("stick take-over: roll moved by -0.31"), 0u) << arbiter.status().reason;
  EXPECT_EQ(arbiter.status().requested_by, "control/manual");
  EXPECT_EQ(arbiter.status().request_sequence, 0u);
}

TEST(ControlArbiter, AStickThatComesBackFromSilenceDoesNotTakeOver) {
  ArbiterOptions options = direct();
  options.takeover_threshold = 0.3;
  ControlArbiter arbiter(options, 0.0);
  arbiter.onCommand(kManual, stick(0.0), 0.0);
  arbiter.onModeRequest(request(2, 1), 0.1);
  arbiter.onCommand(kManual, stick(0.9), 5.0);  // plugged in again, held over
  EXPECT_EQ(arbiter.status().mode, kAuto);
  arbiter.onCommand(kManual, stick(0.55), 5.1);
  EXPECT_EQ(arbiter.status().mode, kManual);
}

TEST(ControlArbiter, TakeOverCanBeSwitchedOff) {
  ArbiterOptions options = direct();
  options.takeover_threshold = 0.0;
  ControlArbiter arbiter(options, 0.0);
  arbiter.onCommand(kManual, stick(0.0), 0.0);
  arbiter.onModeRequest(request(2, 1), 0.1);
  arbiter.onCommand(kManual, stick(1.0), 0.2);
  EXPECT_EQ(arbiter.status().mode, kAuto);
}

TEST(ControlArbiter, MotorsAndLeversReplaceEachOther) {
  ArbiterOptions options = direct();
  options.engines = 2;
  options.takeover_threshold = 0.0;
  ControlArbiter arbiter(options, 0.0);
  arbiter.onCommand(kManual, only(kFieldThrottle, &ControlCommand::throttle, 0.5), 0.0);
  const auto levers = arbiter.step(0.0);
  EXPECT_EQ(levers.fields, static_cast<std::uint32_t>(kFieldThrottle));
  EXPECT_EQ(levers.active.count(), 2u);
  ControlCommand motors;
  motors.fields = kFieldMotors;
  motors.engine_count = 4;
  motors.motors = {0.1, 0.2, 0.3, 0.4};
  arbiter.onCommand(kAuto, motors, 0.1);
  arbiter.onModeRequest(request(2, 1), 0.1);
  const auto direct_motors = arbiter.step(0.1);
  EXPECT_EQ(direct_motors.fields, static_cast<std::uint32_t>(kFieldMotors)) << "levers are no longer sent";
  EXPECT_EQ(direct_motors.active.count(), 4u);
  EXPECT_DOUBLE_EQ(direct_motors.values[index(motorChannel(3))], 0.4);
  arbiter.onModeRequest(request(1, 2), 0.2);
  const auto back = arbiter.step(0.2);
  EXPECT_EQ(back.fields, static_cast<std::uint32_t>(kFieldThrottle));
  EXPECT_DOUBLE_EQ(back.values[index(leverChannel(1))], 0.5);
}

TEST(ControlArbiter, OneSourceThatChangesFromLeversToMotorsLeavesTheLevers) {
  ControlArbiter arbiter(direct(), 0.0);
  arbiter.onCommand(kManual, only(kFieldThrottle, &ControlCommand::throttle, 0.5), 0.0);
  arbiter.step(0.0);
  ControlCommand motors;
  motors.fields = kFieldMotors;
  motors.engine_count = 1;
  arbiter.onCommand(kManual, motors, 0.1);
  EXPECT_EQ(arbiter.step(0.1).fields, static_cast<std::uint32_t>(kFieldMotors));
}

TEST(ControlArbiter, MotorsFallToTheirFailsafeWhenAutoFallsSilent) {
  ArbiterOptions options = direct();
  for (int engine = 0; engine < kMaxEngines; ++engine) options.channels[index(motorChannel(engine))].neutral = 0.4;
  ControlArbiter arbiter(options, 0.0);
  arbiter.onModeRequest(request(2, 1), 0.0);
  ControlCommand motors;
  motors.fields = kFieldMotors;
  motors.engine_count = 4;
  motors.motors = {0.6, 0.6, 0.6, 0.6};
  arbiter.onCommand(kAuto, motors, 0.0);
  arbiter.step(0.0);
  const auto& out = arbiter.step(1.0);
  EXPECT_EQ(out.active.count(), 4u);
  EXPECT_DOUBLE_EQ(out.values[index(motorChannel(3))], 0.4);
}

TEST(ControlArbiter, ExcitationIsAddedAfterSlewAndKeptWithinLimits) {
  ArbiterOptions options = direct();
  options.channels[index(Channel::kRoll)].slew = 0.1;
  options.channels[index(Channel::kRoll)].high = 0.5;
  ControlArbiter arbiter(options, 0.0);
  arbiter.onCommand(kManual, stick(0.4), 0.0);
  arbiter.step(0.0);
  ChannelExcitation excitation;
  excitation.channels.set(index(Channel::kRoll));
  excitation.channels.set(index(Channel::kYaw));  // not in use
  excitation.values.fill(-0.3);
  const auto down = arbiter.step(0.01, excitation);
  EXPECT_DOUBLE_EQ(roll(down), 0.4 - 0.3);
  EXPECT_EQ(down.excited, static_cast<std::uint32_t>(kFieldRoll));
  EXPECT_EQ(down.limited, 0u);
  EXPECT_FALSE(down.active.test(index(Channel::kYaw)));
  excitation.values.fill(0.3);
  const auto up = arbiter.step(0.02, excitation);
  EXPECT_DOUBLE_EQ(roll(up), 0.5);
  EXPECT_EQ(up.limited, static_cast<std::uint32_t>(kFieldRoll));
  EXPECT_DOUBLE_EQ(roll(arbiter.step(0.03)), 0.4) << "leaves no trace";
}

TEST(ControlArbiter, ExcitationIsAddedOnlyToWhatALivingSourceCommands) {
  ControlArbiter arbiter(direct(), 0.0);
  arbiter.onCommand(kManual, stick(0.4), 0.0);
  arbiter.step(0.0);
  ChannelExcitation excitation;
  excitation.channels.set(index(Channel::kRoll));
  excitation.values.fill(0.25);
  EXPECT_DOUBLE_EQ(roll(arbiter.step(0.25, excitation)), 0.65);
  EXPECT_EQ(arbiter.commanded().count(), 2u);
  const auto& late = arbiter.step(0.75, excitation);
  EXPECT_DOUBLE_EQ(roll(late), 0.0) << "the failsafe's";
  EXPECT_EQ(late.excited, 0u);
  EXPECT_TRUE(arbiter.commanded().none());
}

TEST(ControlArbiter, ExcitationWithItsOwnRestMovesChannelsWithoutCommandsForAsLong) {
  ControlArbiter arbiter(direct(), 0.0);
  ChannelExcitation excitation;
  excitation.channels.set(index(Channel::kRoll));
  excitation.rest = 0.1;
  excitation.values.fill(0.25);
  const auto taken = arbiter.step(0.0, excitation);
  EXPECT_DOUBLE_EQ(roll(taken), 0.35);
  EXPECT_EQ(taken.active.count(), 1u);
  EXPECT_EQ(taken.fields, static_cast<std::uint32_t>(kFieldRoll));
  EXPECT_EQ(taken.excited, static_cast<std::uint32_t>(kFieldRoll));
  EXPECT_EQ(taken.source, CommandSource::kNone) << "no source commands";
  EXPECT_TRUE(arbiter.step(0.1).active.none()) << "leaves no trace";
  EXPECT_FALSE(arbiter.status().failsafe);
  arbiter.onCommand(kManual, stick(0.4), 0.2);
  EXPECT_DOUBLE_EQ(roll(arbiter.step(0.2, excitation)), 0.65) << "added to a command where there is one";
}

TEST(ControlArbiter, ExcitationWithItsOwnRestMovesWhatALivingSourceHasLeft) {
  ControlArbiter arbiter(direct(), 0.0);
  arbiter.onCommand(kManual, stick(0.4), 0.0);
  arbiter.step(0.0);
  ControlCommand pedals;
  pedals.fields = kFieldYaw;
  arbiter.onCommand(kManual, pedals, 0.4);
  ChannelExcitation excitation;
  excitation.channels.set(index(Channel::kRoll));
  excitation.rest = 0.9;
  excitation.values.fill(0.25);
  EXPECT_DOUBLE_EQ(roll(arbiter.step(0.75, excitation)), 0.25) << "added to the neutral of its failsafe";
  EXPECT_EQ(arbiter.step(1.5, excitation).excited, 0u) << "the failsafe flies all";
  EXPECT_DOUBLE_EQ(roll(arbiter.step(1.5, excitation)), 0.0);
}

TEST(ControlArbiter, ForgottenCommandsAreAsBeforeTheFirst) {
  ControlArbiter arbiter(direct(), 0.0);
  arbiter.onModeRequest(request(2, 1), 0.0);
  arbiter.onCommand(kAuto, stick(0.4), 0.0);
  arbiter.step(0.0);
  EXPECT_TRUE(arbiter.step(1.0).active.any());
  EXPECT_TRUE(arbiter.status().failsafe);
  arbiter.forgetCommands("X-Plane is gone", 1.0);
  EXPECT_EQ(arbiter.status().reason, "X-Plane is gone");
  EXPECT_EQ(arbiter.status().mode, kAuto) << "stays";
  EXPECT_TRUE(arbiter.step(1.0).active.none());
  EXPECT_FALSE(arbiter.status().failsafe);
  EXPECT_EQ(arbiter.statistics(kAuto).accepted, 1u);
  arbiter.forgetCommands("X-Plane is gone again", 2.0);
  EXPECT_EQ(arbiter.status().reason, "X-Plane is gone") << "why nothing is sent";
}

TEST(ControlArbiter, AModeThatBeginsWithAFailsafeKeepsItsReason) {
  ControlArbiter arbiter(direct(), 0.0);
  arbiter.onCommand(kManual, stick(0.4), 0.0);
  arbiter.step(0.0);
  arbiter.onModeRequest(request(2, 1), 0.1);
  arbiter.step(0.1);
  EXPECT_TRUE(arbiter.status().failsafe);
  EXPECT_EQ(arbiter.status().reason, "request; timeout of control/auto");
  EXPECT_EQ(arbiter.status().requested_by, "joystick");
}

TEST(ControlArbiter, RevisionShowsEveryChangeOfStatus) {
  ControlArbiter arbiter(direct(), 0.0);
  auto revision = arbiter.status().revision;
  const auto changed = [&] {
    const bool differs = arbiter.status().revision != revision;
    revision = arbiter.status().revision;
    return differs;
  };
  arbiter.step(0.0);
  EXPECT_FALSE(changed());
  arbiter.onCommand(kManual, stick(0.0), 0.1);
  arbiter.step(0.1);
  EXPECT_TRUE(changed()) << "control/manual is alive";
  arbiter.step(0.2);
  EXPECT_FALSE(changed());
  arbiter.step(0.7);
  EXPECT_TRUE(changed()) << "failsafe";
  EXPECT_TRUE(arbiter.status().failsafe);
}

TEST(ControlArbiter, OptionsAreCheckedByName) {
  const auto complaint = [](auto change) {
    ArbiterOptions options;
    change(options);
    return validate(options).value_or("");
  };
  EXPECT_EQ(complaint([](auto&) {}), "");
  EXPECT_EQ(complaint([](auto& o) { o.command_timeout = 0.0; }).find("command_timeout is 0"), 0u);
  EXPECT_EQ(complaint([](auto& o) { o.engines = 9; }).find("engines is 9"), 0u);
  EXPECT_EQ(
      complaint([](auto& o) { o.channels[index(Channel::kFlaps)].low = -0.1; }).find("channels.flaps.low is -0.1"), 0u);
  EXPECT_EQ(complaint([](auto& o) { o.channels[index(Channel::kRoll)].neutral = 2.0; }).find("channels.roll.neutral"),
            0u);
  EXPECT_EQ(complaint([](auto& o) { o.channels[0].slew = 0.0; }).find("channels.roll.slew"), 0u);
  EXPECT_EQ(complaint([](auto& o) { o.transition_rate = std::nan(""); }).find("transition_rate"), 0u);
  ArbiterOptions bad;
  bad.engines = 0;
  EXPECT_THROW(ControlArbiter(bad, 0.0), std::invalid_argument);
}

}  // namespace
}  // namespace xplane_bridge::core
