#include "xplane_bridge/nodes/tx/command_intake.hpp"

#include <string>
#include <variant>

#include <ros/console.h>

#include "xplane_bridge/nodes/messages/control_conversions.hpp"
#include "xplane_bridge/nodes/messages/traffic_conversions.hpp"

namespace xplane_bridge {

std::optional<std::int64_t> CommandIntake::onCommand(core::FlightMode from, const ControlCommand& message) {
  ControlPath& path = actuation_.path();
  if (const auto refusal = path.command(from, toCore(message))) {
    ROS_WARN_THROTTLE(1.0, "control/%s is refused: %s", from == core::FlightMode::kManual ? "manual" : "auto",
                      refusal->text.c_str());
    return std::nullopt;
  }
  return path.deadline();
}

void CommandIntake::onModeRequest(const ModeRequest& message) {
  actuation_.path().requestMode({message.sequence, message.mode, message.requester, message.header.stamp.toSec()});
}

void CommandIntake::onSurfaceCommand(const SurfaceCommand& message) {
  const std::string refusal = actuation_.commandSurfaces(message.names, message.deflections_deg, message.sequence);
  if (!refusal.empty()) ROS_WARN_THROTTLE(1.0, "control/surfaces is refused: %s", refusal.c_str());
}

void CommandIntake::onTraffic(const TrafficCommand& message, double age) {
  const auto poses = toCore(message);
  const std::string refusal = std::holds_alternative<std::string>(poses)
                                  ? std::get<std::string>(poses)
                                  : actuation_.traffic().command(std::get<0>(poses), actuation_.simTime() - age);
  if (!refusal.empty()) ROS_WARN_THROTTLE(1.0, "traffic/command is refused: %s", refusal.c_str());
}

}  // namespace xplane_bridge
