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

TEST(VersionRange, HasItsFirstVersionAndNotItsEnd) {
  constexpr VersionRange range{120000, 120800};
  EXPECT_FALSE(range.has(SimulatorVersion{119999}));
  EXPECT_TRUE(range.has(SimulatorVersion{120000}));
  EXPECT_TRUE(range.has(SimulatorVersion{120799}));
  EXPECT_FALSE(range.has(SimulatorVersion{120800}));
}

TEST(VersionRange, AnUnknownVersionHasOnlyWhatAllHave) {
  EXPECT_TRUE(VersionRange{}.isAll());
  EXPECT_TRUE(VersionRange{}.has(SimulatorVersion{}));
  EXPECT_FALSE((VersionRange{0, 120000}.has(SimulatorVersion{})));
  EXPECT_FALSE((VersionRange{120000}.has(SimulatorVersion{})));
}

}  // namespace
}  // namespace xplane_bridge::core
