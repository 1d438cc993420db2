#include "xplane_bridge/core/control/axis_map.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace xplane_bridge::core {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

DirectInput direct(JoyTarget target, int axis, double scale = 1.0) {
  DirectInput in;
  in.key = std::string("channels.") + toString(target);
  in.target = target;
  in.axis = {axis, axis};
  in.scale = scale;
  return in;
}

IntegratedInput integrated(JoyTarget target, int axis, double rate, double low = -1.0, double high = 1.0) {
  IntegratedInput in;
  in.key = std::string("channels.") + toString(target);
  in.target = target;
  in.axis = {axis, axis};
  in.rate = rate;
  in.dead_zone = 0.0;
  in.low = low;
  in.high = high;
  in.initial = std::max(low, 0.0);
  return in;
}

JoystickOptions options() {
  JoystickOptions o;
  o.device = "Test Pad";
  return o;
}

TEST(AxisMap, EquationOneIsScaleTimesInput) {
  JoystickOptions o = options();
  o.direct = {direct(JoyTarget::kRoll, 0, -1.0), direct(JoyTarget::kPitch, 1, 0.5), direct(JoyTarget::kYaw, 2, 2.0)};
  JoystickMapper mapper(o);
  ASSERT_TRUE(mapper.onJoy({0.25f, -0.5f, 0.75f}, {}, 0.0));
  const auto out = mapper.update(0.01);
  ASSERT_TRUE(out.alive);
  EXPECT_EQ(out.command.fields, static_cast<std::uint32_t>(kFieldRoll | kFieldPitch | kFieldYaw));
  EXPECT_DOUBLE_EQ(out.command.roll, -0.25);
  EXPECT_DOUBLE_EQ(out.command.pitch, -0.25);
  EXPECT_DOUBLE_EQ(out.command.yaw, 1.0) << "2 * 0.75 saturates";
  EXPECT_FALSE(checkCommand(out.command)) << "what the mapper makes, tx accepts";
}

TEST(AxisMap, DeadZoneIsStretchedAndExpoIsCubic) {
  EXPECT_DOUBLE_EQ(shapeAxis(0.1, 0.2, 0.0), 0.0);
  EXPECT_DOUBLE_EQ(shapeAxis(-0.2, 0.2, 0.0), 0.0);
  EXPECT_NEAR(shapeAxis(0.6, 0.2, 0.0), 0.5, 1e-12);  // (0.6 - 0.2) / 0.8
  EXPECT_NEAR(shapeAxis(-1.0, 0.2, 0.0), -1.0, 1e-12);
  EXPECT_NEAR(shapeAxis(0.5, 0.0, 1.0), 0.125, 1e-12);   // 0.5^3
  EXPECT_NEAR(shapeAxis(-0.5, 0.0, 0.4), -0.35, 1e-12);  // 0.6 * 0.5 + 0.4 * 0.125
  EXPECT_NEAR(shapeAxis(0.6, 0.2, 0.4), 0.35, 1e-12);
  EXPECT_DOUBLE_EQ(shapeAxis(1.0005, 0.0, 0.0), 1.0);
}

TEST(AxisMap, ThrottleTravelBecomesZeroToOne) {
  JoystickOptions o = options();
  o.direct = {direct(JoyTarget::kThrottle, 0, -1.0)};
  o.direct[0].travel = AxisTravel::kFull;
  JoystickMapper mapper(o);
  const auto throttle = [&mapper](float j) {
    mapper.onJoy({j}, {}, 0.0);
    return mapper.update(0.0).command.throttle;
  };
  EXPECT_DOUBLE_EQ(throttle(1.0f), 0.0);
  EXPECT_DOUBLE_EQ(throttle(-1.0f), 1.0);
  EXPECT_DOUBLE_EQ(throttle(-0.5f), 0.75);
  o.direct[0].travel = AxisTravel::kPositive;
  mapper = JoystickMapper(o);
  EXPECT_DOUBLE_EQ(throttle(0.5f), 0.0);
  EXPECT_DOUBLE_EQ(throttle(-0.5f), 0.5);
}

