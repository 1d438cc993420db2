#include "fixture.hpp"

namespace xplane_bridge {
namespace {

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

core::ControlCommand throttleCommand(double value) {
  core::ControlCommand command;
  command.fields = core::kFieldThrottle;
  command.throttle = value;
  return command;
}

TEST_F(MotorsTest, GoToTheirFailsafeWhereTheStickHasOnceMovedALeverAndIsSilent) {
  constexpr float kNeutral = 0.4F;
  for (int engine = 0; engine < 2; ++engine) {
    options.arbiter.channels[core::index(core::motorChannel(engine))].neutral = kNeutral;
  }
  start();
  runWith(throttleCommand(0.0), 0.2);
  ask(FlightMode::kAuto);
  for (int i = 0; i < 100; ++i) {
    path->command(FlightMode::kAuto, motorsCommand(0.8, 0.8));
    frame();
  }
  ask(FlightMode::kManual);
  run(2.0);
  EXPECT_TRUE(path->mode().failsafe);
  EXPECT_FLOAT_EQ(sim.value("sim/flightmodel/engine/ENGN_thro_use[1]"), kNeutral);
  runWith(throttleCommand(0.1), 2.0);
  EXPECT_FALSE(path->mode().failsafe);
  EXPECT_EQ(sim.value(kMotorOverride), 0.0F);
  EXPECT_FLOAT_EQ(lever(1), 0.1F);
}

TEST_F(MotorsTest, ThrustGoesOverToALeverAtTheTransitionRate) {
  options.arbiter.transition_rate = 2.0;
  start();
  runWith(throttleCommand(0.0), 0.2);
  ask(FlightMode::kAuto);
  const auto both = [&](int frames) {
    for (int i = 0; i < frames; ++i) {
      path->command(FlightMode::kManual, throttleCommand(0.0));
      path->command(FlightMode::kAuto, motorsCommand(0.8, 0.6));
      frame();
    }
  };
  both(100);
  ASSERT_FLOAT_EQ(sim.value("sim/flightmodel/engine/ENGN_thro_use[1]"), 0.6F);
  ask(FlightMode::kManual);
  both(1);
  EXPECT_EQ(sim.value(kMotorOverride), 0.0F);
  EXPECT_NEAR(lever(0), 0.8F, 0.1F);
  EXPECT_NEAR(lever(1), 0.6F, 0.1F);
  both(50);
  EXPECT_FLOAT_EQ(lever(0), 0.0F);
}

TEST_F(MotorsTest, LeverWithoutReverseIsNotBelowZero) {
  start();
  core::ControlCommand command = motorsCommand(-0.5, 0.7);
  if (path->command(FlightMode::kManual, command)) GTEST_SKIP() << "motors take no negative values";
  runWith(command, 0.5);
  path->suspend("loading");
  EXPECT_FLOAT_EQ(lever(0), 0.0F);
}

// --- another flight has levers of its own ---

class MotorsOfTheLastFlight : public MotorsTest {
 protected:
  /// By a controller, whose motors fly their failsafe once it is silent.
  void fly() {
    sim.set(kFlightTime, 50.0F);
    start();
    ask(FlightMode::kAuto);
    for (int i = 0; i < 25; ++i) {
      path->command(FlightMode::kAuto, motorsCommand(0.6, 0.7));
      frame();
    }
    ASSERT_EQ(sim.value(kMotorOverride), 1.0F);
    overrides.recordPreparations();
  }
  void expectNoneInTheJournal() {
    overrides.recordPreparations();
    for (const core::JournalEntry& entry : sim.journal()->entries()) EXPECT_EQ(entry.undo.size(), 1U) << entry.id;
  }
  void expectLeversOfTheirOwn() {
    run(1.0);
    EXPECT_EQ(sim.value(kMotorOverride), 0.0F);
    EXPECT_EQ(lever(0), 0.0F);
    EXPECT_EQ(lever(1), 0.0F);
  }
};

TEST_F(MotorsOfTheLastFlight, MoveNoLeverOfANewOne) {
  fly();
  path->onNewFlight("the flight began anew");
  expectNoneInTheJournal();
  expectLeversOfTheirOwn();
}

TEST_F(MotorsOfTheLastFlight, HeldByTheirFailsafeMoveNoLeverOfANewOne) {
  for (int engine = 0; engine < 2; ++engine) {
    options.arbiter.channels[core::index(core::motorChannel(engine))].failsafe = core::Failsafe::kHold;
  }
  fly();
  run(2.0);
  ASSERT_TRUE(path->mode().failsafe);
  path->onNewFlight("the flight began anew");
  expectLeversOfTheirOwn();
}

TEST_F(MotorsOfTheLastFlight, MoveNoLeverOfAnotherAircraft) {
  fly();
  path->onAircraft({"QUAD", ""});
  expectNoneInTheJournal();
  expectLeversOfTheirOwn();
}

TEST_F(MotorsOfTheLastFlight, MoveNoLeverOfARestartedXPlane) {
  fly();
  sim.set(kMotorOverride, 0.0F);
  restartXPlane();
  path->tick();  // before its first frame
  expectLeversOfTheirOwn();
}

TEST_F(MotorsOfTheLastFlight, MoveTheLeversOfTheSameOneThatComesBack) {
  fly();
  setState(LinkState::kLost);
  run(0.6);
  setState(LinkState::kConnected);
  path->tick();
  EXPECT_EQ(lever(0), 0.0F) << "it has not shown its flight yet";
  run(1.0);
  EXPECT_EQ(sim.value(kMotorOverride), 0.0F);
  EXPECT_FLOAT_EQ(lever(0), 0.6F);
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

}  // namespace
}  // namespace xplane_bridge
