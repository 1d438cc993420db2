#include "xplane_bridge/nodes/tx/tx_options.hpp"

#include <algorithm>

#include "xplane_bridge/core/control/control_channels.hpp"

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
    core::ChannelRange range = core::commandRange(section.first);
    // Below 0 a lever means reverse thrust, which most aircraft do not have.
    if (core::isLever(section.first) && !reverse_thrust) range.low = 0.0;
    // Sticks, levers, motors and toe brakes follow the aircraft's `failsafe`; handles hold unless they say otherwise.
    const bool primary = core::channelWire(section.first, {}).refresh == core::Refresh::kContinuous;
    core::ChannelOptions options;
    options.low = in.number("low", {range.low, range.high}, range.low);
    options.high = in.number("high", {options.low, range.high}, range.high);
    if (in.has("slew")) options.slew = in.number("slew", {1e-3, 1e3});
    options.failsafe = failsafeOf(in, "failsafe", primary ? failsafe : core::Failsafe::kHold, false);
    options.neutral = in.number("neutral", {options.low, options.high}, std::clamp(0.0, options.low, options.high));
    for (std::size_t i = core::index(section.first); i <= core::index(section.last); ++i) out->channels[i] = options;
  }
}

AircraftOptions loadAircraft(const ParamLoader& in, ControlPathOptions* control) {
  AircraftOptions out;
  control->aircraft = in.texts("identity");
  control->reverse_thrust = in.boolean("reverse_thrust", false);
  control->arbiter.engines = in.integer("engines", {1, core::kMaxEngines});
  loadChannels(in, control->reverse_thrust, &control->arbiter);
  const ParamLoader excitation = in.section("excitation");
  out.max_roll_deg = excitation.number("max_roll_deg", {1.0, 180.0}, out.max_roll_deg);
  out.max_pitch_deg = excitation.number("max_pitch_deg", {1.0, 90.0}, out.max_pitch_deg);
  const ParamLoader surfaces = in.section("surfaces");
  out.surfaces.rate_deg_s = surfaces.number("rate_deg_s", {1.0, 1000.0}, out.surfaces.rate_deg_s);
  out.surfaces.floating_gain = surfaces.number("floating_gain", {0.0, 2.0}, out.surfaces.floating_gain);
  out.surfaces.floating_time = surfaces.number("floating_time", {0.01, 10.0}, out.surfaces.floating_time);
  out.flap_rate = surfaces.number("flap_rate", {0.001, 100.0}, out.flap_rate);
  out.speedbrake_rate = surfaces.number("speedbrake_rate", {0.001, 100.0}, out.speedbrake_rate);
  return out;
}

}  // namespace

TxOptions loadTxOptions(const ParamLoader& own, const std::string& aircraft) {
  TxOptions out;
  out.control.rate = own.number("rate", {1.0, 500.0}, out.control.rate);
  out.control.max_rate = own.number("max_rate", {1.0, 2000.0}, out.control.max_rate);
  out.service_timeout = own.number("service_timeout", {0.1, 10.0}, out.service_timeout);
  out.setting_timeout = own.number("setting_timeout", {0.5, 300.0}, out.setting_timeout);
  out.load_timeout = own.number("load_timeout", {0.5, 3600.0}, out.load_timeout);
  core::ArbiterOptions& arbiter = out.control.arbiter;
  arbiter.command_timeout = own.number("command_timeout", {0.02, 60.0}, arbiter.command_timeout);
  arbiter.resume_grace = own.number("resume_grace", {0.0, 60.0}, arbiter.resume_grace);
  arbiter.transition_rate = own.number("transition_rate", {0.01, 1000.0}, arbiter.transition_rate);
  arbiter.takeover_threshold = own.number("takeover_threshold", {0.0, 2.0}, arbiter.takeover_threshold);
  arbiter.initial_mode = own.choice("initial_mode", {"manual", "auto"}, "manual") == "auto" ? core::FlightMode::kAuto
                                                                                            : core::FlightMode::kManual;
  const ParamLoader mixing = own.section("mixing");
  core::MixingRequirements& need = out.mixing;
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
  out.aircraft = loadAircraft(file, &out.control);
  out.control.aircraft_file = "config/aircraft/" + aircraft + ".yaml";
  if (const auto wrong = core::validate(arbiter)) throw ParamError("parameter " + own.fullKey(*wrong));
  return out;
}

}  // namespace xplane_bridge
