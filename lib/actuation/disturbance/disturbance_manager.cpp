#include "xplane_bridge/actuation/disturbance/disturbance_manager.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/core/simulator/flight_settings.hpp"
#include "xplane_bridge/core/state/frames.hpp"

namespace xplane_bridge {
namespace {

using Lock = std::lock_guard<core::HandlerMutex>;

constexpr double kAskWait = 3.0;   // [s] for X-Plane to show its weather
constexpr double kRepeat = 1.0;    // [s] after which also what has not changed is sent: datagrams get lost
constexpr double kGap = 0.4;       // [s] without a frame, in which the guardian may have put the weather back
constexpr double kHangWait = 0.5;  // [s] until it would be known that it was the guardian
constexpr int kTimesPutBack = 2;
constexpr double kMostWind = 100.0;  // [m/s] as set_wind
constexpr const char* kNotYet = "the wind of before the last disturbance could not be put back yet";
constexpr const char* kEntry = "override:the wind before a disturbance";

/// X-Plane answers, or is late with a frame: what it was sent stays.
bool isThere(const core::LinkStatus& status) { return status.up() || status.state == core::LinkState::kStale; }

std::string described(const DisturbanceLabel& label) {
  return "disturbance " + std::to_string(label.id) + ", " + core::toString(label.spec->kind);
}

}  // namespace

DisturbanceManager::DisturbanceManager(core::SimulatorPort* link, std::string purpose, Publish publish, Report report)
    : link_(link), purpose_(std::move(purpose)), publish_(std::move(publish)), report_(std::move(report)) {
  this->publish();
}

std::string DisturbanceManager::begin(const core::DisturbanceSpec& spec, const std::string& who) {
  const Lock lock(mutex_);
  if (ended_) return "tx_node ends";
  if (state_ != State::kIdle) return described(label_) + ", runs; one at a time: wait for its end, or stop it";
  if (!link_->journal()) return "there is no journal to note the wind of before in";
  putBack();
  if (!restores_.empty()) return kNotYet;
  version_ = link_->status().version;
  std::vector<std::string> names;
  for (const core::DatarefWrite& each : core::windWrites({}, version_)) names.push_back(each.dataref);
  for (const std::string& each : core::shownWindDatarefs(version_)) names.push_back(each);
  const std::uint32_t id = label_.id + 1;
  label_ = {};
  label_.id = id;
  label_.spec = spec;
  label_.result = "asks X-Plane for its weather";
  who_ = who;
  state_ = State::kAsking;
  publish();
  link_->read(names, kAskWait, [this, id, names](const std::vector<core::DatarefValue>& values) {
    const Lock answered(mutex_);
    onWeather(id, names, values);
  });
  return "";
}

void DisturbanceManager::onWeather(std::uint32_t id, const std::vector<std::string>& names,
                                   const std::vector<core::DatarefValue>& values) {
  if (state_ != State::kAsking || id != label_.id) return;
  std::vector<std::string> unknown;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i >= values.size() || !values[i] || !std::isfinite(*values[i])) unknown.push_back(names[i]);
  }
  const auto journal = link_->journal();
  if (!unknown.empty() || !journal) {
    return end("refused: X-Plane does not show " + core::join(unknown) + ", which could not be put back", false);
  }
  const std::size_t weather = names.size() - 2;  // behind it: the wind at the aircraft
  std::vector<core::UndoOperation> all;
  // Last what lets the rest act at once.
  for (std::size_t i = weather; i-- > 0;) all.push_back(core::UndoDref{names[i], *values[i], false});
  try {
    journal->record(kEntry, purpose_, all);
  } catch (const core::JournalError& error) {
    return end("refused: " + core::whyNotChanged(error), false);
  }
  restores_ = std::move(all);
  sent_frames_ = noted_frames_ = 0;
  framed_at_ = link_->clock().steadySeconds();
  times_put_back_ = 0;
  const auto speed = static_cast<double>(*values[weather]);
  label_.steady =
      core::windNedFromDirection(static_cast<double>(*values[weather + 1]) * core::kRadiansPerDegree, speed);
  disturbance_.emplace(*label_.spec);
  sent_.clear();
  state_ = State::kRunning;
}