TEST(AxisMap, LeverThatReadsZeroUntilTouchedCommandsNothingUntilThen) {
  JoystickOptions o = options();
  o.direct = {direct(JoyTarget::kThrottle, 0, 1.0), direct(JoyTarget::kRoll, 1)};
  o.direct[0].travel = AxisTravel::kFull;
  o.direct[0].silent_until_moved = true;
  JoystickMapper mapper(o);
  mapper.onJoy({0.0f, 0.0f}, {}, 0.0);
  EXPECT_EQ(mapper.update(0.0).command.fields, static_cast<std::uint32_t>(kFieldRoll));
  mapper.onJoy({std::numeric_limits<float>::min(), 0.0f}, {}, 0.05);  // as the virtual stick's lever in its middle
  EXPECT_EQ(mapper.update(0.05).command.throttle, 0.5);
  mapper.onJoy({-0.6f, 0.0f}, {}, 0.1);
  EXPECT_NEAR(mapper.update(0.1).command.throttle, 0.2, 1e-7);
  mapper.onJoy({0.0f, 0.0f}, {}, 0.2);  // now a real zero
  const auto out = mapper.update(0.2);
  EXPECT_EQ(out.command.fields, static_cast<std::uint32_t>(kFieldThrottle | kFieldRoll));
  EXPECT_DOUBLE_EQ(out.command.throttle, 0.5);
}

TEST(AxisMap, LeverOfADeviceThatWasPulledOutCommandsNothingUntilItIsTouchedAgain) {
  JoystickOptions o = options();
  o.direct = {direct(JoyTarget::kThrottle, 0, 1.0), direct(JoyTarget::kRoll, 1)};
  o.direct[0].travel = AxisTravel::kFull;
  o.direct[0].silent_until_moved = true;
  JoystickMapper mapper(o);
  mapper.onJoy({-1.0f, 0.0f}, {}, 0.0);
  EXPECT_DOUBLE_EQ(mapper.update(0.0).command.throttle, 0.0);
  mapper.onJoy({0.0f, 0.0f}, {}, 5.0);  // back, at idle, yet read as half
  EXPECT_EQ(mapper.update(5.0).command.fields, static_cast<std::uint32_t>(kFieldRoll));
  mapper.onJoy({-0.5f, 0.0f}, {}, 5.1);
  EXPECT_DOUBLE_EQ(mapper.update(5.1).command.throttle, 0.25);
}

TEST(AxisMap, TriggerThatReadsZeroUntilTouchedIsNotHalfPulled) {
  JoystickOptions o = options();
  o.direct = {direct(JoyTarget::kBrakes, 0, -1.0)};  // rests at 1, pulled -1
  o.direct[0].travel = AxisTravel::kFull;
  o.direct[0].silent_until_moved = true;
  JoystickMapper mapper(o);
  mapper.onJoy({0.0f}, {}, 0.0);
  EXPECT_EQ(mapper.update(0.0).command.fields, 0u);
  mapper.onJoy({1.0f}, {}, 0.1);
  EXPECT_DOUBLE_EQ(mapper.update(0.1).command.left_brake, 0.0);
  mapper.onJoy({-1.0f}, {}, 0.2);
  EXPECT_DOUBLE_EQ(mapper.update(0.2).command.right_brake, 1.0);
}

TEST(AxisMap, EquationTwoIntegratesOverRealTime) {
  JoystickOptions o = options();
  o.integrated = {integrated(JoyTarget::kTrimPitch, 0, 0.25)};  // travel -1..1: 0.5 units a second
  JoystickMapper mapper(o);
  mapper.onJoy({0.0f}, {}, 0.0);
  EXPECT_EQ(mapper.update(0.1).command.fields, 0u) << "not moved yet: X-Plane's trim stays as it is";
  mapper.onJoy({1.0f}, {}, 0.2);
  EXPECT_NEAR(mapper.update(0.3).command.trim_pitch, 0.05, 1e-12);
  mapper.onJoy({1.0f}, {}, 0.6);
  EXPECT_NEAR(mapper.update(0.6).command.trim_pitch, 0.2, 1e-12) << "uneven steps make no difference";
  mapper.onJoy({-1.0f}, {}, 1.0);
  EXPECT_NEAR(mapper.update(1.0).command.trim_pitch, 0.4, 1e-12);
  EXPECT_NEAR(mapper.update(1.2).command.trim_pitch, 0.3, 1e-12);
  mapper.onJoy({0.0f}, {}, 1.4);
  EXPECT_NEAR(mapper.update(1.8).command.trim_pitch, 0.2, 1e-12) << "released: stays";
}

