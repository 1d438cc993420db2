#include "fixture.hpp"

namespace xplane_bridge {
namespace {

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
  setState(LinkState::kLost);  // a busy computer: the new X-Plane's first frames come late
  flyOn(FlightMode::kAuto, 1.0);
  setState(LinkState::kConnected);
  flyOn(FlightMode::kAuto, 1.0);
  EXPECT_EQ(modes.back().reason.rfind("X-Plane was restarted; AUTO is off", 0), 0u) << modes.back().reason;
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

TEST_F(ControlPathTest, ADeadSourceTimesOutHoweverOftenXPlaneIsPaused) {
  for (const LinkState away : {LinkState::kPaused, LinkState::kStale}) {
    SCOPED_TRACE(core::toString(away));
    start();
    runWith(rollCommand(0.25), 0.5);
    for (int i = 0; i < 10; ++i) {
      setState(away);
      run(0.1);
      setState(LinkState::kConnected);
      run(0.2);
    }
    EXPECT_TRUE(path->mode().failsafe);
    EXPECT_FLOAT_EQ(sim.value(kStickRoll), 0.0F);
  }
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

}  // namespace
}  // namespace xplane_bridge
