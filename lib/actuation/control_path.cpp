#include "xplane_bridge/actuation/control_path.hpp"

#include <algorithm>
#include <utility>

#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/core/link/journal.hpp"

namespace xplane_bridge {
namespace {

constexpr double kOverrideRefresh = 1.0;  // [s] a lost datagram must not leave the stick with X-Plane
constexpr double kHandleRepeat = 0.3;     // [s] in which a changed handle is sent with every refresh
constexpr double kDoesNotFollow = 1.0;    // [s] without read-back until it is said
constexpr std::size_t kUnseenKept = 64;   // two frames of 200 commands and 20 frames a second, three times

}  // namespace

const char* toString(Standing standing) {
  switch (standing) {
    case Standing::kFlying:
      return "flying";
    case Standing::kWrongAircraft:
      return "wrong aircraft";
    case Standing::kWaitingForMode:
      return "waiting for a mode";
    case Standing::kSuspended:
      return "suspended";
    case Standing::kNotConnected:
      return "not connected";
  }
  return "";
}

ControlPath::ControlPath(core::SimulatorPort* link, OverrideManager* overrides, const ControlPathOptions& options,
                         ControlPathHooks hooks, std::shared_ptr<core::HandlerMutex> mutex)
    : link_(link),
      overrides_(overrides),
      options_(options),
      hooks_(std::move(hooks)),
      mutex_(std::move(mutex)),
      arbiter_(options.arbiter, now()),
      encoder_(core::EncoderOptions{{}, options.reverse_thrust}) {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  arbiter_.setFlowing(false, now());
  settle();
  sayMode();
}

double ControlPath::now() const { return link_->clock().steadySeconds(); }

bool ControlPath::isUp() const {
  return link_status_.state == core::LinkState::kConnected || link_status_.state == core::LinkState::kPaused;
}

// --- the standing ---

/// The one place that decides on the standing. Called whenever something that it follows from has changed.
void ControlPath::settle() {
  const bool away = link_status_.state == core::LinkState::kSearching || link_status_.state == core::LinkState::kLost;
  const bool fits = this->fits(aircraft_);
  if (away) {
    standing_ = Standing::kNotConnected;
    why_not_ = "X-Plane is not connected";
  } else if (!flight_shown_) {
    standing_ = Standing::kNotConnected;
    why_not_ = "X-Plane is back, but has not shown its flight yet";
  } else if (!suspension_.empty()) {
    standing_ = Standing::kSuspended;
    why_not_ = suspension_;
  } else if (!released_.empty()) {
    standing_ = Standing::kWaitingForMode;
    why_not_ = "another client has released " + released_ + ": ask for a mode to fly on";
  } else if (!fits && aircraft_ == core::AircraftIdentity{}) {
    standing_ = Standing::kWrongAircraft;
    why_not_ = "X-Plane has not told which aircraft is loaded";
  } else if (!fits) {
    standing_ = Standing::kWrongAircraft;
    why_not_ = "the aircraft loaded is " + described(aircraft_) + ", but " + options_.aircraft_file + " is for " +
               core::join(options_.aircraft);
  } else {
    standing_ = Standing::kFlying;
    why_not_.clear();
  }
  if (standing_ == Standing::kFlying) {
    said_.clear();
  } else {
    hooks_.end_excitation("nothing is sent: " + why_not_);
  }
}

void ControlPath::suspend(const std::string& why) {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  suspension_ = why;
  hooks_.end_excitation(why);
  hooks_.release_surfaces(why);
  settle();
  send(now());
}

void ControlPath::resume() {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  suspension_.clear();
  settle();
}

void ControlPath::onLink(const core::LinkStatus& status) {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  const std::uint32_t epoch = std::exchange(link_status_, status).epoch;
  // X-Plane has come back, or another one has come: which, its first frame shows.
  if (status.epoch != epoch && epoch != 0) flight_shown_ = false;
  arbiter_.setFlowing(status.state == core::LinkState::kConnected, now());
  if (status.version.known() && status.version != encoder_.options().version) {
    encoder_ = core::ControlEncoder(core::EncoderOptions{status.version, options_.reverse_thrust});
    watched_.reset();
  }
  settle();
}

void ControlPath::onAircraft(const core::AircraftIdentity& aircraft) {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  aircraft_ = aircraft;
  overrides_->forgetShown();
  settle();
}

void ControlPath::onNewFlight() {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  overrides_->forgetShown();
}

void ControlPath::onFrame(const core::FlightWatch& watch) {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  // Total running time only runs back in another X-Plane, also where the link has bridged the gap.
  const bool ran_back = watch.sim_time < watch_.sim_time - core::kOvertaking;
  watch_ = watch;
  if (!flight_shown_ || ran_back) comeBack(now());
  // A test signal goes out with every frame, however rarely commands come, and so does its end.
  if (excited_ || hooks_.excitation().channels.any()) send(now());
}

void ControlPath::comeBack(double time) {
  flight_shown_ = true;
  settle();
  overrides_->forgetShown();
  unseen_.clear();
  ever_sent_.reset();  // another X-Plane does not know where the handles are
  if (time - last_command_ <= options_.arbiter.command_timeout) {
    overrides_->refresh();
    return;
  }
  // Nobody flies any more, so X-Plane, which may be another one now, is not taken over.
  arbiter_.forgetCommands("X-Plane came back and nobody commanded it", time);
  sayMode();
  overrides_->setRequired({});
}

void ControlPath::watchReleases() {
  const std::vector<std::string> released = overrides_->releasedByOthers();
  if (released.empty()) return;
  released_ = released.front();
  settle();
  hooks_.release_surfaces(why_not_);
  hooks_.event(ControlPathHooks::Kind::kOverride, "nothing is sent any more: " + why_not_, "");
  send(now());
}

// --- commands ---

std::optional<core::CommandRefusal> ControlPath::command(core::FlightMode from, const core::ControlCommand& command) {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  const double time = now();
  const core::FlightMode before = arbiter_.status().mode;
  if (auto refusal = arbiter_.onCommand(from, command, time)) return refusal;
  last_command_ = time;
  afterModeChange(before);
  if (from != arbiter_.status().mode) return std::nullopt;
  if (link_->clock().steady_ns() < next_command_ns_) {
    command_waits_ = true;
    return std::nullopt;
  }
  sendCommand(time);
  return std::nullopt;
}

core::RequestOutcome ControlPath::requestMode(const core::ModeRequest& request) {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  const double time = now();
  const core::FlightMode before = arbiter_.status().mode;
  const core::RequestOutcome outcome = arbiter_.onModeRequest(request, time);
  if (outcome == core::RequestOutcome::kIgnored) return outcome;
  if (outcome != core::RequestOutcome::kRefused) {
    released_.clear();
    settle();
  }
  afterModeChange(before);
  if (outcome == core::RequestOutcome::kChanged) {
    send(time);
  } else {
    sayMode();
  }
  return outcome;
}

void ControlPath::afterModeChange(core::FlightMode before) {
  const core::ModeStatus& status = arbiter_.status();
  if (status.mode == before) return;
  hooks_.end_excitation("the mode changed");
  hooks_.event(ControlPathHooks::Kind::kMode, std::string(core::toString(status.mode)) + ": " + status.reason,
               status.requested_by);
}

void ControlPath::tick() {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  const double time = now();
  watchReleases();
  if (isUp() && time - last_override_refresh_ > kOverrideRefresh) {
    overrides_->refresh();
    last_override_refresh_ = time;
  }
  if (command_waits_ && link_->clock().steady_ns() >= next_command_ns_) {
    sendCommand(time);
  } else if (time - last_send_ >= 0.5 / options_.rate) {
    send(time);
  }
}

std::optional<std::int64_t> ControlPath::deadline() const {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  return command_waits_ ? std::optional<std::int64_t>(next_command_ns_) : std::nullopt;
}

/// Only commands count for `max_rate`: a refresh just before one does not hold it up.
void ControlPath::sendCommand(double time) {
  next_command_ns_ = link_->clock().steady_ns() + core::toNanoseconds(1.0 / options_.max_rate);
  send(time);
}

/// The one way down. Whatever it is called for, the newest command goes with it.
void ControlPath::send(double time) {
  command_waits_ = false;
  const core::ChannelExcitation excitation = hooks_.excitation();
  const core::ArbitratedControls& controls = arbiter_.step(time, excitation);
  excited_ = controls.excited != 0u;
  if (excitation.channels.any() && !excited_) hooks_.end_excitation("nobody commands the axis any more");
  sayMode();
  std::array<double, 3> stick{std::nan(""), std::nan(""), std::nan("")};
  if (fly(controls, time)) {
    const core::Channel axes[] = {core::Channel::kRoll, core::Channel::kPitch, core::Channel::kYaw};
    for (std::size_t i = 0; i < stick.size(); ++i) {
      if (controls.active.test(core::index(axes[i]))) stick[i] = controls.values[core::index(axes[i])];
    }
  }
  hooks_.stick(stick);
}

bool ControlPath::fly(const core::ArbitratedControls& controls, double time) {
  if (controls.active.none()) return false;
  try {
    if (standing_ != Standing::kFlying) {
      if (std::exchange(said_, why_not_) != why_not_) hooks_.warn("commands are not sent: " + why_not_);
      if (isUp()) overrides_->setRequired({});
      return false;
    }
    overrides_->setRequired(core::requiredOverrides(controls.active, encoder_.options()));
    said_.clear();
  } catch (const core::JournalError& error) {
    const std::string why = std::string("overrides could not be given back after a crash: ") + error.what();
    if (std::exchange(said_, why) != why) hooks_.warn("commands are not sent, because " + why);
    return false;
  }
  writes_.clear();
  encoder_.encode(controls.values, channelsToSend(controls, time), writes_);
  for (const core::DatarefWrite& write : writes_) link_->write(write.dataref, write.value);
  last_send_ = time;
  sayApplied(controls);
  watchReadBack(controls.active);
  return true;
}

core::ChannelSet ControlPath::channelsToSend(const core::ArbitratedControls& controls, double time) {
  core::ChannelSet out;
  for (std::size_t i = 0; i < core::kChannelCount; ++i) {
    if (!controls.active.test(i)) continue;
    const auto channel = static_cast<core::Channel>(i);
    if (core::channelWire(channel, encoder_.options()).refresh == core::Refresh::kOnChange) {
      if (!ever_sent_.test(i) || last_values_[i] != controls.values[i]) changed_at_[i] = time;
      last_values_[i] = controls.values[i];
      // Sent a few times, because a datagram may be lost; then it may be moved in the cockpit.
      if (time - changed_at_[i] > kHandleRepeat) continue;
    }
    ever_sent_.set(i);
    out.set(i);
  }
  return out;
}

void ControlPath::sayMode() {
  const core::ModeStatus& status = arbiter_.status();
  if (said_revision_ == status.revision) return;
  said_revision_ = status.revision;
  hooks_.mode(status, watch_.sim_time);
}

void ControlPath::sayApplied(const core::ArbitratedControls& controls) {
  AppliedControls applied;
  applied.controls = controls;
  applied.sent_ns = link_->clock().system_ns();
  applied.sim_time = watch_.sim_time;
  hooks_.applied(applied);
  if (unseen_.empty()) last_seen_ = now();  // until now there was nothing to show
  unseen_.push_back(std::move(applied));
  if (unseen_.size() > kUnseenKept) unseen_.pop_front();
}

// --- the way back ---

void ControlPath::watchReadBack(const core::ChannelSet& channels) {
  if (channels == watched_) return;
  watched_ = channels;
  watched_order_.clear();
  shown_known_.reset();
  core::RrefGroup group{"read-back", {core::flightWatchDatarefs().front()}, core::kEveryFrameRateHz, 1};
  for (std::size_t i = 0; i < core::kChannelCount; ++i) {
    if (!channels.test(i)) continue;
    watched_order_.push_back(static_cast<core::Channel>(i));
    group.datarefs.push_back(core::readBackDataref(static_cast<core::Channel>(i), encoder_.options()));
  }
  if (read_back_) {
    read_back_.replace(std::move(group));
  } else {
    read_back_ = link_->subscribe(
        std::move(group), [this](const core::RrefView& view, const core::ReceiveInfo&) { onReadBack(view); }, mutex_);
  }
}

void ControlPath::onReadBack(const core::RrefView& view) {
  double sim_time = watch_.sim_time;
  for (std::size_t i = 0; i < view.size(); ++i) {
    const core::RrefPair pair = view[i];
    if (pair.index == 0) sim_time = static_cast<double>(pair.value);
    if (pair.index < 1 || static_cast<std::size_t>(pair.index) > watched_order_.size()) continue;
    const std::size_t channel = core::index(watched_order_[static_cast<std::size_t>(pair.index) - 1]);
    shown_[channel] = static_cast<double>(pair.value);
    shown_known_.set(channel);
  }
  // The newest that fits: older ones were overtaken.
  for (auto it = unseen_.rbegin(); it != unseen_.rend(); ++it) {
    bool all = true;
    for (std::size_t i = 0; i < core::kChannelCount && all; ++i) {
      if (!it->controls.active.test(i)) continue;
      all = shown_known_.test(i) && encoder_.shows(static_cast<core::Channel>(i), it->controls.values[i], shown_[i]);
    }
    // What stood there before the command reached X-Plane is not its doing.
    const bool too_early = link_status_.state != core::LinkState::kPaused && sim_time <= it->sim_time;
    if (!all || too_early) continue;
    it->read_back = true;
    it->read_back_sim_time = sim_time;
    it->read_back_frames = (sim_time - it->sim_time) / watch_.frame_period;
    hooks_.applied(*it);
    last_seen_ = now();
    unseen_.erase(unseen_.begin(), it.base());
    return;
  }
}

// --- what is ---

bool ControlPath::fits(const core::AircraftIdentity& aircraft) const {
  const std::vector<std::string>& codes = options_.aircraft;
  return codes.empty() || std::find(codes.begin(), codes.end(), aircraft.icao) != codes.end();
}

Standing ControlPath::standing() const {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  return standing_;
}

std::string ControlPath::refusal() const {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  return why_not_;
}

core::ModeStatus ControlPath::mode() const {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  return arbiter_.status();
}

core::SourceStatistics ControlPath::statistics(core::FlightMode source) const {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  return arbiter_.statistics(source);
}

core::ChannelSet ControlPath::commanded() const {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  return standing_ == Standing::kFlying ? arbiter_.commanded() : core::ChannelSet{};
}

std::vector<std::string> ControlPath::notFollowed() const {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  std::vector<std::string> out;
  if (unseen_.empty() || link_status_.state != core::LinkState::kConnected || now() - last_seen_ <= kDoesNotFollow) {
    return out;
  }
  const core::ArbitratedControls& last = unseen_.back().controls;
  for (std::size_t i = 0; i < core::kChannelCount; ++i) {
    const auto channel = static_cast<core::Channel>(i);
    if (!last.active.test(i) || (shown_known_.test(i) && encoder_.shows(channel, last.values[i], shown_[i]))) continue;
    out.push_back(core::channelName(channel));
  }
  return out;
}

}  // namespace xplane_bridge
