// The part of BaseNode that owns the link to X-Plane.

#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <utility>

#include <ros/poll_manager.h>

#include "xplane_bridge/core/wire/udp_hub.hpp"
#include "xplane_bridge/nodes/base/base_node.hpp"
#include "xplane_bridge/nodes/base/conformance_file.hpp"
#include "xplane_bridge/nodes/base/link_diagnostics.hpp"
#include "xplane_bridge/nodes/base/log_to_ros.hpp"
#include "xplane_bridge/nodes/base/user_folder.hpp"

namespace xplane_bridge {
namespace {

// Time to end a thousand subscriptions, a batch in two frames of X-Plane, also where undoing has taken its time.
constexpr double kShortestLinkStop = 1.0;  // [s]
// Of a node whose wire is logged, in the place of its process number.
constexpr std::uint32_t kLoggedJitterSeed = 7;

}  // namespace

void logToRos(core::LogLevel level, const std::string& text) {
  switch (level) {
    case core::LogLevel::kDebug:
      ROS_DEBUG("%s", text.c_str());
      break;
    case core::LogLevel::kInfo:
      ROS_INFO("%s", text.c_str());
      break;
    case core::LogLevel::kWarn:
      ROS_WARN("%s", text.c_str());
      break;
    case core::LogLevel::kError:
      ROS_ERROR("%s", text.c_str());
      break;
  }
}

void BaseNode::makeLink() {
  if (!usesLink()) {
    return;
  }
  core::SimLinkOptions options = linkOptions(common_);
  if (!lockstep()) options.jitter_seed = wire_ ? kLoggedJitterSeed : static_cast<std::uint32_t>(getpid());
  options.otherwise = [file = common_.conformance_file, replays = replays()](const core::Endpoint& peer,
                                                                             std::int32_t version) {
    return readConformance(file, peer, version, replays);
  };
  configureLink(&options);
  std::unique_ptr<core::DatagramHub> hub = std::move(hub_of_link_);
  if (!hub) hub = std::make_unique<core::UdpHub>();
  waking_ = hub.get();
  if (lockstep()) {
    auto frames = std::make_unique<core::LockstepHub>(std::move(hub), *lockstep_clock_, host_clock_, lockstepHooks());
    hub_ = frames.get();
    hub = std::move(frames);
  }
  link_ = std::make_unique<core::SimLink>(options, linkCallbacks(), clock_, logToRos,
                                          core::journalsIn(userFolder(), name(), logToRos), std::move(hub));
  addDiagnostics("link to X-Plane", [this, last = core::LinkCounters()](auto& status) mutable {
    const core::LinkCounters now = link_->counters();
    fillLinkDiagnostics(link_->status(), now, last, link_->unansweredDatarefs(), &status);
    last = now;
  });
}

core::LockstepHooks BaseNode::lockstepHooks() {
  core::LockstepHooks hooks;
  hooks.begin = [this, flying = false](const core::LockstepFrame& frame) mutable {
    showRosTime();
    if (!std::exchange(flying, true)) {
      timers_->restart();
      beginFlight();
    }
    beginFrame(frame);
  };
  hooks.ready = [this](const core::LockstepFrame& frame) {
    return (frame.number > 0 || link_->settled()) && frameReady(frame);
  };
  hooks.close = [this](const core::LockstepFrame& frame) {
    closeFrame(frame);
    timers_->runDue();
  };
  hooks.end = [this](const core::LockstepFrame& frame) { endFrame(frame); };
  return hooks;
}

void BaseNode::moveClock(const ros::Time& stamp) {
  const std::int64_t start_ns = core::toNanoseconds(common_.lockstep.start_time);
  lockstep_clock_->move(static_cast<std::int64_t>(stamp.toNSec()) - start_ns);
  showRosTime();
  timers_->runDue();
}

void BaseNode::startLink() {
  if (!link_) {
    return;
  }
  if (!(receivesOnNetworkThread() || lockstep()) || link_->fd() < 0) {
    link_->start();
    return;
  }
  link_->startDriven();
  DrivenByNetwork driven{link_->fd(), [this] { return link_->receive(); }, [this] { link_->stepThrough(); },
                         [this] { return link_->patienceMs(); }};
  if (lockstep()) {
    // All of a frame is done on the thread that reads the answers of others, too: no thread wakes another. roscpp sends
    // what was published behind that, in the order in which it was advertised.
    driven.receive = [this] {
      link_->stepThrough();
      return false;
    };
    driven.patience_ms = [this] {
      const bool flies = lockstep_clock_->phase() == core::LockstepClock::Phase::kFlying;
      return flies ? link_->patienceMs() : std::min(link_->patienceMs(), core::LockstepHub::kLongestWaitMs);
    };
  }
  driver_ = std::make_unique<NetworkThreadDriver>(driven, host_clock_, &ros::PollManager::instance()->getPollSet());
}

void BaseNode::stopLink(const Deadline& deadline) {
  if (!link_) {
    return;
  }
  driver_.reset();
  if (wire_) wire_->leaveOnWake();
  const bool undone = link_->stop(std::max(deadline.left(), kShortestLinkStop));
  if (wire_) wire_->free();
  if (!undone) {
    const std::shared_ptr<core::Journal> journal = link_->journal();
    ROS_WARN("not everything could be undone in X-Plane; the rest is in %s and is undone at the next start",
             journal ? journal->path().c_str() : "no journal");
  }
}

}  // namespace xplane_bridge
