#include "xplane_bridge/vision/server_clock.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>

namespace vision = xplane_bridge::vision;

namespace {
constexpr std::int64_t kMillisecond = 1'000'000;
}

TEST(ServerClock, MovesALateArrivalBackToTheDrawing) {
  // The server's clock started 5 s before the host's zero and wraps on the way; events take 0.1 ms, some 20 ms more.
  vision::ServerClock clock;
  std::mt19937 random(3);
  std::uniform_int_distribution<int> late(0, 9);
  const std::int64_t server_zero_ns = -5000 * kMillisecond;
  const std::uint32_t start_ms = 0xfffffff0U;
  for (int i = 0; i < 300; ++i) {
    const std::int64_t drawn = 16'666'667LL * i;
    const auto server_ms = start_ms + static_cast<std::uint32_t>((drawn - server_zero_ns) / kMillisecond);
    const bool held_up = late(random) == 0;
    const std::int64_t arrival = drawn + 100'000 + (held_up ? 20 * kMillisecond : 0);
    const std::int64_t host = clock.toHost(server_ms, arrival);
    EXPECT_LE(host, arrival);
    if (i < 60) continue;
    EXPECT_NEAR(static_cast<double>(host - drawn), 0.0, 0.7e6) << i;
  }
}

TEST(ServerClock, StartsAnewWhenTheHostClockIsSet) {
  vision::ServerClock clock;
  (void)clock.toHost(1000, 1000 * kMillisecond);
  const std::int64_t after = 3'600'000LL * kMillisecond;
  EXPECT_EQ(clock.toHost(1016, after), after);
}

TEST(ServerClock, TheFirstEventIsItsArrival) {
  vision::ServerClock clock;
  EXPECT_EQ(clock.toHost(12345, 777), 777);
  clock.reset();
  EXPECT_EQ(clock.toHost(5, 999), 999);
}
