#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace xplane_bridge::core {

enum class LogLevel : std::uint8_t { kDebug, kInfo, kWarn, kError };

/// Where the core's messages go. May be called from any thread.
using LogFunction = std::function<void(LogLevel, const std::string&)>;

}  // namespace xplane_bridge::core
