#pragma once

/// Wind, loading and files that tx_node's services set: what is sent, and whether X-Plane shows it. Datarefs after
/// Laminar's lists of 11.40 and 12.08 (DataRefs.txt of XPlane2Blender).

#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/core/control/control_channels.hpp"
#include "xplane_bridge/core/wire/dataref_reader.hpp"

namespace xplane_bridge::core {

// --- wind ---

/// The same wind at every height.
struct UniformWind {
  double speed = 0.0;       ///< [m/s]
  double from_deg = 0.0;    ///< true, where it comes from
  double turbulence = 0.0;  ///< 0..1
};

/// X-Plane's turbulence goes from 0 to 10; "the unit is just a scale".
inline constexpr double kXPlaneFullTurbulence = 10.0;
/// [? wind-names] `sim/weather/region/wind_speed_msc` is m/s by its name and by Laminar's article on version 12's
/// weather, knots by the text of the list. This is what one metre a second is there.
inline constexpr double kRegionSpeedPerMps = 1.0;

std::optional<std::string> check(const UniformWind& wind);
/// Every layer of X-Plane's weather gets the same wind without shear; real weather and its changing end.
std::vector<DatarefWrite> windWrites(const UniformWind& wind, SimulatorVersion version);
/// Speed [m/s] and direction [deg, from, true] of the air at the aircraft.
std::vector<std::string> shownWindDatarefs(SimulatorVersion version);
/// The values of shownWindDatarefs() are this wind, gusts of its turbulence allowed.
bool matches(const UniformWind& wind, const std::vector<DatarefValue>& values);

// --- loading ---

/// Unset (empty, nullopt) stays as it is.
struct Loading {
  std::vector<double> fuel_tank;       ///< [kg] by tank
  std::optional<double> payload_mass;  ///< [kg]
  std::optional<double> cg_offset;     ///< [m] without fuel, aft +
};

std::optional<std::string> check(const Loading& loading);
/// Where X-Plane 12 shows how the payload is spread; none before.
std::vector<std::string> stationDatarefs(SimulatorVersion version);
/// What is sent. The balance comes last: X-Plane moves it with the masses.
/// @param stations values of stationDatarefs(): the payload is spread as it is now, or put on the first one where none
/// is loaded; without them, or where one is not known, it is written as a sum
std::vector<DatarefWrite> loadingWrites(const Loading& loading, const std::vector<DatarefValue>& stations = {});
/// What X-Plane must show once it took it: the payload as a sum, which the stations make in X-Plane 12.
inline std::vector<DatarefWrite> loadingShown(const Loading& loading) { return loadingWrites(loading); }
/// One of loadingShown() is shown [? stations]; engines burn fuel meanwhile.
bool matches(const DatarefWrite& loading, double shown);

// --- files ---

/// A path below X-Plane's folder for ACFN and SIMO: what is wrong with it; nullopt: nothing.
/// @param ending e.g. ".acf"
std::optional<std::string> checkXPlanePath(const std::string& path, const std::string& ending);
/// The first `characters` of the loaded aircraft's path, one dataref each; empty: that version does not show it.
std::vector<std::string> aircraftPathDatarefs(std::size_t characters, SimulatorVersion version);
/// The text of such datarefs, up to the first NUL or missing one.
std::string textFrom(const std::vector<DatarefValue>& characters);
/// The same file: X-Plane writes separators as its platform does, which may ignore capitals.
bool isSamePath(const std::string& a, const std::string& b);

}  // namespace xplane_bridge::core
