// X-Plane's own autopilot: the dials as settings, the modes by commands of which X-Plane shows the effect.

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "xplane_bridge/actuation/flight_changes.hpp"
#include "xplane_bridge/core/base/text.hpp"

namespace xplane_bridge {
namespace {

constexpr int kPresses = 3;         // of a switch that shows nothing: messages may be lost
constexpr double kPressWait = 1.5;  // [s] for one
constexpr const char* kService = "set_autopilot";
constexpr const char* kDone = "the autopilot is set as asked for";

std::string shownText(const core::AutopilotStep& step, const std::vector<core::DatarefValue>& values) {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < step.shown.size(); ++i) {
    char text[32] = "does not answer";
    if (i < values.size() && values[i]) std::snprintf(text, sizeof text, "is %g", static_cast<double>(*values[i]));
    out.push_back(step.shown[i] + " " + text);
  }
  return core::join(out);
}

bool allAnswer(const std::vector<core::DatarefValue>& values) {
  return std::all_of(values.begin(), values.end(), [](const core::DatarefValue& value) { return value.has_value(); });
}

/// What takes stick, pedals or surfaces from the autopilot.
std::vector<std::string> takenFromAutopilot(const std::vector<std::string>& overrides) {
  std::vector<std::string> out;
  for (const std::string& name : overrides) {
    const std::string leaf(core::afterLastSlash(name));
    for (const char* part : {"joystick", "control_surfaces", "DATA row"}) {
      if (leaf.find(part) != std::string::npos) out.push_back(leaf);
    }
  }
  return out;
}

}  // namespace

std::string FlightChanges::press(const core::AutopilotStep& step) {
  const auto fits = [step](const std::vector<core::DatarefValue>& values) { return core::matches(step, values); };
  std::vector<core::DatarefValue> values = link_->read(step.shown, kPressWait);
  for (int i = 0; i < kPresses && allAnswer(values) && !fits(values) && !stopping_; ++i) {
    link_->command(step.command);
    values = link_->readUntil(step.shown, kPressWait, fits);
    // Those of a wait may be from before a silence in which the press has come: the next one would undo it.
    if (!fits(values)) values = link_->read(step.shown, kPressWait);
  }
  if (fits(values)) return "";
  if (!allAnswer(values)) {
    return "X-Plane does not show whether \"" + step.name + "\" is engaged: " + shownText(step, values) +
           linkCondition();
  }
  return "X-Plane does not engage \"" + step.name + "\" by " + step.command + ": " + shownText(step, values) +
         linkCondition() + "; has this aircraft an autopilot with it, and has that its power?";
}

FlightChanges::Outcome FlightChanges::applyAutopilot(const core::AutopilotSetting& setting) {
  const auto failed = [](const std::string& why) {
    return Outcome{core::EventKind::kSetting, std::string(kService) + ": " + why, false};
  };
  const core::SimulatorVersion version = link_->status().version;
  if (setting.restore_on_exit) {
    const std::string problem = remember(core::autopilotRestored(setting, version));
    if (!problem.empty()) return failed(problem);
  }
  const std::vector<core::SettingWrite> dials = core::autopilotDials(setting, version);
  const auto turnDials = [&] {
    if (!core::shownDatarefs(dials).empty()) return applySettings(dials, kService, kDone, false);
    for (const core::SettingWrite& each : dials) write({each.write});
    return Outcome{core::EventKind::kSetting, kDone, true};
  };
  Outcome outcome = turnDials();
  const std::vector<core::DatarefValue> master = link_->read({core::kAutopilotMaster}, kPressWait);
  for (const core::AutopilotStep& step : core::autopilotSteps(setting, master.front())) {
    if (!outcome.success) return outcome;
    const std::string problem = press(step);
    if (!problem.empty()) return failed(problem);
  }
  // Engaging a mode turns its dial to what is flown.
  if (outcome.success) outcome = turnDials();
  const bool flies = setting.master == core::AutopilotMaster::kServos;
  const auto taken = takenFromAutopilot(flies && hooks_.overrides ? hooks_.overrides() : std::vector<std::string>());
  if (outcome.success && !taken.empty()) {
    outcome.text += "; but tx_node holds " + core::join(taken) + ", and there the autopilot moves nothing";
  }
  return outcome;
}

}  // namespace xplane_bridge