TEST(AxisMap, IntegrationSaturatesWithoutWindUp) {
  JoystickOptions o = options();
  o.joy_timeout = 100.0;
  o.integrated = {integrated(JoyTarget::kFlaps, 0, 0.5, 0.0, 1.0)};
  JoystickMapper mapper(o);
  mapper.onJoy({1.0f}, {}, 0.0);
  EXPECT_DOUBLE_EQ(mapper.update(60.0).command.flaps, 1.0);
  mapper.onJoy({-1.0f}, {}, 60.0);
  EXPECT_NEAR(mapper.update(60.4).command.flaps, 0.8, 1e-12) << "leaves the stop at once";
  EXPECT_DOUBLE_EQ(mapper.update(90.0).command.flaps, 0.0);
}

TEST(AxisMap, IntegrationStopsWhenTheDeviceDies) {
  JoystickOptions o = options();
  o.joy_timeout = 0.5;
  o.integrated = {integrated(JoyTarget::kTrimPitch, 0, 0.1)};  // 0.2 units a second
  JoystickMapper mapper(o);
  mapper.onJoy({1.0f}, {}, 0.0);
  EXPECT_NEAR(mapper.update(0.4).command.trim_pitch, 0.08, 1e-12);
  EXPECT_FALSE(mapper.update(10.0).alive);
  mapper.onJoy({1.0f}, {}, 20.0);
  EXPECT_NEAR(mapper.update(20.1).command.trim_pitch, 0.02, 1e-12) << "from where it begins, by what is held since";
}

TEST(AxisMap, OfADeviceThatComesBackNothingIsIntegratedUntilItIsTouchedAgain) {
  JoystickOptions o = options();
  o.integrated = {integrated(JoyTarget::kThrottle, 0, 1.0, 0.0, 1.0)};
  JoystickMapper mapper(o);
  mapper.onJoy({1.0f}, {}, 0.0);
  EXPECT_NEAR(mapper.update(0.4).command.throttle, 0.4, 1e-12);
  for (int i = 0; i < 100; ++i) mapper.onJoy({0.0f}, {}, 57.0 + 0.02 * i);
  EXPECT_TRUE(mapper.update(59.0).alive);
  EXPECT_EQ(mapper.update(59.0).command.fields, 0u);
}

TEST(AxisMap, AMotionlessStickThatRepeatsIsAlive) {
  JoystickOptions o = options();
  o.direct = {direct(JoyTarget::kRoll, 0)};
  JoystickMapper mapper(o);
  EXPECT_FALSE(mapper.update(0.0).alive) << "nothing before the first message";
  for (int i = 0; i < 100; ++i) {
    mapper.onJoy({0.3f}, {}, 0.1 * i);
    EXPECT_TRUE(mapper.update(0.1 * i + 0.05).alive);
  }
  EXPECT_TRUE(mapper.update(9.9 + 0.49).alive);
  EXPECT_FALSE(mapper.update(9.9 + 0.51).alive);
}

TEST(AxisMap, DetentsSnapToTheNearest) {
  TravelIntegrator flaps(0.0, 1.0, 0.0, {0.0, 0.33, 0.66, 1.0});
  flaps.integrate(0.1, 1.0, 1.6);  // 0.16
  EXPECT_DOUBLE_EQ(flaps.value(), 0.0);
  flaps.integrate(0.1, 1.0, 0.1);  // 0.17
  EXPECT_DOUBLE_EQ(flaps.value(), 0.33);
  EXPECT_NEAR(flaps.fraction(), 0.17, 1e-12) << "the state keeps its resolution";
}

TEST(AxisMap, ButtonsIntegrateAndReverse) {
  JoystickOptions o = options();
  IntegratedInput in = integrated(JoyTarget::kSpeedbrake, -1, -0.5, 0.0, 1.0);
  in.increase_button = 0;
  in.decrease_button = 1;
  in.initial = 1.0;
  o.integrated = {in};
  JoystickMapper mapper(o);
  mapper.onJoy({}, {1, 0}, 0.0);
  EXPECT_NEAR(mapper.update(0.4).command.speedbrake, 0.8, 1e-12) << "a negative rate reverses";
  mapper.onJoy({}, {1, 1}, 0.4);
  EXPECT_NEAR(mapper.update(0.8).command.speedbrake, 0.8, 1e-12) << "both pressed: nothing";
}

