// FlightChanges' settings: weather, time, loading, and X-Plane's own autopilot, whose dials are settings and whose
// modes are engaged by commands of which X-Plane shows the effect.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "xplane_bridge/actuation/flight_changes.hpp"
#include "xplane_bridge/actuation/override_manager.hpp"
#include "xplane_bridge/core/base/text.hpp"

namespace xplane_bridge {
namespace {

constexpr double kWriteAgain = 0.3;    // [s] until datarefs that are not shown are written once more
constexpr double kStationsWait = 0.5;  // [s] until a payload that the stations do not take is written as a sum
constexpr double kWindAgain = 1.0;     // [s] the same of the weather
constexpr double kAnswerWait = 0.5;    // [s] for what X-Plane has now, also where its frames are slow
constexpr const char* kSettingsEntry = "override:settings of the flight";

// Of the autopilot.
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

/// Whether it could be put back. X-Plane may show NaN, which can be neither written nor noted.
bool isKnown(const core::DatarefValue& value) { return value && std::isfinite(*value); }

/// Empty: all is shown.
std::string loadingDifference(const std::vector<core::DatarefWrite>& writes,
                              const std::vector<core::DatarefValue>& values) {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < writes.size(); ++i) {
    const bool answered = i < values.size() && values[i];
    if (answered && core::matches(writes[i], static_cast<double>(*values[i]))) continue;
    out.push_back(writes[i].dataref +
                  (answered ? " is " + std::to_string(*values[i]) + ", not " + std::to_string(writes[i].value)
                            : " does not answer"));
  }
  return core::join(out);
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

// --- settings ---

FlightChanges::Outcome FlightChanges::applyWind(const core::UniformWind& wind) {
  const auto names = core::shownWindDatarefs(link_->status().version);
  const auto fits = [wind](const std::vector<core::DatarefValue>& values) { return core::matches(wind, values); };
  std::vector<core::DatarefValue> values;
  for (const core::Deadline deadline = deadlineAfter(options_.setting_timeout); !expired(deadline);) {
    write(core::windWrites(wind, link_->status().version));
    for (const core::Deadline again = deadlineAfter(kWindAgain); !expired(again);) {
      values = link_->readUntil(names, kPoll, fits);
      if (fits(values)) return {core::EventKind::kSetting, "the wind blows as asked for", true};
    }
  }
  std::string text = "set_wind: the air at the aircraft does not show it";
  if (values.size() == 2 && values[0] && values[1]) {
    text += ", but " + std::to_string(*values[0]) + " m/s from " + std::to_string(*values[1]) + " deg";
  }
  return {core::EventKind::kSetting, text + linkCondition(), false};
}

std::string FlightChanges::remember(const std::vector<core::SettingWrite>& settings) {
  std::vector<std::string> names, unknown;
  for (const core::SettingWrite& each : settings) names.push_back(each.write.dataref);
  const auto all_known = [](const std::vector<core::DatarefValue>& values) {
    return std::all_of(values.begin(), values.end(), isKnown);
  };
  std::vector<core::DatarefValue> values(names.size());
  for (const core::Deadline deadline = deadlineAfter(options_.setting_timeout);
       !all_known(values) && !expired(deadline);) {
    values = link_->readUntil(names, kAnswerWait, all_known);
  }
  if (stopping_) return "nothing was set";
  const std::lock_guard<std::mutex> lock(restores_mutex_);
  const auto journal = link_->journal();
  const auto before = journal ? core::ownEntry(*journal, kSettingsEntry) : std::nullopt;
  std::vector<core::UndoOperation> all = before ? before->undo : std::vector<core::UndoOperation>();
  for (std::size_t i = 0; i < settings.size(); ++i) {
    const bool known = std::any_of(all.begin(), all.end(), [&](const core::UndoOperation& operation) {
      return std::get<core::UndoDref>(operation).path == names[i];
    });
    if (known) continue;  // what X-Plane had before the first of them counts
    if (i < values.size() && isKnown(values[i])) {
      // Not looked at: time runs on, and X-Plane's own weather may change it at once.
      all.push_back(core::UndoDref{names[i], *values[i], false});
    } else if (settings[i].is_shown) {
      unknown.push_back(names[i]);
    }
  }
  if (!unknown.empty() || !journal) {
    return "X-Plane does not report " + core::join(unknown.empty() ? names : unknown) +
           ", which could not be put back on exit" + linkCondition();
  }
  std::stable_partition(all.begin(), all.end(), [](const core::UndoOperation& operation) {
    return !core::hasOthersAct(std::get<core::UndoDref>(operation).path);
  });
  journal->record(kSettingsEntry, kOverridePurpose, std::move(all));
  return "";
}

void FlightChanges::endSettings(bool restore) {
  const std::lock_guard<std::mutex> lock(restores_mutex_);
  const auto journal = link_->journal();
  if (!journal) return;
  try {
    const auto entry = core::ownEntry(*journal, kSettingsEntry);
    if (!entry) return;
    if (restore && !isUp()) return journal->leave({kSettingsEntry}, "X-Plane went first");
    for (const core::UndoOperation& operation : entry->undo) {
      if (restore) link_->sendUndo(operation);
    }
    journal->removeUndone({*entry});
  } catch (const core::JournalError&) {
    // The next start does it once more, or for the first time.
  }
}

FlightChanges::Outcome FlightChanges::applySettings(const std::vector<core::SettingWrite>& settings,
                                                    const std::string& service, const std::string& done, bool restore) {
  if (restore) {
    const std::string problem = remember(settings);
    if (!problem.empty()) return {core::EventKind::kSetting, service + ": " + problem, false};
  }
  std::vector<core::DatarefWrite> writes;
  writes.reserve(settings.size());
  for (const core::SettingWrite& each : settings) writes.push_back(each.write);
  const auto names = core::shownDatarefs(settings);
  const auto fits = [settings](const std::vector<core::DatarefValue>& values) {
    return core::differenceOf(settings, values).empty();
  };
  std::vector<core::DatarefValue> values;
  for (const core::Deadline deadline = deadlineAfter(options_.setting_timeout); !expired(deadline);) {
    write(writes);
    values = link_->readUntil(names, kWriteAgain, fits);
    if (fits(values)) return {core::EventKind::kSetting, done, true};
  }
  const std::string difference = core::differenceOf(settings, values);
  return {core::EventKind::kSetting, service + ": " + difference + linkCondition(), false};
}

FlightChanges::Outcome FlightChanges::applyTime(const core::TimeSetting& time) {
  return applySettings(core::timeWrites(time), "set_time", "it is the time that was asked for", time.restore_on_exit);
}

FlightChanges::Outcome FlightChanges::applyWeather(const core::Weather& weather) {
  const core::SimulatorVersion version = link_->status().version;
  if (const auto refusal = core::refusalBy(version, weather)) {
    return {core::EventKind::kSetting, "set_weather: " + *refusal, false};
  }
  Outcome outcome = applySettings(core::weatherWrites(weather, version), "set_weather",
                                  "the weather is set as asked for", weather.restore_on_exit);
  if (const auto command = core::cloudCommand(weather, version); command && outcome.success) link_->command(*command);
  return outcome;
}

FlightChanges::Outcome FlightChanges::applyLoading(const core::Loading& loading) {
  const core::SimulatorVersion version = link_->status().version;
  const auto shown = core::loadingShown(loading);
  std::vector<std::string> names;
  names.reserve(shown.size());
  for (const core::DatarefWrite& each : shown) names.push_back(each.dataref);
  const auto fits = [shown](const std::vector<core::DatarefValue>& values) {
    return loadingDifference(shown, values).empty();
  };
  const auto stations = core::stationDatarefs(version);
  const bool spread = loading.payload_mass && !stations.empty();
  std::vector<core::DatarefValue> values;
  if (spread) values = link_->read(stations, kWriteAgain);
  const auto writes = core::loadingWrites(loading, values);
  const core::Deadline by_stations = deadlineAfter(kStationsWait);
  for (const core::Deadline deadline = deadlineAfter(options_.setting_timeout); !expired(deadline);) {
    write(writes);
    // An aircraft without stations takes the sum.
    if (spread && by_stations.over()) write(shown);
    values = link_->readUntil(names, kWriteAgain, fits);
    if (fits(values)) return {core::EventKind::kSetting, "the aircraft is loaded as asked for", true};
  }
  return {core::EventKind::kSetting, "set_loading: " + loadingDifference(shown, values) + linkCondition(), false};
}

// --- the autopilot ---

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
