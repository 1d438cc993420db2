#include "xplane_bridge/core/simulator/autopilot_settings.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "setting_texts.hpp"
#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

constexpr double kHeadingTolerance = 0.6;    // [deg]; dials of many aircraft go in whole degrees
constexpr double kAltitudeTolerance = 1.0;   // [ft]
constexpr float kCapturedTolerance = 20.0F;  // [ft] between the altitude held and the dial
constexpr double kClimbTolerance = 1.0;      // [ft/min]
constexpr double kAirspeedTolerance = 0.6;   // [kt]; whole knots
constexpr double kMachTolerance = 0.006;     // hundredths
constexpr double kFullTurn = 360.0;          // [deg]

const std::string kAutopilotFolder = "sim/cockpit2/autopilot/";
const std::string kCommands = "sim/autopilot/";
constexpr const char* kYawDamper = "sim/cockpit2/switches/yaw_damper_on";

std::optional<std::string> outsideIfGiven(const std::string& name, const std::optional<double>& value, double low,
                                          double high, const char* unit) {
  return value ? outside(name, *value, low, high, unit) : std::nullopt;
}

std::optional<std::string> notAmong(const std::string& name, int value, int low, int high, const char* words) {
  if (value >= low && value <= high) return std::nullopt;
  return name + " is " + std::to_string(value) + ": expected " + words;
}

SettingWrite dial(const std::string& name, double value, double tolerance, double turns_over_at = 0.0) {
  return {{kAutopilotFolder + name, static_cast<float>(value)}, tolerance, true, turns_over_at};
}

/// @param master what flight_director_mode shows now
AutopilotStep masterStep(AutopilotMaster wanted, float master) {
  const auto level = static_cast<float>(wanted);
  const auto step = [level](const char* name, const char* command) {
    return AutopilotStep{name, kCommands + command, {kAutopilotMaster}, level, level};
  };
  if (wanted == AutopilotMaster::kOff) return step("off", "servos_fdir_off");
  if (wanted == AutopilotMaster::kServos) return step("servos", "servos_on");
  return step("flight director", master > level ? "servos_off_any" : "fdir_on");
}

AutopilotStep modeStep(const char* name, const char* command, std::vector<std::string> shown) {
  for (std::string& each : shown) each.insert(0, kAutopilotFolder);
  return {name, kCommands + command, std::move(shown)};
}

AutopilotStep lateralStep(LateralMode mode) {
  switch (mode) {
    case LateralMode::kHeading:
      return modeStep("heading select", "heading", {"heading_status"});
    case LateralMode::kNav:
      return modeStep("nav", "NAV", {"nav_status"});
    case LateralMode::kApproach:
      return modeStep("approach", "approach", {"approach_status"});
    case LateralMode::kWingLevel:
      break;
  }
  return modeStep("wing level", "wing_leveler", {"roll_status"});
}

AutopilotStep verticalStep(VerticalMode mode) {
  switch (mode) {
    case VerticalMode::kAltitude:
      return modeStep("altitude hold", "altitude_hold", {"altitude_hold_status"});
    case VerticalMode::kSpeed:
      return modeStep("speed by pitch", "level_change", {"speed_status"});
    case VerticalMode::kVerticalSpeed:
      break;
  }
  return modeStep("vertical speed", "vertical_speed", {"vvi_status"});
}

/// A switch that has a command for each of its states.
AutopilotStep switchStep(const char* name, const char* command_on, const char* command_off, bool on,
                         const std::string& shown) {
  const float low = on ? 1.0F : -1.0F, high = on ? 2.0F : 0.0F;  // -1: hard off
  return {std::string(name) + (on ? "" : " off"), on ? command_on : command_off, {shown}, low, high};
}

}  // namespace

const char* const kAutopilotMaster = "sim/cockpit2/autopilot/flight_director_mode";

std::optional<std::string> check(const AutopilotSetting& setting) {
  const AutopilotSetting& s = setting;
  const bool has_switch = s.master || s.lateral || s.vertical || s.altitude_armed || s.autothrottle || s.yaw_damper;
  if (!has_switch && !s.heading_magnetic_deg && !s.altitude && !s.vertical_speed && !s.airspeed && !s.mach) {
    return "nothing is given: expected `fields` with bits of what is to be set, MASTER, LATERAL, HEADING and so on";
  }
  if (s.airspeed && s.mach) return "AIRSPEED and MACH are given: expected one of them, they are one dial";
  if (s.master) {
    const int master = static_cast<int>(*s.master);
    if (auto wrong = notAmong("master", master, 0, 2, "OFF, FLIGHT_DIRECTOR or SERVOS")) return wrong;
  }
  if (s.lateral) {
    const int lateral = static_cast<int>(*s.lateral);
    if (auto wrong = notAmong("lateral", lateral, 1, 4, "WING_LEVEL, HEADING_SELECT, NAV or APPROACH")) return wrong;
  }
  if (s.vertical) {
    const int vertical = static_cast<int>(*s.vertical);
    const char* const words = "VERTICAL_SPEED_HOLD, ALTITUDE_HOLD or SPEED_BY_PITCH";
    if (auto wrong = notAmong("vertical", vertical, 1, 3, words)) return wrong;
  }
  if (auto wrong = outsideIfGiven("heading_magnetic_deg", s.heading_magnetic_deg, 0.0, kFullTurn, "deg")) return wrong;
  if (auto wrong = outsideIfGiven("altitude", s.altitude, -500.0, 30000.0, "m")) return wrong;
  if (auto wrong = outsideIfGiven("vertical_speed", s.vertical_speed, -60.0, 60.0, "m/s")) return wrong;
  if (auto wrong = outsideIfGiven("airspeed", s.airspeed, 10.0, 600.0, "m/s")) return wrong;
  return outsideIfGiven("mach", s.mach, 0.1, 5.0, "-");
}

