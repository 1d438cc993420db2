#pragma once

#include <cstdint>
#include <optional>

#include "xplane_bridge/ControlCommand.h"
#include "xplane_bridge/ModeRequest.h"
#include "xplane_bridge/SurfaceCommand.h"
#include "xplane_bridge/TrafficCommand.h"
#include "xplane_bridge/actuation/actuation.hpp"

namespace xplane_bridge {

/// Hands the messages on tx_node's topics to its Actuation; what that refuses is logged, at most once a second.
class CommandIntake {
 public:
  explicit CommandIntake(Actuation* actuation) : actuation_(*actuation) {}

  /// @return [ns] of the clock's steady time, when a command that has to wait is due
  std::optional<std::int64_t> onCommand(core::FlightMode from, const ControlCommand& message);
  void onModeRequest(const ModeRequest& message);
  void onSurfaceCommand(const SurfaceCommand& message);
  /// @param age [s] of simulator time since the frame that the message is meant for
  void onTraffic(const TrafficCommand& message, double age);

 private:
  Actuation& actuation_;
};

}  // namespace xplane_bridge
