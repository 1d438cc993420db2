// FailureManager's requests: they are checked, carried out and waited for. What drives and watches failures:
// failure_manager.cpp.

#include <algorithm>
#include <cmath>

#include "xplane_bridge/actuation/failure_manager.hpp"
#include "xplane_bridge/actuation/link_condition.hpp"
#include "xplane_bridge/core/base/text.hpp"

namespace xplane_bridge {
namespace {

constexpr double kWaitSlack = 1.0;  // [s] a service waits beyond what ends by itself
constexpr double kReadWait = 0.5;   // [s] for one dataref, however late it is
constexpr const char* kNotNow = " cannot be broken now: ";

}  // namespace

std::optional<RequestResult> FailureManager::add(const core::FailureRequest& request, const std::string& who) {
  const auto planned = core::planFailure(request, version_);
  if (planned.error == core::FailureError::kInvalid) return RequestResult{core::ResultCode::kRefused, planned.text};
  if (planned.error != core::FailureError::kNone) return RequestResult{core::ResultCode::kNotSupported, planned.text};
  const std::string& name = planned.plan.name;
  if (const auto same = registry_.sameAs(planned.plan)) {
    return RequestResult{core::ResultCode::kRefused, name + " is broken already as " + *same + ": clear that first"};
  }
  if (request.trigger == static_cast<int>(core::FailureTrigger::kAtSimTime) && !std::isfinite(flight_.sim_time)) {
    return RequestResult{core::ResultCode::kNoLink, "X-Plane has not shown its time yet"};
  }
  // A failure of the same name is replaced; a surface that stays driven goes from where it is.
  for (const core::FailurePlan& plan : registry_.clear({name}, false).undo) undo(plan);
  not_shown_.erase(name);
  asked_by_[name] = who;
  registry_.add(request, planned.plan, flight_);
  dirty_ = true;
  if (request.trigger != 0) report_("failure armed: " + described(planned.plan), who, true);
  if (!stopped_) {
    for (const core::FailurePlan& plan : registry_.due(flight_)) carryOut(plan);
  }
  applySurfaces();
  return std::nullopt;
}

bool FailureManager::gone() const {
  // A short silence (STALE) is waited through: X-Plane loads scenery.
  return link_status_.state == core::LinkState::kLost || link_status_.state == core::LinkState::kSearching;
}

RequestResult FailureManager::await(const core::FailurePlan& plan) {
  const std::string& name = plan.name;
  const double longest = 2.0 * timeout_ + kBehaviourWait + kWaitSlack;
  const auto ended = [this, &name] {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    return stopped_ || pending_.count(name) == 0 || link_status_.state == core::LinkState::kPaused || gone();
  };
  if (!link_->waitUntil(ended, longest)) return {core::ResultCode::kTimeout, "X-Plane did not show it in time"};
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  // Not kNoLink, with which nothing has been done.
  if (stopped_) return {core::ResultCode::kTimeout, "tx_node ends before X-Plane has shown it"};
  if (gone()) return {core::ResultCode::kTimeout, "X-Plane went before it has shown it"};
  if (pending_.count(name) != 0) return {core::ResultCode::kAccepted, "X-Plane is paused: it acts when it goes on"};
  const auto why = not_shown_.find(name);
  if (why != not_shown_.end()) return {core::ResultCode::kTimeout, why->second};
  return {core::ResultCode::kOk, "X-Plane shows it" + (registry_.isDriven(name) ? "" : alsoBroken(plan))};
}

std::optional<RequestResult> FailureManager::unanswered(const core::FailurePlan& plan) {
  bool answered = !plan.datarefs.empty();
  if (answered) {
    const auto values = link_->read(plan.datarefs, timeout_);
    answered = std::all_of(values.begin(), values.end(), [](const auto& value) { return value.has_value(); });
  }
  if (answered) return std::nullopt;
  if (!link_->status().up()) return noLink();
  if (!plan.surface) {
    return RequestResult{core::ResultCode::kNotSupported,
                         "this X-Plane does not answer to " + plan.datarefs.front() + ": is the name right?"};
  }
  const auto refusal = surfaces_->refusalFor(plan.surface->surface);
  if (!refusal) return std::nullopt;
  return RequestResult{refusal->code, plan.name + kNotNow + refusal->text};
}

/// X-Plane's own failures are of all surfaces of a set on one side: the others of them that the aircraft has, as the
/// end of a sentence.
std::string FailureManager::alsoBroken(const core::FailurePlan& plan) const {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < core::surfaceTable().size() && !plan.datarefs.empty(); ++i) {
    const std::string& name = core::surfaceTable()[i].name;
    if (name == plan.name || !surfaces_->lawOf(i)) continue;
    const auto its = core::planFailure({name, plan.kind, plan.value, 0, 0.0}, version_);
    if (its.plan.datarefs == plan.datarefs) names.push_back(name);
  }
  return names.empty() ? "" : "; X-Plane breaks with it " + core::join(names);
}