TEST(AxisMap, ButtonsChooseWhatTheHatDoes) {
  JoystickOptions o = options();
  o.integrated = {integrated(JoyTarget::kTrimPitch, 0, 0.25), integrated(JoyTarget::kFlaps, 0, 0.5, 0.0, 1.0)};
  o.integrated[0].select_button = 2;
  o.integrated[1].select_button = 3;
  JoystickMapper mapper(o);
  mapper.onJoy({1.0f}, {0, 0, 0, 0}, 0.0);
  EXPECT_EQ(mapper.selected(), std::vector<std::string>{"channels.trim_pitch"});
  mapper.onJoy({1.0f}, {0, 0, 0, 1}, 0.4);  // trim ran for 0.4 s
  EXPECT_EQ(mapper.selected(), std::vector<std::string>{"channels.flaps"});
  mapper.onJoy({1.0f}, {0, 0, 0, 0}, 0.6);
  const auto out = mapper.update(0.8);
  EXPECT_NEAR(out.command.trim_pitch, 0.2, 1e-12);
  EXPECT_NEAR(out.command.flaps, 0.2, 1e-12);
  EXPECT_EQ(out.command.fields, static_cast<std::uint32_t>(kFieldTrimPitch | kFieldFlaps));
}

TEST(AxisMap, InputsOfOneHatNeedSelectButtons) {
  JoystickOptions o = options();
  o.integrated = {integrated(JoyTarget::kTrimPitch, 0, 0.25), integrated(JoyTarget::kFlaps, 0, 0.5, 0.0, 1.0)};
  o.integrated[0].select_button = 2;
  EXPECT_NE(validate(o).value_or("").find("channels.flaps.select_button"), std::string::npos);
}

TEST(AxisMap, ModeButtonsAskOncePerPress) {
  JoystickOptions o = options();
  o.mode = {0, 1, 2};
  JoystickMapper mapper(o);
  mapper.onJoy({}, {0, 0, 0}, 0.0);
  for (int i = 1; i < 5; ++i) mapper.onJoy({}, {0, 1, 0}, 0.1 * i);
  EXPECT_EQ(mapper.takeModeRequests(), std::vector<FlightMode>{FlightMode::kAuto});
  mapper.onJoy({}, {1, 0, 0}, 0.5);
  EXPECT_EQ(mapper.takeModeRequests(), std::vector<FlightMode>{FlightMode::kManual});
  EXPECT_TRUE(mapper.takeModeRequests().empty());
}

TEST(AxisMap, ToggleAsksForTheOtherMode) {
  JoystickOptions o = options();
  o.mode.toggle = 0;
  JoystickMapper mapper(o);
  mapper.onJoy({}, {0}, 0.0);
  mapper.setMode(FlightMode::kAuto);  // another node engaged it
  mapper.onJoy({}, {1}, 0.1);
  mapper.onJoy({}, {0}, 0.2);
  mapper.onJoy({}, {1}, 0.3);
  EXPECT_EQ(mapper.takeModeRequests(), (std::vector<FlightMode>{FlightMode::kManual, FlightMode::kAuto}));
}

TEST(AxisMap, BouncingContactIsOnePress) {
  JoystickOptions o = options();
  o.joy_timeout = 100.0;
  o.debounce = 0.05;
  o.mode.toggle = 0;
  JoystickMapper mapper(o);
  mapper.onJoy({}, {0}, 0.0);
  const double bounce[] = {1.000, 1.004, 1.009, 1.015, 1.022};
  int level = 1;
  for (const double t : bounce) {
    mapper.onJoy({}, {level}, t);
    level = 1 - level;
  }
  mapper.update(1.1);
  EXPECT_EQ(mapper.takeModeRequests().size(), 1u);
  // A short tap whose release fell into the bounce time is seen as released later, without a second press.
  mapper.onJoy({}, {0}, 2.0);
  mapper.update(2.1);
  mapper.onJoy({}, {1}, 3.0);
  mapper.onJoy({}, {0}, 3.01);
  mapper.update(3.1);
  mapper.onJoy({}, {1}, 3.2);
  EXPECT_EQ(mapper.takeModeRequests().size(), 2u);
}

