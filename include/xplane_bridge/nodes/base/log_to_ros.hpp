#pragma once

#include <string>

#include "xplane_bridge/core/base/log.hpp"

namespace xplane_bridge {

/// The core's messages in ROS's log.
void logToRos(core::LogLevel level, const std::string& text);

}  // namespace xplane_bridge
