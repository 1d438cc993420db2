#include "xplane_bridge/core/simulator/world_settings.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "setting_texts.hpp"
#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/core/simulator/flight_settings.hpp"

namespace xplane_bridge::core {
namespace {

constexpr double kDay = 86400.0;         // [s]
constexpr double kTimeTolerance = 30.0;  // [s] that pass while it is read back, at a high ratio
constexpr std::int32_t kLastDay = 365, kMaxTimeRatio = 16;
constexpr std::size_t kLayers = 3, kRegionLayers = 13;
constexpr double kAboveHighest = 1000.0;  // [m] between layers that only repeat the highest one
constexpr double kMetersPerMile = 1609.344;
constexpr double kOktasOf11 = 6.0;  // cloud_coverage there goes from 0 to 6
constexpr int kLastType11 = 5, kLastType12 = 3;
constexpr const char *kRegion = "sim/weather/region/", *kUpdateImmediately = "update_immediately";
constexpr double kShare = 1e-4;  // of a value, by which float32 may show it otherwise

/// Collects settings under the weather's folder of a version.
class Sheet {
 public:
  explicit Sheet(bool regions) : folder_(regions ? kRegion : "sim/weather/") {}

  void send(const std::string& name, double value) { add(name, value, false); }
  void set(const std::string& name, double value) { add(name, value, true); }
  /// The brackets are part of the old names, and elements of the regions' arrays.
  void set(const std::string& name, std::size_t layer, double value) {
    set(name + "[" + std::to_string(layer) + "]", value);
  }
  std::vector<SettingWrite> take() { return std::move(settings_); }

 private:
  void add(const std::string& name, double value, bool is_shown) {
    const double tolerance = kShare * std::max(1.0, std::abs(value));
    settings_.push_back({{folder_ + name, static_cast<float>(value)}, tolerance, is_shown, 0.0});
  }

