#include "xplane_bridge/nodes/tx/tx_node.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "xplane_bridge/ControlMode.h"
#include "xplane_bridge/Event.h"
#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/core/link/journal.hpp"
#include "xplane_bridge/nodes/messages/control_conversions.hpp"

namespace xplane_bridge {
namespace {

constexpr double kWorkPeriod = 0.2;    // [s]
constexpr double kReleaseWait = 1.0;   // [s] of one attempt
constexpr double kIdentityWait = 2.0;  // [s] of asking for it once

}  // namespace

void TxNode::loadParameters(const ParamLoader& own) { options_ = loadTxOptions(own, common().aircraft); }

void TxNode::advertise() {
  events_.start(advertiseTopic<EventList>("events", 1, true), clock());
  mode_publisher_ = advertiseTopic<ControlMode>("control/mode", 10, true);
  applied_publisher_ = advertiseTopic<AppliedCommand>("control/applied", 100);
  failure_publisher_ = advertiseTopic<FailureState>("failures/state", 10, true);
  excitation_publisher_ = advertiseTopic<ExcitationState>("excitation/state", 10, true);
  advertiseServices();
  addDiagnostics("control", [this](diagnostic_updater::DiagnosticStatusWrapper& status) { fillDiagnostics(&status); });
}

void TxNode::subscribe() {
  subscribeTopic<ControlCommand>("control/manual", 1, [this](const ControlCommandConstPtr& command) {
    onCommand(core::FlightMode::kManual, *command);
  });
  subscribeTopic<ControlCommand>("control/auto", 1, [this](const ControlCommandConstPtr& command) {
    onCommand(core::FlightMode::kAuto, *command);
  });
  // Requests are few and none may be lost.
  subscribeTopic<ModeRequest>("control/mode_request", 20,
                              [this](const ModeRequestConstPtr& request) { onModeRequest(*request); });
  subscribeTopic<SurfaceCommand>("control/surfaces", 1,
                                 [this](const SurfaceCommandConstPtr& command) { onSurfaceCommand(*command); });
  addTimer(1.0 / options_.control.rate, [this] { onTimer(); });
  deadline_ = addAlarm([this] { path_->tick(); });
}

core::SimLinkCallbacks TxNode::linkCallbacks() {
  core::SimLinkCallbacks callbacks;
  callbacks.on_state = [this](const core::LinkStatus& status) { onLinkState(status); };
  return callbacks;
}

void TxNode::start() {
  guardian_.start();
  overrides_ = std::make_unique<OverrideManager>(&link(), [this](const std::string& text, bool success) {
    logEvent(Event::OVERRIDE, "overrides: " + text, "", success);
  });
  makeSurfaceControl();
  makeControlPath();
  {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    subscribeToXPlane();
  }
  makeFlightJobs();
  worker_ = std::thread([this] { work(); });
}

void TxNode::subscribeToXPlane() {
  watch_subscription_ = link().subscribe(
      {"flight watch", core::flightWatchDatarefs(), core::kEveryFrameRateHz, 2},
      [this](const core::RrefView& view, const core::ReceiveInfo&) { onWatch(view); }, mutex_);
  identity_subscription_ = link().subscribe(
      {"aircraft identity", core::AircraftIdentityReader::datarefs(), core::AircraftIdentityReader::kRateHz, 1},
      [this](const core::RrefView& view, const core::ReceiveInfo& info) {
        if (identity_.add(view, info.stamp_ns)) onIdentity();
      },
      mutex_);
}

void TxNode::makeControlPath() {
  ControlPathHooks hooks;
  hooks.mode = [this](const core::ModeStatus& status, double sim_time) { publishMode(status, sim_time); };
  hooks.applied = [this](const AppliedControls& applied) { publishApplied(applied); };
  hooks.stick = [this](const std::array<double, 3>& stick) { surfaces_->setStick(stick); };
  hooks.excitation = [this] { return excitation_->excitation(); };
  hooks.end_excitation = [this](const std::string& why) { excitation_->abort(why); };
  hooks.release_surfaces = [this](const std::string& why) { surfaces_->release(why); };
  hooks.event = [this](ControlPathHooks::Kind kind, const std::string& text, const std::string& who) {
    logEvent(kind == ControlPathHooks::Kind::kMode ? Event::MODE : Event::OVERRIDE, text, who);
  };
  hooks.warn = [](const std::string& text) { ROS_WARN("%s", text.c_str()); };
  auto path = std::make_unique<ControlPath>(&link(), overrides_.get(), options_.control, std::move(hooks), mutex_);
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  path_ = std::move(path);
}

void TxNode::onCommand(core::FlightMode from, const ControlCommand& message) {
  if (const auto refusal = path_->command(from, toCore(message))) {
    ROS_WARN_THROTTLE(1.0, "control/%s is refused: %s", from == core::FlightMode::kManual ? "manual" : "auto",
                      refusal->text.c_str());
  } else if (const auto time_ns = path_->deadline()) {
    setAlarm(deadline_, *time_ns);
  }
}

core::RequestOutcome TxNode::onModeRequest(const ModeRequest& message) {
  return path_->requestMode({message.sequence, message.mode, message.requester, message.header.stamp.toSec()});
}

void TxNode::onTimer() {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  surfaces_->tick(path_->refusal());
  failures_->tick();
  path_->tick();
}

void TxNode::publishMode(const core::ModeStatus& status, double sim_time) {
  ControlMode message;
  message.header.stamp = stampNow();
  message.mode = static_cast<std::uint8_t>(status.mode);
  message.previous = status.previous ? static_cast<std::uint8_t>(*status.previous) : std::uint8_t{0};
  message.requested_by = status.requested_by;
  message.reason = status.reason;
  message.request_sequence = status.request_sequence;
  message.accepted = status.accepted;
  message.sim_time = static_cast<float>(sim_time);
  message.manual_alive = status.manual_alive;
  message.auto_alive = status.auto_alive;
  message.failsafe = status.failsafe;
  mode_publisher_.publish(message);
}

void TxNode::publishApplied(const AppliedControls& applied) {
  AppliedCommand message;
  message.header.stamp = toRosTime(applied.sent_ns);
  toMessage(applied.controls, &message);
  fillSurfaces(surfaces_->individuallyDriven(), &message);
  message.read_back = applied.read_back;
  message.read_back_sim_time = static_cast<float>(applied.read_back_sim_time);
  message.read_back_frames = static_cast<float>(applied.read_back_frames);
  applied_publisher_.publish(message);
}

void TxNode::onLinkState(const core::LinkStatus& status) {
  surfaces_->onLink(status);
  std::string text;
  std::optional<std::string> pause_by;
  {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    if (status.paused && link_status_.paused && status.paused != link_status_.paused) {
      pause_by = std::exchange(pause_by_, "");
    }
    if (status.state != link_status_.state) text = std::string(core::toString(status.state)) + ": " + status.reason;
    if (status.epoch != link_status_.epoch) {
      identity_.reset();
      reset_detector_.restart();
    }
    link_status_ = status;
    failures_->onLink(status);
    path_->onLink(status);
    const auto journal = link().journal();
    if (status.peer.valid() && journal) guardian_.setPeer(status.peer, journal->path());
    work_now_ = true;
    work_wanted_.notifyAll();
  }
  if (!text.empty()) logEvent(Event::LINK, text);
  if (pause_by) logEvent(Event::PAUSE, *status.paused ? "paused" : "resumed", *pause_by);
}

void TxNode::onWatch(const core::RrefView& view) {
  const bool crashed = watch_.crashed;
  const double before = watch_.sim_time;
  core::updateFlightWatch(view, &watch_);
  // Restarted within a gap that the link has bridged: total running time only runs back in another X-Plane.
  if (watch_.sim_time < before - core::kOvertaking) reset_detector_.restart();
  if (const auto reset = reset_detector_.add(watch_)) onReset(*reset);
  sim_time_ = watch_.sim_time;
  failures_->onFrame(watch_);
  excitation_->onFrame(watch_);
  path_->onFrame(watch_);
  if (watch_.crashed && !crashed) {
    excitation_->abort("the aircraft has crashed");
    logEvent(Event::CRASH, "the aircraft has crashed");
  }
}

void TxNode::onIdentity() {
  const core::AircraftIdentity& loaded = identity_.identity();
  path_->onAircraft(loaded);
  const bool fits = path_->fits(loaded);
  logEvent(Event::AIRCRAFT, "aircraft: " + described(loaded) + (fits ? "" : "; not the one of the configuration"),
           jobs_ ? jobs_->mover() : "");
  excitation_->abort("another aircraft was loaded");
  surfaces_->onAircraft(loaded.icao.empty() ? loaded.description : loaded.icao);
}

void TxNode::askIdentity() {
  link().read(core::AircraftIdentityReader::datarefs(), kIdentityWait,
              [this](const std::vector<core::DatarefValue>& values) {
                std::lock_guard<core::HandlerMutex> lock(*mutex_);
                if (identity_.add(values)) onIdentity();
              });
}

void TxNode::onReset(const std::string& how) {
  ++resets_;
  excitation_->abort("the flight was reset");
  path_->onNewFlight();
  // Perhaps with another aircraft, which must not be flown until the subscription tells.
  askIdentity();
  // What was asked for is told with its outcome.
  if (!jobs_ || jobs_->mover().empty()) logEvent(Event::RESET, how);
}

void TxNode::work() {
  std::unique_lock<core::HandlerMutex> lock(*mutex_);
  while (!worker_ends_) {
    work_wanted_.waitUntil(&lock, Deadline(clock(), kWorkPeriod), [this] { return worker_ends_ || work_now_; });
    work_now_ = false;
    if (worker_ends_ || !linkIsUp()) continue;
    const std::uint32_t epoch = link_status_.epoch;
    lock.unlock();
    try {
      if (leftovers_of_epoch_ != epoch && overrides_->releaseLeftovers(kReleaseWait)) leftovers_of_epoch_ = epoch;
      if (overrides_->releasesPending()) overrides_->confirmReleases(kReleaseWait);
    } catch (const core::JournalError& error) {
      ROS_ERROR_THROTTLE(5.0, "%s", error.what());
    }
    lock.lock();
  }
}

void TxNode::stopInputs() {
  {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    worker_ends_ = true;
    if (excitation_) excitation_->abort("tx_node ends");
  }
  if (jobs_) jobs_->stop();
  work_wanted_.notifyAll();
  if (worker_.joinable()) worker_.join();
  if (surfaces_) surfaces_->stop();
  if (failures_) failures_->stop();
}

void TxNode::undo(const Deadline& deadline) {
  if (!overrides_) return;
  // Left undone, the guardian tries once more, and the journal keeps it for the next start.
  if (!overrides_->releaseAll(std::max(0.1, deadline.left()))) return;
  guardian_.dismiss();
  failures_->repaired();
}

void TxNode::publishFinalState() {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  if (path_) publishMode(path_->mode(), sim_time_);
  if (failures_) failures_->publish();
  if (excitation_) excitation_->publish();
}

void TxNode::joinThreads() {}

bool TxNode::linkIsUp() const {
  return link_status_.state == core::LinkState::kConnected || link_status_.state == core::LinkState::kPaused;
}

std::uint32_t TxNode::logEvent(std::uint8_t kind, const std::string& text, const std::string& who, bool success,
                               std::uint32_t number) {
  if (success) {
    ROS_INFO("%s", text.c_str());
  } else {
    ROS_ERROR("%s", text.c_str());
  }
  return events_.add(kind, text, sim_time_, who, success, number);
}

}  // namespace xplane_bridge
