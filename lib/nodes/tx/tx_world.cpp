// What tx_node does to the world around the aircraft.

#include "xplane_bridge/nodes/messages/traffic_conversions.hpp"
#include "xplane_bridge/nodes/tx/tx_node.hpp"

namespace xplane_bridge {

void TxNode::onTraffic(const TrafficCommand& message) {
  const auto poses = toCore(message);
  const std::string refusal = std::holds_alternative<std::string>(poses)
                                  ? std::get<std::string>(poses)
                                  : actuation_->traffic().command(std::get<0>(poses), actuation_->simTime());
  if (!refusal.empty()) ROS_WARN_THROTTLE(1.0, "traffic/command is refused: %s", refusal.c_str());
}

}  // namespace xplane_bridge