  std::string folder_;
  std::vector<SettingWrite> settings_;
};

std::optional<std::string> wrongWith(const WindLayer& layer, const std::string& name) {
  if (auto wrong = outside(name + "altitude", layer.altitude, -500.0, 30000.0, "m")) return wrong;
  if (auto wrong = outside(name + "from_deg", layer.from_deg, 0.0, 360.0, "deg true")) return wrong;
  if (auto wrong = outside(name + "speed", layer.speed, 0.0, 100.0, "m/s")) return wrong;
  if (auto wrong = outside(name + "shear", layer.shear, 0.0, 100.0, "m/s")) return wrong;
  return outside(name + "turbulence", layer.turbulence, 0.0, 1.0, "-");
}

std::optional<std::string> wrongWith(const CloudLayer& layer, const std::string& name) {
  if (auto wrong = outside(name + "base", layer.base, -500.0, 30000.0, "m")) return wrong;
  if (auto wrong = outside(name + "top", layer.top, layer.base, 30000.0, "m, not below its base")) return wrong;
  if (auto wrong = outside(name + "cover", layer.cover, 0.0, 1.0, "-")) return wrong;
  return outside(name + "type", layer.type, 0.0, kLastType11, "X-Plane's number");
}

void addWind(const std::vector<WindLayer>& given, bool regions, Sheet* sheet) {
  for (std::size_t i = 0; i < (regions ? kRegionLayers : kLayers); ++i) {
    WindLayer layer = given[std::min(i, given.size() - 1)];
    if (i >= given.size()) layer.altitude += kAboveHighest * static_cast<double>(i + 1 - given.size());
    const double speed = regions ? kRegionSpeedPerMps : 1.0 / kMetersPerSecondPerKnot;
    sheet->set("wind_altitude_msl_m", i, layer.altitude);
    sheet->set("wind_direction_degt", i, layer.from_deg);
    sheet->set(regions ? "shear_speed_msc" : "shear_speed_kt", i, layer.shear * speed);
    sheet->set("turbulence", i, layer.turbulence * kXPlaneFullTurbulence);
    sheet->set(regions ? "wind_speed_msc" : "wind_speed_kt", i, layer.speed * speed);
  }
}

void addClouds(const std::vector<CloudLayer>& given, bool regions, Sheet* sheet) {
  for (std::size_t i = 0; i < kLayers; ++i) {
    const CloudLayer layer = i < given.size() ? given[i] : CloudLayer{};
    sheet->set("cloud_base_msl_m", i, layer.base);
    sheet->set("cloud_tops_msl_m", i, layer.top);
    sheet->set("cloud_type", i, layer.type);
    sheet->set(regions ? "cloud_coverage_percent" : "cloud_coverage", i, layer.cover * (regions ? 1.0 : kOktasOf11));
  }
}

}  // namespace

std::vector<std::string> shownDatarefs(const std::vector<SettingWrite>& settings) {
  std::vector<std::string> names;
  for (const SettingWrite& each : settings) {
    if (each.is_shown) names.push_back(each.write.dataref);
  }
  return names;
}

std::string differenceOf(const std::vector<SettingWrite>& settings, const std::vector<DatarefValue>& shown) {
  std::string text;
  std::size_t next = 0;
  for (const SettingWrite& each : settings) {
    if (!each.is_shown) continue;
    const bool answers = next < shown.size() && shown[next].has_value();
    const double value = answers ? static_cast<double>(*shown[next]) : 0.0;
    const auto wanted = static_cast<double>(each.write.value);
    ++next;
    double off = std::abs(value - wanted);
    if (each.turns_over_at > 0.0) off = std::min(off, std::abs(each.turns_over_at - off));
    if (answers && off <= each.tolerance) continue;
    text += (text.empty() ? "" : ", ") + each.write.dataref;
    text += answers ? " is " + number(value) + ", not " + number(wanted) : std::string(" does not answer");
  }
  return text;
}

// --- time ---

std::optional<std::string> check(const TimeSetting& time) {
  if (!time.zulu_time && !time.date_days && !time.time_ratio) {
    return "nothing is given: expected `fields` with DATE, ZULU_TIME or TIME_RATIO";
  }
  if (time.zulu_time) {
    if (auto wrong = outside("zulu_time", *time.zulu_time, 0.0, kDay, "s since midnight UTC")) return wrong;
  }
  if (time.date_days) {
    if (auto wrong = outside("date_days", *time.date_days, 0, kLastDay, "d since 1 January")) return wrong;
  }
  if (!time.time_ratio) return std::nullopt;
  return outside("time_ratio", *time.time_ratio, 1, kMaxTimeRatio, "-, a whole number; the service `pause` stops time");
}

std::vector<SettingWrite> timeWrites(const TimeSetting& time) {
  std::vector<SettingWrite> out;
  if (time.zulu_time || time.date_days) out.push_back({{"sim/time/use_system_time", 0.0F}, 0.0, false, 0.0});
  if (time.date_days) {
    out.push_back({{"sim/time/local_date_days", static_cast<float>(*time.date_days)}, 0.5, true, 0.0});
  }
  if (time.zulu_time) {
    out.push_back({{"sim/time/zulu_time_sec", static_cast<float>(*time.zulu_time)}, kTimeTolerance, true, kDay});
  }
  if (time.time_ratio) {
    out.push_back({{"sim/time/sim_speed", static_cast<float>(*time.time_ratio)}, 0.5, true, 0.0});
  }
  return out;
}

// --- weather ---

std::optional<std::string> check(const Weather& weather) {
  const Weather& w = weather;
  if (!w.wind && !w.clouds && !w.visibility && !w.precipitation && !w.sea_level_temperature && !w.sea_level_pressure) {
    return "nothing is given: expected `fields` with WIND, CLOUDS, VISIBILITY, PRECIPITATION, TEMPERATURE or PRESSURE";
  }
  if (w.wind) {
    if (w.wind->empty()) return "wind_layer_altitude is empty: expected one or more layers; calm air has speed 0";
    for (std::size_t i = 0; i < w.wind->size(); ++i) {
      const WindLayer& layer = (*w.wind)[i];
      if (auto wrong = wrongWith(layer, "wind layer " + std::to_string(i) + ": ")) return wrong;
      if (i == 0 || layer.altitude > (*w.wind)[i - 1].altitude) continue;
      return "wind layer " + std::to_string(i) + ": altitude is " + number(layer.altitude) +
             ": expected above the layer before it, " + number((*w.wind)[i - 1].altitude) + " [m]";
    }
  }
  if (w.clouds) {
    for (std::size_t i = 0; i < w.clouds->size(); ++i) {
      if (auto wrong = wrongWith((*w.clouds)[i], "cloud layer " + std::to_string(i) + ": ")) return wrong;
    }
  }
  if (w.visibility) {
    if (auto wrong = outside("visibility", *w.visibility, 10.0, 200000.0, "m")) return wrong;
  }
  if (w.precipitation) {
    if (auto wrong = outside("precipitation", *w.precipitation, 0.0, 1.0, "-")) return wrong;
  }
  if (w.sea_level_temperature) {
    if (auto wrong = outside("sea_level_temperature", *w.sea_level_temperature, -60.0, 60.0, "deg C")) return wrong;
  }
  if (!w.sea_level_pressure) return std::nullopt;
  return outside("sea_level_pressure", *w.sea_level_pressure, 85000.0, 110000.0, "Pa");
}

std::optional<std::string> refusalBy(SimulatorVersion version, const Weather& weather) {
  const bool regions = hasRegions(version);
  const std::string who = regions ? "X-Plane from 12.08 on" : "X-Plane before 12.08";
  const auto tooMany = [&who](const char* what, std::size_t given, std::size_t most) {
    return who + " has " + std::to_string(most) + " layers of " + what + ": " + std::to_string(given) + " are given";
  };
  if (weather.wind && weather.wind->size() > (regions ? kRegionLayers : kLayers)) {
    return tooMany("wind", weather.wind->size(), regions ? kRegionLayers : kLayers);
  }
  if (!weather.clouds) return std::nullopt;
  if (weather.clouds->size() > kLayers) return tooMany("clouds", weather.clouds->size(), kLayers);
  for (const CloudLayer& layer : *weather.clouds) {
    if (layer.type <= (regions ? kLastType12 : kLastType11)) continue;
    return "cloud type " + std::to_string(layer.type) + " is none of " + who + ": expected 0 to " +
           std::to_string(kLastType12);
  }
  return std::nullopt;
}

std::vector<SettingWrite> weatherWrites(const Weather& weather, SimulatorVersion version) {
  const bool regions = hasRegions(version);
  Sheet sheet(regions);
  if (regions) {
    constexpr int kStaticWeather = 3;
    sheet.send(kUpdateImmediately, 1.0);
    sheet.send("change_mode", kStaticWeather);
    sheet.send("variability_pct", 0.0);
  } else if (!version.is12()) {  // there it cannot be written
    sheet.send("use_real_weather_bool", 0.0);
  }
  if (weather.wind) addWind(*weather.wind, regions, &sheet);
  if (weather.clouds) addClouds(*weather.clouds, regions, &sheet);
  if (weather.visibility && regions) sheet.set("visibility_reported_sm", *weather.visibility / kMetersPerMile);
  if (weather.visibility && !regions) sheet.set("visibility_reported_m", *weather.visibility);
  if (weather.precipitation) sheet.set("rain_percent", *weather.precipitation);
  if (weather.sea_level_temperature) {
    sheet.set(regions ? "sealevel_temperature_c" : "temperature_sealevel_c", *weather.sea_level_temperature);
  }
  if (weather.sea_level_pressure && regions) sheet.set("sealevel_pressure_pas", *weather.sea_level_pressure);
  if (weather.sea_level_pressure && !regions) {
    sheet.set("barometer_sealevel_inhg", *weather.sea_level_pressure / kPascalsPerInchOfMercury);
  }
  return sheet.take();
}

bool hasOthersAct(const std::string& dataref) { return dataref == std::string(kRegion) + kUpdateImmediately; }

std::optional<std::string> cloudCommand(const Weather& weather, SimulatorVersion version) {
  if (!weather.clouds || !hasRegions(version)) return std::nullopt;
  return "sim/operation/regen_weather";
}

}  // namespace xplane_bridge::core
