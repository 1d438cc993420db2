#include <gtest/gtest.h>

#include "xplane_bridge/core/base/node_name.hpp"

namespace xplane_bridge::core {
namespace {

TEST(IsNamed, TakesAFullNameAsItIsAndAShortOneInAnyNamespace) {
  EXPECT_TRUE(isNamed("/a/b", "/a/b"));
  EXPECT_FALSE(isNamed("/x/a/b", "/a/b"));
  EXPECT_TRUE(isNamed("/b", "b"));
  EXPECT_TRUE(isNamed("/a/b", "b"));
  EXPECT_TRUE(isNamed("/x/a/b", "a/b"));
  EXPECT_FALSE(isNamed("/a/my_b", "b"));
  EXPECT_FALSE(isNamed("/a/b/c", "b"));
}

}  // namespace
}  // namespace xplane_bridge::core
