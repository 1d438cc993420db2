#include "xplane_bridge/nodes/messages/flight_conversions.hpp"

#include <cmath>

#include "xplane_bridge/core/control/field_bits.hpp"

namespace xplane_bridge {
namespace {

std::optional<double> given(float value) {
  return std::isnan(value) ? std::nullopt : std::optional<double>(static_cast<double>(value));
}

}  // namespace

core::FlightStart toCore(const ResetFlight::Request& request) {
  core::FlightStart out;
  out.latitude_deg = request.latitude;
  out.longitude_deg = request.longitude;
  out.altitude_msl = request.altitude_msl;
  out.roll_deg = static_cast<double>(request.roll_deg);
  out.pitch_deg = static_cast<double>(request.pitch_deg);
  out.heading_true_deg = static_cast<double>(request.heading_true_deg);
  out.true_airspeed = static_cast<double>(request.true_airspeed);
  out.flight_path_angle_deg = static_cast<double>(request.flight_path_angle_deg);
  return out;
}

core::UniformWind toCore(const SetWind::Request& request) {
  return {static_cast<double>(request.speed), static_cast<double>(request.from_deg),
          static_cast<double>(request.turbulence)};
}

core::Loading toCore(const SetLoading::Request& request) {
  core::Loading out;
  out.fuel_tank.assign(request.fuel_tank.begin(), request.fuel_tank.end());
  // A request that leaves both out has 0 in both.
  if (request.payload_mass == 0.0F && request.cg_offset == 0.0F) return out;
  out.payload_mass = given(request.payload_mass);
  out.cg_offset = given(request.cg_offset);
  return out;
}

core::AutopilotSetting toCore(const SetAutopilot::Request& request) {
  using Request = SetAutopilot::Request;
  const auto take = [&request](std::uint32_t bit, auto value) {
    return (request.fields & bit) != 0 ? std::optional(value) : std::nullopt;
  };
  const auto wide = [](float value) { return static_cast<double>(value); };
  core::AutopilotSetting out;
  out.master = take(Request::MASTER, static_cast<core::AutopilotMaster>(request.master));
  out.lateral = take(Request::LATERAL, static_cast<core::LateralMode>(request.lateral));
  out.vertical = take(Request::VERTICAL, static_cast<core::VerticalMode>(request.vertical));
  out.altitude_armed = take(Request::ALTITUDE_ARMED, request.altitude_armed != 0);
  out.autothrottle = take(Request::AUTOTHROTTLE, request.autothrottle != 0);
  out.yaw_damper = take(Request::YAW_DAMPER, request.yaw_damper != 0);
  out.heading_magnetic_deg = take(Request::HEADING, wide(request.heading_magnetic_deg));
  out.altitude = take(Request::ALTITUDE, wide(request.altitude));
  out.vertical_speed = take(Request::VERTICAL_SPEED, wide(request.vertical_speed));
  out.airspeed = take(Request::AIRSPEED, wide(request.airspeed));
  out.mach = take(Request::MACH, wide(request.mach));
  out.restore_on_exit = request.restore_on_exit != 0;
  return out;
}

core::TimeSetting toCore(const SetTime::Request& request) {
  core::TimeSetting out;
  if ((request.fields & SetTime::Request::DATE) != 0) out.date_days = request.date_days;
  if ((request.fields & SetTime::Request::ZULU_TIME) != 0) out.zulu_time = request.zulu_time;
  if ((request.fields & SetTime::Request::TIME_RATIO) != 0) out.time_ratio = request.time_ratio;
  out.restore_on_exit = request.restore_on_exit != 0;
  return out;
}

core::Weather toCore(const SetWeather::Request& request) {
  const auto has = [&request](std::uint32_t bit) { return (request.fields & bit) != 0; };
  const auto wide = [](float value) { return static_cast<double>(value); };
  core::Weather out;
  if (has(SetWeather::Request::WIND)) {
    out.wind.emplace();
    for (std::size_t i = 0; i < request.wind_layer_altitude.size(); ++i) {
      const auto extra = [&](const std::vector<float>& list) { return list.empty() ? 0.0 : wide(list[i]); };
      out.wind->push_back({wide(request.wind_layer_altitude[i]), wide(request.wind_layer_from_deg[i]),
                           wide(request.wind_layer_speed[i]), extra(request.wind_layer_shear),
                           extra(request.wind_layer_turbulence)});
    }
  }
  if (has(SetWeather::Request::CLOUDS)) {
    out.clouds.emplace();
    for (std::size_t i = 0; i < request.cloud_base.size(); ++i) {
      out.clouds->push_back({wide(request.cloud_base[i]), wide(request.cloud_top[i]), wide(request.cloud_cover[i]),
                             request.cloud_type[i]});
    }
  }
  if (has(SetWeather::Request::VISIBILITY)) out.visibility = wide(request.visibility);
  if (has(SetWeather::Request::PRECIPITATION)) out.precipitation = wide(request.precipitation);
  if (has(SetWeather::Request::TEMPERATURE)) out.sea_level_temperature = wide(request.sea_level_temperature);
  if (has(SetWeather::Request::PRESSURE)) out.sea_level_pressure = wide(request.sea_level_pressure);
  out.restore_on_exit = request.restore_on_exit != 0;
  return out;
}

std::optional<std::string> wrongWith(const SetAutopilot::Request& request) {
  if (auto wrong = core::unknownBits(request.fields, request.ALL_FIELDS)) return wrong;
  return core::check(toCore(request));
}

std::optional<std::string> wrongWith(const SetTime::Request& request) {
  if (auto wrong = core::unknownBits(request.fields, request.ALL_FIELDS)) return wrong;
  return core::check(toCore(request));
}

std::optional<std::string> wrongWith(const SetWeather::Request& request) {
  if (auto wrong = core::unknownBits(request.fields, request.ALL_FIELDS)) return wrong;
  struct List {
    const char* name;
    std::size_t size, expected;
    bool may_be_empty;
  };
  const std::size_t layers = request.wind_layer_altitude.size(), clouds = request.cloud_base.size();
  for (const List& list : {List{"wind_layer_from_deg", request.wind_layer_from_deg.size(), layers, false},
                           List{"wind_layer_speed", request.wind_layer_speed.size(), layers, false},
                           List{"wind_layer_shear", request.wind_layer_shear.size(), layers, true},
                           List{"wind_layer_turbulence", request.wind_layer_turbulence.size(), layers, true},
                           List{"cloud_top", request.cloud_top.size(), clouds, false},
                           List{"cloud_cover", request.cloud_cover.size(), clouds, false},
                           List{"cloud_type", request.cloud_type.size(), clouds, false}}) {
    if (list.size == list.expected || (list.may_be_empty && list.size == 0)) continue;
    return std::string(list.name) + " has " + std::to_string(list.size) + " values: expected " +
           std::to_string(list.expected) + ", one a layer";
  }
  return core::check(toCore(request));
}

std::optional<std::string> wrongWith(const SetWind::Request& request) { return core::check(toCore(request)); }
std::optional<std::string> wrongWith(const SetLoading::Request& request) { return core::check(toCore(request)); }

std::optional<std::string> wrongWith(const LoadAircraft::Request& request) {
  if (auto wrong = core::checkXPlanePath(request.path, ".acf")) return wrong;
  if (request.livery >= 0) return std::nullopt;
  return "livery is " + std::to_string(request.livery) + ": expected 0 (the default) or more";
}

std::optional<std::string> wrongWith(const Situation::Request& request) {
  return core::checkXPlanePath(request.path, ".sit");
}

}  // namespace xplane_bridge
