#pragma once

/// X-Plane's own autopilot that tx_node's service sets: its dials, and the commands that engage its modes with the
/// datarefs that show them. Names after Laminar's lists of 11.40 to 12.10, which have all of them.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/core/base/simulator_version.hpp"
#include "xplane_bridge/core/simulator/world_settings.hpp"
#include "xplane_bridge/core/wire/dataref_reader.hpp"

namespace xplane_bridge::core {

/// What `flight_director_mode` shows.
enum class AutopilotMaster : std::uint8_t { kOff = 0, kFlightDirector = 1, kServos = 2 };
enum class LateralMode : std::uint8_t { kWingLevel = 1, kHeading = 2, kNav = 3, kApproach = 4 };
enum class VerticalMode : std::uint8_t { kVerticalSpeed = 1, kAltitude = 2, kSpeed = 3 };

/// nullopt stays as it is.
struct AutopilotSetting {
  std::optional<AutopilotMaster> master;
  std::optional<LateralMode> lateral;
  std::optional<VerticalMode> vertical;
  std::optional<bool> altitude_armed;
  std::optional<bool> autothrottle;
  std::optional<bool> yaw_damper;
  std::optional<double> heading_magnetic_deg;  ///< dial
  std::optional<double> altitude;              ///< [m] dial
  std::optional<double> vertical_speed;        ///< [m/s] dial, up +
  std::optional<double> airspeed;              ///< [m/s] dial, indicated
  std::optional<double> mach;                  ///< the same dial
  bool restore_on_exit = false;                ///< dials and what flies; X-Plane's modes can only be toggled
};

/// One switch: pressed only while X-Plane does not show it, because a second press of most ends what the first began.
struct AutopilotStep {
  std::string name;                ///< in words
  std::string command;             ///< that presses it
  std::vector<std::string> shown;  ///< datarefs of which one shows it
  float low = 1.0F, high = 1e6F;   ///< from where to where, inclusive
  /// `shown` is: armed, status, the altitude held [ft], the dial [ft]. The status shows it only where the altitude held
  /// is that of the dial: the hold of any other altitude has the same status.
  bool at_dial = false;
};

std::optional<std::string> check(const AutopilotSetting& setting);
/// Dials, and in version 12 the autopilot's power before them.
std::vector<SettingWrite> autopilotDials(const AutopilotSetting& setting, SimulatorVersion version);
/// Shows what the flight director does: AutopilotMaster.
extern const char* const kAutopilotMaster;
/// In the order in which they must be pressed.
/// @param master what kAutopilotMaster shows now
std::vector<AutopilotStep> autopilotSteps(const AutopilotSetting& setting, const DatarefValue& master);
/// What must be remembered to put it back by writing.
std::vector<SettingWrite> autopilotRestored(const AutopilotSetting& setting, SimulatorVersion version);
/// @param values of step.shown
bool matches(const AutopilotStep& step, const std::vector<DatarefValue>& values);

}  // namespace xplane_bridge::core
