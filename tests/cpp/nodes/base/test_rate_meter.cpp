#include "xplane_bridge/nodes/base/rate_meter.hpp"

#include <gtest/gtest.h>

namespace xplane_bridge {
namespace {

constexpr std::int64_t kSecond = core::kNanosecondsPerSecond;

TEST(RateMeter, IsTheRateSinceTheLastReport) {
  RateMeter meter;
  EXPECT_EQ(meter.update(500, 10 * kSecond), 0.0);
  EXPECT_DOUBLE_EQ(meter.update(560, 11 * kSecond), 60.0);
  EXPECT_DOUBLE_EQ(meter.update(570, 13 * kSecond), 5.0);
}

TEST(RateMeter, IsZeroWhileTheClockStands) {
  RateMeter meter;
  meter.update(0, 10 * kSecond);
  EXPECT_EQ(meter.update(60, 10 * kSecond), 0.0);
}

}  // namespace
}  // namespace xplane_bridge
