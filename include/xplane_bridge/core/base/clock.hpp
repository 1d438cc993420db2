#pragma once

#include <pthread.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {

/// [s] by which X-Plane's time may seem to run backwards, because datagrams overtake each other.
constexpr double kOvertaking = 0.25;

class ClockCondition;

/// Who waits for a time of a clock that does not run by itself. Thread-safe.
class ClockWaiters {
 public:
  /// Lets those look at the time whose deadline is over: to be called whenever the clock was moved. The caller may hold
  /// any lock.
  /// @param steady_ns [ns] the clock's steady time
  void wake(std::int64_t steady_ns);

 private:
  friend class ClockCondition;
  struct Waiting {
    ClockCondition* condition;
    std::int64_t end_ns;  // steady time
  };
  std::mutex mutex_;
  std::vector<Waiting> waiting_;
};

/// Time source handed to all code that needs the time; a copy is the same clock. The functions may be called from any
/// thread and must not wait for a lock that is held while `waiters` are woken.
struct Clock {
  std::function<std::int64_t()> steady_ns;  ///< [ns] never steps; for deadlines and ages
  std::function<std::int64_t()> system_ns;  ///< [ns] since the Unix epoch; for stamps
  /// Null: the clock runs as fast as the host's. Otherwise it stands until something moves it, which then wakes these.
  std::shared_ptr<ClockWaiters> waiters = nullptr;

  /// [s] of steady_ns
  double steadySeconds() const { return toSeconds(steady_ns()); }
};

/// The host's CLOCK_MONOTONIC and CLOCK_REALTIME.
Clock hostClock();

/// The end of a stretch of a clock's steady time.
class Deadline {
 public:
  /// @param seconds from now on
  Deadline(Clock clock, double seconds)
      : clock_(std::move(clock)), end_ns_(clock_.steady_ns() + toNanoseconds(seconds)) {}
  /// @param steady_ns [ns] of the clock's steady time
  static Deadline at(Clock clock, std::int64_t steady_ns) {
    Deadline out(std::move(clock), 0.0);
    out.end_ns_ = steady_ns;
    return out;
  }

  const Clock& clock() const { return clock_; }
  /// [ns] of the clock's steady time
  std::int64_t endNs() const { return end_ns_; }
  bool over() const { return clock_.steady_ns() >= end_ns_; }
  /// [s] until then; 0 or less once it is over
  double left() const { return toSeconds(end_ns_ - clock_.steady_ns()); }

 private:
  Clock clock_;
  std::int64_t end_ns_;
};

/// What std::condition_variable is to the host's clock, to any Clock. Waiting takes no processor time, and ends as soon
/// as it is notified or the clock reaches the deadline, whichever way the clock goes.
class ClockCondition {
 public:
  ClockCondition();
  ~ClockCondition();
  ClockCondition(const ClockCondition&) = delete;
  ClockCondition& operator=(const ClockCondition&) = delete;

  /// Lets all who wait look at what they wait for. The caller may hold their mutex.
  void notifyAll();

  /// Waits until done() is true, which is called with `lock` locked.
  /// @param lock a std::unique_lock or its like, locked once
  template <class Lock, class Predicate>
  void wait(Lock* lock, const Predicate& done) {
    while (!done()) waitOnce(lock, nullptr);
  }

  /// The same until `deadline` at most. @return whether done() was true
  template <class Lock, class Predicate>
  bool waitUntil(Lock* lock, const Deadline& deadline, const Predicate& done) {
    while (!done()) {
      if (deadline.over()) return false;
      waitOnce(lock, &deadline);
    }
    return true;
  }

 private:
  friend class ClockWaiters;
  /// Returns when notified, when the deadline is over, and sometimes without a cause.
  template <class Lock>
  void waitOnce(Lock* lock, const Deadline* deadline) {
    const bool in_turn = beginWait(deadline);
    {
      std::unique_lock<std::mutex> sleeping(mutex_);
      lock->unlock();
      sleep(&sleeping, deadline, in_turn);
    }
    if (!in_turn) endWait(deadline);
    lock->lock();
  }
  /// @return whether the thread waits in a turn: then who gives turns looks at the time, and it is not among the
  ///         clock's waiters. So it stays for this wait, also where turns end meanwhile.
  bool beginWait(const Deadline* deadline);
  void sleep(std::unique_lock<std::mutex>* sleeping, const Deadline* deadline, bool in_turn);
  void endWait(const Deadline* deadline);

  // Held when a waiting thread goes to sleep and when one is woken, so that no waking gets lost in between. Nothing
  // else is locked while it is held; this is why those who notify or move the clock may hold any lock.
  std::mutex mutex_;
  // std::condition_variable of g++ 9 waits by the system's time, and so too long where that is set back meanwhile.
  pthread_cond_t changed_{};
};

}  // namespace xplane_bridge::core
