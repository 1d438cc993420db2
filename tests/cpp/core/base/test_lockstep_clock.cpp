#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <thread>

#include "hand_clock.hpp"
#include "xplane_bridge/core/base/lockstep_clock.hpp"

namespace xplane_bridge::core {
namespace {

constexpr std::int64_t kS = kNanosecondsPerSecond;
constexpr std::int64_t kStart = 1'000'000'000 * kS;

class LockstepClockTest : public testing::Test {
 protected:
  HandClock host_;
  LockstepClock lockstep_{host_.clock(), kStart};
  Clock clock_ = lockstep_.clock();
};

TEST_F(LockstepClockTest, GoesAtTheHostsPaceBeforeTheFlightButItsStampsStand) {
  const std::int64_t before = clock_.steady_ns();
  host_.move(3 * kS);
  EXPECT_EQ(clock_.steady_ns() - before, 3 * kS);
  EXPECT_EQ(clock_.system_ns(), kStart);
  EXPECT_EQ(lockstep_.phase(), LockstepClock::Phase::kHeld);
}

TEST_F(LockstepClockTest, GoesByFramesOnceItFliesAndNeverByTheHost) {
  host_.move(5 * kS);
  const std::int64_t before = clock_.steady_ns();
  lockstep_.move(40 * kS);
  EXPECT_EQ(clock_.steady_ns(), before) << "the first frame is no step";
  EXPECT_EQ(clock_.system_ns(), kStart + 40 * kS);
  host_.move(60 * kS);
  EXPECT_EQ(clock_.steady_ns(), before);
  lockstep_.move(40 * kS + 16'667'000);
  EXPECT_EQ(clock_.steady_ns(), before + 16'667'000);
  EXPECT_EQ(clock_.system_ns(), kStart + 40 * kS + 16'667'000);
}

TEST_F(LockstepClockTest, SteadyTimeStandsWhereSimulatedTimeRunsBack) {
  lockstep_.move(40 * kS);
  lockstep_.move(41 * kS);
  const std::int64_t before = clock_.steady_ns();
  lockstep_.move(2 * kS);
  EXPECT_EQ(clock_.steady_ns(), before);
  EXPECT_EQ(clock_.system_ns(), kStart + 2 * kS);
  lockstep_.move(3 * kS);
  EXPECT_EQ(clock_.steady_ns(), before + kS);
}

TEST_F(LockstepClockTest, SteadyTimeGoesOnByFramesWhereSimulatedTimeStands) {
  lockstep_.move(40 * kS);
  lockstep_.move(40 * kS);
  const std::int64_t before = clock_.steady_ns();
  lockstep_.move(40 * kS + 20'000'000);
  lockstep_.move(40 * kS + 20'000'000);
  lockstep_.move(40 * kS + 20'000'000);
  EXPECT_EQ(clock_.steady_ns(), before + 60'000'000) << "who waits in a pause waits for frames";
  EXPECT_EQ(clock_.system_ns(), kStart + 40 * kS + 20'000'000);
}

TEST_F(LockstepClockTest, GoesOnByTheHostOnceReleased) {
  lockstep_.move(40 * kS);
  const std::int64_t before = clock_.steady_ns();
  host_.move(7 * kS);
  lockstep_.release();
  EXPECT_EQ(clock_.steady_ns(), before);
  host_.move(2 * kS);
  EXPECT_EQ(clock_.steady_ns(), before + 2 * kS);
  lockstep_.move(50 * kS);
  EXPECT_EQ(clock_.system_ns(), kStart + 40 * kS) << "stamps stay those of the last frame";
}

TEST_F(LockstepClockTest, WakesWhoWaitsForItsTime) {
  lockstep_.move(0);
  std::mutex mutex;
  ClockCondition condition;
  std::atomic<bool> over{false};
  std::thread waiting([&] {
    std::unique_lock<std::mutex> lock(mutex);
    condition.waitUntil(&lock, Deadline(clock_, 1.0), [] { return false; });
    over = true;
  });
  lockstep_.move(999 * kNanosecondsPerMillisecond);
  EXPECT_FALSE(over);
  while (!over) {  // its deadline may have begun with the second move
    lockstep_.move(clock_.system_ns() - kStart + kS);
    std::this_thread::yield();
  }
  waiting.join();
}

}  // namespace
}  // namespace xplane_bridge::core
