#pragma once

#include <cstdint>

namespace xplane_bridge::core {

/// Thins a stream of stamps to a highest rate, evenly: on average exactly that rate where the stream has more, every
/// stamp where it has less. A stamp up to a fifth of the period early is let through, so that jitter does not turn
/// every second frame into every second or third.
class RateLimiter {
 public:
  /// @param rate_hz highest rate; 0: everything passes
  explicit RateLimiter(double rate_hz = 0.0)
      : period_ns_(rate_hz > 0.0 ? static_cast<std::int64_t>(1e9 / rate_hz) : 0) {}

  /// Whether the sample with this stamp [ns] is to be passed on. A stamp before the last one starts anew.
  bool due(std::int64_t stamp_ns) {
    if (period_ns_ == 0) return true;
    const bool starts = !started_ || stamp_ns < last_ns_;
    last_ns_ = stamp_ns;
    if (starts) {
      started_ = true;
      next_ns_ = stamp_ns + period_ns_;
      return true;
    }
    if (stamp_ns < next_ns_ - period_ns_ / 5) return false;
    next_ns_ += period_ns_;
    if (next_ns_ < stamp_ns) next_ns_ = stamp_ns + period_ns_;
    return true;
  }

 private:
  std::int64_t period_ns_;
  bool started_ = false;
  std::int64_t last_ns_ = 0;
  std::int64_t next_ns_ = 0;
};

}  // namespace xplane_bridge::core