TEST(AxisMap, ButtonHeldWhenTheDeviceAppearsIsNoPress) {
  JoystickOptions o = options();
  o.mode.toggle = 0;
  JoystickMapper mapper(o);
  mapper.onJoy({}, {1}, 0.0);
  EXPECT_TRUE(mapper.takeModeRequests().empty());
  mapper.onJoy({}, {0}, 0.1);
  mapper.onJoy({}, {1}, 10.0);  // silence, then back with the button down
  EXPECT_TRUE(mapper.takeModeRequests().empty());
}

TEST(AxisMap, ButtonsSetValues) {
  JoystickOptions o = options();
  o.buttons = {{"buttons.gear_up", JoyTarget::kGear, 0, 0.0, std::nullopt},
               {"buttons.gear_down", JoyTarget::kGear, 1, 1.0, std::nullopt},
               {"buttons.brakes", JoyTarget::kBrakes, 2, 0.8, 0.0}};
  JoystickMapper mapper(o);
  mapper.onJoy({}, {0, 0, 0}, 0.0);
  EXPECT_EQ(mapper.update(0.0).command.fields, 0u);
  mapper.onJoy({}, {1, 0, 1}, 0.1);
  mapper.onJoy({}, {0, 0, 1}, 0.2);
  auto out = mapper.update(0.2).command;
  EXPECT_EQ(out.fields, static_cast<std::uint32_t>(kFieldGear | kFieldToeBrakes));
  EXPECT_DOUBLE_EQ(out.gear, 0.0);
  EXPECT_DOUBLE_EQ(out.left_brake, 0.8);
  EXPECT_DOUBLE_EQ(out.right_brake, 0.8);
  mapper.onJoy({}, {0, 1, 0}, 0.3);
  out = mapper.update(0.3).command;
  EXPECT_DOUBLE_EQ(out.gear, 1.0);
  EXPECT_DOUBLE_EQ(out.left_brake, 0.0);
}

TEST(AxisMap, StickModesSwapPitchAndThrottle) {
  JoystickOptions o = options();
  o.direct = {direct(JoyTarget::kPitch, 0), direct(JoyTarget::kThrottle, 0)};
  o.direct[0].axis = {1, 4};
  o.direct[1].axis = {4, 1};
  o.stick_mode = StickMode::kMode1;
  const std::vector<float> axes = {0.0f, 0.25f, 0.0f, 0.0f, 0.5f};
  JoystickMapper mode_1(o);
  mode_1.onJoy(axes, {}, 0.0);
  EXPECT_DOUBLE_EQ(mode_1.update(0.0).command.pitch, 0.25) << "pitch on the left stick";
  EXPECT_DOUBLE_EQ(mode_1.update(0.0).command.throttle, 0.5);
  o.stick_mode = StickMode::kMode2;
  JoystickMapper mode_2(o);
  mode_2.onJoy(axes, {}, 0.0);
  EXPECT_DOUBLE_EQ(mode_2.update(0.0).command.pitch, 0.5);
  EXPECT_DOUBLE_EQ(mode_2.update(0.0).command.throttle, 0.25);
}

TEST(AxisMap, MissingAxesAndButtonsAreNamedAndNotCommanded) {
  JoystickOptions o = options();
  o.direct = {direct(JoyTarget::kRoll, 0), direct(JoyTarget::kYaw, 5)};
  o.buttons = {{"buttons.brakes", JoyTarget::kBrakes, 9, 1.0, 0.0}};
  o.mode.toggle = 7;
  JoystickMapper mapper(o);
  ASSERT_TRUE(mapper.onJoy({0.5f, 0.0f}, {0, 0}, 0.0));
  const auto out = mapper.update(0.0);
  EXPECT_TRUE(out.alive);
  EXPECT_EQ(out.command.fields, static_cast<std::uint32_t>(kFieldRoll));
  ASSERT_EQ(mapper.problems().size(), 3u);
  const auto& yaw = mapper.problems()[0];
  EXPECT_EQ(yaw.kind, JoyProblem::Kind::kAxisMissing);
  EXPECT_EQ(yaw.index, 5);
  EXPECT_EQ(yaw.key, "channels.yaw.axis");
  EXPECT_EQ(yaw.text,
            "Test Pad: axis 5 (channels.yaw.axis) does not exist: the device has 2 axes; it is not commanded");
  EXPECT_EQ(mapper.problems()[1].key, "buttons.brakes.button");
  EXPECT_EQ(mapper.problems()[2].key, "mode.toggle");
  EXPECT_EQ(mapper.problems()[2].kind, JoyProblem::Kind::kButtonMissing);
}

