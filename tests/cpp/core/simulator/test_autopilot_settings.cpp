#include "xplane_bridge/core/simulator/autopilot_settings.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

namespace xplane_bridge::core {
namespace {

const std::string kFolder = "sim/cockpit2/autopilot/";

AutopilotSetting allDials() {
  AutopilotSetting out;
  out.heading_magnetic_deg = 270.0;
  out.altitude = 1524.0;       // 5000 ft
  out.vertical_speed = -2.54;  // 500 ft/min down
  out.airspeed = 72.0222;      // 140 kt
  return out;
}

TEST(Autopilot, DialsAreInXPlanesUnits) {
  std::map<std::string, float> writes;
  for (const SettingWrite& each : autopilotDials(allDials(), kXPlane11)) {
    EXPECT_TRUE(each.is_shown);
    writes[each.write.dataref] = std::round(each.write.value * 100.0F) / 100.0F;
  }
  EXPECT_EQ(writes, (std::map<std::string, float>{{kFolder + "heading_dial_deg_mag_pilot", 270.0F},
                                                  {kFolder + "altitude_dial_ft", 5000.0F},
                                                  {kFolder + "vvi_dial_fpm", -500.0F},
                                                  {kFolder + "airspeed_is_mach", 0.0F},
                                                  {kFolder + "airspeed_dial_kts_mach", 140.0F}}));
}

TEST(Autopilot, OneDialIsMachOrKnots) {
  AutopilotSetting fast;
  fast.mach = 0.78;
  const auto dials = autopilotDials(fast, kXPlane12);
  ASSERT_EQ(dials.size(), 2U);
  EXPECT_EQ(dials[0].write.value, 1.0F);
  EXPECT_EQ(dials[1].write.dataref, kFolder + "airspeed_dial_kts_mach");
  EXPECT_FLOAT_EQ(dials[1].write.value, 0.78F);
  fast.airspeed = 150.0;
  EXPECT_EQ(*check(fast), "AIRSPEED and MACH are given: expected one of them, they are one dial");
}

TEST(Autopilot, HeadingIsTheSameAcrossNorth) {
  AutopilotSetting north;
  north.heading_magnetic_deg = 360.0;
  EXPECT_EQ(differenceOf(autopilotDials(north, kXPlane11), {0.0F}), "");
  EXPECT_NE(differenceOf(autopilotDials(north, kXPlane11), {2.0F}), "");
}

TEST(Autopilot, InVersion12ItGetsPower) {
  AutopilotSetting on;
  on.master = AutopilotMaster::kServos;
  EXPECT_TRUE(autopilotDials(on, kXPlane11).empty());
  const auto writes = autopilotDials(on, kXPlane12);
  ASSERT_EQ(writes.size(), 1U);
  EXPECT_EQ(writes[0].write.dataref, kFolder + "autopilot_electric_master");
  EXPECT_FALSE(writes[0].is_shown) << "an aircraft without such a switch flies all the same";
}

TEST(Autopilot, SwitchesComeInTheirOrderEachWithWhatShowsIt) {
  AutopilotSetting all;
  all.master = AutopilotMaster::kServos;
  all.lateral = LateralMode::kHeading;
  all.vertical = VerticalMode::kVerticalSpeed;
  all.altitude_armed = true;
  all.autothrottle = true;
  all.yaw_damper = false;
  const auto steps = autopilotSteps(all, 0.0F);
  std::vector<std::string> commands, shown;
  for (const AutopilotStep& step : steps) {
    commands.push_back(step.command);
    shown.push_back(step.shown.front());
  }
  EXPECT_EQ(commands, (std::vector<std::string>{"sim/autopilot/servos_on", "sim/autopilot/heading",
                                                "sim/autopilot/vertical_speed", "sim/autopilot/altitude_arm",
                                                "sim/autopilot/autothrottle_on", "sim/systems/yaw_damper_off"}));
  EXPECT_EQ(shown, (std::vector<std::string>{kAutopilotMaster, kFolder + "heading_status", kFolder + "vvi_status",
                                             kFolder + "altitude_hold_armed", kFolder + "autothrottle_enabled",
                                             "sim/cockpit2/switches/yaw_damper_on"}));
  EXPECT_TRUE(matches(steps[1], {1.0F})) << "armed";
  EXPECT_TRUE(matches(steps[1], {2.0F})) << "captured";
  EXPECT_FALSE(matches(steps[1], {0.0F}));
  EXPECT_FALSE(matches(steps[1], {std::nullopt}));
  EXPECT_TRUE(matches(steps[3], {1.0F, 0.0F, 1000.0F, 5000.0F})) << "armed";
  EXPECT_TRUE(matches(steps[3], {0.0F, 2.0F, 4990.0F, 5000.0F})) << "the altitude is captured already";
  EXPECT_FALSE(matches(steps[3], {0.0F, 2.0F, 1000.0F, 5000.0F})) << "another altitude is held";
  EXPECT_FALSE(matches(steps[3], {0.0F, 2.0F, std::nullopt, 5000.0F}));
  EXPECT_FALSE(matches(steps[3], {0.0F, 0.0F, 5000.0F, 5000.0F}));
  EXPECT_TRUE(matches(steps[5], {0.0F}));
  EXPECT_FALSE(matches(steps[5], {1.0F}));
}

TEST(Autopilot, FlightDirectorIsReachedFromBothSides) {
  AutopilotSetting director;
  director.master = AutopilotMaster::kFlightDirector;
  EXPECT_EQ(autopilotSteps(director, 0.0F)[0].command, "sim/autopilot/fdir_on");
  const AutopilotStep down = autopilotSteps(director, 2.0F)[0];
  EXPECT_EQ(down.command, "sim/autopilot/servos_off_any");
  EXPECT_FALSE(matches(down, {2.0F}));
  EXPECT_TRUE(matches(down, {1.0F}));
}

TEST(Autopilot, EveryModeHasACommandOfItsOwn) {
  AutopilotSetting setting;
  std::vector<std::string> commands;
  for (int mode = 1; mode <= 4; ++mode) {
    setting.lateral = static_cast<LateralMode>(mode);
    commands.push_back(autopilotSteps(setting, 1.0F)[0].command);
  }
  setting.lateral.reset();
  for (int mode = 1; mode <= 3; ++mode) {
    setting.vertical = static_cast<VerticalMode>(mode);
    commands.push_back(autopilotSteps(setting, 1.0F)[0].command);
  }
  EXPECT_EQ(commands,
            (std::vector<std::string>{"sim/autopilot/wing_leveler", "sim/autopilot/heading", "sim/autopilot/NAV",
                                      "sim/autopilot/approach", "sim/autopilot/vertical_speed",
                                      "sim/autopilot/altitude_hold", "sim/autopilot/level_change"}));
}

TEST(Autopilot, WhatIsPutBackIsWhatCanBeWritten) {
  AutopilotSetting setting;
  setting.lateral = LateralMode::kHeading;
  setting.heading_magnetic_deg = 10.0;
  setting.autothrottle = true;
  setting.yaw_damper = true;
  std::vector<std::string> names;
  for (const SettingWrite& each : autopilotRestored(setting, kXPlane11)) names.push_back(each.write.dataref);
  EXPECT_EQ(names, (std::vector<std::string>{kFolder + "heading_dial_deg_mag_pilot", kAutopilotMaster,
                                             kFolder + "autothrottle_enabled", "sim/cockpit2/switches/yaw_damper_on"}));
}

TEST(Autopilot, RefusesWhatCannotBe) {
  EXPECT_FALSE(check(allDials()));
  EXPECT_NE(check(AutopilotSetting{})->find("nothing is given"), std::string::npos);
  AutopilotSetting wrong;
  wrong.lateral = static_cast<LateralMode>(9);
  EXPECT_EQ(*check(wrong), "lateral is 9: expected WING_LEVEL, HEADING_SELECT, NAV or APPROACH");
  wrong = {};
  wrong.vertical = static_cast<VerticalMode>(0);
  EXPECT_EQ(*check(wrong), "vertical is 0: expected VERTICAL_SPEED_HOLD, ALTITUDE_HOLD or SPEED_BY_PITCH");
  wrong = {};
  wrong.master = static_cast<AutopilotMaster>(3);
  EXPECT_EQ(*check(wrong), "master is 3: expected OFF, FLIGHT_DIRECTOR or SERVOS");
  wrong = allDials();
  wrong.altitude = std::nan("");
  EXPECT_EQ(*check(wrong), "altitude is nan: expected -500..30000 [m]");
  wrong = allDials();
  wrong.airspeed = 0.78;
  EXPECT_EQ(*check(wrong), "airspeed is 0.78: expected 10..600 [m/s]");
}

}  // namespace
}  // namespace xplane_bridge::core
