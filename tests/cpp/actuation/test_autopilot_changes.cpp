// set_autopilot: dials are written, modes are pressed until X-Plane shows them, and what was there comes back.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "fake_simulator.hpp"
#include "xplane_bridge/actuation/flight_changes.hpp"

namespace xplane_bridge {
namespace {

using core::AutopilotMaster;
using core::AutopilotSetting;
using core::LateralMode;
using Names = std::vector<std::string>;

const std::string kFolder = "sim/cockpit2/autopilot/";
const std::string kDirector = kFolder + "flight_director_mode", kHeading = kFolder + "heading_status";
const std::string kDial = kFolder + "heading_dial_deg_mag_pilot";

/// An autopilot that takes servos, heading (a toggle, which turns its dial to 90) and nothing else.
class AutopilotChangesTest : public testing::Test {
 protected:
  AutopilotChangesTest() {
    sim_.setAll({kDirector, kHeading, kFolder + "vvi_status"}, 0.0F);
    sim_.set(kDial, 10.0F);
    sim_.setReadOnly(kHeading);
    sim_.on_message = [this](const core::FakeSimulator::Message& message) {
      if (message.label != "CMND") return;
      if (message.path == "sim/autopilot/servos_on") sim_.set(kDirector, 2.0F);
      if (message.path != "sim/autopilot/heading") return;
      sim_.set(kHeading, sim_.value(kHeading) > 0.0F ? 0.0F : 2.0F);
      sim_.set(kDial, 90.0F);
    };
    sim_.run(0.1);
  }

  FlightChangeHooks hooks() {
    FlightChangeHooks out;
    out.overrides = [this] { return overrides_; };
    return out;
  }
  static AutopilotSetting heading(double dial) {
    AutopilotSetting out;
    out.master = AutopilotMaster::kServos;
    out.lateral = LateralMode::kHeading;
    out.heading_magnetic_deg = dial;
    return out;
  }

