#pragma once

#include <cstdint>
#include <functional>

namespace xplane_bridge::core {

constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;
constexpr std::int64_t kNanosecondsPerMillisecond = 1'000'000;
/// [s] by which X-Plane's time may seem to run backwards, because datagrams overtake each other.
constexpr double kOvertaking = 0.25;

/// Time sources handed to whoever needs the time. Both functions may be called from any thread.
struct Clock {
  std::function<std::int64_t()> steady_ns;  ///< [ns] never steps; for deadlines and ages
  std::function<std::int64_t()> system_ns;  ///< [ns] since the Unix epoch; for stamps
};

/// The host's CLOCK_MONOTONIC and CLOCK_REALTIME.
Clock hostClock();

}  // namespace xplane_bridge::core
