#include "xplane_bridge/core/base/whole_number.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

namespace xplane_bridge::core {
namespace {

nlohmann::json parsed(const std::string& text) { return nlohmann::json::parse(text); }

TEST(WholeNumber, IsGivenUpToTheLimitsOfItsType) {
  EXPECT_EQ(wholeNumber<std::int32_t>(parsed("2147483647")), 2147483647);
  EXPECT_EQ(wholeNumber<std::int32_t>(parsed("-2147483648")), -2147483647 - 1);
  EXPECT_EQ(wholeNumber<std::uint16_t>(parsed("65535")), 65535);
  EXPECT_EQ(wholeNumber<std::int64_t>(parsed("9223372036854775807")), std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(wholeNumber<int>(parsed("0")), 0);
}

TEST(WholeNumber, WhatItsTypeDoesNotHoldIsRefusedWithTheNumber) {
  for (const char* text : {"2147483648", "-2147483649", "1e50", "1.5", "7.0", "\"7\"", "null", "true", "[7]"}) {
    EXPECT_THROW((void)wholeNumber<std::int32_t>(parsed(text)), std::out_of_range) << text;
  }
  EXPECT_THROW((void)wholeNumber<std::uint16_t>(parsed("65536")), std::out_of_range);
  EXPECT_THROW((void)wholeNumber<std::uint16_t>(parsed("-1")), std::out_of_range);
  try {
    (void)wholeNumber<std::uint16_t>(parsed("70000"));
    FAIL();
  } catch (const std::out_of_range& error) {
    EXPECT_STREQ(error.what(), "70000 is no whole number, or one too large");
  }
}

}  // namespace
}  // namespace xplane_bridge::core