TEST(AxisMap, MessageWithABadAxisIsDroppedSoThatTheDeviceDies) {
  JoystickOptions o = options();
  o.direct = {direct(JoyTarget::kRoll, 0)};
  JoystickMapper mapper(o);
  mapper.onJoy({0.5f, kNan}, {}, 0.0);
  EXPECT_TRUE(mapper.problems().empty()) << "an axis without use";
  for (const float bad : {kNan, std::numeric_limits<float>::infinity(), 1.01f, -1.01f}) {
    EXPECT_FALSE(mapper.onJoy({bad, 0.0f}, {}, 0.4));
    ASSERT_EQ(mapper.problems().size(), 1u);
    EXPECT_EQ(mapper.problems()[0].key, "channels.roll.axis");
  }
  EXPECT_EQ(mapper.dropped(), 4u);
  EXPECT_DOUBLE_EQ(mapper.update(0.45).command.roll, 0.5);
  EXPECT_FALSE(mapper.update(0.55).alive);
  EXPECT_TRUE(mapper.onJoy({1.0005f, 0.0f}, {}, 0.6)) << "drivers round a little above full travel";
  EXPECT_DOUBLE_EQ(mapper.update(0.6).command.roll, 1.0);
}

TEST(AxisMap, HatThatIsNotANumberMovesNothing) {
  JoystickOptions o = options();
  o.integrated = {integrated(JoyTarget::kFlaps, 0, 0.5, 0.0, 1.0)};
  JoystickMapper mapper(o);
  mapper.onJoy({1.0f}, {}, 0.0);
  EXPECT_NEAR(mapper.update(0.2).command.flaps, 0.1, 1e-12);
  for (const float bad : {kNan, -std::numeric_limits<float>::infinity(), 7.0f}) {
    EXPECT_FALSE(mapper.onJoy({bad}, {}, 0.4));
    ASSERT_EQ(mapper.problems().size(), 1u);
    EXPECT_EQ(mapper.problems()[0].key, "channels.flaps.axis");
  }
  // The last good message goes on for joy_timeout, 0.5 s, and no further.
  EXPECT_NEAR(mapper.update(0.48).command.flaps, 0.24, 1e-12);
  EXPECT_FALSE(mapper.update(9.0).alive);
}

TEST(AxisMap, TheLaterOfTwoSelectButtonsWins) {
  JoystickOptions o = options();
  o.joy_timeout = 100.0;
  o.integrated = {integrated(JoyTarget::kTrimPitch, 0, 0.25), integrated(JoyTarget::kFlaps, 0, 0.5, 0.0, 1.0)};
  o.integrated[0].select_button = 0;
  o.integrated[1].select_button = 1;
  JoystickMapper mapper(o);
  mapper.onJoy({0.0f}, {0, 0}, 0.0);
  mapper.onJoy({0.0f}, {0, 1}, 1.0);
  mapper.onJoy({0.0f}, {1, 0}, 1.001);  // both at once for a moment: the later one wins
  EXPECT_EQ(mapper.selected(), std::vector<std::string>{"channels.trim_pitch"});
  mapper.onJoy({0.0f}, {0, 0}, 1.01);  // released within the debounce time: no second press when it settles
  mapper.update(1.2);
  EXPECT_EQ(mapper.selected(), std::vector<std::string>{"channels.trim_pitch"});
}

