#include "xplane_bridge/core/base/rate_limiter.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace xplane_bridge::core {
namespace {

constexpr std::int64_t kMs = 1'000'000;

std::vector<int> passed(RateLimiter limiter, const std::vector<std::int64_t>& stamps_ms) {
  std::vector<int> indices;
  for (std::size_t i = 0; i < stamps_ms.size(); ++i) {
    if (limiter.due(stamps_ms[i] * kMs)) indices.push_back(static_cast<int>(i));
  }
  return indices;
}

TEST(RateLimiter, ZeroPassesEverything) {
  EXPECT_EQ(passed(RateLimiter(0.0), {0, 1, 1, 2}), (std::vector<int>{0, 1, 2, 3}));
}

TEST(RateLimiter, SlowerStreamsPassWhole) {
  EXPECT_EQ(passed(RateLimiter(50.0), {0, 40, 79, 121, 160}), (std::vector<int>{0, 1, 2, 3, 4}));
}

TEST(RateLimiter, HalvesAStreamEvenlyInSpiteOfJitter) {
  // 100 Hz with +-1 ms, limited to 50 Hz: every second one.
  EXPECT_EQ(passed(RateLimiter(50.0), {0, 11, 19, 30, 41, 49, 59, 70, 81}), (std::vector<int>{0, 2, 4, 6, 8}));
}

TEST(RateLimiter, KeepsTheRateOnAverage) {
  std::vector<std::int64_t> stamps;
  for (int i = 0; i < 1000; ++i) stamps.push_back(10 * i);  // 100 Hz, 10 s
  EXPECT_NEAR(static_cast<double>(passed(RateLimiter(30.0), stamps).size()), 300.0, 1.0);
}

TEST(RateLimiter, GapsAreNotCaughtUp) {
  EXPECT_EQ(passed(RateLimiter(50.0), {0, 20, 1000, 1005, 1010, 1020}), (std::vector<int>{0, 1, 2, 5}));
}

TEST(RateLimiter, StartsAnewWhenTimeRunsBack) {
  EXPECT_EQ(passed(RateLimiter(50.0), {1000, 1005, 0, 5, 20}), (std::vector<int>{0, 2, 4}));
}

}  // namespace
}  // namespace xplane_bridge::core
