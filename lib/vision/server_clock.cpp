#include "xplane_bridge/vision/server_clock.hpp"

#include <algorithm>

namespace xplane_bridge::vision {
namespace {

constexpr std::int64_t kMillisecond = 1'000'000;
constexpr std::int64_t kWindow = 10'000 * kMillisecond;  // clocks drift by well under a millisecond in this time
constexpr std::int64_t kStep = 5'000 * kMillisecond;     // a clock that was set or stood still starts the fit anew
// The stamp is the whole millisecond below the drawing, so the least delay belongs to a drawing just after the stamp;
// others lie half a millisecond later on average.
constexpr std::int64_t kHalfResolution = kMillisecond / 2;

}  // namespace

void ServerClock::reset() {
  started_ = false;
  delays_.clear();
}

std::int64_t ServerClock::toHost(std::uint32_t server_ms, std::int64_t arrival_ns) {
  if (!started_) {
    started_ = true;
    unwrapped_ms_ = server_ms;
  } else {
    unwrapped_ms_ += static_cast<std::int32_t>(server_ms - last_ms_);
  }
  last_ms_ = server_ms;
  const std::int64_t delay = arrival_ns - unwrapped_ms_ * kMillisecond;
  if (!delays_.empty() && std::abs(delay - delays_.front().second) > kStep) delays_.clear();
  while (!delays_.empty() && arrival_ns - delays_.front().first > kWindow) delays_.pop_front();
  while (!delays_.empty() && delays_.back().second >= delay) delays_.pop_back();
  delays_.emplace_back(arrival_ns, delay);
  const std::int64_t drawn = unwrapped_ms_ * kMillisecond + delays_.front().second + kHalfResolution;
  return std::min(drawn, arrival_ns);
}

}  // namespace xplane_bridge::vision
