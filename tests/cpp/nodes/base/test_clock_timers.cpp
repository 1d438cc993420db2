#include "xplane_bridge/nodes/base/clock_timers.hpp"

#include <gtest/gtest.h>
#include <ros/callback_queue.h>

#include <atomic>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "hand_clock.hpp"

namespace xplane_bridge {
namespace {

constexpr std::int64_t kMs = core::kNanosecondsPerMillisecond;

/// Counts what it is given to serve.
class CountingQueue : public ros::CallbackQueue {
 public:
  void addCallback(const ros::CallbackInterfacePtr& callback, std::uint64_t id) override {
    ros::CallbackQueue::addCallback(callback, id);
    ++added_;
  }
  void awaitAdded(int count) const {
    while (added_ < count) std::this_thread::yield();
  }

 private:
  std::atomic<int> added_{0};
};

/// Timers on a clock moved by hand; what they call writes its name down.
class ClockTimersTest : public testing::Test {
 protected:
  void add(const std::string& name, double period) {
    timers_.add(period, [this, name] { called_.push_back(name); });
  }
  /// Serves the queue until `count` callbacks were called in all.
  void serve(std::size_t count) {
    while (called_.size() < count) queue_.callOne(ros::WallDuration(1.0));
  }

  core::HandClock hand_;
  CountingQueue queue_;
  ClockTimers timers_{hand_.clock(), &queue_};
  std::vector<std::string> called_;
};

using Names = std::vector<std::string>;

TEST_F(ClockTimersTest, FireInOrderAsTheClockIsMoved) {
  add("every 50 ms", 0.05);
  add("every 20 ms", 0.02);
  timers_.start();
  hand_.move(20 * kMs - 1);  // nothing yet
  hand_.move(1);
  serve(1);
  hand_.move(20 * kMs);
  serve(2);
  hand_.move(20 * kMs);  // 60 ms: 50 ms was due before
  serve(4);
  EXPECT_EQ(called_, (Names{"every 20 ms", "every 20 ms", "every 50 ms", "every 20 ms"}));
}

TEST_F(ClockTimersTest, FireOnTheThreadThatServesTheQueue) {
  std::thread::id called_on;
  timers_.add(0.02, [&] {
    called_on = std::this_thread::get_id();
    called_.emplace_back();
  });
  timers_.start();
  hand_.move(20 * kMs);
  serve(1);
  EXPECT_EQ(called_on, std::this_thread::get_id());
}

TEST_F(ClockTimersTest, WaitInTheQueueOnceHoweverLongItIsNotServed) {
  add("every 20 ms", 0.02);
  add("every 40 ms", 0.04);
  timers_.start();
  hand_.move(20 * kMs);
  queue_.awaitAdded(1);
  hand_.move(20 * kMs);  // both are due, the first one waits already
  queue_.awaitAdded(2);
  serve(2);
  EXPECT_EQ(called_, (Names{"every 20 ms", "every 40 ms"}));
  EXPECT_TRUE(queue_.isEmpty());
  hand_.move(20 * kMs);
  serve(3);
  EXPECT_EQ(called_.back(), "every 20 ms");
}

TEST_F(ClockTimersTest, BeginWithWhatIsDueAtTheStart) {
  add("every 20 ms", 0.02);
  hand_.move(25 * kMs);
  timers_.start();
  serve(1);
  hand_.move(15 * kMs);  // 40 ms
  serve(2);
  EXPECT_EQ(called_.size(), 2U);
}

TEST_F(ClockTimersTest, CallNothingOnceStopped) {
  add("every 20 ms", 0.02);
  timers_.start();
  hand_.move(20 * kMs);
  while (queue_.isEmpty()) std::this_thread::yield();
  timers_.stop();
  hand_.move(20 * kMs);
  queue_.callAvailable();
  EXPECT_EQ(called_, Names{});
}

TEST_F(ClockTimersTest, StopWhileTheClockStands) {
  add("every 20 ms", 0.02);
  timers_.start();
  timers_.stop();
  EXPECT_TRUE(queue_.isEmpty());
}

TEST_F(ClockTimersTest, RefuseATimerAfterTheStart) {
  add("every 20 ms", 0.02);
  timers_.start();
  EXPECT_THROW(add("late", 0.02), std::logic_error);
}

TEST_F(ClockTimersTest, AnAlarmGoesOffWhenItIsSetTo) {
  const auto alarm = timers_.addAlarm([this] { called_.emplace_back("alarm"); });
  add("every 20 ms", 0.02);
  timers_.start();
  timers_.setAlarm(alarm, hand_.clock().steady_ns() + 5 * kMs);
  hand_.move(5 * kMs);
  serve(1);
  hand_.move(20 * kMs);
  serve(2);
  EXPECT_EQ(called_, (Names{"alarm", "every 20 ms"}));
}

TEST_F(ClockTimersTest, AnAlarmSetByItsOwnCallbackGoesOffAgain) {
  core::TimerSchedule::Timer alarm = 0;
  alarm = timers_.addAlarm([&] {
    called_.emplace_back("alarm");
    if (called_.size() == 1) {
      timers_.setAlarm(alarm, 0);  // at once
      while (queue_.isEmpty()) std::this_thread::yield();
    }
  });
  timers_.start();
  timers_.setAlarm(alarm, 0);
  serve(2);
  EXPECT_EQ(called_.size(), 2U);
}

TEST_F(ClockTimersTest, AnAlarmWaitsInTheQueueOnceAlsoWhereItsOwnCallbackSetIt) {
  core::TimerSchedule::Timer alarm = 0;
  alarm = timers_.addAlarm([&] {
    called_.emplace_back("alarm");
    if (called_.size() == 1) {
      timers_.setAlarm(alarm, 0);
      queue_.awaitAdded(2);
    }
  });
  const auto marker = timers_.addAlarm([this] { called_.emplace_back("marker"); });
  timers_.start();
  timers_.setAlarm(alarm, 0);
  serve(1);
  timers_.setAlarm(alarm, 0);  // it waits already
  timers_.setAlarm(marker, 0);
  queue_.awaitAdded(3);
  serve(3);
  EXPECT_EQ(called_, (Names{"alarm", "alarm", "marker"}));
}

TEST(ClockTimersOfTheHost, FireByThemselves) {
  ros::CallbackQueue queue;
  ClockTimers timers(core::hostClock(), &queue);
  int calls = 0;
  timers.add(1e-3, [&calls] { ++calls; });
  timers.start();
  while (calls < 3) queue.callOne(ros::WallDuration(1.0));
  timers.stop();
  EXPECT_EQ(calls, 3);
}

}  // namespace
}  // namespace xplane_bridge
