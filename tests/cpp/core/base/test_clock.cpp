#include "xplane_bridge/core/base/clock.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <thread>
#include <vector>

#include "hand_clock.hpp"

namespace xplane_bridge::core {
namespace {

constexpr std::int64_t kMs = kNanosecondsPerMillisecond;

TEST(HostClock, RunsByItself) {
  const Clock clock = hostClock();
  EXPECT_EQ(clock.waiters, nullptr);
  const std::int64_t before = clock.steady_ns();
  while (clock.steady_ns() == before) {
  }
  EXPECT_GT(clock.steady_ns(), before);
  EXPECT_GT(clock.system_ns(), std::int64_t{1'500'000'000} * kNanosecondsPerSecond);  // it is after July 2017
}

TEST(DeadlineOfAClock, IsOverWhenItIsReached) {
  HandClock hand;
  const Deadline deadline(hand.clock(), 0.5);
  EXPECT_DOUBLE_EQ(deadline.left(), 0.5);
  hand.move(500 * kMs - 1);
  EXPECT_FALSE(deadline.over());
  EXPECT_DOUBLE_EQ(deadline.left(), 1e-9);
  hand.move(1);
  EXPECT_TRUE(deadline.over());
  hand.move(kMs);
  EXPECT_DOUBLE_EQ(deadline.left(), -1e-3);
  const Deadline later = Deadline::at(hand.clock(), hand.steadyNs() + 2 * kMs);
  EXPECT_DOUBLE_EQ(later.left(), 2e-3);
}

/// Something to wait for, and a thread that waits for it until a deadline.
class AConditionOfAClock : public testing::Test {
 protected:
  struct Outcome {
    bool done;
    std::int64_t steady_ns;  ///< when the wait ended
  };

  std::future<Outcome> waitUntil(const Deadline& deadline) {
    return std::async(std::launch::async, [this, deadline] {
      std::unique_lock<std::mutex> lock(mutex_);
      const bool done = condition_.waitUntil(&lock, deadline, [this] { return done_; });
      EXPECT_TRUE(lock.owns_lock());
      return Outcome{done, deadline.clock().steady_ns()};
    });
  }

  std::mutex mutex_;
  ClockCondition condition_;
  bool done_ = false;
};

TEST_F(AConditionOfAClock, IsWaitedForUntilTheHandReachesTheDeadline) {
  HandClock hand;
  std::future<Outcome> waiting = waitUntil(Deadline(hand.clock(), 0.1));
  const std::int64_t deadline = hand.steadyNs() + 100 * kMs;
  while (hand.steadyNs() < deadline) hand.move(kMs);
  // Moved no further: a waking that came too early would have seen an earlier time, a lost one would wait for ever.
  const Outcome outcome = waiting.get();
  EXPECT_FALSE(outcome.done);
  EXPECT_EQ(outcome.steady_ns, deadline);
}

TEST_F(AConditionOfAClock, SleepsWhileOthersAreWoken) {
  constexpr int kOthers = 200;
  HandClock hand;
  std::atomic<int> looks{0};
  const Deadline deadline(hand.clock(), 1e-3 * (kOthers + 1));
  std::future<void> last = std::async(std::launch::async, [&] {
    std::mutex mutex;
    std::unique_lock<std::mutex> lock(mutex);
    ClockCondition condition;
    condition.waitUntil(&lock, deadline, [&] {
      ++looks;
      return false;
    });
  });
  for (int i = 0; i < kOthers; ++i) {
    std::future<Outcome> other = waitUntil(Deadline(hand.clock(), 1e-3));
    hand.move(kMs);
    other.get();
  }
  hand.move(kMs);
  last.get();
  EXPECT_LT(looks, kOthers / 10);  // some may come without a cause
}

TEST_F(AConditionOfAClock, EndsWithTheNotificationWhileTheClockStands) {
  HandClock hand;
  std::future<Outcome> waiting = waitUntil(Deadline(hand.clock(), 0.1));
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    done_ = true;
    condition_.notifyAll();  // also with the mutex locked
  }
  const Outcome outcome = waiting.get();
  EXPECT_TRUE(outcome.done);
  EXPECT_EQ(outcome.steady_ns, HandClock::kBegin);
}

TEST_F(AConditionOfAClock, IsNotWaitedForOnceTheDeadlineIsOver) {
  HandClock hand;
  const Deadline deadline(hand.clock(), 0.0);
  EXPECT_FALSE(waitUntil(deadline).get().done);
  done_ = true;
  EXPECT_TRUE(waitUntil(deadline).get().done);
}

TEST_F(AConditionOfAClock, EndsByTheHostsTime) {
  const Deadline deadline(hostClock(), 0.02);
  const Outcome outcome = waitUntil(deadline).get();
  EXPECT_FALSE(outcome.done);
  EXPECT_TRUE(deadline.over());
}

TEST_F(AConditionOfAClock, MayBeMovedByWhoHoldsTheMutex) {
  // As a handler does that runs under its node's mutex when a frame moves the clock.
  HandClock hand;
  std::future<Outcome> waiting = waitUntil(Deadline(hand.clock(), 1e-3));
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    hand.move(kMs);
  }
  EXPECT_FALSE(waiting.get().done);
}

TEST_F(AConditionOfAClock, IsNotWaitedForWhereTheClockIsMovedJustBefore) {
  std::atomic<std::int64_t> now{0};
  const auto waiters = std::make_shared<ClockWaiters>();
  int looks = 0;
  const Clock clock{[&] {
                      const std::int64_t seen = now;
                      if (++looks == 2) {  // the wait has seen that the deadline is not over, and does not sleep yet
                        now = kMs;
                        waiters->wake(now);
                      }
                      return seen;
                    },
                    [] { return std::int64_t{0}; }, waiters};
  const Deadline deadline = Deadline::at(clock, kMs);
  std::unique_lock<std::mutex> lock(mutex_);
  EXPECT_FALSE(condition_.waitUntil(&lock, deadline, [] { return false; }));
}

TEST_F(AConditionOfAClock, LosesNoNotificationWhileItGoesToSleep) {
  // A lock that lets another thread notify as soon as it is unlocked, which is before the waiting one sleeps.
  struct NotifiedInUnlock {
    void lock() { mutex->lock(); }
    void unlock() {
      mutex->unlock();
      if (notifying.joinable()) return;
      notifying = std::thread([this] {
        {
          const std::lock_guard<std::mutex> locked(*mutex);
          *done = true;
        }
        condition->notifyAll();
        notified = true;
      });
      // Right code holds the other back until it sleeps itself, wrong code lets it be done with it by now.
      for (int i = 0; i < 10'000 && !notified; ++i) std::this_thread::yield();
    }
    std::mutex* mutex;
    bool* done;
    ClockCondition* condition;
    std::thread notifying{};
    std::atomic<bool> notified{false};
  };
  NotifiedInUnlock lock{&mutex_, &done_, &condition_};
  lock.lock();
  condition_.wait(&lock, [this] { return done_; });
  EXPECT_TRUE(done_);
  lock.unlock();
  lock.notifying.join();
}

TEST_F(AConditionOfAClock, LosesNoWakingOfManyMovesAndWaiters) {
  HandClock hand;
  constexpr int kWaits = 2000;
  std::atomic<std::int64_t> wanted{HandClock::kBegin};
  std::vector<std::thread> threads;
  for (int i = 0; i < 3; ++i) {
    threads.emplace_back([&] {
      for (int wait = 1; wait <= kWaits; ++wait) {
        const Deadline deadline = Deadline::at(hand.clock(), HandClock::kBegin + wait * kMs);
        wanted = std::max<std::int64_t>(wanted, HandClock::kBegin + wait * kMs);
        std::unique_lock<std::mutex> lock(mutex_);
        condition_.waitUntil(&lock, deadline, [] { return false; });
      }
    });
  }
  while (hand.steadyNs() < HandClock::kBegin + kWaits * kMs) {
    if (hand.steadyNs() < wanted) hand.move(kMs);
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(hand.steadyNs(), HandClock::kBegin + kWaits * kMs);
}

TEST_F(AConditionOfAClock, WaitsWithoutADeadline) {
  std::thread waiting([this] {
    std::unique_lock<std::mutex> lock(mutex_);
    condition_.wait(&lock, [this] { return done_; });
  });
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    done_ = true;
  }
  condition_.notifyAll();
  waiting.join();
}

}  // namespace
}  // namespace xplane_bridge::core
