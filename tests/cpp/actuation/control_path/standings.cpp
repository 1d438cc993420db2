#include "fixture.hpp"

namespace xplane_bridge {
namespace {

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

TEST_F(ControlPathTest, OnlyWithoutXPlaneIsARequestRefusedForWantOfALink) {
  const auto refused_with = [this](core::ResultCode code) {
    const auto refusal = path->requestRefusal();
    ASSERT_TRUE(refusal) << "it flies";
    EXPECT_EQ(refusal->code, code) << refusal->text;
    EXPECT_EQ(refusal->text, path->refusal());
  };
  sim.setState(LinkState::kSearching);
  start(LinkState::kSearching);
  refused_with(core::ResultCode::kNoLink);
  setState(LinkState::kConnected);
  refused_with(core::ResultCode::kNoLink);  // no frame yet
  frame();
  EXPECT_FALSE(path->requestRefusal());
  path->onGivenBack("tx_node hung");
  refused_with(core::ResultCode::kRefused);
  ask(FlightMode::kManual);
  EXPECT_FALSE(path->requestRefusal());
  path->suspend("another aircraft is being loaded");
  refused_with(core::ResultCode::kRefused);
  path->resume();
  path->onAircraft({"QUAD", "Quadrotor"});
  refused_with(core::ResultCode::kRefused);
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

TEST_F(ControlPathTest, AnotherXPlaneIsNotFlownBeforeItHasShownItsAircraft) {
  start();
  runWith(rollCommand(0.3), 0.2);
  shows_aircraft = false;
  restartXPlane();
  sim.clearMessages();
  runWith(rollCommand(0.3), 1.5);
  EXPECT_EQ(path->standing(), Standing::kNotConnected);
  EXPECT_EQ(path->refusal(), "X-Plane is back, but has not shown which aircraft is loaded yet");
  EXPECT_TRUE(writesTo(kStickRoll).empty());
  EXPECT_EQ(sim.value(kStickOverride), 0.0F);
  path->onAircraft({"QUAD", ""});
  runWith(rollCommand(0.3), 0.2);
  EXPECT_EQ(path->standing(), Standing::kWrongAircraft);
  EXPECT_TRUE(writesTo(kStickRoll).empty());
}

TEST_F(ControlPathTest, ARestartWithinAGapIsNotFlownBeforeItsAircraftIsShown) {
  start();
  runWith(rollCommand(0.3), 0.2);
  shows_aircraft = false;
  sim.set(kRunningTime, 1.0F);  // the link has noticed nothing
  sim.set(kStickOverride, 0.0F);
  sim.frame();
  sim.clearMessages();
  runWith(rollCommand(0.3), 0.2);
  EXPECT_TRUE(writesTo(kStickRoll).empty());
  path->onSameAircraft();
  runWith(rollCommand(0.3), 0.1);
  EXPECT_FLOAT_EQ(sim.value(kStickRoll), 0.3F);
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

TEST_F(ControlPathTest, AnOverrideThatCannotBeNotedKeepsItsOwnChannelsBackAndNoOther) {
  constexpr const char* kLeftBrake = "sim/cockpit2/controls/left_brake_ratio";
  constexpr const char* kRightBrake = "sim/cockpit2/controls/right_brake_ratio";
  sim.set(kLeftBrake, 0.0F);
  sim.set(kRightBrake, 0.0F);
  start();
  runWith(rollCommand(0.3), 0.2);
  sim.breakJournal();
  core::ControlCommand braking = rollCommand(-0.2);
  braking.fields |= core::kFieldToeBrakes | core::kFieldFlaps;
  braking.left_brake = braking.right_brake = 1.0;
  braking.flaps = 0.5;
  sim.clearMessages();
  runWith(braking, 0.2);
  EXPECT_FLOAT_EQ(sim.value(kStickRoll), -0.2F) << "its override is held";
  EXPECT_FLOAT_EQ(sim.value(kFlapHandle), 0.5F) << "takes no override";
  EXPECT_TRUE(writesTo(kLeftBrake).empty());
  EXPECT_FLOAT_EQ(static_cast<float>(stick[0]), -0.2F);
  EXPECT_FALSE(applied.back().controls.active.test(core::index(core::Channel::kLeftBrake)));
  EXPECT_EQ(applied.back().controls.fields & core::kFieldToeBrakes, 0U);
  ASSERT_EQ(warnings.size(), 1U) << "warned of once";
  EXPECT_EQ(warnings[0].find("commands of left_brake, right_brake are not sent: it could not be given back"), 0U);
  sim.breakJournal(false);
  runWith(braking, 0.1);
  EXPECT_FLOAT_EQ(sim.value(kLeftBrake), 1.0F);
}

TEST_F(ControlPathTest, AnAxisThatIsNotHeldIsNoneThatIsSent) {
  start();
  sim.journalOfAnother(true).record(std::string("override:") + kYawOverride, kOverridePurpose,
                                    {core::UndoDref{kYawOverride, 0.0F}});
  core::ControlCommand command = rollCommand(0.3);
  command.fields |= core::kFieldYaw;
  command.yaw = 0.5;
  runWith(command, 0.1);
  EXPECT_FLOAT_EQ(static_cast<float>(stick[0]), 0.3F);
  EXPECT_TRUE(std::isnan(stick[2])) << "surfaces that are driven by hand must not follow it";
  EXPECT_TRUE(writesTo(kStickYaw).empty());
}

TEST(Standing, EachHasAName) {
  for (const Standing standing : {Standing::kFlying, Standing::kWrongAircraft, Standing::kWaitingForMode,
                                  Standing::kSuspended, Standing::kNotConnected}) {
    EXPECT_STRNE(toString(standing), "");
  }
}

}  // namespace
}  // namespace xplane_bridge
