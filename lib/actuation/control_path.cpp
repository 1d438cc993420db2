#include "xplane_bridge/actuation/control_path.hpp"

#include <utility>

#include "xplane_bridge/actuation/link_condition.hpp"
#include "xplane_bridge/core/base/text.hpp"

namespace xplane_bridge {
namespace {

constexpr double kOverrideRefresh = 1.0;  // [s] a lost datagram must not leave the stick with X-Plane
constexpr double kSameFlight = 1.0;       // [s] by which a flight may seem to have run on too far in a gap
constexpr double kGap = 0.4;              // [s] without a frame in which X-Plane may have been restarted

/// Whether each axis of a test signal is excited. Of the levers one is enough: not every engine's is commanded.
bool everyAxisExcited(const core::ChannelSet& channels, std::uint32_t excited) {
  bool levers = false;
  for (std::size_t i = 0; i < core::kChannelCount; ++i) {
    if (!channels.test(i)) continue;
    const auto channel = static_cast<core::Channel>(i);
    if (core::isLever(channel)) {
      levers = true;
    } else if ((excited & core::fieldOf(channel)) == 0u) {
      return false;
    }
  }
  return !levers || (excited & (core::kFieldThrottle | core::kFieldEngineThrottles)) != 0u;
}

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
      encoder_(core::EncoderOptions{{}, options.reverse_thrust, options.rows}) {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  arbiter_.setTimeRunning(false, now());
  settle();
  publishMode();
}

double ControlPath::now() const { return link_->clock().steadySeconds(); }

// --- the standing ---

/// The one place that decides on the standing. Called whenever something that it follows from has changed.
void ControlPath::settle() {
  const bool away = link_status_.state == core::LinkState::kSearching || link_status_.state == core::LinkState::kLost;
  const bool fits = this->fits(aircraft_);
  const bool was_given_back = standing_ == Standing::kSuspended || standing_ == Standing::kWaitingForMode ||
                              standing_ == Standing::kWrongAircraft;
  if (away) {
    standing_ = Standing::kNotConnected;
    why_not_ = "X-Plane is not connected";
  } else if (!flight_shown_) {
    standing_ = Standing::kNotConnected;
    why_not_ = "X-Plane is back, but has not shown its flight yet";
  } else if (!aircraft_shown_ && !options_.aircraft.empty()) {
    standing_ = Standing::kNotConnected;
    why_not_ = "X-Plane is back, but has not shown which aircraft is loaded yet";
  } else if (!suspension_.empty()) {
    standing_ = Standing::kSuspended;
    why_not_ = suspension_;
  } else if (!halted_.empty()) {
    standing_ = Standing::kWaitingForMode;
    why_not_ = halted_ + ": ask for a mode to fly on";
  } else if (!fits && aircraft_ == core::AircraftIdentity{}) {
    standing_ = Standing::kWrongAircraft;
    why_not_ = "X-Plane has not reported which aircraft is loaded";
  } else if (!fits) {
    standing_ = Standing::kWrongAircraft;
    why_not_ = "the aircraft loaded is " + described(aircraft_) + ", but " + options_.aircraft_file + " is for " +
               core::join(options_.aircraft) + "; scripts/aircraft_config writes a file for the one that is loaded";
  } else {
    standing_ = Standing::kFlying;
    why_not_.clear();
  }
  if (standing_ == Standing::kFlying) {
    last_warning_.clear();
    if (was_given_back) {
      // Others may have flown since: a lever held at what was sent then would move by itself, and handles are not known
      // to be where they were sent.
      arbiter_.forgetSent(core::ChannelSet{}.set());
      forgetApplied();
    }
  } else {
    hooks_.end_excitation("nothing is sent: " + why_not_);
  }
}

/// Whether the arbiter's time goes on: while X-Plane runs, and through a hitch of it as long as the source that flies
/// goes on. One that has become silent with X-Plane waits for its frames.
bool ControlPath::timeRuns(double time) {
  if (link_status_.state == core::LinkState::kConnected) return true;
  if (link_status_.state != core::LinkState::kStale || link_status_.paused.value_or(false)) return false;
  const double silence = time - last_frame_;
  return silence <= options_.stale_after && time - lastCommandOf(arbiter_.status().mode) < 0.5 * silence;
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
  if (status.epoch != epoch && epoch != 0) flight_shown_ = aircraft_shown_ = false;
  arbiter_.setTimeRunning(timeRuns(now()), now());
  if (status.version.known() && status.version != encoder_.options().version) {
    encoder_ = core::ControlEncoder(core::EncoderOptions{status.version, options_.reverse_thrust, options_.rows});
    watched_.reset();
  }
  settle();
}

void ControlPath::onAircraft(const core::AircraftIdentity& aircraft) {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  aircraft_ = aircraft;
  aircraft_shown_ = true;
  overrides_->forgetShown();
  overrides_->forgetPreparations();
  askMissing();
  settle();
}

void ControlPath::onSameAircraft() {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  if (std::exchange(aircraft_shown_, true)) return;
  settle();
}

void ControlPath::onNewFlight(const std::string& how) {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  overrides_->forgetShown();
  forgetApplied();  // it has put the handles to its own start
  // Nor does it begin with levers where they were in the last one, unless a source goes on to command them.
  core::ChannelSet levers;
  for (int engine = 0; engine < core::kMaxEngines; ++engine) {
    levers.set(core::index(core::leverChannel(engine))).set(core::index(core::motorChannel(engine)));
  }
  arbiter_.forgetSent(levers);
  overrides_->forgetPreparations();
  endAuto(how, now());
}

/// A controller must not fly on in a flight that it does not know.
void ControlPath::endAuto(const std::string& why, double time) {
  const core::FlightMode before = arbiter_.status().mode;
  if (options_.resume_auto || before != core::FlightMode::kAuto) return;
  arbiter_.setMode(core::FlightMode::kManual, "tx_node", why + "; AUTO is off until it is asked for", time);
  afterModeChange(before);
  publishMode();
}

/// Whether a time of X-Plane's has run on since before the gap, and no further than the gap was long.
bool ControlPath::ranOn(double before, double after) const {
  const double longest = now() - last_frame_ + kSameFlight;
  return after >= before - core::kOvertaking && after <= before + longest;
}

/// Whether it is the flight of before the gap: both of X-Plane's times have run on.
bool ControlPath::continues(const core::FlightWatch& watch) const {
  const bool flight_time_known = std::isfinite(watch_.flight_time);
  return ranOn(watch_.sim_time, watch.sim_time) && (!flight_time_known || ranOn(watch_.flight_time, watch.flight_time));
}

/// Whether X-Plane was restarted, also where the link has bridged the gap: its total running time has run back, or is
/// no longer than the gap. One that is paused may have run for less than the gap: its times stand.
bool ControlPath::isAnotherXPlane(const core::FlightWatch& watch) const {
  if (!std::isfinite(watch_.sim_time)) return false;
  const double gap = now() - last_frame_;
  const auto stands = [](double before, double after) { return std::abs(after - before) <= core::kOvertaking; };
  const bool is_paused = stands(watch_.sim_time, watch.sim_time) &&
                         (!std::isfinite(watch_.flight_time) || stands(watch_.flight_time, watch.flight_time));
  return watch.sim_time < watch_.sim_time - core::kOvertaking || (gap > kGap && watch.sim_time <= gap && !is_paused);
}

bool ControlPath::showsAnother(const core::FlightWatch& watch) {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  // The flight's time does not show it: X-Plane is silent while it loads, and the flight begins anew.
  return isAnotherXPlane(watch) || (!flight_shown_ && !ranOn(watch_.sim_time, watch.sim_time));
}

void ControlPath::beginFlight() {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  last_frame_ = now();
  last_override_refresh_ = last_frame_;
}

void ControlPath::onFrame(const core::FlightWatch& watch) {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  const bool another = isAnotherXPlane(watch);
  const bool same_flight = !another && continues(watch);
  watch_ = watch;
  last_frame_ = now();
  if (another) aircraft_shown_ = false;
  if (!flight_shown_ || another) resetAfterReconnect(same_flight, last_frame_);
  // A test signal goes out with every frame, however rarely commands come, and so does its end.
  if (!options_.each_frame && (excited_ || hooks_.excitation().channels.any())) send(now());
}

void ControlPath::resetAfterReconnect(bool same_flight, double time) {
  flight_shown_ = true;
  settle();
  if (!same_flight) {
    endAuto("X-Plane was restarted", time);
    overrides_->forgetPreparations();
  }
  overrides_->forgetShown();
  forgetApplied();  // another X-Plane does not know where the handles are
  const core::ModeStatus& status = arbiter_.status();
  if (time - lastCommandOf(status.mode) <= options_.arbiter.command_timeout) {
    if (standing_ != Standing::kFlying) overrides_->setRequired({});  // it may have another aircraft
    overrides_->refresh();
    return;
  }
  // What flies now is silent, so X-Plane, which may be another one, is not taken over.
  const std::string silent = core::toString(status.mode) + std::string(" is not commanded");
  arbiter_.forgetCommands((status.since == time ? status.reason : "X-Plane came back") + "; " + silent, time);
  watchSurfaces();
  publishMode();
  overrides_->setRequired({});
}

void ControlPath::watchReleases() {
  const std::vector<std::string> released = overrides_->releasedByOthers();
  if (!released.empty()) onReleasedByAnother(released.front());
}

void ControlPath::onReleasedByAnother(const std::string& override_name) {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  halt("another client has released " + override_name, now());
}

void ControlPath::onGivenBack(const std::string& why) {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  const double time = now();
  const core::FlightMode before = arbiter_.status().mode;
  arbiter_.setMode(core::FlightMode::kManual, "tx_node", why + "; nothing is sent until a mode is asked for", time);
  afterModeChange(before);
  publishMode();
  halt(why, time);
}

void ControlPath::halt(const std::string& why, double time) {
  halted_ = why;
  settle();
  hooks_.release_surfaces(why_not_);
  hooks_.event(ControlPathHooks::Kind::kOverride, "nothing is sent any more: " + why_not_, "");
  send(time);
}

// --- commands ---

std::optional<core::CommandRefusal> ControlPath::command(core::FlightMode from, const core::ControlCommand& command) {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  const double time = now();
  const core::FlightMode before = arbiter_.status().mode;
  if (auto refusal = arbiter_.onCommand(from, command, time)) return refusal;
  lastCommandOf(from) = time;
  afterModeChange(before);
  if (from != arbiter_.status().mode) return std::nullopt;
  if (options_.each_frame) return std::nullopt;
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
    halted_.clear();
    settle();
  }
  afterModeChange(before);
  if (outcome == core::RequestOutcome::kChanged) {
    send(time);
  } else {
    publishMode();
  }
  return outcome;
}

std::string ControlPath::refusalOfSurfaces() {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  return standing_ == Standing::kFlying ? arbiter_.refusalOfSurfaces(now()) : why_not_;
}

void ControlPath::onSurfaceCommand(bool gives_back) {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  surfaces_fly_ = !gives_back;
  if (gives_back) {
    arbiter_.endSurfaces();
    return;
  }
  lastCommandOf(options_.arbiter.surfaces_source) = now();
  arbiter_.onSurfaces(now());
}

void ControlPath::watchFailsafe() {
  const core::ModeStatus& status = arbiter_.status();
  if (std::exchange(failsafe_, status.failsafe) == status.failsafe) return;
  const std::string mode = core::toString(status.mode);
  const std::string text =
      status.failsafe ? mode + ": failsafe: " + status.reason : mode + ": the failsafe ends: " + status.reason;
  hooks_.event(ControlPathHooks::Kind::kFailsafe, text, status.requested_by);
}

/// What the arbiter has ended ends before anything else is sent.
void ControlPath::watchSurfaces() {
  if (!surfaces_fly_ || arbiter_.surfacesFly()) return;
  surfaces_fly_ = false;
  hooks_.end_surface_commands();
}

void ControlPath::afterModeChange(core::FlightMode before) {
  const core::ModeStatus& status = arbiter_.status();
  if (status.mode == before) return;
  watchSurfaces();
  hooks_.end_excitation("the mode changed");
  hooks_.event(ControlPathHooks::Kind::kMode, std::string(core::toString(status.mode)) + ": " + status.reason,
               status.requested_by);
}

void ControlPath::tick() {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  const double time = now();
  arbiter_.setTimeRunning(timeRuns(time), time);
  watchReleases();
  if (link_status_.up() && time - last_override_refresh_ > kOverrideRefresh) {
    overrides_->refresh();
    last_override_refresh_ = time;
  }
  if (options_.each_frame) {
    send(time);
  } else if (command_waits_ && link_->clock().steady_ns() >= next_command_ns_) {
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
  core::ArbitratedControls controls = withoutMissing(arbiter_.step(time, excitation));
  watchSurfaces();
  watchFailsafe();
  excited_ = controls.excited != 0u;
  if (!everyAxisExcited(excitation.channels, controls.excited)) {
    hooks_.end_excitation("the commands of the axis have ended");
  }
  publishMode();
  std::array<double, 3> stick{std::nan(""), std::nan(""), std::nan("")};
  if (fly(&controls, time)) {
    const core::Channel axes[] = {core::Channel::kRoll, core::Channel::kPitch, core::Channel::kYaw};
    for (std::size_t i = 0; i < stick.size(); ++i) {
      if (controls.active.test(core::index(axes[i]))) stick[i] = controls.values[core::index(axes[i])];
    }
  }
  hooks_.stick(stick);
}

void ControlPath::publishMode() {
  const core::ModeStatus& status = arbiter_.status();
  if (published_revision_ == status.revision) return;
  published_revision_ = status.revision;
  hooks_.mode(status, watch_.sim_time);
}

// --- what is ---

bool ControlPath::fits(const core::AircraftIdentity& aircraft) const {
  return options_.aircraft.empty() || core::isListed(aircraft, options_.aircraft);
}

Standing ControlPath::standing() const {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  return standing_;
}

std::string ControlPath::refusal() const {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  return why_not_;
}

std::optional<RequestResult> ControlPath::requestRefusal() const {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  if (why_not_.empty()) return std::nullopt;
  const bool away = standing_ == Standing::kNotConnected;
  return RequestResult{away ? core::ResultCode::kNoLink : core::ResultCode::kRefused, why_not_};
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
  return standing_ == Standing::kFlying ? arbiter_.commanded() & ~missingChannels() : core::ChannelSet{};
}

}  // namespace xplane_bridge