  core::FakeSimulator sim_;
  Names overrides_;
  FlightChanges changes_{&sim_, {2.0, 20.0}, hooks()};
};

TEST_F(AutopilotChangesTest, ModesAreEngagedAndTheDialIsAsAskedFor) {
  const FlightChangeOutcome outcome = changes_.applyAutopilot(heading(270.0));
  EXPECT_TRUE(outcome.success) << outcome.text;
  EXPECT_EQ(outcome.text, "the autopilot is set as asked for");
  EXPECT_EQ(sim_.value(kDirector), 2.0F);
  EXPECT_EQ(sim_.value(kHeading), 2.0F);
  EXPECT_EQ(sim_.value(kDial), 270.0F) << "though engaging turned it";
}

TEST_F(AutopilotChangesTest, WhatIsEngagedIsNotPressedAgain) {
  ASSERT_TRUE(changes_.applyAutopilot(heading(270.0)).success);
  const std::size_t before = sim_.commands().size();
  EXPECT_TRUE(changes_.applyAutopilot(heading(180.0)).success);
  EXPECT_EQ(sim_.commands().size(), before);
  EXPECT_EQ(sim_.value(kHeading), 2.0F);
  EXPECT_EQ(sim_.value(kDial), 180.0F);
}

TEST_F(AutopilotChangesTest, LostPressIsRepeated) {
  AutopilotSetting setting;
  setting.lateral = LateralMode::kHeading;
  sim_.loseMessages(1);
  EXPECT_TRUE(changes_.applyAutopilot(setting).success);
  EXPECT_EQ(sim_.value(kHeading), 2.0F);
}

TEST_F(AutopilotChangesTest, AircraftWithoutTheModeIsReported) {
  AutopilotSetting setting;
  setting.vertical = core::VerticalMode::kVerticalSpeed;
  const FlightChangeOutcome outcome = changes_.applyAutopilot(setting);
  EXPECT_FALSE(outcome.success);
  EXPECT_EQ(outcome.text,
            "set_autopilot: X-Plane does not engage \"vertical speed\" by sim/autopilot/vertical_speed: " + kFolder +
                "vvi_status is 0; has this aircraft an autopilot with it, and has that its power?");
  EXPECT_EQ(sim_.commands(), Names(3, "sim/autopilot/vertical_speed"));
}

TEST_F(AutopilotChangesTest, XPlaneThatDoesNotShowTheModeIsReported) {
  AutopilotSetting setting;
  setting.lateral = LateralMode::kNav;
  const FlightChangeOutcome outcome = changes_.applyAutopilot(setting);
  EXPECT_FALSE(outcome.success);
  EXPECT_NE(outcome.text.find(kFolder + "nav_status does not answer"), std::string::npos) << outcome.text;
}

TEST_F(AutopilotChangesTest, NothingIsPressedOfWhichNothingIsShown) {
  ASSERT_TRUE(changes_.applyAutopilot(heading(270.0)).success);
  const std::size_t before = sim_.commands().size();
  AutopilotSetting setting;
  setting.lateral = LateralMode::kHeading;
  sim_.setState(core::LinkState::kStale);
  const FlightChangeOutcome outcome = changes_.applyAutopilot(setting);
  EXPECT_FALSE(outcome.success);
  EXPECT_EQ(outcome.text.find("set_autopilot: X-Plane does not show whether \"heading select\" is engaged: " +
                              kHeading + " does not answer"),
            0U)
      << outcome.text;
  EXPECT_EQ(sim_.commands().size(), before) << "it is engaged, and a press would end that";
}

TEST_F(AutopilotChangesTest, XPlaneThatIsSilentAfterAPressIsNotPressedAgain) {
  const auto obey = sim_.on_message;
  sim_.on_message = [this, obey](const core::FakeSimulator::Message& message) {
    obey(message);
    if (message.path == "sim/autopilot/heading") sim_.setState(core::LinkState::kStale);
  };
  AutopilotSetting setting;
  setting.lateral = LateralMode::kHeading;
  EXPECT_FALSE(changes_.applyAutopilot(setting).success);
  EXPECT_EQ(sim_.commands(), Names{"sim/autopilot/heading"});
  EXPECT_EQ(sim_.value(kHeading), 2.0F);
}

TEST_F(AutopilotChangesTest, AltitudeIsArmedThoughAnotherOneIsHeld) {
  const std::string armed = kFolder + "altitude_hold_armed";
  sim_.set(armed, 0.0F);
  sim_.set(kFolder + "altitude_hold_status", 2.0F);
  sim_.set(kFolder + "altitude_hold_ft", 1000.0F);
  sim_.set(kFolder + "altitude_dial_ft", 1000.0F);
  sim_.on_message = [this, armed](const core::FakeSimulator::Message& message) {
    if (message.path == "sim/autopilot/altitude_arm") sim_.set(armed, 1.0F - sim_.value(armed));
  };
  AutopilotSetting setting;
  setting.altitude_armed = true;
  EXPECT_TRUE(changes_.applyAutopilot(setting).success);
  EXPECT_EQ(sim_.value(armed), 0.0F) << "the altitude of the dial is held already";
  setting.altitude = 1524.0;  // 5000 ft
  EXPECT_TRUE(changes_.applyAutopilot(setting).success);
  EXPECT_EQ(sim_.value(armed), 1.0F);
}

TEST_F(AutopilotChangesTest, DialThatDoesNotTurnEndsItBeforeAnythingIsEngaged) {
  sim_.setReadOnly(kDial);
  const FlightChangeOutcome outcome = changes_.applyAutopilot(heading(270.0));
  EXPECT_FALSE(outcome.success);
  EXPECT_EQ(outcome.text, "set_autopilot: " + kDial + " is 10, not 270");
  EXPECT_TRUE(sim_.commands().empty());
}

TEST_F(AutopilotChangesTest, WhoHoldsTheStickIsNamed) {
  overrides_ = {"sim/operation/override/override_joystick_roll", "sim/operation/override/override_throttles"};
  const FlightChangeOutcome outcome = changes_.applyAutopilot(heading(270.0));
  EXPECT_TRUE(outcome.success);
  EXPECT_EQ(
      outcome.text,
      "the autopilot is set as asked for; but tx_node holds override_joystick_roll, and there the autopilot moves "
      "nothing");
}

TEST_F(AutopilotChangesTest, DialsAndWhatFliesComeBack) {
  AutopilotSetting setting = heading(270.0);
  setting.restore_on_exit = true;
  ASSERT_TRUE(changes_.applyAutopilot(setting).success);
  ASSERT_EQ(sim_.journal()->entries().size(), 1U);
  changes_.restoreSettings();
  sim_.run(0.1);
  EXPECT_EQ(sim_.value(kDial), 10.0F);
  EXPECT_EQ(sim_.value(kDirector), 0.0F);
  EXPECT_TRUE(sim_.journal()->entries().empty());
}

TEST_F(AutopilotChangesTest, WhatCouldNotBePutBackIsNotChanged) {
  AutopilotSetting setting;
  setting.altitude = 1000.0;
  setting.restore_on_exit = true;
  const FlightChangeOutcome outcome = changes_.applyAutopilot(setting);
  EXPECT_FALSE(outcome.success);
  EXPECT_EQ(outcome.text, "set_autopilot: X-Plane does not report " + kFolder +
                              "altitude_dial_ft, which could not be put back on exit");
  EXPECT_TRUE(sim_.writes().empty());
}

}  // namespace
}  // namespace xplane_bridge
