#include "xplane_bridge/nodes/tx/heartbeat.hpp"

#include <utility>

namespace xplane_bridge {
namespace {

const ros::WallDuration kPeriod(0.1);

}  // namespace

void Heartbeat::start(const ros::NodeHandle& handle, std::function<bool()> beat, std::function<void()> on_hang) {
  beat_ = std::move(beat);
  on_hang_ = std::move(on_hang);
  timer_ = handle.createSteadyTimer(kPeriod, [this](const ros::SteadyTimerEvent&) { this->beat(); });
}

}  // namespace xplane_bridge
