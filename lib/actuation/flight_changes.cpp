#include "xplane_bridge/actuation/flight_changes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>
#include <utility>
#include <variant>

#include "xplane_bridge/actuation/link_condition.hpp"
#include "xplane_bridge/actuation/override_manager.hpp"
#include "xplane_bridge/core/base/text.hpp"

namespace xplane_bridge {
namespace {

constexpr double kPoll = 0.2;                   // [s] longest wait without looking at anything else
constexpr double kPlaceAgain = 3.0;             // [s] until a placement of which nothing is seen is sent once more
constexpr int kMoves = 2;                       // attempts at moving the aircraft before a new flight is begun
constexpr int kBeginnings = 2;                  // attempts at beginning a flight
constexpr double kBeginningVisibleAfter = 0.5;  // [s] of flight from which on its beginning anew can be seen
constexpr double kBeginningVisibleWait = 1.0;   // [s] for that
constexpr double kWriteAgain = 0.3;             // [s] until datarefs that are not shown are written once more
constexpr double kStationsWait = 0.5;           // [s] until a payload that the stations do not take is written as a sum
constexpr double kWindAgain = 1.0;              // [s] the same of the weather
constexpr double kAnswerWait = 0.5;             // [s] for what X-Plane has now, also where its frames are slow
constexpr double kPauseWait = 1.0;              // [s] until a pause must be shown
constexpr double kPauseAgain = 20.0;            // [s] in which it is asked for again
constexpr double kIdentityChangeWait = 3.0;     // [s] until X-Plane must have shown its aircraft
constexpr const char* kSettingsEntry = "override:settings of the flight";
constexpr const char* kLoading = "another aircraft is being loaded";

template <std::size_t Size, class Encode>
bool sendMessage(core::SimulatorPort* link, Encode encode) {
  std::array<std::uint8_t, Size> buffer;
  const core::EncodeResult encoded = encode(core::ByteSpan(buffer));
  return encoded.ok() && link->send({buffer.data(), encoded.value()}) == core::SendStatus::kSent;
}

bool sendSituation(core::SimulatorPort* link, core::SituationAction action, const std::string& path) {
  return sendMessage<core::kSimoSize>(link, [&](core::ByteSpan out) { return core::encodeSimo(out, action, path); });
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

bool isNear(const core::FlightStart& start, const std::optional<core::ShownFlight>& shown) {
  return shown && core::isNear(start, *shown);
}

std::string spotOf(const core::AirportStart& start) {
  const bool ramp = start.spot == core::AirportSpot::kRamp;
  std::string name = start.name.empty() ? std::to_string(start.index) : start.name;
  if (start.name.empty() && !ramp) name += ", end " + std::to_string(start.end);
  return (ramp ? "ramp " : "runway ") + name + " of " + start.airport;
}

/// Gives a spot that is named its numbers and place; returns what is wrong, empty: nothing.
std::string resolve(const std::string& airport_data, core::AirportStart* start) {
  if (start->name.empty()) return "";
  if (airport_data.empty()) {
    return "\"" + start->name +
           "\" is a name: set tx_node's parameter airport_data to X-Plane's apt.dat, or give spot_index and runway_end";
  }
  std::ifstream file(airport_data);
  if (!file) return "airport_data " + airport_data + " cannot be read: expected X-Plane's apt.dat";
  const std::string problem = core::findSpot(file, start);
  return problem.empty() ? "" : problem + " (in " + airport_data + ")";
}

}  // namespace

FlightChanges::FlightChanges(core::SimulatorPort* link, const FlightChangeOptions& options, FlightChangeHooks hooks)
    : link_(link), options_(options), hooks_(std::move(hooks)) {}

// --- means ---

bool FlightChanges::waitFor(double seconds, const std::function<bool()>& condition) {
  bool met = false;
  link_->waitUntil([&] { return stopping_ || (met = condition()); }, seconds);
  return met;
}

void FlightChanges::write(const std::vector<core::DatarefWrite>& writes) {
  for (const core::DatarefWrite& each : writes) link_->write(each.dataref, each.value);
}

bool FlightChanges::beginningIsVisible() {
  const auto visible = [this] { return hooks_.watch().flight_time > kBeginningVisibleAfter; };
  if (!link_->status().paused.value_or(false)) waitFor(kBeginningVisibleWait, visible);
  return visible();
}

bool FlightChanges::isUp() const { return xplane_bridge::isUp(link_->status()); }

PauseOutcome FlightChanges::pause(bool paused, const std::string& who) {
  hooks_.pausing(who);
  const auto record = [this, paused] {
    if (paused) recordPause(link_);  // after a crash X-Plane must go on
  };
  // Waited for also while stopping: a resume that goes by what is shown before a pause would leave X-Plane paused, and
  // a resume that is not seen would leave the entry to end a pause of the user's.
  const PauseOutcome outcome = setPaused(
      link_, paused, kPauseWait, [] { return false; }, record);
  if (outcome != PauseOutcome::kFollowed) hooks_.pausing("");
  return outcome;
}

// --- placing ---

FlightChanges::Outcome FlightChanges::place(const core::FlightStart& start, const std::string& who) {
  const bool visible = movesAircraft() || beginningIsVisible();
  // Paused, so that the aircraft does not fly between place and motion. A new flight may begin in the other state.
  const PauseOutcome before = firstPause(who);
  PauseOutcome again = PauseOutcome::kUnknown;
  std::optional<core::ShownFlight> shown;
  std::string problem = waitForPlacement(start, visible, &shown);
  if (problem.empty()) {
    again = pause(true, who);
    problem = waitForMotion(start, &shown);
  }
  const std::string stands = pauseAsBefore(before, again, who);
  if (!problem.empty())
    return {core::EventKind::kReset, "reset_flight: X-Plane did not place the aircraft: " + problem + stands, false};
  if (!stands.empty()) return {core::EventKind::kReset, "reset_flight: the aircraft is placed" + stands, false};
  return {core::EventKind::kReset, "the flight goes on at the place, attitude and speed asked for", true};
}

/// One that is found may be ours, of a change before.
PauseOutcome FlightChanges::firstPause(const std::string& who) {
  const bool ours = isPauseOurs(link_);
  if (ours) recordPause(link_);  // no longer left: it must last as long as this change
  const PauseOutcome outcome = pause(true, who);
  return ours ? PauseOutcome::kFollowed : outcome;
}

/// Returns what is to be said where X-Plane does not show it, however often it is asked for.
std::string FlightChanges::pauseAsBefore(PauseOutcome before, PauseOutcome again, const std::string& who) {
  // A silent X-Plane has not shown at first whether it was paused.
  const PauseOutcome first = before == PauseOutcome::kUnknown ? again : before;
  if (first == PauseOutcome::kUnknown) return "";
  const bool paused = first == PauseOutcome::kWasSo;
  const core::Deadline deadline = deadlineAfter(kPauseAgain);
  do {
    const PauseOutcome last = pause(paused, who);
    if (last != PauseOutcome::kWasSo && last != PauseOutcome::kFollowed) continue;
    forgetPause(link_);
    return "";
  } while (!expired(deadline));
  if (paused) return ", but X-Plane does not show that it is paused, as it was" + linkCondition();
  leavePause(link_);
  hooks_.pause_left();
  return ", but X-Plane does not show that it goes on" + linkCondition() + ": it is let go on when it is back";
}

std::optional<core::ShownFlight> FlightChanges::shownFlight() {
  return core::shownFlightFrom(link_->read(core::shownFlightDatarefs(link_->status().version), kPoll));
}

bool FlightChanges::movesAircraft() const {
  const core::SimulatorVersion version = link_->status().version;
  return version.is12() && !version.is(core::Otherwise::kVehs) && !hooks_.watch().crashed;
}

std::string FlightChanges::waitForPlacement(const core::FlightStart& start, bool visible,
                                            std::optional<core::ShownFlight>* shown) {
  const core::Deadline deadline = deadlineAfter(options_.load_timeout);  // scenery may have to be loaded
  *shown = shownFlight();
  // X-Plane 12 moves an aircraft that flies; one that has crashed needs a new flight.
  if (movesAircraft() && moveThere(start, deadline, shown)) return "";
  const auto there = [&start](const std::optional<core::ShownFlight>& now) { return isNear(start, now); };
  if (beginThere({core::placementOf(start), there, visible, false}, deadline, shown)) return "";
  if (!*shown) return "it does not show where it is" + linkCondition();
  if (!isNear(start, *shown)) return core::differenceOf(start, **shown) + linkCondition();
  return "the flight has not begun anew" + linkCondition();
}

bool FlightChanges::moveThere(const core::FlightStart& start, const core::Deadline& deadline,
                              std::optional<core::ShownFlight>* shown) {
  // Where it was near already, only the very place shows that it was moved.
  const bool was_near = isNear(start, *shown);
  for (int attempt = 0; attempt < kMoves; ++attempt) {
    // Twice: the elevation is wrong the first time.
    for (int i = 0; i < 2; ++i) {
      sendMessage<core::kVehicleSize>(link_,
                                      [&](core::ByteSpan out) { return core::encodeVehs(out, core::poseOf(start)); });
    }
    for (const core::Deadline again = deadlineAfter(kPlaceAgain); !expired(again) && !expired(deadline);) {
      *shown = shownFlight();
      if (isNear(start, *shown) && (!was_near || core::placeDifferenceOf(start, **shown).empty())) return true;
    }
  }
  return false;
}

bool FlightChanges::beginThere(const Beginning& wanted, const core::Deadline& deadline,
                               std::optional<core::ShownFlight>* shown) {
  // X-Plane reads nothing while it loads; what is sent meanwhile would begin the flight once more afterwards.
  if (!waitFor(deadline.left(), [this] { return isUp(); })) return false;
  const unsigned resets = hooks_.resets();
  bool seen = false;  // that the flight began anew, or that X-Plane loads
  core::Deadline again = deadlineAfter(0.0);
  for (int sent = 0; !expired(deadline);) {
    if (!seen && again.over() && isUp()) {
      if (sent < kBeginnings) {
        sendMessage<core::kPrelSize>(link_,
                                     [&](core::ByteSpan out) { return core::encodePrel(out, wanted.placement); });
        again = deadlineAfter(kPlaceAgain);
        ++sent;
      } else if (wanted.may_be_refused) {
        return false;
      }
    }
    *shown = shownFlight();
    seen = seen || hooks_.resets() != resets || !isUp();
    // A flight that has only just begun does not show whether it began anew: then the time it is given has to do.
    const bool begun = seen || (!wanted.visible && again.over());
    if (begun && wanted.there(*shown)) return true;
  }
  return false;
}

std::string FlightChanges::waitForMotion(const core::FlightStart& start, std::optional<core::ShownFlight>* shown) {
  // The link may look at values after a wait was given up: what it calls owns what it uses.
  const auto fits = [start](const std::vector<core::DatarefValue>& values) {
    const auto now = core::shownFlightFrom(values);
    return now && core::differenceOf(start, *now).empty();
  };
  for (const core::Deadline deadline = deadlineAfter(options_.setting_timeout); !expired(deadline);) {
    write(core::motionWrites(start, **shown));
    const auto values = link_->readUntil(core::shownFlightDatarefs(link_->status().version), kPoll, fits);
    if (const auto now = core::shownFlightFrom(values)) *shown = now;
    if (fits(values)) return "";
  }
  return core::differenceOf(start, **shown) + linkCondition();
}

// --- placing at an airport ---

FlightChanges::Outcome FlightChanges::placeAt(const core::AirportStart& asked, const std::string& who) {
  const auto failed = [](const std::string& problem) {
    return FlightChangeOutcome{core::EventKind::kReset, "reset_flight: " + problem, false};
  };
  core::AirportStart start = asked;
  if (const std::string problem = resolve(options_.airport_data, &start); !problem.empty()) return failed(problem);
  if (!beginningIsVisible()) {
    return failed("the flight has only just begun, so X-Plane would not show a new one" + linkCondition() +
                  ": let it fly for a second, then ask again");
  }
  const PauseOutcome before = firstPause(who);
  PauseOutcome again = PauseOutcome::kUnknown;
  std::optional<core::ShownFlight> shown;
  const std::string problem = waitForAirport(start, &shown);
  if (problem.empty()) again = pause(true, who);
  const std::string stands = pauseAsBefore(before, again, who);
  if (!problem.empty() || !stands.empty()) return failed((problem.empty() ? "the flight is placed" : problem) + stands);
  if (start.spot != core::AirportSpot::kFinal) {
    return {core::EventKind::kReset, "the flight begins at " + spotOf(start), true};
  }
  FlightChangeOutcome outcome = place(core::finalStart(start, *shown), who);
  if (outcome.success) {
    char distance[32];
    std::snprintf(distance, sizeof distance, "%.0f m", start.final_distance);
    outcome.text = std::string("the flight goes on ") + distance + " before " + spotOf(start);
  }
  return outcome;
}

std::string FlightChanges::waitForAirport(const core::AirportStart& start, std::optional<core::ShownFlight>* shown) {
  const core::Deadline deadline = deadlineAfter(options_.load_timeout);
  const unsigned resets = hooks_.resets();
  const auto there = [&start](const std::optional<core::ShownFlight>& now) {
    return now && core::isThere(start, *now);
  };
  if (beginThere({core::placementOf(start), there, true, true}, deadline, shown)) return "";
  if (hooks_.resets() == resets) {
    return "X-Plane begins no flight at " + spotOf(start) + (isUp() ? "" : linkCondition()) +
           ": does it have that airport, and so many ramps or runways there?";
  }
  if (!*shown) return "X-Plane does not show where the aircraft is" + linkCondition();
  return "X-Plane has begun a flight, but the aircraft does not stand at " + spotOf(start) + linkCondition();
}

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

// --- files ---

FlightChanges::Outcome FlightChanges::applyAircraft(const std::string& path, std::int32_t livery) {
  const auto resume = [this](void*) { hooks_.suspend_control(""); };
  std::unique_ptr<void, decltype(resume)> suspended(this, resume);
  hooks_.suspend_control(kLoading);
  const std::string problem = waitForAircraft(path, livery);
  suspended.reset();
  if (!problem.empty())
    return {core::EventKind::kAircraft, "load_aircraft " + path + ": " + problem + linkCondition(), false};
  return {core::EventKind::kAircraft, "loaded " + path + ": " + hooks_.aircraft(), true};
}

std::string FlightChanges::waitForAircraft(const std::string& path, std::int32_t livery) {
  const auto names = core::aircraftPathDatarefs(path.size() + 1, link_->status().version);
  // Where no file is shown, that the flight began anew has to do, or that the aircraft is another one.
  const bool shows_file = !names.empty();
  const auto isShown = [&] { return !shows_file || core::isSamePath(core::textFrom(link_->read(names, kPoll)), path); };
  const bool same = isShown();
  if (same) beginningIsVisible();
  const unsigned resets = hooks_.resets();
  const std::string aircraft = hooks_.aircraft();
  bool begun = false;  // the flight anew, or loading
  const auto hasBegun = [&] {
    return begun = begun || !isUp() || hooks_.resets() != resets || hooks_.aircraft() != aircraft;
  };
  if (!sendMessage<core::kAcfnSize>(link_,
                                    [&](core::ByteSpan out) { return core::encodeAcfn(out, 0, path, livery); })) {
    return "it could not be sent";
  }
  const core::Deadline deadline = deadlineAfter(options_.load_timeout);
  for (bool loaded = false; !loaded;) {
    if (expired(deadline)) return "X-Plane does not show it; is the path that of a file below its folder?";
    if (!shows_file) waitFor(kPoll, [&] { return hasBegun() && isUp(); });
    loaded = isShown() && (hasBegun() || !same) && isUp();
  }
  const unsigned identities = hooks_.identities();
  const bool shown = waitFor(kIdentityChangeWait, [&] { return hooks_.identities() != identities; });
  return shown ? "" : "X-Plane has loaded it, but does not report which aircraft it is";
}

FlightChanges::Outcome FlightChanges::saveSituation(const std::string& path) {
  const bool sent = sendSituation(link_, core::SituationAction::kSaveSituation, path);
  return {core::EventKind::kSituation,
          sent ? "asked X-Plane to save the situation as " + path + "; it does not show whether it did"
               : "save_state " + path + ": it could not be sent",
          sent};
}

FlightChanges::Outcome FlightChanges::applySituation(const std::string& path) {
  beginningIsVisible();
  const unsigned resets = hooks_.resets();
  const bool sent = sendSituation(link_, core::SituationAction::kLoadSituation, path);
  const bool loaded = sent && waitFor(options_.load_timeout, [&] { return hooks_.resets() != resets; });
  if (loaded) return {core::EventKind::kSituation, "the situation " + path + " is loaded", true};
  return {core::EventKind::kSituation,
          "load_state " + path + ": the flight goes on as it was; is there such a file below X-Plane's folder?" +
              linkCondition(),
          false};
}

}  // namespace xplane_bridge
