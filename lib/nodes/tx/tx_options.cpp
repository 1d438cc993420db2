#include "xplane_bridge/nodes/tx/tx_options.hpp"

#include <algorithm>

#include "xplane_bridge/core/control/control_arbiter.hpp"
#include "xplane_bridge/nodes/base/user_folder.hpp"

namespace xplane_bridge {
namespace {

core::Failsafe failsafeOf(const ParamLoader& in, const std::string& key, core::Failsafe fallback, bool required) {
  const std::vector<std::string> allowed = {"neutral", "hold", "manual"};
  if (!required && !in.has(key)) return fallback;
  const std::string text = in.choice(key, allowed);
  if (text == "hold") return core::Failsafe::kHold;
  return text == "manual" ? core::Failsafe::kManual : core::Failsafe::kNeutral;
}

void loadChannels(const ParamLoader& aircraft, bool reverse_thrust, core::ArbiterOptions* out) {
  const core::Failsafe failsafe = failsafeOf(aircraft, "failsafe", core::Failsafe::kNeutral, true);
  const ParamLoader channels = aircraft.section("channels");
  for (const core::ChannelSection& section : core::kChannelSections) {
    const ParamLoader in = channels.section(section.name);
    core::ChannelOptions options = core::channelDefaults(section, failsafe, reverse_thrust);
    const double lowest = options.low, highest = options.high;
    options.low = in.number("low", {lowest, highest}, lowest);
    options.high = in.number("high", {options.low, highest}, highest);
    if (in.has("slew")) options.slew = in.number("slew", {1e-3, 1e3});
    options.failsafe = failsafeOf(in, "failsafe", options.failsafe, false);
    options.neutral = in.number("neutral", {options.low, options.high}, std::clamp(0.0, options.low, options.high));
    for (std::size_t i = core::index(section.first); i <= core::index(section.last); ++i) out->channels[i] = options;
  }
}

void loadAircraft(const ParamLoader& in, ActuationOptions* out) {
  ControlPathOptions& control = out->control;
  control.aircraft = in.textList("identity");
  control.reverse_thrust = in.boolean("reverse_thrust", false);
  control.arbiter.engines = in.integer("engines", {1, core::kMaxEngines});
  loadChannels(in, control.reverse_thrust, &control.arbiter);
  const ParamLoader excitation = in.section("excitation");
  out->max_roll_deg = excitation.number("max_roll_deg", {1.0, 180.0}, out->max_roll_deg);
  out->max_pitch_deg = excitation.number("max_pitch_deg", {1.0, 90.0}, out->max_pitch_deg);
  const ParamLoader in_surfaces = in.section("surfaces");
  SurfaceControlOptions& surfaces = out->surfaces;
  core::DriverOptions& driver = surfaces.driver;
  driver.rate_deg_s = in_surfaces.number("rate_deg_s", {1.0, 1000.0}, driver.rate_deg_s);
  driver.floating_gain = in_surfaces.number("floating_gain", {0.0, 2.0}, driver.floating_gain);
  driver.floating_time = in_surfaces.number("floating_time", {0.01, 10.0}, driver.floating_time);
  surfaces.flap_rate = in_surfaces.number("flap_rate", {0.001, 100.0}, surfaces.flap_rate);
  surfaces.speedbrake_rate = in_surfaces.number("speedbrake_rate", {0.001, 100.0}, surfaces.speedbrake_rate);
}

}  // namespace

TxOptions loadTxOptions(const ParamLoader& own, const std::string& aircraft) {
  TxOptions options;
  ActuationOptions& out = options.actuation;
  out.control.rate = own.number("rate", {1.0, 500.0}, out.control.rate);
  out.control.max_rate = own.number("max_rate", {1.0, 2000.0}, out.control.max_rate);
  out.service_timeout = own.number("service_timeout", {0.1, 10.0}, out.service_timeout);
  out.flight.setting_timeout = own.number("setting_timeout", {0.5, 300.0}, out.flight.setting_timeout);
  out.flight.load_timeout = own.number("load_timeout", {0.5, 3600.0}, out.flight.load_timeout);
  out.flight.airport_data = own.text("airport_data", "");
  core::ArbiterOptions& arbiter = out.control.arbiter;
  out.traffic.rate = own.number("traffic_rate", {1.0, 200.0}, out.traffic.rate);
  out.traffic.timeout = own.number("traffic_timeout", {0.1, 60.0}, out.traffic.timeout);
  out.traffic.vehx = own.choice("traffic_way", {"written", "vehx"}, "written") == "vehx";
  arbiter.command_timeout = own.number("command_timeout", {0.02, 60.0}, arbiter.command_timeout);
  arbiter.resume_grace = own.number("resume_grace", {0.0, 60.0}, arbiter.resume_grace);
  arbiter.transition_rate = own.number("transition_rate", {0.01, 1000.0}, arbiter.transition_rate);
  arbiter.takeover_threshold = own.number("takeover_threshold", {0.0, 2.0}, arbiter.takeover_threshold);
  arbiter.initial_mode = own.choice("initial_mode", {"manual", "auto"}, "manual") == "auto" ? core::FlightMode::kAuto
                                                                                            : core::FlightMode::kManual;
  out.control.stale_after = own.number("control_stale_after", {0.1, 60.0}, out.control.stale_after);
  options.hang_timeout = own.number("hang_timeout", {0.5, 60.0}, options.hang_timeout);
  out.control.resume_auto = own.boolean("resume_auto", false);
  out.control.rows = own.choice("transport", {"dref", "data"}, "dref") == "data";
  const bool manual_surfaces = own.choice("surfaces_source", {"auto", "manual"}, "auto") == "manual";
  arbiter.surfaces_source = manual_surfaces ? core::FlightMode::kManual : core::FlightMode::kAuto;
  const ParamLoader mixing = own.section("mixing");
  core::MixingRequirements& need = out.surfaces.mixing;
  need.excursion = mixing.number("excursion", {0.05, 1.0}, need.excursion);
  need.independence = mixing.number("independence", {0.001, 0.5}, need.independence);
  need.residual_deg = mixing.number("residual_deg", {0.01, 10.0}, need.residual_deg);
  need.slope_error_deg = mixing.number("slope_error_deg", {0.01, 10.0}, need.slope_error_deg);
  need.samples = static_cast<std::size_t>(mixing.integer("samples", {10, 100000}, static_cast<int>(need.samples)));
  if (!own.has("aircraft")) {
    throw ParamError("parameter " + own.fullKey("aircraft") +
                     " is missing: tx_node does not fly an aircraft it has no limits and failsafes of; start it with "
                     "tx.launch, or load one of config/aircraft/ there");
  }
  const ParamLoader file = own.section("aircraft");
  if (file.text("name") != aircraft) {
    file.refuse("name",
                "\"" + aircraft + "\", the shared parameter `aircraft`: load that aircraft's file, or name this one");
  }
  loadAircraft(file, &out);
  out.surfaces.mixing_folder = userFolder() + "/mixing";
  out.surfaces.shipped_mixing = mixing.text("shipped", "");
  out.control.aircraft_file = "config/aircraft/" + aircraft + ".yaml";
  if (const auto wrong = core::validate(arbiter)) throw ParamError("parameter " + own.fullKey(*wrong));
  return options;
}

}  // namespace xplane_bridge