TEST(AxisMap, DeviceThatComesBackSmallerDoesNotCrash) {
  JoystickOptions o = options();
  o.buttons = {{"buttons.brakes", JoyTarget::kBrakes, 2, 1.0, 0.0}};
  IntegratedInput in = integrated(JoyTarget::kTrimYaw, 1, 0.1);
  o.integrated = {in};
  JoystickMapper mapper(o);
  mapper.onJoy({0.0f, 1.0f}, {0, 0, 0}, 0.0);
  mapper.onJoy({0.0f, 1.0f}, {0, 0, 1}, 0.1);
  mapper.onJoy({}, {}, 0.2);
  EXPECT_DOUBLE_EQ(mapper.update(0.3).command.left_brake, 0.0) << "a button that went away is released";
  EXPECT_EQ(mapper.update(0.3).command.fields, static_cast<std::uint32_t>(kFieldToeBrakes))
      << "nor an axis that went away";
}

TEST(AxisMap, OptionsAreCheckedByKey) {
  const auto complaint = [](auto change) {
    JoystickOptions o = options();
    o.direct = {direct(JoyTarget::kRoll, 0)};
    o.integrated = {integrated(JoyTarget::kFlaps, 1, 0.5, 0.0, 1.0)};
    o.buttons = {{"buttons.gear_up", JoyTarget::kGear, 0, 0.0, std::nullopt}};
    change(o);
    return validate(o).value_or("");
  };
  EXPECT_EQ(complaint([](auto&) {}), "");
  EXPECT_EQ(complaint([](auto& o) { o.direct[0].axis = {}; }).find("channels.roll.axis is -1"), 0u);
  EXPECT_EQ(complaint([](auto& o) { o.direct[0].dead_zone = 1.0; }).find("channels.roll.dead_zone is 1"), 0u);
  EXPECT_EQ(complaint([](auto& o) { o.direct[0].expo = -0.1; }).find("channels.roll.expo"), 0u);
  EXPECT_EQ(complaint([](auto& o) { o.direct[0].scale = 0.0; }).find("channels.roll.scale"), 0u);
  EXPECT_EQ(complaint([](auto& o) { o.integrated[0].low = -1.0; }).find("channels.flaps.low is -1: expected 0..1"), 0u);
  EXPECT_EQ(complaint([](auto& o) { o.integrated[0].rate = 0.0; }).find("channels.flaps.rate"), 0u);
  EXPECT_EQ(complaint([](auto& o) { o.integrated[0].detents = {0.5, 0.5}; }).find("channels.flaps.detents"), 0u);
  EXPECT_EQ(complaint([](auto& o) { o.integrated[0].increase_button = 1; }).find("channels.flaps: expected either"),
            0u);
  EXPECT_EQ(complaint([](auto& o) {
              o.integrated[0].axis = {};
              o.integrated[0].increase_button = o.integrated[0].decrease_button = 1;
            }),
            "channels.flaps.decrease_button is 1: expected another button than that of channels.flaps.increase_button");
  EXPECT_EQ(complaint([](auto& o) { o.direct.push_back(direct(JoyTarget::kRoll, 2)); }),
            "channels.roll.target is roll: expected another than that of channels.roll");
  EXPECT_EQ(complaint([](auto& o) { o.integrated.push_back(integrated(JoyTarget::kFlaps, 2, 0.5, 0.0, 1.0)); }),
            "channels.flaps.target is flaps: expected another than that of channels.flaps");
  EXPECT_EQ(
      complaint([](auto& o) {
        o.integrated.push_back(integrated(JoyTarget::kTrimPitch, 1, 0.5));
        o.integrated[0].select_button = o.integrated[1].select_button = 4;
      }),
      "channels.flaps.select_button is 4: expected another button than that of channels.trim_pitch.select_button");
  EXPECT_EQ(complaint([](auto& o) { o.mode.manual = o.mode.automatic = 3; }),
            "mode.auto is 3: expected another button than that of mode.manual");
  EXPECT_EQ(complaint([](auto& o) { o.mode.automatic = o.mode.toggle = 3; }),
            "mode.toggle is 3: expected another button than that of mode.auto");
  EXPECT_EQ(complaint([](auto& o) { o.buttons[0].value = 2.0; }).find("buttons.gear_up.value is 2"), 0u);
  EXPECT_EQ(complaint([](auto& o) { o.joy_timeout = 0.0; }).find("joy_timeout"), 0u);
  EXPECT_FALSE(joyTargetFrom("ailerons"));
  EXPECT_EQ(joyTargetFrom("thrust_vector"), JoyTarget::kThrustVector);
}

// ------------------------------------------------------------------------------------------------ single surfaces

}  // namespace
}  // namespace xplane_bridge::core
