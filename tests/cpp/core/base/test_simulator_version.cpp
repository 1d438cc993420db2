#include "xplane_bridge/core/base/simulator_version.hpp"

#include <gtest/gtest.h>

namespace xplane_bridge::core {
namespace {

TEST(SimulatorVersion, IsTakenApart) {
  for (const std::int32_t number : {105100, 110000, 115501, 119999}) {
    EXPECT_TRUE(SimulatorVersion{number}.is11()) << number;
    EXPECT_FALSE(SimulatorVersion{number}.is12()) << number;
  }
  for (const std::int32_t number : {120000, 122015}) {
    EXPECT_TRUE(SimulatorVersion{number}.is12()) << number;
    EXPECT_FALSE(SimulatorVersion{number}.is11()) << number;
  }
  EXPECT_TRUE(kXPlane11.is11());
  EXPECT_TRUE(kXPlane12.is12());
}

TEST(SimulatorVersion, UnknownIsNeither) {
  for (const SimulatorVersion version : {SimulatorVersion{}, SimulatorVersion{0}, SimulatorVersion{-1}}) {
    EXPECT_FALSE(version.known());
    EXPECT_FALSE(version.is11());
    EXPECT_FALSE(version.is12());
    EXPECT_EQ(version, SimulatorVersion{});
    EXPECT_NE(version, kXPlane11);
  }
}

TEST(SimulatorVersion, KeepsTheExactNumber) {
  EXPECT_NE(SimulatorVersion{115501}, SimulatorVersion{115502});
  EXPECT_EQ(SimulatorVersion{115501}, SimulatorVersion{115501});
}

}  // namespace
}  // namespace xplane_bridge::core
