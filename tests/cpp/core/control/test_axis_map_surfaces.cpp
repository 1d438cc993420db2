#include "xplane_bridge/core/control/axis_map.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace xplane_bridge::core {
namespace {

SurfaceInput aileron(int select_button, double rate = 0.0) {
  SurfaceInput in;
  in.key = "surfaces.aileron1_wing2_left";
  in.name = "aileron1_wing2_left";
  in.axis = {0, 0};
  in.select_button = select_button;
  in.rate = rate;
  in.dead_zone = 0.0;
  in.low = -25.0;
  in.high = 15.0;
  return in;
}

/// Two ailerons on one axis, chosen by buttons 0 and 1; the right one is moved at half of its travel a second.
JoystickOptions ailerons() {
  JoystickOptions o;
  o.device = "Test Pad";
  o.debounce = 0.0;
  SurfaceInput right = aileron(1, 0.5);
  right.key = "surfaces.aileron1_wing2_right";
  right.name = "aileron1_wing2_right";
  o.surfaces = {aileron(0), right};
  return o;
}

/// A device held so from `now` on, for `seconds` at 50 messages a second.
JoystickCommand hold(JoystickMapper* mapper, float axis, std::vector<std::int32_t> buttons, double* now,
                     double seconds = 0.02) {
  JoystickCommand out;
  for (int i = 0; i < static_cast<int>(std::lround(seconds / 0.02)); ++i) {
    mapper->onJoy({axis}, buttons, *now);
    *now += 0.02;
    out = mapper->update(*now);
  }
  return out;
}

std::string textOf(const JoystickCommand& command) {
  std::string text;
  for (const SurfaceSetting& each : command.surfaces) {
    text += each.name + " " + std::to_string(std::lround(each.deflection_deg * 10.0)) + " ";
  }
  return text;
}

TEST(JoySurfaces, NothingIsCommandedBeforeOneIsChosen) {
  JoystickMapper mapper(ailerons());
  double now = 0.0;
  EXPECT_TRUE(hold(&mapper, 1.0F, {0, 0}, &now).surfaces.empty());
  EXPECT_TRUE(mapper.selected().empty());
}

TEST(JoySurfaces, AnAxisSetsTheChosenOneBetweenItsEnds) {
  JoystickMapper mapper(ailerons());
  double now = 0.0;
  hold(&mapper, 0.0F, {0, 0}, &now);
  hold(&mapper, 0.0F, {1, 0}, &now);
  EXPECT_EQ(textOf(hold(&mapper, 0.0F, {0, 0}, &now)), "aileron1_wing2_left 0 ");
  EXPECT_EQ(textOf(hold(&mapper, 0.5F, {0, 0}, &now)), "aileron1_wing2_left 75 ") << "tenths of a degree";
  EXPECT_EQ(textOf(hold(&mapper, -1.0F, {0, 0}, &now)), "aileron1_wing2_left -250 ");
  EXPECT_EQ(mapper.selected(), std::vector<std::string>{"surfaces.aileron1_wing2_left"});
}

TEST(JoySurfaces, ScaleTurnsTheAxisRound) {
  JoystickOptions o = ailerons();
  o.surfaces[0].scale = -1.0;
  JoystickMapper mapper(o);
  double now = 0.0;
  hold(&mapper, 0.0F, {0, 0}, &now);
  hold(&mapper, 1.0F, {1, 0}, &now);
  EXPECT_EQ(textOf(hold(&mapper, 1.0F, {1, 0}, &now)), "aileron1_wing2_left -250 ");
}

TEST(JoySurfaces, OfASurfaceThatGoesOneWayTheWholeAxisIsTheTravel) {
  JoystickOptions o = ailerons();
  o.surfaces[0].low = 0.0;
  o.surfaces[0].high = 42.0;
  JoystickMapper mapper(o);
  double now = 0.0;
  hold(&mapper, 0.0F, {0, 0}, &now);
  hold(&mapper, 0.0F, {1, 0}, &now);
  EXPECT_EQ(textOf(hold(&mapper, 0.0F, {0, 0}, &now)), "aileron1_wing2_left 210 ");
}

TEST(JoySurfaces, ARateMovesIt) {
  JoystickMapper mapper(ailerons());
  double now = 0.0;
  hold(&mapper, 0.0F, {0, 0}, &now);
  hold(&mapper, 0.0F, {0, 1}, &now);
  const JoystickCommand up = hold(&mapper, 1.0F, {0, 0}, &now, 0.5);
  ASSERT_EQ(up.surfaces.size(), 1U);
  EXPECT_NEAR(up.surfaces[0].deflection_deg, 10.0, 0.5) << "a quarter of 40 deg";
  EXPECT_EQ(textOf(hold(&mapper, 1.0F, {0, 0}, &now, 2.0)), "aileron1_wing2_right 150 ") << "its end";
}

TEST(JoySurfaces, AnotherOneIsChosenAndTheFirstStaysWhereItWasSet) {
  JoystickMapper mapper(ailerons());
  double now = 0.0;
  hold(&mapper, 0.0F, {0, 0}, &now);
  hold(&mapper, 0.0F, {1, 0}, &now);
  hold(&mapper, 1.0F, {0, 0}, &now);
  hold(&mapper, 1.0F, {0, 1}, &now);
  EXPECT_EQ(textOf(hold(&mapper, -1.0F, {0, 0}, &now, 4.0)), "aileron1_wing2_left 150 aileron1_wing2_right -250 ");
}

TEST(JoySurfaces, ASecondPressGivesItBack) {
  JoystickMapper mapper(ailerons());
  double now = 0.0;
  hold(&mapper, 0.0F, {0, 0}, &now);
  hold(&mapper, 0.0F, {1, 0}, &now);
  EXPECT_FALSE(hold(&mapper, 0.0F, {0, 0}, &now).surfaces.empty());
  EXPECT_TRUE(hold(&mapper, 0.0F, {1, 0}, &now).surfaces.empty());
  EXPECT_TRUE(mapper.selected().empty());
}

TEST(JoySurfaces, OneWhoseAxisTheDeviceLacksIsNotCommanded) {
  JoystickOptions o = ailerons();
  o.surfaces[0].axis = {3, 3};
  o.surfaces[0].low = -60.0;
  JoystickMapper mapper(o);
  double now = 0.0;
  hold(&mapper, 0.0F, {0, 0}, &now);
  hold(&mapper, 0.0F, {0, 1}, &now);
  EXPECT_EQ(textOf(hold(&mapper, 0.0F, {1, 0}, &now)), "aileron1_wing2_right 0 ");
  ASSERT_EQ(mapper.problems().size(), 1U);
  EXPECT_NE(mapper.problems()[0].text.find("it is not commanded"), std::string::npos);
  EXPECT_EQ(mapper.selected(), std::vector<std::string>{"surfaces.aileron1_wing2_right"}) << "that stays chosen";
}

TEST(JoySurfaces, OneWhoseAxisIsMissingForAWhileIsLeftWhereItWasSet) {
  JoystickMapper mapper(ailerons());
  double now = 0.0;
  hold(&mapper, 0.0F, {0, 0}, &now);
  hold(&mapper, 0.0F, {1, 0}, &now);
  EXPECT_EQ(textOf(hold(&mapper, 1.0F, {0, 0}, &now)), "aileron1_wing2_left 150 ");
  EXPECT_TRUE(mapper.onJoy({}, {0, 0}, now));
  EXPECT_TRUE(mapper.update(now + 0.02).surfaces.empty());
  EXPECT_TRUE(mapper.onJoy({}, {1, 0}, now + 0.02));  // a second press gives it back
  EXPECT_TRUE(mapper.selected().empty());
}

TEST(JoySurfaces, ADeviceThatComesBackHasNoneChosen) {
  JoystickMapper mapper(ailerons());
  double now = 0.0;
  hold(&mapper, 0.0F, {0, 0}, &now);
  hold(&mapper, 0.0F, {1, 0}, &now);
  now += 5.0;
  EXPECT_TRUE(hold(&mapper, 0.0F, {1, 0}, &now).surfaces.empty());
}

TEST(JoySurfaces, ValidateNamesKeyAndValue) {
  JoystickOptions o = ailerons();
  EXPECT_FALSE(validate(o));
  o.surfaces[1].select_button = 0;
  EXPECT_EQ(*validate(o),
            "surfaces.aileron1_wing2_right.select_button is 0: expected another button than that of "
            "surfaces.aileron1_wing2_left.select_button");
  o = ailerons();
  o.surfaces[0].high = -30.0;
  EXPECT_EQ(*validate(o), "surfaces.aileron1_wing2_left.high is -30: expected -90..90 [deg], above low");
  o = ailerons();
  o.surfaces[0].axis = {};
  EXPECT_NE(validate(o)->find("expected either an axis or increase_button"), std::string::npos);
  o.surfaces[0].increase_button = 5;
  EXPECT_EQ(*validate(o), "surfaces.aileron1_wing2_left.rate is 0: expected a rate other than 0 [1/s], for buttons");
  o = ailerons();
  o.surfaces[0].select_button = -1;
  EXPECT_NE(validate(o)->find("the button that chooses it"), std::string::npos);
}

TEST(JoyActions, AreReportedOnceAPress) {
  JoystickOptions o;
  o.device = "Test Pad";
  o.debounce = 0.0;
  o.actions = {{"functions.pause", 2}, {"functions.rear", 1}, {"functions.both", 1}};
  JoystickMapper mapper(o);
  double now = 0.0;
  hold(&mapper, 0.0F, {0, 1, 0}, &now);
  EXPECT_TRUE(mapper.takeActions().empty()) << "held down when the device appeared";
  hold(&mapper, 0.0F, {0, 0, 1}, &now, 0.1);
  EXPECT_EQ(mapper.takeActions(), (std::vector<std::size_t>{0}));
  EXPECT_TRUE(mapper.takeActions().empty());
  hold(&mapper, 0.0F, {0, 1, 0}, &now);
  EXPECT_EQ(mapper.takeActions(), (std::vector<std::size_t>{1, 2}));
  hold(&mapper, 0.0F, {0, 0}, &now);
  ASSERT_EQ(mapper.problems().size(), 1U);
  EXPECT_NE(mapper.problems()[0].text.find("button 2 (functions.pause.button) does not exist"), std::string::npos);
}

}  // namespace
}  // namespace xplane_bridge::core
