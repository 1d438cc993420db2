#include "xplane_bridge/core/base/thread_turns.hpp"

#include <atomic>
#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace xplane_bridge::core {
namespace {

/// A thread that says what it does, and waits for a word in between.
class Talker {
 public:
  Talker(std::string name, const std::shared_ptr<ThreadTurns>& turns, std::vector<std::string>* said)
      : seat_(turns), thread_([this, name = std::move(name), said] {
          const ThreadSeat::Taken taken(&seat_);
          std::unique_lock<std::mutex> lock(mutex_);
          for (int heard = 0; !ends_; ++heard) {
            said->push_back(name + std::to_string(heard));
            changed_.wait(&lock, [&] { return words_ > heard || ends_; });
          }
          said->push_back(name + " ends");
        }) {}
  ~Talker() {
    if (thread_.joinable()) end();
  }
  void speak() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ++words_;
    }
    changed_.notifyAll();
  }
  void end() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ends_ = true;
    }
    changed_.notifyAll();
    seat_.letEnd();
    thread_.join();
  }

 private:
  std::mutex mutex_;
  ClockCondition changed_;
  int words_ = 0;
  bool ends_ = false;
  ThreadSeat seat_;
  std::thread thread_;
};

using Said = std::vector<std::string>;

TEST(ThreadTurns, GoByTheSeatsAndNotByWhoIsFirst) {
  const auto turns = std::make_shared<ThreadTurns>();
  Said said;
  Talker a("a", turns, &said);
  Talker b("b", turns, &said);
  EXPECT_TRUE(said.empty());  // however fast the threads are
  turns->give();
  EXPECT_EQ(said, (Said{"a0", "b0"}));
  turns->give();
  EXPECT_EQ(said.size(), 2U) << "no thread had anything to go on with";
  b.speak();
  a.speak();
  EXPECT_EQ(said.size(), 2U) << "no thread had a turn";
  turns->give();
  EXPECT_EQ(said, (Said{"a0", "b0", "a1", "b1"}));
}

TEST(ThreadTurns, AThreadGoesOnOnceItsDeadlineIsOver) {
  const auto turns = std::make_shared<ThreadTurns>();
  std::atomic<std::int64_t> now{0};
  const Clock clock{[&] { return now.load(); }, [&] { return now.load(); }, std::make_shared<ClockWaiters>()};
  std::atomic<int> passed{0};
  ThreadSeat seat(turns);
  std::thread thread([&] {
    const ThreadSeat::Taken taken(&seat);
    std::mutex mutex;
    std::unique_lock<std::mutex> lock(mutex);
    ClockCondition changed;
    changed.waitUntil(&lock, Deadline(clock, 1.0), [] { return false; });
    ++passed;
  });
  turns->give();
  now = 999'999'999;
  clock.waiters->wake(now);
  turns->give();
  EXPECT_EQ(passed, 0);
  now = 1'000'000'000;
  turns->give();
  EXPECT_EQ(passed, 1);
  thread.join();
}

TEST(ThreadTurns, WhoEndsAnotherLetsItHaveItsTurn) {
  const auto turns = std::make_shared<ThreadTurns>();
  Said said;
  Talker a("a", turns, &said);
  turns->give();
  ThreadSeat seat(turns);
  std::thread thread([&] {
    const ThreadSeat::Taken taken(&seat);
    said.push_back("stop");
    a.end();
    said.push_back("stopped");
  });
  turns->give();
  EXPECT_EQ(said, (Said{"a0", "stop", "a ends", "stopped"}));
  thread.join();
}

TEST(ThreadTurns, AMutexHeldWhileWaitingHoldsNoOtherThreadUp) {
  const auto turns = std::make_shared<ThreadTurns>();
  Said said;
  TurnMutex mutex;
  std::atomic<bool> done{false};
  ClockCondition changed;
  ThreadSeat first(turns);
  ThreadSeat second(turns);
  std::thread waits([&] {
    const ThreadSeat::Taken taken(&first);
    const std::lock_guard<TurnMutex> held(mutex);
    said.push_back("holds");
    std::mutex own;
    std::unique_lock<std::mutex> lock(own);
    changed.wait(&lock, [&] { return done.load(); });
    said.push_back("gives");
  });
  std::thread wants([&] {
    const ThreadSeat::Taken taken(&second);
    said.push_back("wants");
    const std::lock_guard<TurnMutex> held(mutex);
    said.push_back("has");
  });
  turns->give();
  EXPECT_EQ(said, (Said{"holds", "wants"}));
  done = true;
  changed.notifyAll();
  turns->give();
  EXPECT_EQ(said, (Said{"holds", "wants", "gives", "has"}));
  waits.join();
  wants.join();
}

