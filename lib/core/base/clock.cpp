#include "xplane_bridge/core/base/clock.hpp"

#include <time.h>

#include <algorithm>
#include <chrono>

namespace xplane_bridge::core {
namespace {

std::int64_t readClock(clockid_t id) {
  timespec now{};
  clock_gettime(id, &now);
  return static_cast<std::int64_t>(now.tv_sec) * kNanosecondsPerSecond + now.tv_nsec;
}

/// Who moves the clock of a deadline; null for a clock that runs by itself.
ClockWaiters* waitersOf(const Deadline* deadline) {
  return deadline != nullptr ? deadline->clock().waiters.get() : nullptr;
}

}  // namespace

Clock hostClock() {
  return {[] { return readClock(CLOCK_MONOTONIC); }, [] { return readClock(CLOCK_REALTIME); }};
}

void ClockWaiters::wakeAll() {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (ClockCondition* condition : waiting_) {
    condition->notifyAll();
  }
}

void ClockCondition::notifyAll() {
  const std::lock_guard<std::mutex> lock(mutex_);
  changed_.notify_all();
}

void ClockCondition::beginWait(const Deadline* deadline) {
  if (ClockWaiters* const waiters = waitersOf(deadline)) {
    const std::lock_guard<std::mutex> lock(waiters->mutex_);
    waiters->waiting_.push_back(this);
  }
}

void ClockCondition::sleep(std::unique_lock<std::mutex>* sleeping, const Deadline* deadline) {
  constexpr double kLongest = 3600.0;  // [s] of one sleep: far below what a duration holds
  if (deadline == nullptr) {
    changed_.wait(*sleeping);
  } else if (waitersOf(deadline) == nullptr) {
    changed_.wait_for(*sleeping, std::chrono::duration<double>(std::min(deadline->left(), kLongest)));
  } else if (!deadline->over()) {
    changed_.wait(*sleeping);
  }
}

void ClockCondition::endWait(const Deadline* deadline) {
  if (ClockWaiters* const waiters = waitersOf(deadline)) {
    const std::lock_guard<std::mutex> lock(waiters->mutex_);
    waiters->waiting_.erase(std::find(waiters->waiting_.begin(), waiters->waiting_.end(), this));
  }
}

}  // namespace xplane_bridge::core
