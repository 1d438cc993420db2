#include "xplane_bridge/core/control/axis_map.hpp"

#include <gtest/gtest.h>

namespace xplane_bridge::core {
namespace {

constexpr double kStep = 0.02;  // [s] between messages

/// Gear and parking brake by buttons 0 to 2, toe brakes by 3, flaps by a hat with detents and by button 4.
JoystickOptions handles() {
  JoystickOptions o;
  o.device = "Test Pad";
  o.debounce = 0.0;
  o.buttons = {{"buttons.gear_up", JoyTarget::kGear, 0, 0.0, std::nullopt},
               {"buttons.gear_down", JoyTarget::kGear, 1, 1.0, std::nullopt},
               {"buttons.parking_brake", JoyTarget::kParkingBrake, 2, 1.0, std::nullopt},
               {"buttons.brakes", JoyTarget::kBrakes, 3, 1.0, 0.0},
               {"buttons.flaps_up", JoyTarget::kFlaps, 4, 0.0, std::nullopt}};
  IntegratedInput flaps;
  flaps.key = "integrated.flaps";
  flaps.target = JoyTarget::kFlaps;
  flaps.axis = {0, 0};
  flaps.rate = 0.5;
  flaps.low = 0.0;
  flaps.high = 1.0;
  flaps.detents = {0.0, 0.5, 1.0};
  o.integrated = {flaps};
  return o;
}

class AxisMapHandles : public testing::Test {
 protected:
  /// The hat and one button (none: -1) held for so long; gives the last command.
  ControlCommand hold(float hat, int button, double seconds = kStep) {
    JoystickCommand out;
    for (const double end = now_ + seconds - 0.5 * kStep; now_ < end;) {
      now_ += kStep;
      std::vector<std::int32_t> buttons(5, 0);
      if (button >= 0) buttons[static_cast<std::size_t>(button)] = 1;
      EXPECT_TRUE(mapper_.onJoy({hat}, buttons, now_));
      out = mapper_.update(now_);
    }
    return out.command;
  }
  ControlCommand rest(double seconds = 1.0) { return hold(0.0f, -1, seconds); }

  JoystickMapper mapper_{handles()};
  double now_ = 0.0;
};

/// As in ControlCommand.msg: tx_node sends a handle again when this has changed.
void expectNudged(double value, double rest) {
  EXPECT_NE(static_cast<float>(value), static_cast<float>(rest));
  EXPECT_NEAR(value, rest, 2e-6);
}

TEST_F(AxisMapHandles, ButtonPressedAgainChangesTheCommandForAMoment) {
  rest();
  EXPECT_EQ(hold(0.0f, 0).gear, 0.0) << "the command begins";
  EXPECT_EQ(rest().gear, 0.0);
  const ControlCommand again = hold(0.0f, 0);
  expectNudged(again.gear, 0.0);
  EXPECT_FALSE(checkCommand(again));
  expectNudged(hold(0.0f, 0, 0.06).gear, 0.0);
  EXPECT_EQ(hold(0.0f, 0, 0.1).gear, 0.0) << "still held";
  EXPECT_EQ(hold(0.0f, 1).gear, 1.0) << "changes by itself";
  rest();
  const ControlCommand down = hold(0.0f, 1);
  expectNudged(down.gear, 1.0);
  EXPECT_FALSE(checkCommand(down));
}

TEST_F(AxisMapHandles, ButtonPressedAgainLeavesOtherHandlesAlone) {
  rest();
  hold(0.0f, 0);
  hold(0.0f, 2);
  rest();
  const ControlCommand out = hold(0.0f, 2);
  expectNudged(out.parking_brake, 1.0);
  EXPECT_EQ(out.gear, 0.0);
}

TEST_F(AxisMapHandles, BrakesThatAreReleasedChangeByThemselves) {
  rest();
  for (int press = 0; press < 2; ++press) {
    EXPECT_EQ(hold(0.0f, 3).left_brake, 1.0);
    EXPECT_EQ(rest().left_brake, 0.0);
  }
}

TEST_F(AxisMapHandles, HatPushedAgainAtItsEndChangesTheCommandForAMoment) {
  rest();
  EXPECT_EQ(hold(1.0f, -1, 1.7).flaps, 1.0) << "the last detent, before the end of the travel";
  EXPECT_EQ(hold(1.0f, -1, 0.5).flaps, 1.0) << "held on";
  EXPECT_EQ(rest().flaps, 1.0);
  expectNudged(hold(1.0f, -1).flaps, 1.0);
  EXPECT_EQ(rest().flaps, 1.0);
  EXPECT_EQ(hold(-1.0f, -1).flaps, 1.0) << "on its way to a detent";
}

TEST_F(AxisMapHandles, HatPushedBetweenItsDetentsMovesNothingBack) {
  rest();
  EXPECT_EQ(hold(1.0f, -1, 1.0).flaps, 0.5);
  rest();
  EXPECT_EQ(hold(1.0f, -1).flaps, 0.5);
}

TEST_F(AxisMapHandles, ButtonAsksAgainForWhatTheHatCommands) {
  rest();
  EXPECT_EQ(hold(-1.0f, -1).flaps, 0.0);
  rest();
  expectNudged(hold(0.0f, 4).flaps, 0.0);
  rest();
  EXPECT_EQ(hold(1.0f, -1, 2.5).flaps, 0.0) << "the button has the flaps";
  rest();
  EXPECT_EQ(hold(1.0f, -1).flaps, 0.0) << "the hat asks for another value";
}

TEST_F(AxisMapHandles, HatHeldWhenTheDeviceAppearsIsNotPushed) {
  hold(-1.0f, -1);
  EXPECT_EQ(hold(-1.0f, -1).flaps, 0.0) << "at its end";
  rest();
  expectNudged(hold(-1.0f, -1).flaps, 0.0);
}

TEST_F(AxisMapHandles, ADeviceThatComesBackCommandsNoHandleUntilItIsUsedAgain) {
  rest();
  hold(0.0f, 0);
  hold(1.0f, -1, 2.5);
  EXPECT_EQ(rest().fields, static_cast<std::uint32_t>(kFieldGear | kFieldFlaps));
  now_ += 3.0;  // in which the pilot lowers the gear in the cockpit
  EXPECT_EQ(rest().fields, 0u);
  const ControlCommand gear = hold(0.0f, 0);
  EXPECT_EQ(gear.fields, static_cast<std::uint32_t>(kFieldGear));
  EXPECT_EQ(gear.gear, 0.0) << "the command begins";
  rest();
  EXPECT_EQ(hold(1.0f, -1).flaps, 0.0) << "from where the integral begins";
}

}  // namespace
}  // namespace xplane_bridge::core
