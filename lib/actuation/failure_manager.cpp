#include "xplane_bridge/actuation/failure_manager.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "xplane_bridge/actuation/link_condition.hpp"
#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/core/failures/failure_names.hpp"
#include "xplane_bridge/core/link/journal.hpp"

namespace xplane_bridge {
namespace {

constexpr std::int32_t kMenuRate = 1;   // [Hz] of all failure datarefs: what is set in the simulator's menu
constexpr std::int32_t kOwnRate = 20;   // [Hz] of those set here
constexpr double kPublishPeriod = 1.0;  // [s]
constexpr double kBehaviourDeg = 2.0;   // [deg] off that counts as obeyed
constexpr double kRepairedAfter = 0.5;  // [s] without it until a failure counts as repaired in the simulator
constexpr double kRepairWait = 0.5;     // [s] in which values from before a repair may still come
constexpr double kSendAgain = 0.3;      // [s] until what X-Plane does not show is sent once more
constexpr int kLockedAfterFrames = 3;   // of showing it: of the second one the surfaces have arrived by then

// Where X-Plane's own failure brings a surface; nullopt where the law does not give that.
std::optional<double> expectedAngle(const core::SurfaceFailure& failure, double shown,
                                    const std::optional<core::SurfaceLaw>& law) {
  switch (failure.fault) {
    case core::SurfaceFault::kStuck:
      return shown;
    case core::SurfaceFault::kHardOverUp:
      return law ? std::optional<double>(law->fullyUp()) : std::nullopt;
    case core::SurfaceFault::kHardOverDown:
      return law ? std::optional<double>(law->fullyDown()) : std::nullopt;
    case core::SurfaceFault::kCentred:
      return law ? std::optional<double>(law->neutral()) : std::nullopt;
    case core::SurfaceFault::kFloating:
    case core::SurfaceFault::kReduced:
    case core::SurfaceFault::kSlow:
    case core::SurfaceFault::kGone:
      return std::nullopt;
  }
  return std::nullopt;
}

}  // namespace

FailureManager::FailureManager(core::SimulatorPort* link, OverrideManager* overrides, SurfaceControl* surfaces,
                               double timeout, Publish publish, Report report)
    : link_(link),
      overrides_(overrides),
      surfaces_(surfaces),
      timeout_(timeout),
      publish_(std::move(publish)),
      report_(std::move(report)) {}

std::string FailureManager::described(const core::FailurePlan& plan) {
  std::string out = plan.name + " " + plan.kind;
  if (!plan.value) return out;
  char text[32];
  std::snprintf(text, sizeof text, " at %g", *plan.value);
  return out + text;
}

double FailureManager::now() const { return link_->clock().steadySeconds(); }

void FailureManager::onLink(const core::LinkStatus& status) {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  link_status_ = status;
  if (!status.version.known()) return;
  if (menu_subscription_ && status.version == version_) return;
  version_ = status.version;
  menu_datarefs_ = core::simulatorFailures(version_);
  watch(&menu_subscription_, {"failures", menu_datarefs_, kMenuRate, 0});
}

void FailureManager::watch(core::Subscription* subscription, core::RrefGroup group) {
  if (group.datarefs.empty()) {
    subscription->reset();
    return;
  }
  // The handler has its list, so that it names each value rightly.
  auto observed = [this, datarefs = group.datarefs](const core::RrefView& view, const core::ReceiveInfo&) {
    observe(datarefs, view);
  };
  *subscription = link_->subscribe(std::move(group), std::move(observed), mutex_);
}

void FailureManager::observe(const std::vector<std::string>& datarefs, const core::RrefView& view) {
  bool any = false;
  for (std::size_t i = 0; i < view.size(); ++i) {
    const core::RrefPair pair = view[i];
    if (pair.index < 0 || static_cast<std::size_t>(pair.index) >= datarefs.size()) continue;
    const std::string& dataref = datarefs[static_cast<std::size_t>(pair.index)];
    // Ignores values that were on their way when it was repaired here.
    const auto undone = undone_.find(dataref);
    if (undone != undone_.end() && now() - undone->second < kRepairWait) continue;
    const std::string name = core::failureName(dataref);
    const bool known = registry_.isOfMenu(name);
    if (!registry_.observe(dataref, static_cast<double>(pair.value), flight_.sim_time)) continue;
    any = true;
    if (known != registry_.isOfMenu(name)) {
      report_(known ? name + " was repaired in the simulator" : name + " was failed in the simulator", "", true);
    }
  }
  if (!any) return;
  dirty_ = true;
  applySurfaces();
}

void FailureManager::onFrame(const core::FlightWatch& watch, bool placing) {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  if (watch.sim_time > flight_.sim_time) countFrame();
  flight_ = {};
  flight_.sim_time = watch.sim_time;
  // A height or a speed that is not flown triggers nothing.
  if (!placing && !watch.replay && link_status_.state != core::LinkState::kPaused) {
    flight_.height_agl = watch.height_agl;
    flight_.indicated_airspeed = watch.indicated_airspeed;
  }
  replay_ = watch.replay;
  if (stopped_) return;
  for (const core::FailurePlan& plan : registry_.due(flight_)) carryOut(plan);
}

/// A moving surface gets stuck where it is when X-Plane locks it, some frames after it was asked to.
void FailureManager::countFrame() {
  for (auto& [name, pending] : pending_) {
    const auto& surface = pending.plan.surface;
    if (pending.confirmed < 0.0 || ++pending.frames_shown != kLockedAfterFrames) continue;
    if (!surface || surface->fault != core::SurfaceFault::kStuck) continue;
    pending.expected_deg = surfaces_->readBack(surface->surface);
  }
}

void FailureManager::onRestart() {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  if (!stopped_) end(false, "X-Plane was restarted");
}

void FailureManager::applySurfaces() {
  surfaces_->setFailures(registry_.drivenSurfaces());
  const auto labels = registry_.labels();
  surfaces_->setDisturbed(
      std::any_of(labels.begin(), labels.end(), [this](const core::FailureLabel& label) { return disturbs(label); }));
}

/// X-Plane itself keeps surfaces from following.
bool FailureManager::disturbs(const core::FailureLabel& label) const {
  const auto own = registry_.datarefsOf(label.name);
  return label.active &&
         (core::touchesSurfaces(label.name) || std::any_of(own.begin(), own.end(), core::touchesSurfaces));
}

std::string FailureManager::brokenControls() const {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  for (const core::FailureLabel& label : registry_.labels()) {
    if (!disturbs(label) && !(label.active && registry_.isDriven(label.name))) continue;
    return label.name + (label.by_bridge ? " is broken: clear_failures repairs it"
                                         : " is failed in the simulator: clear_failures with include_simulator "
                                           "repairs it");
  }
  return "";
}

void FailureManager::carryOut(const core::FailurePlan& plan) {
  dirty_ = true;
  Pending pending;
  pending.plan = plan;
  pending.who = asked_by_[plan.name];
  pending.since = pending.sent = now();
  if (plan.surface) {
    const double shown = surfaces_->readBack(plan.surface->surface);
    if (plan.surface->fault == core::SurfaceFault::kStuck && !plan.value) registry_.setValue(plan.name, shown);
    pending.expected_deg = expectedAngle(*plan.surface, shown, surfaces_->lawOf(plan.surface->surface));
  }
  try {
    for (const std::string& dataref : plan.datarefs) {
      overrides_->acquire(OverrideHolder::kFailures, dataref, static_cast<float>(core::kFailedNow), false);
      undone_.erase(dataref);
    }
  } catch (const core::JournalError& error) {
    giveUp(plan.name, core::whyNotChanged(error));
    return;
  }
  report_("failure: " + described(plan) + alsoBroken(plan), pending.who, true);
  pending_[plan.name] = pending;
  watchOwn();
  applySurfaces();
}

void FailureManager::watchOwn() {
  std::vector<std::string> datarefs;
  for (const auto& [name, pending] : pending_) {
    if (!registry_.isDriven(name)) {
      datarefs.insert(datarefs.end(), pending.plan.datarefs.begin(), pending.plan.datarefs.end());
    }
  }
  for (const core::FailureLabel& label : registry_.labels()) {
    if (!label.by_bridge || !label.active || pending_.count(label.name) != 0) continue;
    const auto own = registry_.datarefsOf(label.name);
    datarefs.insert(datarefs.end(), own.begin(), own.end());
  }
  if (datarefs == own_datarefs_) return;
  own_datarefs_ = datarefs;
  watch(&own_subscription_, {"failures set", own_datarefs_, kOwnRate, 1});
}

void FailureManager::undo(const core::FailurePlan& plan) {
  pending_.erase(plan.name);
  obeyed_.erase(plan.name);
  repaired_since_.erase(plan.name);
  repair(plan.datarefs);
}

void FailureManager::repair(const std::vector<std::string>& datarefs) {
  for (const std::string& dataref : datarefs) {
    try {
      overrides_->release(OverrideHolder::kFailures, dataref);
    } catch (const core::JournalError& error) {
      report_(error.what(), "", false);
    }
    undone_[dataref] = now();
    // One of the simulator's menu is not held.
    link_->write(dataref, static_cast<float>(core::kWorking));
  }
}

void FailureManager::giveUp(const std::string& name, const std::string& why) {
  for (const core::FailurePlan& plan : registry_.clear({name}, false).undo) undo(plan);
  not_shown_[name] = why;
  report_("failure of " + name + " is given up: " + why, asked_by_[name], false);
  dirty_ = true;
  watchOwn();
  applySurfaces();
}

void FailureManager::end(bool driven_only, const std::string& why) {
  for (const core::FailureLabel& label : registry_.labels()) {
    if (!label.by_bridge || (driven_only && !registry_.isDriven(label.name))) continue;
    for (const core::FailurePlan& plan : registry_.clear({label.name}, false).undo) undo(plan);
    not_shown_[label.name] = why;
    report_("failure of " + label.name + " has ended: " + why, "", true);
    dirty_ = true;
  }
  watchOwn();
  applySurfaces();  // which may have been given them again meanwhile
}

void FailureManager::useDriver(const Pending& pending) {
  repair(pending.plan.datarefs);
  registry_.useDriver(pending.plan.name, flight_.sim_time, pending.expected_deg);
  report_(pending.plan.name + ": X-Plane's own failure does not act as it says, so that tx_node drives the surfaces",
          pending.who, true);
  dirty_ = true;
  watchOwn();
  applySurfaces();
}

/// Better X-Plane's failure than none: it stays where the driver cannot take the surface, which is said.
bool FailureManager::staysXPlanes(const Pending& pending) {
  const auto refusal = surfaces_->refusalFor(pending.plan.surface->surface);
  if (!refusal) return false;
  std::string& why = not_shown_[pending.plan.name];
  why = "X-Plane's own failure does not act as it says, and tx_node cannot drive the surface: " + refusal->text;
  report_(pending.plan.name + ": " + why, pending.who, false);
  return true;
}

bool FailureManager::settled(Pending* pending) {
  const std::string name = pending->plan.name;  // a copy: giveUp() erases `pending`
  const auto settle = [this, pending, &name] {
    const auto& surface = pending->plan.surface;
    // Where it got stuck is known only now.
    if (surface && surface->fault == core::SurfaceFault::kStuck && !surface->value) {
      registry_.setValue(name, surfaces_->readBack(surface->surface));
    }
    return true;
  };
  const double age = now() - pending->since;
  if (registry_.isDriven(name)) {
    if (surfaces_->follows(pending->plan.surface->surface)) {
      registry_.confirm(name, true);
      return settle();
    }
    if (age < timeout_) return false;
    const std::string refusal = surfaces_->blockReason();
    giveUp(name, refusal.empty() ? "X-Plane does not show what is sent to the surface" : refusal);
    return true;
  }
  if (pending->confirmed < 0.0) {
    const auto labels = registry_.labels();
    const bool shown = std::any_of(labels.begin(), labels.end(), [&name](const core::FailureLabel& label) {
      return label.name == name && label.confirmed;
    });
    if (shown) {
      pending->confirmed = now();
    } else if (age <= timeout_) {
      if (now() - pending->sent < kSendAgain) return false;
      pending->sent = now();  // a datagram may have been lost
      for (const std::string& dataref : pending->plan.datarefs) {
        link_->write(dataref, static_cast<float>(core::kFailedNow));
      }
    } else {
      if (pending->plan.surface) {
        pending->since = now();
        useDriver(*pending);
        return false;
      }
      giveUp(name, "X-Plane does not show it");
      return true;
    }
    return false;
  }
  if (!pending->plan.surface || !pending->expected_deg) return settle();
  const double off = surfaces_->readBack(pending->plan.surface->surface) - *pending->expected_deg;
  if (now() - pending->confirmed < kBehaviourWait) return false;
  if (std::abs(off) <= kBehaviourDeg) {
    // A surface that stands still by itself looks stuck, until it moves.
    Obeyed& obeyed = obeyed_[name] = {*pending, now()};
    obeyed.failure.expected_deg = surfaces_->readBack(pending->plan.surface->surface);
    return settle();
  }
  if (staysXPlanes(*pending)) return true;
  pending->since = now();
  useDriver(*pending);
  return false;
}

void FailureManager::watchPending() {
  std::vector<std::string> names;
  for (const auto& [name, pending] : pending_) names.push_back(name);
  for (const std::string& name : names) {
    const auto it = pending_.find(name);
    if (it == pending_.end() || !settled(&it->second)) continue;
    pending_.erase(name);
    dirty_ = true;
  }
}

void FailureManager::watchObeyed() {
  std::vector<std::string> names;
  for (auto& [name, obeyed] : obeyed_) {
    const double off = surfaces_->readBack(obeyed.failure.plan.surface->surface) - *obeyed.failure.expected_deg;
    if (replay_ || !(std::abs(off) > kBehaviourDeg)) obeyed.last = now();
    if (now() - obeyed.last >= kBehaviourWait) names.push_back(name);
  }
  for (const std::string& name : names) {
    Pending pending = obeyed_.at(name).failure;
    pending.since = now();
    obeyed_.erase(name);
    if (staysXPlanes(pending)) continue;
    pending_[name] = pending;
    useDriver(pending);
  }
}

void FailureManager::watchRepairs() {
  for (const core::FailureLabel& label : registry_.labels()) {
    const bool ours = label.by_bridge && label.active && pending_.count(label.name) == 0;
    if (!ours || label.confirmed) {
      repaired_since_.erase(label.name);
      continue;
    }
    const auto since = repaired_since_.emplace(label.name, now()).first->second;
    if (now() - since < kRepairedAfter) continue;
    for (const core::FailurePlan& plan : registry_.clear({label.name}, false).undo) undo(plan);
    report_(label.name + " was repaired in the simulator", "", true);
    dirty_ = true;
    watchOwn();
    applySurfaces();
  }
}

void FailureManager::tick() {
  const auto abandoned = surfaces_->takeAbandoned();
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  const double time = now();
  if (abandoned) end(true, *abandoned);
  if (link_status_.state == core::LinkState::kConnected) {
    watchPending();
    watchRepairs();
    watchObeyed();
  } else {
    // Time stands still for what X-Plane has to show.
    for (auto& [name, pending] : pending_) {
      pending.since = time;
      if (pending.confirmed >= 0.0) pending.confirmed = time;
    }
    for (auto& [name, obeyed] : obeyed_) obeyed.last = time;
  }
  if (dirty_ || published_driving_ != surfaces_->driving() || time - publish_time_ >= kPublishPeriod) publishLocked();
}

void FailureManager::stop() {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  stopped_ = true;
}

void FailureManager::repaired(const std::string& why) {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  end(false, why);
}

void FailureManager::publish() {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  publishLocked();
}

FailureSnapshot FailureManager::snapshot() const {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  return snapshotLocked();
}

FailureSnapshot FailureManager::snapshotLocked() const {
  return {flight_.sim_time, registry_.labels(), surfaces_->driving(), surfaces_->lagFrames()};
}

void FailureManager::publishLocked() {
  const FailureSnapshot snapshot = snapshotLocked();
  published_driving_ = snapshot.surrogate_mixing;
  publish_time_ = now();
  dirty_ = false;
  publish_(snapshot);
}

}  // namespace xplane_bridge
