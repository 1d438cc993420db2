#pragma once

/// Time of day and weather that tx_node's services set: what is sent, and whether X-Plane shows it. Datarefs after
/// Laminar's lists of 11.40 to 12.10.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/core/control/control_channels.hpp"
#include "xplane_bridge/core/wire/dataref_reader.hpp"

namespace xplane_bridge::core {

/// What X-Plane is sent, and by when it has taken it: the same dataref shows the value.
struct SettingWrite {
  DatarefWrite write;
  double tolerance = 0.0;
  bool is_shown = true;      ///< false: sent only
  double turns_over_at = 0;  ///< from where it begins at 0 again, as the time of day; 0: nowhere
};

/// Which settings X-Plane does not show, in words; empty: it shows them all.
/// @param shown of shownDatarefs(settings)
std::string differenceOf(const std::vector<SettingWrite>& settings, const std::vector<DatarefValue>& shown);
std::vector<std::string> shownDatarefs(const std::vector<SettingWrite>& settings);

// --- time ---

/// nullopt stays as it is.
struct TimeSetting {
  std::optional<double> zulu_time;         ///< [s] since midnight UTC
  std::optional<std::int32_t> date_days;   ///< [d] since 1 January, which is 0; of the local date
  std::optional<std::int32_t> time_ratio;  ///< simulator time over real time, a whole number
  bool restore_on_exit = false;            ///< what X-Plane had before comes back when the node ends
};

std::optional<std::string> check(const TimeSetting& time);
/// The computer's clock no longer sets the simulator's.
std::vector<SettingWrite> timeWrites(const TimeSetting& time);

// --- weather ---

struct WindLayer {
  double altitude = 0.0;    ///< [m] above mean sea level
  double from_deg = 0.0;    ///< true, where it comes from
  double speed = 0.0;       ///< [m/s]
  double shear = 0.0;       ///< [m/s] gain above the speed in gusts
  double turbulence = 0.0;  ///< 0..1
};

struct CloudLayer {
  double base = 0.0;   ///< [m] above mean sea level
  double top = 0.0;    ///< [m] above mean sea level
  double cover = 0.0;  ///< 0..1 of the sky
  int type = 0;        ///< X-Plane's number, which differs between 11 and 12
};

/// nullopt stays as it is.
struct Weather {
  std::optional<std::vector<WindLayer>> wind;     ///< from the lowest up; the highest blows on above
  std::optional<std::vector<CloudLayer>> clouds;  ///< none: a clear sky
  std::optional<double> visibility;               ///< [m]
  std::optional<double> precipitation;            ///< 0..1
  std::optional<double> sea_level_temperature;    ///< [deg C]
  std::optional<double> sea_level_pressure;       ///< [Pa]
  bool restore_on_exit = false;                   ///< what X-Plane had before comes back when the node ends
};

std::optional<std::string> check(const Weather& weather);
/// What this version of X-Plane cannot do of it, in words; nullopt: nothing.
std::optional<std::string> refusalBy(SimulatorVersion version, const Weather& weather);
/// Real weather and its changing end. Only for what refusalBy() does not refuse.
std::vector<SettingWrite> weatherWrites(const Weather& weather, SimulatorVersion version);
/// Whether this one of its datarefs has the others act at once: it goes back last, for them to.
bool hasOthersAct(const std::string& dataref);
/// What has X-Plane draw the clouds that these settings ask for; without it they come up to a minute later, from 12.08
/// on, where update_immediately is for all but them. nullopt: nothing has to.
std::optional<std::string> cloudCommand(const Weather& weather, SimulatorVersion version);

}  // namespace xplane_bridge::core
