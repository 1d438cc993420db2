#include "xplane_bridge/actuation/flight_jobs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "xplane_bridge/Event.h"
#include "xplane_bridge/actuation/pausing.hpp"
#include "xplane_bridge/core/base/text.hpp"

namespace xplane_bridge {
namespace {

constexpr double kPoll = 0.2;          // [s] longest wait without looking at anything else
constexpr double kPlaceAgain = 3.0;    // [s] until a placement that is not shown is sent once more
constexpr double kWriteAgain = 0.3;    // [s] the same of datarefs
constexpr double kPauseWait = 1.0;     // [s] until a pause must be shown
constexpr double kIdentityWait = 3.0;  // [s] until X-Plane must have told its aircraft
constexpr const char* kLoading = "another aircraft is being loaded";

template <std::size_t Size, class Encode>
bool sendMessage(core::SimulatorPort* link, Encode encode) {
  std::array<std::uint8_t, Size> buffer;
  const core::EncodeResult encoded = encode(core::ByteSpan(buffer));
  return encoded.ok() && link->send({buffer.data(), encoded.value()}) == core::SendStatus::kSent;
}

/// Empty: all is shown.
std::string loadingDifference(const std::vector<core::DatarefWrite>& writes,
                              const std::vector<core::DatarefValue>& values) {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < writes.size(); ++i) {
    const bool answered = i < values.size() && values[i];
    if (answered && core::shows(writes[i], static_cast<double>(*values[i]))) continue;
    out.push_back(writes[i].dataref +
                  (answered ? " is " + std::to_string(*values[i]) + ", not " + std::to_string(writes[i].value)
                            : " does not answer"));
  }
  return core::join(out);
}

}  // namespace

FlightJobs::FlightJobs(core::SimulatorPort* link, const FlightJobOptions& options, FlightJobHooks hooks)
    : link_(link), options_(options), hooks_(std::move(hooks)), thread_([this] { loop(); }) {}

FlightJobs::~FlightJobs() { stop(); }

void FlightJobs::stop() {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
    jobs_.clear();
  }
  wanted_.notify_all();
  if (thread_.joinable()) thread_.join();
}

bool FlightJobs::full() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return stopping_ || jobs_.size() >= kMostWaiting;
}

std::string FlightJobs::mover() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return mover_;
}

void FlightJobs::add(std::uint32_t number, const std::string& who, bool moves, std::function<Outcome()> run) {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (stopping_) return;
    jobs_.push_back({number, who, moves, std::move(run)});
  }
  wanted_.notify_all();
}

void FlightJobs::loop() {
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    wanted_.wait(lock, [this] { return stopping_ || !jobs_.empty(); });
    if (stopping_) return;
    const Job job = std::move(jobs_.front());
    jobs_.pop_front();
    if (job.moves) mover_ = job.who;
    lock.unlock();
    Outcome outcome;
    try {
      outcome = job.run();
    } catch (const std::exception& error) {  // the journal's disk
      outcome = {Event::SETTING, job.who + ": " + error.what(), false};
    }
    if (stopping_ && !outcome.success) outcome.text += " (tx_node ends)";
    hooks_.report(job.number, outcome.kind, outcome.text, job.who, outcome.success);
    lock.lock();
    mover_.clear();
  }
}

void FlightJobs::reset(const core::FlightStart& start, std::uint32_t number, const std::string& who) {
  add(number, who, true, [this, start] { return place(start); });
}

void FlightJobs::setWind(const core::UniformWind& wind, std::uint32_t number, const std::string& who) {
  add(number, who, false, [this, wind] { return blow(wind); });
}

void FlightJobs::setLoading(const core::Loading& loading, std::uint32_t number, const std::string& who) {
  add(number, who, false, [this, loading] { return load(loading); });
}

void FlightJobs::loadAircraft(const std::string& path, std::int32_t livery, std::uint32_t number,
                              const std::string& who) {
  add(number, who, true, [this, path, livery] { return change(path, livery); });
}

void FlightJobs::saveSituation(const std::string& path, std::uint32_t number, const std::string& who) {
  add(number, who, false, [this, path] { return save(path); });
}

void FlightJobs::loadSituation(const std::string& path, std::uint32_t number, const std::string& who) {
  add(number, who, true, [this, path] { return restore(path); });
}

// --- means ---

