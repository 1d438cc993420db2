#include "xplane_bridge/actuation/flight_changes.hpp"

#include <array>
#include <cstdio>
#include <fstream>
#include <memory>
#include <utility>

#include "xplane_bridge/actuation/link_condition.hpp"

namespace xplane_bridge {
namespace {

constexpr double kPlaceAgain = 3.0;             // [s] until a placement of which nothing is seen is sent once more
constexpr int kMoves = 2;                       // attempts at moving the aircraft before a new flight is begun
constexpr int kBeginnings = 2;                  // attempts at beginning a flight
constexpr double kBeginningVisibleAfter = 0.5;  // [s] of flight from which on its beginning anew can be seen
constexpr double kBeginningVisibleWait = 1.0;   // [s] for that
constexpr double kPauseWait = 1.0;              // [s] until a pause must be shown
constexpr double kPauseAgain = 20.0;            // [s] in which it is asked for again
constexpr double kIdentityChangeWait = 3.0;     // [s] until X-Plane must have shown its aircraft
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

bool FlightChanges::isUp() const { return link_->status().up(); }

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
  const unsigned resets = hooks_.resets();
  std::string problem = waitForPlacement(start, visible, &shown);
  if (problem.empty()) {
    again = pause(true, who);
    problem = waitForMotion(start, &shown);
    // One that was moved by little, or had only just begun, does not show that it was reset.
    if (hooks_.resets() == resets) hooks_.placed();
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