void DisturbanceManager::onFrame(const core::FlightWatch& watch) {
  const Lock lock(mutex_);
  if (up_ && std::exchange(unsure_, false) && state_ == State::kIdle) putBack();
  if (state_ != State::kRunning) return;
  if (isQuiet() && isPutBackByAnother()) return endAsPutBack();
  framed_at_ = link_->clock().steadySeconds();
  if (!std::isfinite(watch.sim_time)) return;
  if (!label_.active) {
    label_.active = true;
    label_.start_sim_time = watch.sim_time;
    label_.result = "running";
    report_(described(label_) + ": begins", who_, true);
  } else if (watch.sim_time < label_.sim_time - core::kOvertaking) {
    return end("aborted: simulator time ran backwards", false);
  } else if (watch.sim_time <= label_.sim_time) {
    return;
  }
  label_.sim_time = watch.sim_time;
  const core::GeoPoint place{watch.latitude_deg, watch.longitude_deg, watch.height_agl};
  label_.model = disturbance_->step({watch.sim_time - label_.start_sim_time, watch.true_airspeed, place});
  if (disturbance_->over()) return end("done", true);
  if (!label_.model.allFinite()) return end("aborted: X-Plane does not show place or airspeed", false);
  Eigen::Vector3d wind = label_.steady + Eigen::Vector3d(label_.model.x(), label_.model.y(), 0.0);
  if (wind.norm() > kMostWind) wind *= kMostWind / wind.norm();
  label_.commanded = wind - label_.steady;
  send(wind);
  publish();
}

void DisturbanceManager::send(const Eigen::Vector3d& wind_ned) {
  ++sent_frames_;
  core::UniformWind wind;
  wind.speed = label_.wind_speed = wind_ned.norm();
  wind.from_deg = label_.wind_from_deg = core::windFromDirectionDeg(wind_ned);
  const double now = link_->clock().steadySeconds();
  const std::vector<core::DatarefWrite> writes = core::windWrites(wind, version_);
  const bool all = sent_.size() != writes.size() || now >= send_all_at_;
  if (all) send_all_at_ = now + kRepeat;
  for (std::size_t i = 0; i < writes.size(); ++i) {
    if (all || writes[i].value != sent_[i].value) link_->write(writes[i].dataref, writes[i].value);
  }
  sent_ = writes;
}

/// Whether no frame has come for so long that this process may have hung.
bool DisturbanceManager::isQuiet() const { return link_->clock().steadySeconds() - framed_at_ > kGap; }

/// By the guardian or another client: the journal has no entry any more, as far as it can be read.
bool DisturbanceManager::isPutBackByAnother() const {
  const auto journal = link_->journal();
  try {
    return journal && !core::ownEntry(*journal, kEntry);
  } catch (const core::JournalError&) {
    return false;
  }
}

void DisturbanceManager::putBack() {
  const auto journal = link_->journal();
  if (restores_.empty() || !journal) return;
  const bool noted = !isPutBackByAnother();
  if (!noted && sent_frames_ == noted_frames_) {
    restores_.clear();
    return;
  }
  try {
    if (!up_ || unsure_) {
      times_put_back_ = 0;
      return journal->leave({kEntry}, "X-Plane went first");
    }
    bool all_sent = true;
    for (const core::UndoOperation& operation : restores_) {
      if (link_->sendUndo(operation) != core::SendStatus::kSent) all_sent = false;
    }
    put_back_again_at_ = link_->clock().steadySeconds() + kRepeat;
    if (noted) noted_frames_ = sent_frames_;
    if (all_sent) ++times_put_back_;
    if (times_put_back_ < kTimesPutBack) return;
    journal->remove({kEntry});
    restores_.clear();
  } catch (const core::JournalError& error) {
    report_(error.what(), who_, false);
  }
}

