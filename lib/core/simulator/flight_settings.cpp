#include "xplane_bridge/core/simulator/flight_settings.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "setting_texts.hpp"
#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/core/state/frames.hpp"
#include "xplane_bridge/core/state/mission_state.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {
namespace {

constexpr std::size_t kTanks = std::tuple_size_v<decltype(FuelState::fuel_tank)>;
constexpr double kMaxWind = 100.0;       // [m/s]
constexpr double kWindTolerance = 0.5;   // [m/s]
constexpr double kGust = 15.0;           // [m/s] that full turbulence may add for a moment
constexpr double kMaxMass = 1e6;         // [kg]
constexpr double kMaxCgOffset = 20.0;    // [m]
constexpr double kMassTolerance = 0.01;  // [kg]
constexpr double kMassShare = 0.005;     // of it
constexpr double kCgTolerance = 0.005;   // [m]
constexpr std::size_t kLayers = 3, kRegionLayers = 13;
constexpr int kStaticWeather = 3;

constexpr const char* kFuel = "sim/flightmodel/weight/m_fuel";
constexpr const char* kPayload = "sim/flightmodel/weight/m_fixed";
constexpr const char* kStations = "sim/flightmodel/weight/m_stations";
constexpr std::size_t kStationCount = 9;
// Without fuel in every version. 12.08's cg_offset_z, by which it is to be replaced, includes the fuel.
constexpr const char* kCg = "sim/flightmodel/misc/cgz_ref_to_default";

std::string element(const std::string& name, std::size_t i) { return name + "[" + std::to_string(i) + "]"; }

}  // namespace

std::optional<std::string> check(const UniformWind& wind) {
  if (auto wrong = outside("speed", wind.speed, 0.0, kMaxWind, "m/s")) return wrong;
  if (auto wrong = outside("from_deg", wind.from_deg, 0.0, 360.0, "deg true")) return wrong;
  if (wind.speed == 0.0 && wind.from_deg == 0.0 && wind.turbulence == 0.0) {
    return "nothing is given: expected speed, from_deg or turbulence; for calm air from_deg 360 and speed 0";
  }
  return outside("turbulence", wind.turbulence, 0.0, 1.0, "-");
}

std::vector<DatarefWrite> windWrites(const UniformWind& wind, SimulatorVersion version) {
  const bool regions = hasRegions(version);
  const std::string at = regions ? "sim/weather/region/" : "sim/weather/";
  const double speed = regions ? wind.speed * kRegionSpeedPerMps : wind.speed / kMetersPerSecondPerKnot;
  std::vector<DatarefWrite> out;
  if (regions) {
    out.push_back({at + "update_immediately", 1.0F});
    out.push_back({at + "change_mode", static_cast<float>(kStaticWeather)});
    out.push_back({at + "variability_pct", 0.0F});
  } else if (!version.is12()) {  // there it cannot be written
    out.push_back({at + "use_real_weather_bool", 0.0F});
  }
  // The brackets are part of the old names, and elements of the regions' arrays.
  for (std::size_t layer = 0; layer < (regions ? kRegionLayers : kLayers); ++layer) {
    out.push_back({element(at + "wind_direction_degt", layer), static_cast<float>(wind.from_deg)});
    out.push_back({element(at + (regions ? "shear_speed_msc" : "shear_speed_kt"), layer), 0.0F});
    out.push_back({element(at + "turbulence", layer), static_cast<float>(wind.turbulence * kXPlaneFullTurbulence)});
    out.push_back({element(at + (regions ? "wind_speed_msc" : "wind_speed_kt"), layer), static_cast<float>(speed)});
  }
  return out;
}

std::vector<std::string> shownWindDatarefs(SimulatorVersion version) {
  if (hasRegions(version)) {
    return {"sim/weather/aircraft/wind_now_speed_msc", "sim/weather/aircraft/wind_now_direction_degt"};
  }
  // In metres a second, in spite of its name.
  return {"sim/weather/wind_speed_kt", "sim/weather/wind_direction_degt"};
}

bool matches(const UniformWind& wind, const std::vector<DatarefValue>& values) {
  if (values.size() != 2 || !values[0] || !values[1]) return false;
  const auto vector = [](double speed, double from_deg) {
    return windNedFromDirection(from_deg * kRadiansPerDegree, speed);
  };
  const Eigen::Vector3d shown = vector(static_cast<double>(*values[0]), static_cast<double>(*values[1]));
  return (shown - vector(wind.speed, wind.from_deg)).norm() <= kWindTolerance + kGust * wind.turbulence;
}

