#include "xplane_bridge/core/failures/failures.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <utility>

#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/core/failures/failure_names.hpp"

namespace xplane_bridge::core {
namespace {

const std::string kFailureFolder = "sim/operation/failures/";
constexpr std::size_t kLongestName = 100;  // of a rel_*: none is nearly as long

// A system whose failures X-Plane has by number.
struct SystemRow {
  const char* name;  // "engine" of engine_1
  int count;
  std::vector<std::string> (*datarefs)(int number);  // number from 1
};

std::string zeroBased(const char* name, int number) { return name + std::to_string(number - 1); }
// rel_esys, rel_esys2, rel_esys3: the first has no number.
std::string firstBare(const char* name, int number) { return number == 1 ? name : name + std::to_string(number); }

const SystemRow kSystems[] = {
    {"engine", 8, [](int n) { return std::vector<std::string>{zeroBased("rel_engfai", n)}; }},
    {"bus", 6, [](int n) { return std::vector<std::string>{firstBare("rel_esys", n)}; }},
    {"generator", 8, [](int n) { return std::vector<std::string>{zeroBased("rel_genera", n)}; }},
    {"battery", 8, [](int n) { return std::vector<std::string>{zeroBased("rel_batter", n)}; }},
    {"pitot", 2, [](int n) { return std::vector<std::string>{firstBare("rel_pitot", n)}; }},
    {"static", 2, [](int n) { return std::vector<std::string>{firstBare("rel_static", n)}; }},
    // Artificial horizon and directional gyro; 1 the pilot's, 2 the copilot's.
    {"gyro", 2,
     [](int n) {
       return n == 1 ? std::vector<std::string>{"rel_ss_ahz", "rel_ss_dgy"}
                     : std::vector<std::string>{"rel_cop_ahz", "rel_cop_dgy"};
     }},
};

FailurePlanResult refuse(FailureError error, const std::string& text) { return {error, text, {}}; }

// How X-Plane 12 names what a surface does; nullptr where it cannot express it.
const char* ownSuffix(SurfaceFault fault, bool has_value) {
  switch (fault) {
    case SurfaceFault::kStuck:
      return has_value ? nullptr : "_lock";
    case SurfaceFault::kHardOverUp:
      return "_mxup";
    case SurfaceFault::kHardOverDown:
      return "_mxdn";
    case SurfaceFault::kCentred:
      return "_cntr";
    case SurfaceFault::kGone:
      return "_gone";
    case SurfaceFault::kFloating:
    case SurfaceFault::kReduced:
    case SurfaceFault::kSlow:
      break;
  }
  return nullptr;
}

// X-Plane 12's own failure of a surface; empty where it cannot express the wish.
std::string ownSurfaceFailure(const SurfaceInfo& surface, SurfaceFault fault, bool has_value) {
  const char* suffix = ownSuffix(fault, has_value);
  if (!suffix) return "";
  const char* stem = nullptr;
  switch (surface.kind) {
    case SurfaceKind::kAileron:
      stem = "ailn";
      break;
    case SurfaceKind::kElevator:
      stem = "elev";
      break;
    case SurfaceKind::kRudder:
      stem = "rudd";
      break;
    case SurfaceKind::kSpoiler:
      stem = "rspo";
      break;
    case SurfaceKind::kSpeedbrake:
      stem = "sbrk";
      break;
    case SurfaceKind::kFlap:
      stem = "flap";
      break;
    case SurfaceKind::kYawBrake:
      stem = "yawb";
      break;
  }
  const std::string set = surface.kind == SurfaceKind::kYawBrake ? "x" : std::to_string(surface.set);
  const std::string side = surface.kind == SurfaceKind::kRudder ? "ctr" : surface.place % 2 == 0 ? "lft" : "rgt";
  return "rel_fcon_" + std::string(stem) + "_" + set + "_" + side + suffix;
}

/// With a value that is ignored more would break than was asked for.
std::optional<std::string> checkValue(const FailureRequest& request) {
  const auto fault = surfaceFaultFrom(request.kind);
  const bool takes_one =
      fault == SurfaceFault::kStuck || fault == SurfaceFault::kReduced || fault == SurfaceFault::kSlow;
  if (takes_one || !request.value) return std::nullopt;
  return wrongNumber("value", *request.value,
                     "none (has_value: false) for kind " + request.kind + "; stuck, reduced and slow take one");
}

FailurePlanResult planSurface(const FailureRequest& request, std::size_t surface, SimulatorVersion version) {
  FailurePlanResult out;
  out.plan = {request.name, request.kind, request.value, {}, std::nullopt};
  const auto fault = surfaceFaultFrom(request.kind);
  if (!fault) {
    return refuse(FailureError::kInvalid, "kind is \"" + request.kind + "\": expected " + kSurfaceFaultWords);
  }
  if (const auto wrong = checkValue(request)) return refuse(FailureError::kInvalid, *wrong);
  if (*fault != SurfaceFault::kGone) {
    const SurfaceFailure failure{surface, *fault, request.value};
    if (const auto wrong = validate(failure)) return refuse(FailureError::kInvalid, request.name + " " + *wrong);
    out.plan.surface = failure;
  }
  const std::string own = version.is(Otherwise::kFconActs)
                              ? ""
                              : ownSurfaceFailure(surfaceTable()[surface], *fault, request.value.has_value());
  // No version has all of them: a flap or a speed brake cannot be centred.
  if (!own.empty() && hasFailure(version, failureDataref(own))) out.plan.datarefs.push_back(failureDataref(own));
  if (out.plan.datarefs.empty() && !out.plan.surface) {
    return refuse(FailureError::kNotSupported,
                  "a lost surface (gone) cannot be expressed by X-Plane 11, nor where rel_fcon_* do not act: use "
                  "floating, or reduced with value 0");
  }
  return out;
}

std::optional<std::string> checkTrigger(const FailureRequest& request) {
  if (request.trigger < 0 || request.trigger > static_cast<int>(FailureTrigger::kAtSpeedBelow)) {
    return "trigger is " + std::to_string(request.trigger) + ": expected 0..5";
  }
  if (!std::isfinite(request.trigger_value)) return "trigger_value is not a finite number";
  if (request.trigger == static_cast<int>(FailureTrigger::kNow)) {
    if (request.trigger_value == 0.0) return std::nullopt;
    return wrongNumber("trigger_value", request.trigger_value, "0 with trigger 0 (NOW): choose one of 1..5 to wait");
  }
  if (request.trigger == static_cast<int>(FailureTrigger::kAtSimTime) && request.trigger_value < 0.0) {
    return "trigger_value is " + std::to_string(request.trigger_value) + ": expected 0 s or more from now";
  }
  return std::nullopt;
}

bool shareDataref(const FailurePlan& a, const FailurePlan& b) {
  return std::any_of(a.datarefs.begin(), a.datarefs.end(), [&b](const std::string& dataref) {
    return std::find(b.datarefs.begin(), b.datarefs.end(), dataref) != b.datarefs.end();
  });
}

// True when the trigger has come; false also while what it looks at is unknown.
bool hasCome(FailureTrigger trigger, double value, const FlightConditions& now) {
  switch (trigger) {
    case FailureTrigger::kNow:
      return true;
    case FailureTrigger::kAtSimTime:
      return now.sim_time >= value;
    case FailureTrigger::kAtAltitudeAbove:
      return now.height_agl >= value;
    case FailureTrigger::kAtAltitudeBelow:
      return now.height_agl <= value;
    case FailureTrigger::kAtSpeedAbove:
      return now.indicated_airspeed >= value;
    case FailureTrigger::kAtSpeedBelow:
      return now.indicated_airspeed <= value;
  }
  return false;
}

}  // namespace

std::string failureDataref(const std::string& name) {
  return name.compare(0, kFailureFolder.size(), kFailureFolder) == 0 ? name : kFailureFolder + name;
}

std::string failureName(const std::string& name) {
  return name.compare(0, kFailureFolder.size(), kFailureFolder) == 0 ? name.substr(kFailureFolder.size()) : name;
}

FailurePlanResult planFailure(const FailureRequest& request, SimulatorVersion version) {
  if (const auto wrong = checkTrigger(request)) return refuse(FailureError::kInvalid, *wrong);
  if (const auto surface = surfaceNumber(request.name)) return planSurface(request, *surface, version);

  FailurePlanResult out;
  out.plan = {request.name, request.kind, std::nullopt, {}, std::nullopt};
  const std::string bare = failureName(request.name);
  const bool plain = bare.size() <= kLongestName &&
                     std::all_of(bare.begin(), bare.end(), [](unsigned char c) { return std::isalnum(c) || c == '_'; });
  if (bare.compare(0, 4, "rel_") == 0 && bare.size() > 4 && plain) {
    out.plan.name = bare;
    out.plan.datarefs.push_back(failureDataref(bare));
  } else {
    const std::size_t underscore = request.name.rfind('_');
    for (const SystemRow& row : kSystems) {
      if (underscore == std::string::npos || request.name.substr(0, underscore) != row.name) continue;
      const std::string digits = request.name.substr(underscore + 1);
      const bool number = digits.size() == 1 && digits[0] >= '1' && digits[0] <= '9';
      if (!number || digits[0] - '0' > row.count) {
        return refuse(FailureError::kInvalid, "name is \"" + request.name + "\": expected " + row.name + "_1 to " +
                                                  row.name + "_" + std::to_string(row.count));
      }
      for (const std::string& dataref : row.datarefs(digits[0] - '0')) {
        out.plan.datarefs.push_back(failureDataref(dataref));
      }
    }
  }
  if (out.plan.datarefs.empty()) {
    return refuse(
        FailureError::kInvalid,
        "name is \"" + request.name +
            "\": expected a surface (docs/control/surfaces.md), engine_<n>, bus_<n>, generator_<n>, battery_<n>, "
            "pitot_<n>, static_<n>, gyro_<n>, or a rel_* dataref");
  }
  if (request.kind != "failed") {
    return refuse(FailureError::kInvalid, "kind is \"" + request.kind + "\": expected failed for " + request.name);
  }
  if (const auto wrong = checkValue(request)) return refuse(FailureError::kInvalid, *wrong);
  return out;
}

std::optional<std::string> FailureRegistry::sameAs(const FailurePlan& plan) const {
  for (const auto& [name, entry] : entries_) {
    if (name != plan.name && shareDataref(entry.plan, plan)) return name;
  }
  return std::nullopt;
}

void FailureRegistry::add(const FailureRequest& request, const FailurePlan& plan, const FlightConditions& now) {
  Entry entry;
  entry.plan = plan;
  entry.trigger = static_cast<FailureTrigger>(request.trigger);
  entry.trigger_value = request.trigger_value;
  if (entry.trigger == FailureTrigger::kAtSimTime) entry.trigger_value += now.sim_time;
  entries_[plan.name] = entry;
}

std::vector<FailurePlan> FailureRegistry::due(const FlightConditions& now) {
  std::vector<FailurePlan> out;
  for (auto& [name, entry] : entries_) {
    if (entry.active || !hasCome(entry.trigger, entry.trigger_value, now)) continue;
    entry.active = true;
    entry.since = now.sim_time;
    out.push_back(entry.plan);
    for (const std::string& dataref : entry.plan.datarefs) of_menu_.erase(failureName(dataref));
  }
  return out;
}

void FailureRegistry::confirm(const std::string& name, bool shown) {
  const auto it = entries_.find(name);
  if (it != entries_.end()) it->second.confirmed = shown;
}

void FailureRegistry::setValue(const std::string& name, double value) {
  const auto it = entries_.find(name);
  if (it != entries_.end()) it->second.plan.value = value;
}

bool FailureRegistry::observe(const std::string& dataref, double value, double sim_time) {
  const bool failed = value == kFailedNow;
  for (auto& [name, entry] : entries_) {
    const auto& names = entry.plan.datarefs;
    // One that is armed only is not what X-Plane shows.
    if (!entry.active || std::find(names.begin(), names.end(), dataref) == names.end()) continue;
    if (failed) {
      entry.shown.insert(dataref);
    } else {
      entry.shown.erase(dataref);
    }
    const bool all = entry.shown.size() == names.size();
    return std::exchange(entry.confirmed, all) != all;
  }
  return failed ? of_menu_.emplace(failureName(dataref), sim_time).second : of_menu_.erase(failureName(dataref)) != 0;
}

FailureRegistry::Cleared FailureRegistry::clear(const std::vector<std::string>& names, bool include_simulator) {
  Cleared out;
  for (auto it = entries_.begin(); it != entries_.end();) {
    const bool named = std::find(names.begin(), names.end(), it->first) != names.end();
    if (!names.empty() && !named) {
      ++it;
      continue;
    }
    if (it->second.active) out.undo.push_back(it->second.plan);
    out.names.push_back(it->first);
    it = entries_.erase(it);
  }
  for (auto it = of_menu_.begin(); include_simulator && it != of_menu_.end();) {
    const std::string& name = it->first;
    if (!names.empty() && std::find(names.begin(), names.end(), name) == names.end()) {
      ++it;
      continue;
    }
    out.undo.push_back({name, "failed", std::nullopt, {failureDataref(name)}, std::nullopt});
    if (std::find(out.names.begin(), out.names.end(), name) == out.names.end()) out.names.push_back(name);
    it = of_menu_.erase(it);
  }
  return out;
}

std::vector<FailureLabel> FailureRegistry::labels() const {
  std::vector<FailureLabel> out;
  for (const auto& [name, entry] : entries_) {
    FailureLabel label;
    label.name = name;
    label.kind = entry.plan.kind;
    if (entry.plan.value) label.value = *entry.plan.value;
    label.active = entry.active;
    label.confirmed = entry.confirmed;
    label.since_sim_time = entry.since;
    out.push_back(label);
  }
  for (const auto& [name, since] : of_menu_) {
    FailureLabel label;
    label.name = name;
    label.kind = "failed";
    label.by_bridge = false;
    label.active = label.confirmed = true;
    label.since_sim_time = since;
    out.push_back(label);
  }
  std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  return out;
}

std::vector<SurfaceFailure> FailureRegistry::drivenSurfaces() const {
  std::vector<SurfaceFailure> out;
  for (const auto& [name, entry] : entries_) {
    if (entry.active && entry.driven()) out.push_back(*entry.plan.surface);
  }
  return out;
}

bool FailureRegistry::isDriven(const std::string& name) const {
  const auto it = entries_.find(name);
  return it != entries_.end() && it->second.driven();
}

std::vector<std::string> FailureRegistry::datarefsOf(const std::string& name) const {
  const auto it = entries_.find(name);
  if (it == entries_.end() || !it->second.active) return {};
  return it->second.plan.datarefs;
}

void FailureRegistry::useDriver(const std::string& name, double sim_time, std::optional<double> stuck_deg) {
  const auto it = entries_.find(name);
  if (it == entries_.end() || !it->second.plan.surface) return;
  it->second.plan.datarefs.clear();  // X-Plane's own failure is another's from here on
  it->second.confirmed = false;
  it->second.since = sim_time;
  SurfaceFailure& failure = *it->second.plan.surface;
  if (failure.fault == SurfaceFault::kStuck && !failure.value) failure.value = stuck_deg;
}

}  // namespace xplane_bridge::core
