#include "xplane_bridge/nodes/tx/heartbeat.hpp"

#include <utility>

namespace xplane_bridge {
namespace {

const ros::WallDuration kPeriod(0.1);

}  // namespace

void Heartbeat::start(const ros::NodeHandle& handle, Hooks hooks) {
  start(std::move(hooks));
  timer_ = handle.createSteadyTimer(kPeriod, [this](const ros::SteadyTimerEvent&) { beat(); });
}

void Heartbeat::beat() {
  look();
  if (hooks_.beat) hooks_.beat();
}

void Heartbeat::look() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (hooks_.acted && hooks_.acted()) hooks_.on_hang();
}

}  // namespace xplane_bridge
