#include "xplane_bridge/core/control/simulator_stick.hpp"

#include <gtest/gtest.h>

#include <map>

#include "datagram.hpp"

namespace xplane_bridge::core {
namespace {

constexpr std::int64_t kNow = 1'000'000'000;
constexpr std::int64_t kLater = 60'000'000'000;
const std::string kFolder = "sim/joystick/";

using Values = std::map<std::string, float>;

Datagram answer(const std::vector<std::string>& requests, const Values& values) {
  Datagram d = Datagram::labelled("RREF,");
  for (std::size_t i = 0; i < requests.size(); ++i) {
    const auto found = values.find(requests[i].substr(kFolder.size()));
    d.pair(static_cast<std::int32_t>(i), found == values.end() ? 0.0F : found->second);
  }
  return d;
}

bool settings(SimulatorStick* stick, const Values& values, std::int64_t at = kNow) {
  return stick->addSettings(answer(stick->settingRequests(), values).rref(), at);
}

bool move(SimulatorStick* stick, Values values, std::int64_t at = kNow) {
  values.emplace("has_joystick", 1.0F);
  return stick->addValues(answer(stick->valueRequests(), values).rref(), at);
}

/// Pitch on X-Plane's axis 1, roll on 0, yaw on 5; the throttle on 2, reversed.
const Values kAssigned = {{"joystick_axis_assignments[0]", 2.0F},
                          {"joystick_axis_assignments[1]", 1.0F},
                          {"joystick_axis_assignments[5]", 3.0F},
                          {"joystick_axis_assignments[2]", 4.0F},
                          {"joystick_axis_reverse[2]", 2.0F}};

TEST(SimulatorStick, AsksForTheAxesThatXPlanesSettingsName) {
  SimulatorStick stick({6, 160, 2, 50});
  EXPECT_EQ(stick.settingRequests().size(), 12U);
  EXPECT_EQ(stick.valueRequests(),
            (std::vector<std::string>{"sim/joystick/has_joystick", "sim/joystick/joystick_button_values[160]",
                                      "sim/joystick/joystick_button_values[161]"}));
  EXPECT_TRUE(settings(&stick, kAssigned));
  EXPECT_EQ(stick.valueRequests(),
            (std::vector<std::string>{"sim/joystick/has_joystick", "sim/joystick/joystick_button_values[160]",
                                      "sim/joystick/joystick_button_values[161]",
                                      "sim/joystick/joystick_axis_values[0]", "sim/joystick/joystick_axis_values[1]",
                                      "sim/joystick/joystick_axis_values[5]", "sim/joystick/joystick_axis_values[2]"}));
  EXPECT_EQ(stick.describe(), "roll 0, pitch 1, yaw 5, throttle 2 (reversed)");
  EXPECT_FALSE(settings(&stick, kAssigned, kLater)) << "nothing has changed";
}

TEST(SimulatorStick, HasTheSignsOfJoy) {
  SimulatorStick stick({6, 0, 2, 50});
  settings(&stick, kAssigned);
  ASSERT_TRUE(move(&stick, {{"joystick_axis_values[0]", 1.0F},   // right
                            {"joystick_axis_values[1]", 0.25F},  // half forward
                            {"joystick_axis_values[5]", 0.0F},   // left
                            {"joystick_axis_values[2]", 0.25F},  // of a reversed lever: three quarters
                            {"joystick_button_values[1]", 1.0F}}));
  EXPECT_EQ(stick.axes(),
            (std::vector<float>{-1.0F, 0.5F, 1.0F, 0.5F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F}));
  EXPECT_EQ(stick.buttons(), (std::vector<std::int32_t>{0, 1}));
}

TEST(SimulatorStick, TakesTheFirstThrottleWhereNoLeverMovesAll) {
  SimulatorStick stick({3, 0, 0, 50});
  settings(&stick, {{"joystick_axis_assignments[0]", 2.0F}, {"joystick_axis_assignments[2]", 20.0F}});
  EXPECT_EQ(stick.describe(), "roll 0, throttle 2");
}

TEST(SimulatorStick, FollowsWhoAssignsItsAxesAnew) {
  SimulatorStick stick({2, 0, 0, 50});
  settings(&stick, {{"joystick_axis_assignments[0]", 2.0F}});
  EXPECT_TRUE(settings(&stick, {{"joystick_axis_assignments[1]", 2.0F}}, kLater));
  ASSERT_TRUE(move(&stick, {{"joystick_axis_values[1]", 0.0F}}));
  EXPECT_EQ(stick.axes().front(), 1.0F);
}

TEST(SimulatorStick, LeavesALeverWhereItWasWhenItsAxisIsGone) {
  SimulatorStick stick({4, 0, 0, 50});
  Values assigned = {{"joystick_axis_assignments[0]", 2.0F},
                     {"joystick_axis_assignments[1]", 1.0F},
                     {"joystick_axis_assignments[2]", 4.0F}};
  settings(&stick, assigned);
  ASSERT_TRUE(move(&stick, {{"joystick_axis_values[1]", 1.0F}, {"joystick_axis_values[2]", 0.1F}}));
  EXPECT_EQ(stick.axes()[1], -1.0F);
  EXPECT_FLOAT_EQ(stick.axes()[3], -0.8F);
  assigned.erase("joystick_axis_assignments[1]");
  assigned.erase("joystick_axis_assignments[2]");
  EXPECT_TRUE(settings(&stick, assigned, kLater));
  ASSERT_TRUE(move(&stick, {{"joystick_axis_values[0]", 0.5F}}, kLater));
  EXPECT_EQ(stick.axes()[1], 0.0F) << "the stick is centred";
  EXPECT_FLOAT_EQ(stick.axes()[3], -0.8F) << "0 would be half throttle";
}

TEST(SimulatorStick, SaysWhyNothingIsPublished) {
  SimulatorStick stick({2, 0, 0, 50});
  EXPECT_EQ(stick.problem(), "X-Plane has not shown its joystick yet");
  EXPECT_FALSE(move(&stick, {}));
  EXPECT_EQ(stick.problem(), "X-Plane has not reported yet what its axes are assigned to");
  settings(&stick, {{"joystick_axis_assignments[0]", 4.0F}});
  EXPECT_FALSE(move(&stick, {}));
  EXPECT_EQ(stick.problem(),
            "none of X-Plane's first 2 axes rolls or pitches: assign them in X-Plane's joystick settings, or raise the "
            "parameter axes");
  settings(&stick, {{"joystick_axis_assignments[0]", 2.0F}}, kLater);
  EXPECT_FALSE(move(&stick, {{"has_joystick", 0.0F}}));
  EXPECT_EQ(stick.problem(), "X-Plane has no joystick: plug one in at its computer");
  EXPECT_TRUE(move(&stick, {}, kLater));
  EXPECT_EQ(stick.problem(), "");
}

}  // namespace
}  // namespace xplane_bridge::core
