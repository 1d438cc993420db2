#include "xplane_bridge/nodes/tx/lockstep_services.hpp"

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <utility>

#include "xplane_bridge/nodes/base/service_result.hpp"

namespace xplane_bridge {
namespace {

using Turn = std::lock_guard<core::TurnMutex>;

constexpr double kFrameWait = 5.0;  // [s] without a frame in which X-Plane counts as standing
constexpr const char* kNodeEnds = "tx_node ends";
constexpr const char* kReplaced = "another lockstep/step or lockstep/run has taken its place";

}  // namespace

LockstepServices::LockstepServices(TxLockstep* lockstep, Actuation* actuation, core::SimulatorPort* link,
                                   std::function<bool()> ending, std::string who)
    : lockstep_(lockstep), actuation_(*actuation), link_(*link), ending_(std::move(ending)), who_(std::move(who)) {}

void LockstepServices::step(const LockstepStep::Request& request, LockstepStep::Response* response) {
  lockstep_ != nullptr ? stepInLockstep(request, response) : stepFreely(request, response);
}

std::string LockstepServices::setRunning(bool running) {
  if (lockstep_ != nullptr) {
    if (running) {
      lockstep_->run();
    } else {
      lockstep_->step(0);
    }
    return "";
  }
  const Turn turn(turn_);
  note(!running);
  const RequestResult result = actuation_.setPaused(!running, who_);
  return result.success() ? "" : result.text;
}

std::uint64_t LockstepServices::note(bool holds) {
  last_holds_ = holds;
  return ++calls_;
}

void LockstepServices::stepInLockstep(const LockstepStep::Request& request, LockstepStep::Response* response) {
  const std::uint32_t before = lockstep_->frame();
  const TxLockstep::Held held = lockstep_->waitUntilHeld(lockstep_->step(request.frames));
  response->success = held == TxLockstep::Held::kHeld;
  response->flown = std::min(lockstep_->frame() - before, request.frames);  // the next call's follow at once
  response->sim_time = actuation_.simTime();
  if (response->success) {
    response->result = result(ServiceResult::OK, "flown and held");
  } else if (held == TxLockstep::Held::kReplaced) {
    response->result = result(ServiceResult::REFUSED, kReplaced);
  } else {
    response->result = result(ServiceResult::NO_LINK, kNodeEnds);
  }
}

void LockstepServices::stepFreely(const LockstepStep::Request& request, LockstepStep::Response* response) {
  std::uint64_t before = 0;
  const auto flown = [&] { return actuation_.framesFlown() - before; };
  std::string why_not;
  std::uint8_t code = ServiceResult::NO_LINK;
  const auto setPaused = [&](bool paused) {
    const RequestResult result = actuation_.setPaused(paused, who_);
    if (result.success() || !why_not.empty()) return;
    why_not = result.text;
    if (result.code == core::ResultCode::kRefused) code = ServiceResult::REFUSED;
  };
  std::uint64_t call = 0;
  {
    const Turn turn(turn_);
    call = note(request.frames == 0);
    before = actuation_.framesFlown();
    if (request.frames > 0) setPaused(false);
  }
  const auto ends = [&] { return calls_ != call || ending_(); };
  while (why_not.empty() && flown() < request.frames && !ends()) {
    const std::uint64_t seen = flown();
    if (!link_.waitUntil([&] { return flown() != seen || ends(); }, kFrameWait)) why_not = "no frame comes";
  }
  {
    const Turn turn(turn_);
    if (calls_ != call && !last_holds_) {
      code = ServiceResult::REFUSED;
      why_not = kReplaced;
    } else if (ending_()) {
      why_not = kNodeEnds;  // who asked for the pause is not there to end it
    } else {
      setPaused(true);
    }
  }
  response->success = why_not.empty();
  response->flown = static_cast<std::uint32_t>(flown());
  response->sim_time = actuation_.simTime();
  response->result = response->success
                         ? result(ServiceResult::OK, "flown and paused: X-Plane does not wait for answers")
                         : result(code, why_not);
}

}  // namespace xplane_bridge
