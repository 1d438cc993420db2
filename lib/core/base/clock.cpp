#include "xplane_bridge/core/base/clock.hpp"

#include <time.h>

namespace xplane_bridge::core {
namespace {

std::int64_t readClock(clockid_t id) {
  timespec now{};
  clock_gettime(id, &now);
  return static_cast<std::int64_t>(now.tv_sec) * kNanosecondsPerSecond + now.tv_nsec;
}

}  // namespace

Clock hostClock() {
  return {[] { return readClock(CLOCK_MONOTONIC); }, [] { return readClock(CLOCK_REALTIME); }};
}

}  // namespace xplane_bridge::core