void DisturbanceManager::end(const std::string& result, bool success, PutBack when) {
  const bool began = label_.active;
  state_ = State::kIdle;
  disturbance_.reset();
  if (when == PutBack::kNow) putBack();
  label_.active = false;
  label_.model = label_.commanded = Eigen::Vector3d::Zero();
  label_.wind_speed = label_.steady.norm();
  label_.wind_from_deg = core::windFromDirectionDeg(label_.steady);
  if (began) label_.end_sim_time = label_.sim_time;
  label_.result = result;
  publish();
  report_(described(label_) + ": " + result, who_, success);
}

/// The journal has lost its entry. Frames may have changed the wind since, but not if the guardian was it: then
/// onHang() comes first.
void DisturbanceManager::endAsPutBack() {
  put_back_again_at_ = link_->clock().steadySeconds() + kHangWait;
  end("aborted: another client has put the wind back", false, PutBack::kLater);
}

void DisturbanceManager::onHang() {
  const Lock lock(mutex_);
  // What was sent before the hang is what the guardian has put back.
  if (isQuiet() && isPutBackByAnother()) noted_frames_ = sent_frames_;
  state_ == State::kIdle ? putBack() : end("aborted: tx_node hung", false);
}

bool DisturbanceManager::abort(const std::string& why) {
  const Lock lock(mutex_);
  if (state_ == State::kIdle) return false;
  end("aborted: " + why, false);
  return true;
}

void DisturbanceManager::stop(const std::string& why) {
  const Lock lock(mutex_);
  ended_ = true;
  abort(why);
  if (up_) putBack();
}

void DisturbanceManager::onLink(const core::LinkStatus& status) {
  const Lock lock(mutex_);
  const bool was_up = up_;
  up_ = isThere(status);
  const bool another = status.epoch != epoch_;
  epoch_ = status.epoch;
  if (another && !restores_.empty()) unsure_ = true;
  if (!up_) {
    abort("X-Plane is lost");
    return;
  }
  if (another) abort("X-Plane began anew");
  if (!was_up && !unsure_ && state_ == State::kIdle) putBack();
}

void DisturbanceManager::forget() {
  const Lock lock(mutex_);
  const bool noted = !restores_.empty();
  restores_.clear();
  unsure_ = false;
  abort("X-Plane was restarted");
  const auto journal = link_->journal();
  if (!noted || !journal) return;
  try {
    journal->remove({kEntry});
  } catch (const core::JournalError& error) {
    report_(error.what(), who_, false);
  }
}

void DisturbanceManager::watch() {
  std::unique_lock<core::HandlerMutex> lock(mutex_);
  const double now = link_->clock().steadySeconds();
  if (state_ == State::kIdle && up_ && !unsure_ && now >= put_back_again_at_) putBack();
  const auto journal = link_->journal();
  if (state_ != State::kRunning || !journal || now < looked_at_ + kRepeat) return;
  looked_at_ = now;
  const std::uint32_t id = label_.id;
  const unsigned frames = sent_frames_;
  lock.unlock();  // another process may hold the journal
  const bool noted = core::ownEntry(*journal, kEntry).has_value();
  lock.lock();
  if (state_ != State::kRunning || id != label_.id) return;
  if (noted) {
    noted_frames_ = frames;
  } else {
    endAsPutBack();
  }
}

std::string DisturbanceManager::windRefusal() {
  const Lock lock(mutex_);
  if (state_ == State::kIdle) {
    if (up_ && unsure_) return kNotYet;
    if (up_) putBack();
    return "";
  }
  return described(label_) + ", sets the wind: wait for its end, or call disturb with kind stop";
}

DisturbanceLabel DisturbanceManager::label() const {
  const Lock lock(mutex_);
  return label_;
}

void DisturbanceManager::publish() const {
  const Lock lock(mutex_);
  publish_(label_);
}

}  // namespace xplane_bridge
