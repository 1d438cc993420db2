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

constexpr double kOverrideRefresh = 1.0;  // [s] a lost datagram must not leave the stick with X-Plane
constexpr double kHandleRepeat = 0.3;     // [s] in which a changed handle is sent with every refresh
constexpr std::size_t kUnseenKept = 64;   // two frames of 200 commands and 20 frames a second, three times
constexpr double kWorkPeriod = 0.2;       // [s]
constexpr double kReleaseWait = 1.0;      // [s] of one attempt
constexpr double kRestartStep = 0.25;  // [s] backwards in total running time, more than datagrams overtake each other
constexpr double kIdentityWait = 2.0;  // [s] of asking for it once

}  // namespace

double TxNode::now() const { return clock().steadySeconds(); }

void TxNode::loadParameters(const ParamLoader& own) {
  options_ = loadTxOptions(own, common().aircraft);
  arbiter_ = std::make_unique<core::ControlArbiter>(options_.arbiter, now());
  arbiter_->setFlowing(false, now());
  encoder_ = std::make_unique<core::ControlEncoder>(core::EncoderOptions{{}, options_.aircraft.reverse_thrust});
}

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
  addTimer(1.0 / options_.rate, [this] { onTimer(); });
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
  {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    subscribeToXPlane();
    publishMode();
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

void TxNode::onCommand(core::FlightMode from, const ControlCommand& message) {
  const double time = now();
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  const core::FlightMode before = arbiter_->status().mode;
  if (const auto refusal = arbiter_->onCommand(from, toCore(message), time)) {
    ROS_WARN_THROTTLE(1.0, "control/%s is refused: %s", from == core::FlightMode::kManual ? "manual" : "auto",
                      refusal->text.c_str());
    return;
  }
  last_command_ = time;
  if (arbiter_->status().mode != before) onModeChange();
  if (from != arbiter_->status().mode) return;
  if (time - last_send_ < 1.0 / options_.max_rate) {
    send_pending_ = true;  // the timer takes it
    return;
  }
  sendControls(time);
}

void TxNode::onModeRequest(const ModeRequest& message) {
  const double time = now();
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  const core::FlightMode before = arbiter_->status().mode;
  const auto outcome =
      arbiter_->onModeRequest({message.sequence, message.mode, message.requester, message.header.stamp.toSec()}, time);
  if (outcome == core::RequestOutcome::kIgnored) return;
  if (outcome != core::RequestOutcome::kRefused) released_.clear();
  if (arbiter_->status().mode != before) {
    onModeChange();
    sendControls(time);
  } else {
    publishMode();
  }
}

void TxNode::onModeChange() {
  const core::ModeStatus& status = arbiter_->status();
  if (excitation_) excitation_->abort("the mode changed");
  logEvent(Event::MODE, std::string(core::toString(status.mode)) + ": " + status.reason, status.requested_by);
}

void TxNode::onTimer() {
  const double time = now();
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  if (!overrides_) return;
  const std::string refusal = refusalToFly();
  surfaces_->tick(refusal);
  if (!refusal.empty()) excitation_->abort("nothing is sent: " + refusal);
  failures_->tick();
  if (came_back_) startAfresh(time);
  watchReleases(time);
  if (linkIsUp() && time - last_refresh_ > kOverrideRefresh) {
    overrides_->refresh();
    last_refresh_ = time;
  }
  if (!send_pending_ && time - last_send_ < 0.5 / options_.rate) return;
  sendControls(time);
}

void TxNode::watchReleases(double time) {
  try {
    const std::vector<std::string> released = overrides_->releasedByOthers();
    if (released.empty()) return;
    released_ = "somebody else has released " + released.front() + ": ask for a mode to fly on";
  } catch (const core::JournalError& error) {
    ROS_ERROR_THROTTLE(5.0, "%s", error.what());
    return;
  }
  excitation_->abort(released_);
  surfaces_->release(released_);  // they would stand still: nothing is sent any more
  logEvent(Event::OVERRIDE, "nothing is sent any more: " + released_);
  sendControls(time);
}

void TxNode::startAfresh(double time) {
  came_back_ = false;
  overrides_->forgetShown();
  unseen_.clear();
  ever_sent_.reset();  // another X-Plane does not know where the handles are
  if (time - last_command_ <= options_.arbiter.command_timeout) {
    overrides_->refresh();
    return;
  }
  // Nobody flies any more, so X-Plane, which may be another one now, is not taken over.
  const core::FlightMode mode = arbiter_->status().mode;
  core::ArbiterOptions options = options_.arbiter;
  options.initial_mode = mode;
  arbiter_ = std::make_unique<core::ControlArbiter>(options, time);
  arbiter_->setFlowing(link_status_.state == core::LinkState::kConnected, time);
  published_revision_.reset();
  overrides_->setRequired({});
}

std::string TxNode::refusalToFly() const {
  if (link_status_.state == core::LinkState::kSearching || link_status_.state == core::LinkState::kLost) {
    return "X-Plane is not connected";
  }
  if (!grounded_.empty()) return grounded_;
  if (!released_.empty()) return released_;
  if (options_.aircraft.identity.empty()) return "";
  if (!identity_.known()) return "X-Plane has not told which aircraft is loaded";
  if (options_.aircraft.fits(identity_.identity())) return "";
  return "the aircraft loaded is " + described(identity_.identity()) + ", but config/aircraft/" + common().aircraft +
         ".yaml is for " + core::join(options_.aircraft.identity);
}

core::ChannelSet TxNode::channelsToSend(const core::ArbitratedControls& controls, double time) {
  core::ChannelSet out;
  for (std::size_t i = 0; i < core::kChannelCount; ++i) {
    if (!controls.active.test(i)) continue;
    const auto channel = static_cast<core::Channel>(i);
    if (core::channelWire(channel, encoder_->options()).refresh == core::Refresh::kOnChange) {
      if (!ever_sent_.test(i) || last_values_[i] != controls.values[i]) changed_at_[i] = time;
      last_values_[i] = controls.values[i];
      // Said a few times, because a datagram may be lost; then it may be moved in the cockpit.
      if (time - changed_at_[i] > kHandleRepeat) continue;
    }
    ever_sent_.set(i);
    out.set(i);
  }
  return out;
}

void TxNode::sendControls(double time) {
  send_pending_ = false;
  const core::ArbitratedControls& controls =
      arbiter_->step(time, excitation_ ? excitation_->excitation() : core::ChannelExcitation{});
  const core::ChannelSet excited = excitation_ ? excitation_->channels() : core::ChannelSet{};
  if (excited.any() && ((excited & controls.active).none() || arbiter_->status().failsafe)) {
    excitation_->abort("nobody commands the axis any more");
    arbiter_->step(time);  // `controls` without it
  }
  publishMode();
  if (overrides_) setCommandedStick(fly(controls, time) ? &controls : nullptr);
}

bool TxNode::fly(const core::ArbitratedControls& controls, double time) {
  if (controls.active.none()) return false;
  const std::string refusal = refusalToFly();
  if (refusal != refusal_said_) {
    refusal_said_ = refusal;
    if (!refusal.empty()) ROS_WARN("commands are not sent: %s", refusal.c_str());
  }
  try {
    if (!refusal.empty()) {
      if (linkIsUp()) overrides_->setRequired({});
      return false;
    }
    overrides_->setRequired(core::requiredOverrides(controls.active, encoder_->options()));
  } catch (const core::JournalError& error) {
    ROS_ERROR_THROTTLE(5.0, "commands are not sent, because overrides could not be given back after a crash: %s",
                       error.what());
    return false;
  }
  writes_.clear();
  encoder_->encode(controls.values, channelsToSend(controls, time), writes_);
  for (const core::DatarefWrite& write : writes_) link().write(write.dataref, write.value);
  last_send_ = time;
  publishApplied(controls, time);
  watchReadBack(controls.active);
  return true;
}

void TxNode::publishMode() {
  const core::ModeStatus& status = arbiter_->status();
  if (published_revision_ == status.revision) return;
  ControlMode message;
  message.header.stamp = stampNow();
  message.mode = static_cast<std::uint8_t>(status.mode);
  message.previous = status.previous ? static_cast<std::uint8_t>(*status.previous) : std::uint8_t{0};
  message.requested_by = status.requested_by;
  message.reason = status.reason;
  message.request_sequence = status.request_sequence;
  message.accepted = status.accepted;
  message.sim_time = static_cast<float>(watch_.sim_time);
  message.manual_alive = status.manual_alive;
  message.auto_alive = status.auto_alive;
  message.failsafe = status.failsafe;
  mode_publisher_.publish(message);
  published_revision_ = status.revision;
}

void TxNode::publishApplied(const core::ArbitratedControls& controls, double time) {
  Sent sent;
  toMessage(controls, &sent.message);
  sent.message.header.stamp = stampNow();
  fillSurfaces(surfaces_->individuallyDriven(), &sent.message);
  sent.message.read_back_sim_time = std::nanf("");
  sent.message.read_back_frames = std::nanf("");
  sent.values = controls.values;
  sent.channels = controls.active;
  sent.sim_time = watch_.sim_time;
  sent.time = time;
  applied_publisher_.publish(sent.message);
  unseen_.push_back(std::move(sent));
  if (unseen_.size() > kUnseenKept) unseen_.pop_front();
}

void TxNode::watchReadBack(const core::ChannelSet& channels) {
  if (channels == read_back_channels_) return;
  read_back_channels_ = channels;
  read_back_order_.clear();
  shown_known_.reset();
  core::RrefGroup group{"read-back", {core::flightWatchDatarefs().front()}, core::kEveryFrameRateHz, 1};
  for (std::size_t i = 0; i < core::kChannelCount; ++i) {
    if (!channels.test(i)) continue;
    read_back_order_.push_back(static_cast<core::Channel>(i));
    group.datarefs.push_back(core::readBackDataref(static_cast<core::Channel>(i), encoder_->options()));
  }
  if (read_back_subscription_) {
    read_back_subscription_.replace(std::move(group));
  } else {
    read_back_subscription_ = link().subscribe(
        std::move(group), [this](const core::RrefView& view, const core::ReceiveInfo&) { onReadBack(view); }, mutex_);
  }
}

void TxNode::onLinkState(const core::LinkStatus& status) {
  surfaces_->onLink(status);
  std::string text;
  std::optional<std::string> pause_by;
  {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    const double time = now();
    if (status.paused && link_status_.paused && status.paused != link_status_.paused) {
      pause_by = std::exchange(pause_by_, "");
    }
    if (status.state != link_status_.state) text = std::string(core::toString(status.state)) + ": " + status.reason;
    if (status.epoch != link_status_.epoch) {
      identity_.reset();
      reset_detector_.restart();
      if (status.epoch > 1) came_back_ = true;
    }
    link_status_ = status;
    failures_->onLink(status);
    if (status.state == core::LinkState::kLost) excitation_->abort("the link is lost");
    arbiter_->setFlowing(status.state == core::LinkState::kConnected, time);
    if (status.version.known() && status.version != encoder_->options().version) {
      encoder_ = std::make_unique<core::ControlEncoder>(
          core::EncoderOptions{status.version, options_.aircraft.reverse_thrust});
      read_back_channels_.reset();
    }
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
  if (watch_.sim_time < before - kRestartStep) {
    came_back_ = true;
    reset_detector_.restart();
  }
  if (const auto reset = reset_detector_.add(watch_)) onReset(*reset);
  sim_time_ = watch_.sim_time;
  failures_->onFrame(watch_);
  // The signal goes out with every frame, however rarely commands come.
  if (excitation_->onFrame(watch_)) sendControls(now());
  if (watch_.crashed && !crashed) {
    excitation_->abort("the aircraft has crashed");
    logEvent(Event::CRASH, "the aircraft has crashed");
  }
}

void TxNode::onIdentity() {
  const core::AircraftIdentity& loaded = identity_.identity();
  overrides_->forgetShown();
  logEvent(
      Event::AIRCRAFT,
      "aircraft: " + described(loaded) + (options_.aircraft.fits(loaded) ? "" : "; not the one of the configuration"),
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
  overrides_->forgetShown();
  // Perhaps with another aircraft, which must not be flown until the subscription tells.
  askIdentity();
  // What was asked for is told with its outcome.
  if (!jobs_ || jobs_->mover().empty()) logEvent(Event::RESET, how);
}

void TxNode::onReadBack(const core::RrefView& view) {
  double sim_time = watch_.sim_time;
  for (std::size_t i = 0; i < view.size(); ++i) {
    const core::RrefPair pair = view[i];
    if (pair.index == 0) sim_time = static_cast<double>(pair.value);
    if (pair.index < 1 || static_cast<std::size_t>(pair.index) > read_back_order_.size()) continue;
    const std::size_t channel = core::index(read_back_order_[static_cast<std::size_t>(pair.index) - 1]);
    shown_[channel] = static_cast<double>(pair.value);
    shown_known_.set(channel);
  }
  // The newest that fits: older ones were overtaken.
  for (auto it = unseen_.rbegin(); it != unseen_.rend(); ++it) {
    bool all = true;
    for (std::size_t i = 0; i < core::kChannelCount && all; ++i) {
      if (!it->channels.test(i)) continue;
      all = shown_known_.test(i) && encoder_->shows(static_cast<core::Channel>(i), it->values[i], shown_[i]);
    }
    // What stood there before the command reached X-Plane is not its doing.
    const bool too_early = link_status_.state != core::LinkState::kPaused && sim_time <= it->sim_time;
    if (!all || too_early) continue;
    AppliedCommand message = it->message;
    message.read_back = true;
    message.read_back_sim_time = static_cast<float>(sim_time);
    message.read_back_frames = static_cast<float>((sim_time - it->sim_time) / watch_.frame_period);
    applied_publisher_.publish(message);
    last_seen_ = now();
    unseen_.erase(unseen_.begin(), it.base());
    return;
  }
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
  publishMode();
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