void FlightJobs::wait(double seconds, const std::function<bool()>& condition) {
  link_->waitUntil([&] { return stopping_ || condition(); }, seconds);
}

void FlightJobs::write(const std::vector<core::DatarefWrite>& writes) {
  for (const core::DatarefWrite& each : writes) link_->write(each.dataref, each.value);
}

std::string FlightJobs::excuse() const {
  const core::LinkStatus status = link_->status();
  if (status.state == core::LinkState::kPaused) return " (it is paused)";
  if (status.state != core::LinkState::kConnected)
    return std::string(" (the link is ") + core::toString(status.state) + ")";
  return "";
}

void FlightJobs::pause(bool paused) {
  hooks_.pausing(mover());
  const PauseOutcome outcome = setPaused(link_, paused, kPauseWait, [this] { return stopping_.load(); });
  if (outcome != PauseOutcome::kFollowed) hooks_.pausing("");
}

// --- placing ---

std::optional<core::ShownFlight> FlightJobs::shownFlight() {
  return core::shownFlightFrom(link_->read(core::shownFlightDatarefs(link_->status().version), kPoll));
}

FlightJobs::Outcome FlightJobs::place(const core::FlightStart& start) {
  // Paused, so that the aircraft does not fly between place and motion.
  const bool was_paused = link_->status().paused.value_or(false);
  pause(true);
  const std::string difference = placed(start);
  // Starting a flight may have paused or resumed it.
  pause(was_paused);
  if (!difference.empty())
    return {Event::RESET, "reset_flight: X-Plane did not place the aircraft: " + difference, false};
  return {Event::RESET, "the flight goes on at the place, attitude and speed asked for", true};
}

std::string FlightJobs::placed(const core::FlightStart& start) {
  // X-Plane 12 moves an aircraft that flies; one that has crashed needs a new flight.
  const bool moves = link_->status().version.is12();
  bool anew = !moves || hooks_.watch().crashed;
  std::optional<core::ShownFlight> shown;
  // Scenery may have to be loaded.
  for (const core::Deadline deadline = in(options_.load_timeout); !over(deadline);) {
    if (anew) {
      sendMessage<core::kPrelSize>(link_,
                                   [&](core::ByteSpan out) { return core::encodePrel(out, core::placementOf(start)); });
      anew = !moves;
    }
    // Twice: the elevation is wrong the first time.
    for (int i = 0; moves && i < 2; ++i) {
      sendMessage<core::kVehicleSize>(link_,
                                      [&](core::ByteSpan out) { return core::encodeVehs(out, core::poseOf(start)); });
    }
    for (const core::Deadline again = in(kPlaceAgain); !over(again) && !(shown && core::isNear(start, *shown));)
      shown = shownFlight();
    if (shown && core::isNear(start, *shown)) break;
  }
  if (!shown) return "it does not show where it is" + excuse();
  if (!core::isNear(start, *shown)) return core::differenceOf(start, *shown) + excuse();
  // The link may look at values after a wait was given up: what it calls owns what it uses.
  const auto fits = [start](const std::vector<core::DatarefValue>& values) {
    const auto now = core::shownFlightFrom(values);
    return now && core::differenceOf(start, *now).empty();
  };
  for (const core::Deadline deadline = in(options_.setting_timeout); !over(deadline);) {
    write(core::motionWrites(start, *shown));
    const auto values = link_->readUntil(core::shownFlightDatarefs(link_->status().version), kPoll, fits);
    if (const auto now = core::shownFlightFrom(values)) shown = now;
    if (fits(values)) return "";
  }
  return core::differenceOf(start, *shown) + excuse();
}

// --- settings ---

FlightJobs::Outcome FlightJobs::blow(const core::UniformWind& wind) {
  const auto names = core::shownWindDatarefs(link_->status().version);
  const auto fits = [wind](const std::vector<core::DatarefValue>& values) { return core::shows(wind, values); };
  std::vector<core::DatarefValue> values;
  for (const core::Deadline deadline = in(options_.setting_timeout); !over(deadline);) {
    write(core::windWrites(wind, link_->status().version));
    for (const core::Deadline again = in(1.0); !over(again);) {
      values = link_->readUntil(names, kPoll, fits);
      if (fits(values)) return {Event::SETTING, "the wind blows as asked for", true};
    }
  }
  std::string text = "set_wind: the air at the aircraft does not show it";
  if (values.size() == 2 && values[0] && values[1]) {
    text += ", but " + std::to_string(*values[0]) + " m/s from " + std::to_string(*values[1]) + " deg";
  }
  return {Event::SETTING, text + excuse(), false};
}

