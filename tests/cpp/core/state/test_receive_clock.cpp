#include <gtest/gtest.h>

#include "jittered_frames.hpp"
#include "xplane_bridge/core/state/clock_filter.hpp"

namespace xplane_bridge::core {
namespace {

TEST(ReceiveClock, CarriesTheStampToTheSteadyClock) {
  ReceiveClock clock;
  const std::int64_t steady = 5000'000000000;
  // Read 3 ms after the kernel's stamp.
  EXPECT_EQ(clock.toHostTime(kStart, kStart + ns(3e-3), steady + ns(3e-3)), kStart);
}

TEST(ReceiveClock, FollowsAStepOnceItPersists) {
  ReceiveClock clock;
  const std::int64_t steady = 5000'000000000;
  std::int64_t wall_offset = kStart - steady;
  const auto read = [&](double t) {
    const std::int64_t now = steady + ns(t);
    return clock.toHostTime(now + wall_offset, now + wall_offset, now);
  };
  for (int i = 0; i < 100; ++i) EXPECT_EQ(read(0.01 * i), kStart + ns(0.01 * i));
  wall_offset += ns(2.5);  // NTP or an operator sets the clock
  EXPECT_EQ(read(1.0), kStart + ns(1.0));
  for (int i = 0; i < 2 * ReceiveClock::kReadings; ++i) read(1.0 + 0.01 * i);
  EXPECT_EQ(clock.steps(), 1U);
  EXPECT_EQ(read(3.0), kStart + ns(3.0) + ns(2.5));
}

TEST(ReceiveClock, OffsetFollowsReadingsAlone) {
  ReceiveClock clock;
  EXPECT_EQ(clock.offsetNs(), 0);
  clock.read(kStart, 5000'000000000);
  EXPECT_EQ(clock.offsetNs(), kStart - 5000'000000000);
  for (int i = 1; i < 2 * ReceiveClock::kReadings; ++i) clock.read(kStart + ns(i + 0.3), 5000'000000000 + ns(i));
  EXPECT_EQ(clock.offsetNs(), kStart + ns(0.3) - 5000'000000000);
}

// The scheduler stops us between the two readings now and then: no step.
TEST(ReceiveClock, DelayedReadingsAreNoStep) {
  ReceiveClock clock;
  const std::int64_t steady = 5000'000000000;
  std::mt19937 random(3);
  for (int i = 0; i < 1000; ++i) {
    const std::int64_t t = ns(0.01 * i);
    const std::int64_t stall = random() % 4 == 0 ? ns(0.004) : 0;
    clock.toHostTime(kStart + t, kStart + t, steady + t + stall);
  }
  EXPECT_EQ(clock.steps(), 0U);
}

}  // namespace
}  // namespace xplane_bridge::core