std::optional<std::string> check(const Loading& loading) {
  if (loading.fuel_tank.empty() && !loading.payload_mass && !loading.cg_offset) {
    return "nothing is given: expected fuel_tank, payload_mass or cg_offset";
  }
  if (loading.fuel_tank.size() > kTanks) {
    return "fuel_tank has " + std::to_string(loading.fuel_tank.size()) + " values: expected at most " +
           std::to_string(kTanks) + ", one a tank";
  }
  for (std::size_t i = 0; i < loading.fuel_tank.size(); ++i) {
    if (auto wrong = outside(element("fuel_tank", i), loading.fuel_tank[i], 0.0, kMaxMass, "kg")) return wrong;
  }
  if (loading.payload_mass) {
    if (auto wrong = outside("payload_mass", *loading.payload_mass, 0.0, kMaxMass, "kg")) return wrong;
  }
  if (!loading.cg_offset) return std::nullopt;
  return outside("cg_offset", *loading.cg_offset, -kMaxCgOffset, kMaxCgOffset, "m, aft +");
}

std::vector<std::string> stationDatarefs(SimulatorVersion version) {
  std::vector<std::string> out;
  if (!version.is12()) return out;
  for (std::size_t i = 0; i < kStationCount; ++i) out.push_back(element(kStations, i));
  return out;
}

namespace {

/// The payload on its stations; empty: they are not known.
std::vector<DatarefWrite> stationWrites(double payload, const std::vector<DatarefValue>& stations) {
  double sum = 0.0;
  for (const DatarefValue& station : stations) {
    if (!station || !(*station >= 0.0F)) return {};
    sum += static_cast<double>(*station);
  }
  std::vector<DatarefWrite> out;
  for (std::size_t i = 0; i < stations.size(); ++i) {
    const double share = sum > kMassTolerance ? static_cast<double>(*stations[i]) / sum : (i == 0 ? 1.0 : 0.0);
    out.push_back({element(kStations, i), static_cast<float>(payload * share)});
  }
  return out;
}

}  // namespace

std::vector<DatarefWrite> loadingWrites(const Loading& loading, const std::vector<DatarefValue>& stations) {
  std::vector<DatarefWrite> out;
  for (std::size_t i = 0; i < loading.fuel_tank.size(); ++i) {
    out.push_back({element(kFuel, i), static_cast<float>(loading.fuel_tank[i])});
  }
  if (loading.payload_mass) {
    const std::vector<DatarefWrite> spread = stationWrites(*loading.payload_mass, stations);
    out.insert(out.end(), spread.begin(), spread.end());
    if (spread.empty()) out.push_back({kPayload, static_cast<float>(*loading.payload_mass)});
  }
  if (loading.cg_offset) out.push_back({kCg, static_cast<float>(*loading.cg_offset)});
  return out;
}

bool matches(const DatarefWrite& loading, double shown) {
  const auto wanted = static_cast<double>(loading.value);
  const double tolerance = loading.dataref == kCg ? kCgTolerance : kMassTolerance + kMassShare * wanted;
  return std::abs(shown - wanted) <= tolerance;
}

std::optional<std::string> checkXPlanePath(const std::string& path, const std::string& ending) {
  const auto refuse = [&](const std::string& why) {
    return std::optional<std::string>("path \"" + path + "\" " + why +
                                      ": expected a file relative to X-Plane's folder, " + "at most " +
                                      std::to_string(kFilePathSize - 1) + " characters, ending in " + ending);
  };
  if (path.empty()) return refuse("is empty");
  if (path.size() >= kFilePathSize) return refuse("has " + std::to_string(path.size()) + " characters");
  if (path.find('\0') != std::string::npos) return refuse("has a NUL in it");
  if (path.front() == '/' || path.front() == '\\' || path.find(':') != std::string::npos) return refuse("is absolute");
  const bool ends = path.size() > ending.size() &&
                    std::equal(ending.rbegin(), ending.rend(), path.rbegin(),
                               [](char a, char b) { return a == std::tolower(static_cast<unsigned char>(b)); });
  return ends ? std::nullopt : refuse("does not end in " + ending);
}

std::vector<std::string> aircraftPathDatarefs(std::size_t characters, SimulatorVersion version) {
  std::vector<std::string> out;
  if (!version.is12()) return out;
  for (std::size_t i = 0; i < characters; ++i) out.push_back(element("sim/aircraft/view/acf_relative_path", i));
  return out;
}

std::string textFrom(const std::vector<DatarefValue>& characters) {
  std::string out;
  for (const DatarefValue& value : characters) {
    if (!value || !(*value >= 1.0F && *value <= 255.0F)) break;
    out.push_back(static_cast<char>(static_cast<unsigned char>(*value)));
  }
  return out;
}

bool isSamePath(const std::string& a, const std::string& b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](char x, char y) {
           const auto plain = [](char c) {
             return c == '\\' ? '/' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
           };
           return plain(x) == plain(y);
         });
}

}  // namespace xplane_bridge::core
