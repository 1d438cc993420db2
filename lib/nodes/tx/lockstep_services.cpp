#include "xplane_bridge/nodes/tx/lockstep_services.hpp"

#include <cstdint>
#include <utility>

#include "xplane_bridge/nodes/base/service_result.hpp"

namespace xplane_bridge {
namespace {

constexpr double kFrameWait = 5.0;  // [s] without a frame in which X-Plane counts as standing

}  // namespace

LockstepServices::LockstepServices(TxLockstep* lockstep, Actuation* actuation, core::SimulatorPort* link,
                                   std::function<bool()> ending, std::string who)
    : lockstep_(lockstep), actuation_(*actuation), link_(*link), ending_(std::move(ending)), who_(std::move(who)) {}

void LockstepServices::step(const LockstepStep::Request& request, LockstepStep::Response* response) {
  lockstep_ != nullptr ? stepInLockstep(request, response) : stepFreely(request, response);
}

std::string LockstepServices::setRunning(bool running) {
  if (lockstep_ != nullptr) {
    running ? lockstep_->run() : lockstep_->step(0);
    return "";
  }
  const RequestResult result = actuation_.setPaused(!running, who_);
  return result.success() ? "" : result.text;
}

void LockstepServices::stepInLockstep(const LockstepStep::Request& request, LockstepStep::Response* response) {
  const std::uint32_t before = lockstep_->frame();
  lockstep_->step(request.frames);
  response->success = lockstep_->waitUntilHeld();
  response->flown = lockstep_->frame() - before;
  response->sim_time = actuation_.simTime();
  response->result =
      response->success ? result(ServiceResult::OK, "flown and held") : result(ServiceResult::NO_LINK, "tx_node ends");
}

void LockstepServices::stepFreely(const LockstepStep::Request& request, LockstepStep::Response* response) {
  const std::uint64_t before = actuation_.framesFlown();
  const auto flown = [this, before] { return actuation_.framesFlown() - before; };
  std::string why_not;
  std::uint8_t code = ServiceResult::NO_LINK;
  const auto setPaused = [&](bool paused) {
    const RequestResult result = actuation_.setPaused(paused, who_);
    if (result.success() || !why_not.empty()) return;
    why_not = result.text;
    if (result.code == core::ResultCode::kRefused) code = ServiceResult::REFUSED;
  };
  if (request.frames > 0) setPaused(false);
  while (why_not.empty() && flown() < request.frames && !ending_()) {
    const std::uint64_t seen = flown();
    if (!link_.waitUntil([&] { return flown() != seen || ending_(); }, kFrameWait)) why_not = "no frame comes";
  }
  setPaused(true);
  response->success = why_not.empty();
  response->flown = static_cast<std::uint32_t>(flown());
  response->sim_time = actuation_.simTime();
  response->result = response->success
                         ? result(ServiceResult::OK, "flown and paused: X-Plane does not wait for answers")
                         : result(code, why_not);
}

}  // namespace xplane_bridge
