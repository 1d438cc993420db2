#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include "xplane_bridge/core/base/clock.hpp"

namespace xplane_bridge::core {

/// A clock that stands until the test moves it; who waits for its time is woken then. Steady time begins at 100 s,
/// system time 1,000,000 s later.
class HandClock {
 public:
  static constexpr std::int64_t kBegin = 100 * kNanosecondsPerSecond;
  static constexpr std::int64_t kSystemAhead = 1'000'000 * kNanosecondsPerSecond;

  Clock clock() const {
    return {[now = now_] { return now->load(); }, [now = now_] { return *now + kSystemAhead; }, waiters_};
  }
  std::int64_t steadyNs() const { return *now_; }
  void move(std::int64_t nanoseconds) {
    *now_ += nanoseconds;
    waiters_->wake(*now_);
  }

 private:
  std::shared_ptr<std::atomic<std::int64_t>> now_ = std::make_shared<std::atomic<std::int64_t>>(kBegin);
  std::shared_ptr<ClockWaiters> waiters_ = std::make_shared<ClockWaiters>();
};

}  // namespace xplane_bridge::core