RequestResult FailureManager::set(const core::FailureRequest& request, const std::string& who) {
  core::SimulatorVersion version;
  {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    if (!link_status_.up() || !link_status_.version.known()) {
      return {core::ResultCode::kNoLink, "X-Plane is not connected"};
    }
    version = version_;
  }
  const auto planned = core::planFailure(request, version);
  if (const auto surface = core::surfaceNumber(request.name); surface && planned.error == core::FailureError::kNone) {
    // X-Plane's own failure would break another one.
    const std::string why = surfaces_->unknownReason(*surface);
    if (!why.empty()) return {core::ResultCode::kRefused, request.name + kNotNow + why};
  }
  const bool waits = !link_->inLockstep();
  if (planned.error == core::FailureError::kNone && (waits || planned.plan.datarefs.empty())) {
    if (const auto refused = unanswered(planned.plan)) return *refused;
  }
  {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    if (const auto refused = add(request, who)) return *refused;
  }
  if (request.trigger != 0)
    return {core::ResultCode::kAccepted, "armed; published on events and failures/state when it comes true"};
  if (!waits)
    return {core::ResultCode::kAccepted, "sent; published on events and failures/state when X-Plane shows it"};
  return await(planned.plan);
}

FailureManager::ClearResult FailureManager::clear(const std::vector<std::string>& names, bool include_simulator,
                                                  const std::string& who) {
  ClearResult out;
  std::unique_lock<core::HandlerMutex> lock(*mutex_);
  std::vector<std::string> labels;
  for (const std::string& name : names) {
    labels.push_back(core::failureName(name));
    if (registry_.knows(labels.back())) continue;
    const std::string broken =
        core::join(registry_.labels(), ", ", [](const core::FailureLabel& label) { return label.name; });
    out.result = {core::ResultCode::kRefused,
                  "\"" + name + "\" is not broken: expected " + (broken.empty() ? "nothing, all is well" : broken)};
    return out;
  }
  const bool driven = surfaces_->driving();
  // What is written to an X-Plane that is away is lost; only what is held is written again.
  const bool up = link_status_.up();
  const auto cleared = registry_.clear(labels, include_simulator && up);
  std::vector<std::string> datarefs;
  for (const core::FailurePlan& plan : cleared.undo) {
    undo(plan);
    datarefs.insert(datarefs.end(), plan.datarefs.begin(), plan.datarefs.end());
  }
  for (const std::string& name : cleared.names) report_("cleared: " + name, who, true);
  out.cleared = cleared.names;
  dirty_ = true;
  watchOwn();
  applySurfaces();
  const bool given_back = driven && registry_.drivenSurfaces().empty();
  for (const std::string& name : labels) {
    if (include_simulator || !registry_.knows(name)) continue;
    out.result = {core::ResultCode::kRefused, name + " was failed in the simulator: set include_simulator"};
    return out;
  }
  lock.unlock();
  if (!up) {
    out.result = {core::ResultCode::kNoLink,
                  std::string("X-Plane is not connected; what the bridge has broken is repaired when it comes back") +
                      (include_simulator ? ", what was failed in the simulator has to be cleared then" : "")};
    return out;
  }
  if (link_->inLockstep()) {
    out.result = {core::ResultCode::kAccepted, "repaired; published on failures/state when X-Plane shows it"};
    return out;
  }
  out.result = awaitRepair(datarefs, given_back);
  if (out.result.code == core::ResultCode::kOk)
    out.result.text = cleared.names.empty() ? "nothing was broken" : "repaired";
  return out;
}

RequestResult FailureManager::awaitRepair(const std::vector<std::string>& datarefs, bool given_back) {
  const core::Deadline deadline(link_->clock(), timeout_);
  const auto left = [&deadline] { return std::max(deadline.left(), 0.01); };
  for (const std::string& dataref : datarefs) {
    if (link_->waitForDataref(dataref, static_cast<float>(core::kWorking), 0.0F, left()).first) continue;
    return {core::ResultCode::kTimeout, "X-Plane still shows " + dataref};
  }
  if (!given_back) return {};
  const auto back = [this] {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    return stopped_ || !surfaces_->givingBack() || link_status_.state == core::LinkState::kPaused;
  };
  const bool ended = link_->waitUntil(back, left());
  if (surfaces_->givingBack() && link_->status().state == core::LinkState::kPaused) {
    return {core::ResultCode::kAccepted, "repaired; X-Plane is paused: its surfaces run back when it goes on"};
  }
  // It also ends by being given up.
  if (!ended || (!surfaces_->driving() &&
                 !link_->waitForDataref(core::kSurfaceOverride, 0.0F, 0.0F, std::max(left(), kReadWait)).first)) {
    return {core::ResultCode::kTimeout, std::string("X-Plane still shows ") + core::kSurfaceOverride};
  }
  return {};
}

}  // namespace xplane_bridge
