#include "xplane_bridge/actuation/actuation.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "xplane_bridge/actuation/link_condition.hpp"
#include "xplane_bridge/actuation/pausing.hpp"

namespace xplane_bridge {
namespace {

using Lock = std::lock_guard<core::HandlerMutex>;
using core::EventKind;

constexpr double kIdentityReadTimeout = 2.0;  // [s] of asking for it once
constexpr double kLeastUndo = 0.2;            // [s] for the view, however long the overrides took
constexpr double kSuspensionWait = 1.0;       // [s] until everything must be given back

}  // namespace

Actuation::Actuation(core::SimulatorPort* link, const ActuationOptions& options, ActuationHooks hooks)
    : link_(link),
      options_(options),
      hooks_(std::move(hooks)),
      overrides_(link, [this](const std::string& text,
                              bool success) { say(EventKind::kOverride, "overrides: " + text, "", success); }),
      surfaces_(
          link, &overrides_, options.surfaces,
          [this](const std::string& text, bool success) { say(EventKind::kOverride, text, "", success); },
          [this] { onSurfaces(); }),
      failures_(link, &overrides_, &surfaces_, options.service_timeout, hooks_.failures, saying(EventKind::kFailure)),
      excitation_(&surfaces_, options.max_roll_deg, options.max_pitch_deg, hooks_.excitation,
                  saying(EventKind::kExcitation)),
      identification_(&surfaces_, &excitation_, options.max_roll_deg, options.max_pitch_deg,
                      [this](std::uint32_t number, const std::string& text, const std::string& who, bool success) {
                        hooks_.event({EventKind::kSetting, text, who, success, false, number, sim_time_});
                      }),
      path_(link, &overrides_, options.control, pathHooks(), mutex_),
      settings_(link, &overrides_, options.service_timeout, saying(EventKind::kSetting)),
      views_(link, saying(EventKind::kSetting)),
      traffic_(link, &overrides_, options.traffic,
               [this](const std::string& text, bool success) { say(EventKind::kSetting, text, "", success); }),
      disturbance_(link, kOverridePurpose, hooks_.disturbance, saying(EventKind::kSetting)),
      releases_(link, &overrides_, hooks_.journal_problem, options.turns, [this] { disturbance_.watch(); }),
      jobs_(
          link, options.flight, changeHooks(),
          [this](std::uint32_t number, const FlightChangeOutcome& outcome, const std::string& who) {
            hooks_.event({outcome.kind, outcome.text, who, outcome.success, false, number, sim_time_});
          },
          options.turns) {
  const Lock lock(*mutex_);
  subscribe();
}

// --- wiring ---

void Actuation::say(EventKind kind, const std::string& text, const std::string& who, bool success) {
  hooks_.event({kind, text, who, success, false, 0, sim_time_});
}

std::function<void(const std::string&, const std::string&, bool)> Actuation::saying(EventKind kind) {
  return [this, kind](const std::string& text, const std::string& who, bool success) { say(kind, text, who, success); };
}

ControlPathHooks Actuation::pathHooks() {
  ControlPathHooks hooks;
  hooks.mode = hooks_.mode;
  hooks.applied = [this](const AppliedControls& applied) { hooks_.applied(applied, surfaces_.individuallyDriven()); };
  hooks.stick = [this](const std::array<double, 3>& stick) { surfaces_.setStick(stick); };
  hooks.excitation = [this] { return excitation_.excitation(); };
  hooks.end_excitation = [this](const std::string& why) { endSignals(why); };
  hooks.release_surfaces = [this](const std::string& why) { surfaces_.release(why); };
  hooks.end_surface_commands = [this] { surfaces_.endCommands(); };
  hooks.event = [this](ControlPathHooks::Kind kind, const std::string& text, const std::string& who) {
    using Kind = ControlPathHooks::Kind;
    const EventKind shown = kind == Kind::kOverride  ? EventKind::kOverride
                            : kind == Kind::kMissing ? EventKind::kAircraft
                                                     : EventKind::kMode;
    hooks_.event({shown, text, who, kind != Kind::kMissing, kind == Kind::kFailsafe, 0, sim_time_});
  };
  hooks.warn = hooks_.warn;
  return hooks;
}

FlightChangeHooks Actuation::changeHooks() {
  FlightChangeHooks hooks;
  hooks.watch = [this] {
    const Lock lock(*mutex_);
    return watch_;
  };
  hooks.resets = [this] {
    const Lock lock(*mutex_);
    return resets_;
  };
  hooks.placed = [this] {
    const Lock lock(*mutex_);
    onReset("the aircraft was placed");
  };
  hooks.identities = [this] {
    const Lock lock(*mutex_);
    return identity_.answers();
  };
  hooks.aircraft = [this] {
    const Lock lock(*mutex_);
    return described(identity_.identity());
  };
  hooks.suspend_control = [this](const std::string& reason) { suspend(reason); };
  hooks.pausing = [this](const std::string& who) { setPausing(who); };
  hooks.overrides = [this] {
    const Lock lock(*mutex_);
    return overrides_.active();
  };
  hooks.pause_left = [this] { releases_.lookAgain(); };
  return hooks;
}

void Actuation::subscribe() {
  watch_subscription_ = link_->subscribe(
      {"flight watch", core::flightWatchDatarefs(), core::kEveryFrameRateHz, 2},
      [this](const core::RrefView& view, const core::ReceiveInfo& info) {
        // By the frame's own epoch: onLink() may come after it.
        if (std::exchange(watch_epoch_, info.link_epoch) != info.link_epoch) reset_detector_.forgetPlace();
        onWatch(view);
      },
      mutex_);
  identity_subscription_ = link_->subscribe(
      {"aircraft identity", core::AircraftIdentityReader::datarefs(), core::AircraftIdentityReader::kRateHz, 1},
      [this](const core::RrefView& view, const core::ReceiveInfo& info) {
        onCharacters([&] { return identity_.add(view, info.stamp_ns); });
      },
      mutex_);
}

// --- what X-Plane shows ---

void Actuation::onLink(const core::LinkStatus& status) {
  surfaces_.onLink(status);
  std::string text;
  std::optional<std::string> pause_by;
  {
    const Lock lock(*mutex_);
    if (status.paused && link_status_.paused && status.paused != link_status_.paused) {
      pause_by = std::exchange(pause_by_, "");
    }
    if (status.state != link_status_.state) text = std::string(core::toString(status.state)) + ": " + status.reason;
    if (status.epoch != link_status_.epoch) {
      identity_.reset();
      traffic_.release("X-Plane began anew");
    }
    if (!status.up()) jobs_.onEffect();
    link_status_ = status;
    failures_.onLink(status);
    path_.onLink(status);
    disturbance_.onLink(status);
  }
  releases_.wake();
  if (!text.empty()) say(EventKind::kLink, text);
  if (pause_by) say(EventKind::kPause, *status.paused ? "paused" : "resumed", *pause_by);
}

void Actuation::onWatch(const core::RrefView& view) {
  const bool crashed = watch_.crashed;
  const double before = watch_.sim_time;
  core::updateFlightWatch(view, &watch_);
  const bool another = path_.showsAnother(watch_);
  // Restarted within a gap that the link has bridged: total running time only runs back in another X-Plane.
  if (watch_.sim_time < before - core::kOvertaking) {
    reset_detector_.restart();
    askIdentity();
  }
  if (const auto reset = reset_detector_.add(watch_)) onReset(*reset);
  sim_time_ = watch_.sim_time;
  if (watch_.sim_time > before) ++frames_flown_;
  if (another) {
    failures_.onRestart();
    jobs_.forgetSettings();
    views_.forget();
    disturbance_.forget();
    traffic_.release("X-Plane was restarted");
  }
  failures_.onFrame(watch_, jobs_.placing());
  excitation_.onFrame(watch_);
  disturbance_.onFrame(watch_);
  if (identification_.running()) identification_.onFrame(watch_, conditions());
  path_.onFrame(watch_);
  if (watch_.crashed && !crashed) {
    endSignals("the aircraft has crashed");
    disturbance_.abort("the aircraft has crashed");
    say(EventKind::kCrash, "the aircraft has crashed");
  }
}

void Actuation::onSurfaces() {
  const Lock lock(*mutex_);
  if (surfaces_.takeReleasedByAnother()) path_.onReleasedByAnother(core::kSurfaceOverride);
  while (const auto echo = surfaces_.takeEcho()) {
    hooks_.surfaces_applied(*echo, path_.mode().mode, surfaces_.individuallyDriven());
  }
}

/// `add` takes them; returns whether they are those of another aircraft.
void Actuation::onCharacters(const std::function<bool()>& add) {
  const unsigned answers = identity_.answers();
  if (add()) {
    onIdentity();
  } else if (identity_.answers() != answers) {
    path_.onSameAircraft();
  }
}

void Actuation::onIdentity() {
  const core::AircraftIdentity& loaded = identity_.identity();
  path_.onAircraft(loaded);
  const bool fits = path_.fits(loaded);
  say(EventKind::kAircraft, "aircraft: " + described(loaded) + (fits ? "" : "; not the one of the configuration"),
      jobs_.movingCaller());
  endSignals("another aircraft was loaded");
  surfaces_.onAircraft(loaded.icao.empty() ? loaded.description : loaded.icao, loaded.icao + " " + loaded.description);
}

void Actuation::askIdentity() {
  link_->read(core::AircraftIdentityReader::datarefs(), kIdentityReadTimeout,
              [this](const std::vector<core::DatarefValue>& values) {
                const Lock lock(*mutex_);
                onCharacters([&] { return identity_.add(values); });
              });
}

void Actuation::onReset(const std::string& how) {
  ++resets_;
  jobs_.onEffect();
  endSignals("the flight was reset");
  disturbance_.abort("the flight was reset");
  path_.onNewFlight(how);
  // Perhaps with another aircraft, which must not be flown until the subscription shows which.
  askIdentity();
  // A requested reset is published with its outcome.
  if (jobs_.movingCaller().empty()) say(EventKind::kReset, how);
}

// --- what drives it ---

void Actuation::tick() {
  const Lock lock(*mutex_);
  surfaces_.tick(path_.requestRefusal());
  failures_.tick();
  path_.tick();
  traffic_.tick(sim_time_);
}

void Actuation::onHang() {
  const Lock lock(*mutex_);
  overrides_.giveBackAll();
  failures_.repaired("tx_node hung");
  traffic_.forget();
  disturbance_.onHang();
  path_.onGivenBack("tx_node hung, and its guardian has given back what it had set");
}

void Actuation::beginFlight() {
  surfaces_.restart();
  path_.beginFlight();
  publish();
}

void Actuation::stop() {
  {
    const Lock lock(*mutex_);
    endSignals("tx_node ends");
  }
  traffic_.release("tx_node ends");
  disturbance_.stop("tx_node ends");
  jobs_.stop();
  releases_.stop();
  surfaces_.stop();
  failures_.stop();
}

bool Actuation::undo(double timeout) {
  jobs_.restoreSettings();
  const core::Deadline deadline(link_->clock(), timeout);
  const bool released = overrides_.releaseAll(timeout);  // the aircraft first
  if (released) failures_.repaired("tx_node ends");
  return views_.giveBack(std::max(deadline.left(), kLeastUndo)) && released;
}

void Actuation::publish() {
  const Lock lock(*mutex_);
  hooks_.mode(path_.mode(), sim_time_);
  failures_.publish();
  excitation_.publish();
  disturbance_.publish();
}

// --- requests ---

std::string Actuation::commandSurfaces(const std::vector<std::string>& names, const std::vector<float>& deflections_deg,
                                       std::uint32_t sequence) {
  const Lock lock(*mutex_);
  const bool gives_back = names.empty();
  std::string refusal = gives_back ? "" : path_.refusalOfSurfaces();
  if (refusal.empty()) {
    refusal = surfaces_.command(names, deflections_deg, sequence).value_or("");
  } else {
    surfaces_.refuseCommand(refusal);
  }
  if (refusal.empty()) path_.onSurfaceCommand(gives_back);
  return refusal;
}

Actuation::Injected Actuation::inject(const ExcitationRequest& request, const std::string& who) {
  const ExcitationManager::Plan plan = excitation_.plan(request);
  const Lock lock(*mutex_);
  surfaces_.tick(path_.requestRefusal());
  if (identification_.running() && plan.wrong.empty()) {
    if (!plan.signals.empty()) {
      return {{core::ResultCode::kRefused,
               "identify_surfaces runs: wait for event " + std::to_string(identification_.number()) + ", or stop it"},
              excitation_.label().id};
    }
    endSignals("stopped by " + who);
    return {{core::ResultCode::kAccepted, "identify_surfaces is stopped"}, excitation_.label().id};
  }
  RequestResult result = excitation_.inject(request, plan, who, watch_, path_.requestRefusal(), path_.commanded());
  return {std::move(result), excitation_.label().id};
}

/// Test signals, those of an identification included.
void Actuation::endSignals(const std::string& why) {
  identification_.abort(why);
  excitation_.abort(why);
}

Actuation::Disturbed Actuation::disturb(const std::string& kind, core::DisturbanceSpec spec, const std::string& who) {
  const auto answer = [this](core::ResultCode code, std::string text) {
    return Disturbed{{code, std::move(text)}, disturbance_.label().id};
  };
  if (kind == "stop") {
    if (!disturbance_.abort("stopped by " + who)) return answer(core::ResultCode::kRefused, "no disturbance runs");
    return answer(core::ResultCode::kAccepted, "it is stopped, and the wind of before is put back");
  }
  const auto known = core::disturbanceKindFrom(kind);
  if (!known) {
    return answer(core::ResultCode::kRefused,
                  "kind is \"" + kind + "\"; expected " + core::kDisturbanceKindWords + " or stop");
  }
  spec.kind = *known;
  if (const auto wrong = core::check(spec)) return answer(core::ResultCode::kRefused, *wrong);
  if (const auto refusal = core::refusalBy(spec)) return answer(core::ResultCode::kNotSupported, *refusal);
  if (const auto refusal = jobs_.refusal()) return answer(refusal->code, refusal->text);
  if (jobs_.busy()) {
    return answer(core::ResultCode::kRefused, "a change of the flight or its weather is under way: wait for its event");
  }
  const std::string refusal = disturbance_.begin(spec, who);
  if (!refusal.empty()) return answer(core::ResultCode::kRefused, refusal);
  return answer(core::ResultCode::kAccepted,
                "it begins when X-Plane has shown its weather; disturbance/state reports it");
}

std::optional<RequestResult> Actuation::windRefusal() {
  const std::string why = disturbance_.windRefusal();
  if (why.empty()) return std::nullopt;
  return RequestResult{core::ResultCode::kRefused, why};
}

IdentificationConditions Actuation::conditions() const {
  return {path_.requestRefusal(), path_.mode().failsafe, failures_.brokenControls(), path_.commanded()};
}

Actuation::Identifying Actuation::identifySurfaces(const IdentificationRequest& request, const std::string& who,
                                                   const std::function<std::uint32_t()>& reserve) {
  const Lock lock(*mutex_);
  surfaces_.tick(path_.requestRefusal());
  if (link_status_.paused.value_or(false)) {
    return {{core::ResultCode::kRefused, "X-Plane is paused: let it run first"}, 0};
  }
  RequestResult result = identification_.begin(request, who, watch_, conditions(), reserve);
  const bool begun = result.code == core::ResultCode::kAccepted;
  return {std::move(result), begun ? identification_.number() : 0};
}

RequestResult Actuation::setPaused(bool paused, const std::string& who) {
  if (link_->inLockstep()) {
    return {core::ResultCode::kNotSupported, "in lock-step the simulator stands between frames: call lockstep/hold"};
  }
  // What X-Plane shows meanwhile is the pause of the reset itself, which ends with it.
  if (jobs_.resets()) return {core::ResultCode::kRefused, "reset_flight runs: wait for its event"};
  const core::LinkStatus status = link_->status();
  if (!status.up() || !status.paused) return noLink();
  const PauseOutcome outcome = xplane_bridge::setPaused(link_, paused, options_.service_timeout, hooks_.stopping,
                                                        [this, &who] { setPausing(who); });
  if (outcome == PauseOutcome::kWasSo || outcome == PauseOutcome::kFollowed) {
    return {core::ResultCode::kOk, paused ? "paused" : "running"};  // published as an event when it happened
  }
  const std::string text = outcome == PauseOutcome::kUnknown ? "X-Plane does not report whether it is paused"
                                                             : "X-Plane did not follow in time";
  setPausing("");
  say(EventKind::kPause, (paused ? "pause asked for: " : "resume asked for: ") + text, who, false);
  return {core::ResultCode::kTimeout, text};
}

void Actuation::setPausing(const std::string& who) {
  const Lock lock(*mutex_);
  pause_by_ = who;
}

/// For a job that loads something: nothing is flown until it is called without a reason.
void Actuation::suspend(const std::string& reason) {
  if (reason.empty()) return path_.resume();
  path_.suspend(reason);
  link_->waitUntil([this] { return !(surfaces_.driving() || overrides_.releasesPending()); }, kSuspensionWait);
}

// --- what is ---

bool Actuation::knowsFlight() const {
  const Lock lock(*mutex_);
  return link_status_.version.known() && std::isfinite(watch_.sim_time) && identity_.answers() > 0;
}

ControlSnapshot Actuation::control() const {
  const Lock lock(*mutex_);
  ControlSnapshot out;
  out.mode = path_.mode();
  out.standing = path_.standing();
  out.refusal = path_.refusal();
  out.not_followed = path_.notFollowed();
  out.received = {path_.statistics(core::FlightMode::kManual), path_.statistics(core::FlightMode::kAuto)};
  out.overrides = overrides_.active();
  out.aircraft = identity_.identity().icao;
  return out;
}

}  // namespace xplane_bridge
