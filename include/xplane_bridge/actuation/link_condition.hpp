#pragma once

#include <string>

#include "xplane_bridge/actuation/request_result.hpp"
#include "xplane_bridge/core/link/simulator_port.hpp"

namespace xplane_bridge {

/// What is added to a failure while it does not run: " (it is paused)", " (the link is LOST)"; else nothing.
inline std::string linkCondition(const core::LinkStatus& status) {
  if (status.state == core::LinkState::kPaused) return " (it is paused)";
  if (status.state != core::LinkState::kConnected)
    return std::string(" (the link is ") + core::toString(status.state) + ")";
  return "";
}

/// The answer to a request while it does not.
inline RequestResult noLink() { return {core::ResultCode::kNoLink, "X-Plane is not connected"}; }

}  // namespace xplane_bridge
