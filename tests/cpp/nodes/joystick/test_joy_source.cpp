#include "xplane_bridge/nodes/joystick/joy_source.hpp"

#include <gtest/gtest.h>

namespace xplane_bridge {
namespace {

constexpr double kTimeout = 0.5;  // [s]

TEST(JoySource, KeepsToTheNodeThatIsHeardAndNamesBoth) {
  JoySource source(kTimeout);
  EXPECT_EQ(source.problem(), "");
  for (int i = 0; i < 100; ++i) {
    const double now = 10.0 + 0.02 * i;
    EXPECT_TRUE(source.accept("/xplane/joy_reader", now));
    EXPECT_FALSE(source.accept("/xplane/scenario_player", now + 0.01));
  }
  EXPECT_EQ(source.refused(), 100U);
  EXPECT_NE(source.problem().find("/xplane/joy_reader is on the stick"), std::string::npos);
  EXPECT_NE(source.problem().find("messages of /xplane/scenario_player are dropped"), std::string::npos);
}

TEST(JoySource, GivesTheStickToAnotherNodeOnceTheFirstIsSilentForTheTimeout) {
  JoySource source(kTimeout);
  EXPECT_TRUE(source.accept("/a", 1.0));
  EXPECT_TRUE(source.accept("/a", 1.25));
  EXPECT_FALSE(source.accept("/b", 1.5));  // heard for the last time 0.25 s ago
  EXPECT_TRUE(source.accept("/b", 1.75));
  EXPECT_FALSE(source.accept("/a", 1.8));
  EXPECT_NE(source.problem().find("/b is on the stick"), std::string::npos);
  EXPECT_EQ(source.refused(), 2U);
}

TEST(JoySource, ADeviceThatComesBackAloneIsHeardAtOnce) {
  JoySource source(kTimeout);
  EXPECT_TRUE(source.accept("/a", 1.0));
  EXPECT_TRUE(source.accept("/a", 60.0));
  EXPECT_EQ(source.refused(), 0U);
}

TEST(JoySource, TakesNoOtherThanTheNodeItIsGiven) {
  JoySource source(kTimeout, "stick");
  EXPECT_FALSE(source.accept("/ns/other", 1.0));
  EXPECT_NE(source.problem().find("stick is on the stick, the messages of /ns/other are dropped"), std::string::npos);
  EXPECT_TRUE(source.accept("/ns/stick", 1.0));
  EXPECT_FALSE(source.accept("/ns/other", 9.0));
  EXPECT_FALSE(source.accept("/ns2/stick", 1.1));
  EXPECT_TRUE(source.accept("/ns/stick", 9.0));
}

}  // namespace
}  // namespace xplane_bridge
