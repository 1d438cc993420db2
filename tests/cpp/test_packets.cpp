#include "xplane_bridge/core/packets.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <string>
#include <vector>

namespace xplane_bridge::core {
namespace {

TEST(EncodeRese, IsTheBareHeader) {
  std::array<std::uint8_t, 8> buffer{};
  const EncodeResult size = encodeRese(buffer);
  ASSERT_TRUE(size.ok());
  ASSERT_EQ(*size, 5U);
  EXPECT_EQ(std::memcmp(buffer.data(), "RESE\0", 5), 0);
}

}  // namespace
}  // namespace xplane_bridge::core