FlightJobs::Outcome FlightJobs::load(const core::Loading& loading) {
  const auto writes = core::loadingWrites(loading, link_->status().version);
  std::vector<std::string> names;
  names.reserve(writes.size());
  for (const core::DatarefWrite& each : writes) names.push_back(each.dataref);
  const auto fits = [writes](const std::vector<core::DatarefValue>& values) {
    return loadingDifference(writes, values).empty();
  };
  std::vector<core::DatarefValue> values;
  for (const core::Deadline deadline = in(options_.setting_timeout); !over(deadline);) {
    write(writes);
    values = link_->readUntil(names, kWriteAgain, fits);
    if (fits(values)) return {Event::SETTING, "the aircraft is loaded as asked for", true};
  }
  return {Event::SETTING, "set_loading: " + loadingDifference(writes, values) + excuse(), false};
}

// --- files ---

FlightJobs::Outcome FlightJobs::change(const std::string& path, std::int32_t livery) {
  const auto fly = [this](void*) { hooks_.ground(""); };
  std::unique_ptr<void, decltype(fly)> grounded(this, fly);
  hooks_.ground(kLoading);
  const std::string problem = changed(path, livery);
  grounded.reset();
  if (!problem.empty()) return {Event::AIRCRAFT, "load_aircraft " + path + ": " + problem + excuse(), false};
  return {Event::AIRCRAFT, "loaded " + path + ": " + hooks_.aircraft(), true};
}

std::string FlightJobs::changed(const std::string& path, std::int32_t livery) {
  const auto names = core::aircraftPathDatarefs(path.size() + 1, link_->status().version);
  const auto isShown = [&] { return core::isSamePath(core::textFrom(link_->read(names, kPoll)), path); };
  // Where no file is shown, that the flight began anew has to do.
  const bool tells = !names.empty();
  const bool same = !tells || isShown();
  const unsigned resets = hooks_.resets();
  bool gap = false;
  const auto isLoaded = [&] {
    gap = gap || link_->status().state == core::LinkState::kStale || link_->status().state == core::LinkState::kLost;
    return (!tells || isShown()) && (!same || gap || hooks_.resets() != resets);
  };
  if (!sendMessage<core::kAcfnSize>(link_,
                                    [&](core::ByteSpan out) { return core::encodeAcfn(out, 0, path, livery); })) {
    return "it could not be sent";
  }
  const core::Deadline deadline = in(options_.load_timeout);
  while (!isLoaded()) {
    if (over(deadline)) return "X-Plane does not show it; is the path that of a file below its folder?";
    if (!tells) wait(kPoll, isLoaded);
  }
  const unsigned identities = hooks_.identities();
  wait(kIdentityWait, [&] { return hooks_.identities() != identities; });
  return hooks_.identities() != identities ? "" : "X-Plane has loaded it, but does not tell which aircraft it is";
}

FlightJobs::Outcome FlightJobs::save(const std::string& path) {
  const bool sent = sendMessage<core::kSimoSize>(
      link_, [&](core::ByteSpan out) { return core::encodeSimo(out, core::SituationAction::kSaveSituation, path); });
  return {Event::SITUATION,
          sent ? "asked X-Plane to save the situation as " + path + "; it does not show whether it did"
               : "save_state " + path + ": it could not be sent",
          sent};
}

FlightJobs::Outcome FlightJobs::restore(const std::string& path) {
  const unsigned resets = hooks_.resets();
  const bool sent = sendMessage<core::kSimoSize>(
      link_, [&](core::ByteSpan out) { return core::encodeSimo(out, core::SituationAction::kLoadSituation, path); });
  if (sent) wait(options_.load_timeout, [&] { return hooks_.resets() != resets; });
  if (sent && hooks_.resets() != resets) return {Event::SITUATION, "the situation " + path + " is loaded", true};
  return {
      Event::SITUATION,
      "load_state " + path + ": the flight goes on as it was; is there such a file below X-Plane's folder?" + excuse(),
      false};
}

}  // namespace xplane_bridge