std::vector<SettingWrite> autopilotDials(const AutopilotSetting& setting, SimulatorVersion version) {
  std::vector<SettingWrite> out;
  const bool wants_power = setting.master && *setting.master != AutopilotMaster::kOff;
  if (wants_power && version.is12())
    out.push_back({{kAutopilotFolder + "autopilot_electric_master", 1.0F}, 0.0, false, 0.0});
  if (setting.heading_magnetic_deg) {
    const double heading = *setting.heading_magnetic_deg;
    out.push_back(dial("heading_dial_deg_mag_pilot", heading, kHeadingTolerance, kFullTurn));
  }
  if (setting.altitude) out.push_back(dial("altitude_dial_ft", *setting.altitude / kMetersPerFoot, kAltitudeTolerance));
  if (setting.vertical_speed) {
    out.push_back(dial("vvi_dial_fpm", *setting.vertical_speed / kMetersPerSecondPerFootPerMinute, kClimbTolerance));
  }
  if (setting.airspeed || setting.mach) out.push_back(dial("airspeed_is_mach", setting.mach ? 1.0 : 0.0, 0.0));
  if (setting.airspeed) {
    out.push_back(dial("airspeed_dial_kts_mach", *setting.airspeed / kMetersPerSecondPerKnot, kAirspeedTolerance));
  }
  if (setting.mach) out.push_back(dial("airspeed_dial_kts_mach", *setting.mach, kMachTolerance));
  return out;
}

std::vector<AutopilotStep> autopilotSteps(const AutopilotSetting& setting, const DatarefValue& master) {
  std::vector<AutopilotStep> out;
  if (setting.master) out.push_back(masterStep(*setting.master, master.value_or(0.0F)));
  if (setting.lateral) out.push_back(lateralStep(*setting.lateral));
  if (setting.vertical) out.push_back(verticalStep(*setting.vertical));
  if (setting.altitude_armed) {
    // An autopilot that has captured the altitude is no longer armed.
    AutopilotStep arm =
        modeStep("altitude arm", "altitude_arm",
                 {"altitude_hold_armed", "altitude_hold_status", "altitude_hold_ft", "altitude_dial_ft"});
    arm.at_dial = true;
    if (!*setting.altitude_armed) {
      arm = modeStep("altitude arm off", "altitude_arm", {"altitude_hold_armed"});
      arm.low = arm.high = 0.0F;
    }
    out.push_back(arm);
  }
  if (setting.autothrottle) {
    out.push_back(switchStep("autothrottle", "sim/autopilot/autothrottle_on", "sim/autopilot/autothrottle_off",
                             *setting.autothrottle, kAutopilotFolder + "autothrottle_enabled"));
  }
  if (setting.yaw_damper) {
    out.push_back(switchStep("yaw damper", "sim/systems/yaw_damper_on", "sim/systems/yaw_damper_off",
                             *setting.yaw_damper, kYawDamper));
  }
  return out;
}

std::vector<SettingWrite> autopilotRestored(const AutopilotSetting& setting, SimulatorVersion version) {
  std::vector<SettingWrite> out = autopilotDials(setting, version);
  if (setting.master || setting.lateral || setting.vertical) out.push_back({{kAutopilotMaster, 0.0F}, 0.0, true, 0.0});
  if (setting.autothrottle) out.push_back({{kAutopilotFolder + "autothrottle_enabled", 0.0F}, 0.0, true, 0.0});
  if (setting.yaw_damper) out.push_back({{kYawDamper, 0.0F}, 0.0, true, 0.0});
  return out;
}

bool matches(const AutopilotStep& step, const std::vector<DatarefValue>& values) {
  const auto shows = [&step](const DatarefValue& value) { return value && *value >= step.low && *value <= step.high; };
  if (!step.at_dial) return std::any_of(values.begin(), values.end(), shows);
  if (values.size() != step.shown.size()) return false;
  const DatarefValue& held = values[2];
  const DatarefValue& dial = values[3];
  return shows(values[0]) || (shows(values[1]) && held && dial && std::abs(*held - *dial) <= kCapturedTolerance);
}

}  // namespace xplane_bridge::core