TEST(ThreadTurns, FreedThreadsWaitAsAnyOther) {
  const auto turns = std::make_shared<ThreadTurns>();
  std::atomic<int> passed{0};
  std::mutex mutex;
  ClockCondition changed;
  int words = 0;
  ThreadSeat seat(turns);
  std::thread thread([&] {
    const ThreadSeat::Taken taken(&seat);
    std::unique_lock<std::mutex> lock(mutex);
    changed.wait(&lock, [&] { return words > 0; });
    ++passed;
  });
  turns->give();
  turns->free();
  {
    const std::lock_guard<std::mutex> lock(mutex);
    ++words;
  }
  changed.notifyAll();
  thread.join();
  EXPECT_EQ(passed, 1);
  turns->give();  // there is no thread left
}

constexpr std::int64_t kSecond = 1'000'000'000;             // [ns]
constexpr auto kLongestFailure = std::chrono::seconds(30);  // of a thread that is not woken

/// A lock that does something when it is first unlocked: between the beginning of a wait and its sleep.
struct HookedLock {
  void lock() { mutex.lock(); }
  void unlock() {
    mutex.unlock();
    if (const std::function<void()> act = std::exchange(hook, nullptr)) act();
  }
  std::function<void()> hook;
  std::mutex mutex{};
};

TEST(ThreadTurns, AWaitThatBeganInATurnFollowsTheClockWhereTurnsEndBeforeItSleeps) {
  const auto turns = std::make_shared<ThreadTurns>();
  std::atomic<std::int64_t> now{0};
  std::atomic<bool> freed{false}, moved{false};
  const auto read = [&] {
    const std::int64_t before = now;
    if (freed && !moved) {  // right behind the reading by which the thread goes to sleep
      now = 2 * kSecond;
      moved = true;
    }
    return before;
  };
  const Clock clock{read, read, std::make_shared<ClockWaiters>()};
  ThreadSeat seat(turns);
  ClockCondition changed;
  std::promise<void> ended;
  std::thread thread([&] {
    const ThreadSeat::Taken taken(&seat);
    HookedLock lock{[&] {
      turns->free();
      freed = true;
    }};
    lock.lock();
    changed.waitUntil(&lock, Deadline(clock, 1.0), [] { return false; });
    lock.unlock();
    ended.set_value();
  });
  turns->give();
  while (!moved) std::this_thread::yield();
  clock.waiters->wake(now);
  EXPECT_EQ(ended.get_future().wait_for(kLongestFailure), std::future_status::ready) << "it sleeps for ever";
  changed.notifyAll();
  thread.join();
}

TEST(ThreadTurns, AWaitInATurnLeavesOthersAmongTheClocksWaiters) {
  const auto turns = std::make_shared<ThreadTurns>();
  const auto waiters = std::make_shared<ClockWaiters>();
  std::atomic<std::int64_t> now{0};
  std::atomic<bool> unlocked{false}, asleep{false};
  const auto read = [&] { return now.load(); };
  const auto read_by_other = [&] {
    const std::int64_t before = now;
    asleep = unlocked.load();  // or certain to sleep: it holds the condition's mutex
    return before;
  };
  const Clock clock{read, read, waiters}, of_other{read_by_other, read_by_other, waiters};
  ClockCondition changed;
  std::promise<void> ended;
  std::thread other([&] {
    HookedLock lock{[&] { unlocked = true; }};
    lock.lock();
    changed.waitUntil(&lock, Deadline(of_other, 2.0), [] { return false; });
    lock.unlock();
    ended.set_value();
  });
  while (!asleep) std::this_thread::yield();
  ThreadSeat seat(turns);
  std::thread thread([&] {
    const ThreadSeat::Taken taken(&seat);
    std::mutex mutex;
    std::unique_lock<std::mutex> lock(mutex);
    changed.waitUntil(&lock, Deadline(clock, 1.0), [] { return false; });
  });
  turns->give();
  now = kSecond;
  turns->give();
  thread.join();
  now = 2 * kSecond;
  waiters->wake(now);
  EXPECT_EQ(ended.get_future().wait_for(kLongestFailure), std::future_status::ready) << "it sleeps for ever";
  changed.notifyAll();
  other.join();
}

TEST(ThreadTurns, WithoutTurnsASeatDoesNothing) {
  ThreadSeat seat(nullptr);
  bool taken = true;
  std::thread thread([&] {
    const ThreadSeat::Taken here(&seat);
    taken = ThreadTurns::taken();
  });
  seat.letEnd();
  thread.join();
  EXPECT_FALSE(taken);
}

}  // namespace
}  // namespace xplane_bridge::core
