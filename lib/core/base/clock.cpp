#include "xplane_bridge/core/base/clock.hpp"

#include <time.h>

#include <algorithm>
#include <system_error>

#include "xplane_bridge/core/base/thread_turns.hpp"

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

void ClockWaiters::wake(std::int64_t steady_ns) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const Waiting& each : waiting_) {
    if (each.end_ns <= steady_ns) each.condition->notifyAll();
  }
}

ClockCondition::ClockCondition() {
  pthread_condattr_t attributes;
  pthread_condattr_init(&attributes);
  pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
  const int error = pthread_cond_init(&changed_, &attributes);
  pthread_condattr_destroy(&attributes);
  if (error != 0) {
    throw std::system_error(error, std::generic_category(), "cannot make a condition");
  }
}

ClockCondition::~ClockCondition() { pthread_cond_destroy(&changed_); }

void ClockCondition::notifyAll() {
  const std::lock_guard<std::mutex> lock(mutex_);
  ThreadTurns::notify(*this);
  pthread_cond_broadcast(&changed_);
}

bool ClockCondition::beginWait(const Deadline* deadline) {
  if (ThreadTurns::taken()) return true;
  if (ClockWaiters* const waiters = waitersOf(deadline)) {
    const std::lock_guard<std::mutex> lock(waiters->mutex_);
    waiters->waiting_.push_back({this, deadline->endNs()});
  }
  return false;
}

void ClockCondition::sleep(std::unique_lock<std::mutex>* sleeping, const Deadline* deadline, bool in_turn) {
  constexpr double kLongest = 3600.0;  // [s] of one sleep: far below what a time holds
  if (in_turn) {
    // Not at all where turns have ended since: then the next wait is no turn's.
    ThreadTurns::sleep(*this, sleeping, deadline);
    return;
  }
  pthread_mutex_t* const mutex = sleeping->mutex()->native_handle();
  if (deadline == nullptr || waitersOf(deadline) != nullptr) {
    if (deadline == nullptr || !deadline->over()) {
      pthread_cond_wait(&changed_, mutex);
    }
    return;
  }
  const std::int64_t end_ns = readClock(CLOCK_MONOTONIC) + toNanoseconds(std::min(deadline->left(), kLongest));
  const timespec end{end_ns / kNanosecondsPerSecond, end_ns % kNanosecondsPerSecond};
  pthread_cond_timedwait(&changed_, mutex, &end);
}

void ClockCondition::endWait(const Deadline* deadline) {
  if (ClockWaiters* const waiters = waitersOf(deadline)) {
    const std::lock_guard<std::mutex> lock(waiters->mutex_);
    auto& waiting = waiters->waiting_;
    const auto found = std::find_if(waiting.begin(), waiting.end(), [&](const ClockWaiters::Waiting& each) {
      return each.condition == this && each.end_ns == deadline->endNs();
    });
    if (found != waiting.end()) waiting.erase(found);
  }
}

}  // namespace xplane_bridge::core
