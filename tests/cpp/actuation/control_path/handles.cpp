// Handles and trims: sent for a while after a change, the cockpit's after that.

#include "fixture.hpp"

namespace xplane_bridge {
namespace {

constexpr const char* kGearHandle = "sim/cockpit2/controls/gear_handle_down";

class HandlesTest : public ControlPathTest {
 protected:
  static core::ControlCommand rollAndFlaps(double roll, double flaps) {
    core::ControlCommand command = rollCommand(roll);
    command.fields |= core::kFieldFlaps;
    command.flaps = flaps;
    return command;
  }
};

TEST_F(HandlesTest, ANewFlightGetsThoseThatAreCommanded) {
  start();
  runWith(rollAndFlaps(0.25, 0.5), 1.0);
  ASSERT_FLOAT_EQ(sim.value(kFlapHandle), 0.5F);
  sim.set(kFlapHandle, 0.0F);
  path->onNewFlight("the flight began anew");
  runWith(rollAndFlaps(0.25, 0.5), 1.0);
  EXPECT_FLOAT_EQ(sim.value(kFlapHandle), 0.5F);
  EXPECT_EQ(path->notFollowed(), Texts{});
}

TEST_F(HandlesTest, ANewFlightDoesNotGetThoseThatAreOnlyHeld) {
  start();
  runWith(rollAndFlaps(0.25, 0.5), 0.5);
  runWith(rollCommand(0.25), 2.0);
  sim.set(kFlapHandle, 0.0F);
  path->onNewFlight("the flight began anew");
  runWith(rollCommand(0.25), 1.0);
  EXPECT_FLOAT_EQ(sim.value(kFlapHandle), 0.0F);
  runWith(rollAndFlaps(0.25, 0.5), 0.1);
  EXPECT_FLOAT_EQ(sim.value(kFlapHandle), 0.5F) << "the same value as before, and commanded again";
}

TEST_F(HandlesTest, AfterAReleaseByAnotherThoseThatAreCommandedAreSentAgain) {
  start();
  core::ControlCommand command = rollAndFlaps(0.25, 0.5);
  command.fields |= core::kFieldTrimYaw;
  command.trim_yaw = 0.2;
  runWith(command, 1.0);
  sim.set(kStickOverride, 0.0F);
  runWith(command, 1.0);
  ASSERT_EQ(path->standing(), Standing::kWaitingForMode);
  sim.set(kFlapHandle, 0.0F);
  sim.set(kRudderTrim, 0.0F);
  runWith(command, 0.5);
  ASSERT_FLOAT_EQ(sim.value(kFlapHandle), 0.0F);
  ask(FlightMode::kManual);
  runWith(command, 1.0);
  EXPECT_FLOAT_EQ(sim.value(kFlapHandle), 0.5F);
  EXPECT_FLOAT_EQ(sim.value(kRudderTrim), 0.2F);
  EXPECT_EQ(path->notFollowed(), Texts{});
}

TEST_F(HandlesTest, OneThatIsCommandedAnewIsSentThoughItIsTheSame) {
  start();
  runWith(rollAndFlaps(0.25, 0.5), 1.0);
  sim.set(kFlapHandle, 0.0F);
  runWith(rollAndFlaps(0.25, 0.5), 1.0);
  ASSERT_FLOAT_EQ(sim.value(kFlapHandle), 0.0F) << "it goes on";
  runWith(rollCommand(0.25), 1.0);
  ASSERT_FLOAT_EQ(sim.value(kFlapHandle), 0.0F) << "held";
  runWith(rollAndFlaps(0.25, 0.5), 0.1);
  EXPECT_FLOAT_EQ(sim.value(kFlapHandle), 0.5F);
}

TEST_F(HandlesTest, TheLeastChangeOfItsCommandSendsItAgain) {
  start();
  core::ControlCommand command = rollAndFlaps(0.25, 1.0);
  command.fields |= core::kFieldGear;
  runWith(command, 1.0);
  sim.set(kFlapHandle, 0.0F);
  sim.set(kGearHandle, 1.0F);
  runWith(command, 1.0);
  ASSERT_FLOAT_EQ(sim.value(kGearHandle), 1.0F);
  core::ControlCommand pressed_again = command;  // as joystick_mapper_node does
  pressed_again.flaps = 0.999999F;
  pressed_again.gear = 1e-6F;
  runWith(pressed_again, 0.02);
  EXPECT_EQ(sim.value(kGearHandle), 0.0F) << "up or down, nothing between them";
  runWith(command, 0.5);
  EXPECT_EQ(sim.value(kFlapHandle), 1.0F);
  EXPECT_EQ(path->notFollowed(), Texts{});
}

TEST_F(HandlesTest, AChangeOfTheModeAloneSendsNone) {
  start();
  const auto flyBoth = [this] {
    for (int i = 0; i < 20; ++i) {
      path->command(FlightMode::kManual, rollAndFlaps(0.25, 0.5));
      path->command(FlightMode::kAuto, rollCommand(0.25));
      frame();
    }
  };
  flyBoth();
  ask(FlightMode::kAuto);
  flyBoth();
  sim.set(kFlapHandle, 1.0F);
  ask(FlightMode::kManual);
  flyBoth();
  EXPECT_FLOAT_EQ(sim.value(kFlapHandle), 1.0F);
}

TEST_F(HandlesTest, OneThatIsMovedInTheCockpitEndsNoReadBack) {
  start();
  runWith(rollAndFlaps(0.25, 0.5), 1.0);
  sim.set(kFlapHandle, 0.25F);
  runWith(rollAndFlaps(0.25, 0.5), 0.2);
  applied.clear();
  for (int i = 1; i <= 50; ++i) runWith(rollAndFlaps(0.01 * i, 0.5), 0.02);
  const auto shown = std::count_if(applied.begin(), applied.end(), [](const auto& each) { return each.read_back; });
  EXPECT_GT(shown, 40);
  EXPECT_FLOAT_EQ(sim.value(kFlapHandle), 0.25F);
  run(1.5);
  EXPECT_EQ(path->notFollowed(), Texts{});
}

TEST_F(HandlesTest, OneThatTakesSecondsIsReadBackWhenItIsThere) {
  start();
  float wanted = 0.0F, there = 0.0F;
  sim.on_message = [&](const core::FakeSimulator::Message& message) {
    if (message.path == kFlapHandle) wanted = message.value;
  };
  sim.on_frame = [&] {
    there = std::min(there + 0.005F, wanted);
    sim.set(kFlapHandle, there);
  };
  core::ControlCommand command;
  command.fields = core::kFieldFlaps;
  command.flaps = 0.5;
  const auto shown = [this] {
    return std::count_if(applied.begin(), applied.end(), [](const auto& each) { return each.read_back; });
  };
  runWith(command, 1.0);
  EXPECT_EQ(shown(), 0);
  runWith(command, 1.5);
  EXPECT_GT(shown(), 0);
  EXPECT_FLOAT_EQ(sim.value(kFlapHandle), 0.5F);
  EXPECT_EQ(path->notFollowed(), Texts{});
}

TEST_F(HandlesTest, OneThatXPlaneDoesNotMoveIsNamedAndTheStickIsReadBack) {
  start();
  sim.on_frame = [this] {
    if (sim.value(kFlapHandle) > 0.0F) sim.set(kFlapHandle, 0.33F);  // its nearest detent
  };
  runWith(rollAndFlaps(0.0, 0.5), 0.5);
  applied.clear();
  for (int i = 1; i <= 50; ++i) runWith(rollAndFlaps(0.01 * i, 0.5), 0.02);
  const auto shown = std::count_if(applied.begin(), applied.end(), [](const auto& each) { return each.read_back; });
  EXPECT_GT(shown, 40);
  EXPECT_EQ(path->notFollowed(), Texts{"flaps"});
}

}  // namespace
}  // namespace xplane_bridge
