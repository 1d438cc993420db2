#include "xplane_bridge/core/base/text.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

namespace xplane_bridge::core {
namespace {

TEST(Join, PutsTheSeparatorBetweenTexts) {
  EXPECT_EQ(join(std::vector<std::string>{"roll", "pitch", "yaw"}), "roll, pitch, yaw");
  EXPECT_EQ(join(std::vector<std::string>{"roll", "pitch"}, "; "), "roll; pitch");
  EXPECT_EQ(join(std::set<std::string>{"b", "a"}), "a, b");
}

TEST(Join, OfOneOrNoTextHasNoSeparator) {
  EXPECT_EQ(join(std::vector<std::string>{"roll"}), "roll");
  EXPECT_EQ(join(std::vector<std::string>{}), "");
}

TEST(Join, KeepsEmptyTexts) { EXPECT_EQ(join(std::vector<std::string>{"", "roll", ""}), ", roll, "); }

TEST(Join, TakesTheTextOfEachItem) {
  EXPECT_EQ(join(std::vector<int>{3, 20}, ", ", [](int row) { return std::to_string(row); }), "3, 20");
}

TEST(AfterLastSlash, IsTheNameOfAPath) {
  EXPECT_EQ(afterLastSlash("sim/operation/override/override_joystick"), "override_joystick");
  EXPECT_EQ(afterLastSlash("override_joystick"), "override_joystick");
  EXPECT_EQ(afterLastSlash("sim/"), "");
}

}  // namespace
}  // namespace xplane_bridge::core
