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

TEST(NameInFiles, IsTheWholeNameOutsideTheUsualNamespace) {
  EXPECT_EQ(nameInFiles("/xplane/rx_node", "/xplane"), "rx_node");
  EXPECT_EQ(nameInFiles("/first/rx_node", "/xplane"), "first.rx_node");
  EXPECT_EQ(nameInFiles("/xplane/left/capture_node", "/xplane"), "xplane.left.capture_node");
  EXPECT_EQ(nameInFiles("/xplane2/rx_node", "/xplane"), "xplane2.rx_node");
  EXPECT_EQ(nameInFiles("/rx_node", "/xplane"), "rx_node");
}

}  // namespace
}  // namespace xplane_bridge::core
