#include "xplane_bridge/core/state/xplane_settings.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

namespace xplane_bridge::core {
namespace {

/// X-Plane's answer: a value for each of the first datarefs.
bool feed(XPlaneSettings* settings, const std::vector<float>& values, std::int64_t receive_ns) {
  std::vector<std::uint8_t> pairs;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto index = static_cast<std::int32_t>(i);
    std::uint8_t pair[8];
    std::memcpy(pair, &index, 4);
    std::memcpy(pair + 4, &values[i], 4);
    pairs.insert(pairs.end(), pair, pair + 8);
  }
  return settings->add(RrefView(pairs.data(), values.size()), receive_ns);
}

TEST(XPlaneSettings, ReportsValuesWhenTheyAreAnother) {
  XPlaneSettings settings;
  EXPECT_TRUE(settings.values().empty());
  std::vector<float> values(XPlaneSettings::datarefs().size(), 0.5F);
  std::int64_t now_ns = 0;
  EXPECT_TRUE(feed(&settings, values, now_ns += 1'000'000'000));
  EXPECT_EQ(settings.values(), values);
  EXPECT_FALSE(feed(&settings, values, now_ns += 1'000'000'000));
  values.front() = 2.0F;
  EXPECT_TRUE(feed(&settings, values, now_ns += 1'000'000'000));
  EXPECT_EQ(settings.values(), values);
}

TEST(XPlaneSettings, WhatXPlaneDoesNotAnswerIsNoNumberAndHoldsUpNothing) {
  XPlaneSettings settings;
  const std::vector<float> values(XPlaneSettings::datarefs().size() - 1, 0.5F);
  bool reported = false;
  for (std::int64_t second = 1; second < 10; ++second)
    reported = feed(&settings, values, second * 1'000'000'000) || reported;
  ASSERT_TRUE(reported);
  EXPECT_EQ(settings.values().front(), 0.5F);
  EXPECT_TRUE(std::isnan(settings.values().back()));
}

TEST(XPlaneSettings, ANumberMissingIsTheSameAsAnother) {
  const float none = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(sameValues({1.0F, none}, {1.0F, none}));
  EXPECT_FALSE(sameValues({1.0F, none}, {1.0F, 2.0F}));
  EXPECT_FALSE(sameValues({1.0F}, {1.0F, 2.0F}));
}

}  // namespace
}  // namespace xplane_bridge::core
