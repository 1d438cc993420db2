#include "xplane_bridge/core/base/units.hpp"

#include <gtest/gtest.h>

namespace xplane_bridge::core {
namespace {

// Reference values: NIST SP 811, appendix B.8.
TEST(Units, MatchPublishedFactors) {
  EXPECT_DOUBLE_EQ(kMetersPerFoot, 0.3048);
  EXPECT_NEAR(kMetersPerSecondPerKnot, 0.514444444444, 1e-12);
  EXPECT_DOUBLE_EQ(kMetersPerSecondPerMph, 0.44704);
  EXPECT_NEAR(kMetersPerSecondPerFootPerMinute, 5.08e-3, 1e-15);
  EXPECT_NEAR(kNewtonsPerPoundForce, 4.448221615, 1e-9);
  EXPECT_NEAR(kNewtonMetersPerFootPound, 1.355817948, 1e-9);
  EXPECT_NEAR(kWattsPerHorsepower, 745.6998716, 1e-7);
  EXPECT_NEAR(kPascalsPerPoundPerSquareFoot, 47.88025898, 1e-8);
  EXPECT_NEAR(kPascalsPerPsi, 6894.757293, 1e-6);
  EXPECT_NEAR(kPascalsPerInchOfMercury, 3386.389, 1e-9);
  EXPECT_NEAR(kKilogramsPerSecondPerPoundPerHour, 1.259979e-4, 1e-10);
  EXPECT_NEAR(kRadiansPerSecondPerRpm, 0.104719755, 1e-9);
  EXPECT_NEAR(kRadiansPerDegree, 0.0174532925199, 1e-13);
  EXPECT_DOUBLE_EQ(kRadiansPerDegree * kDegreesPerRadian, 1.0);
}

// 100 kt = 51.444 m/s; 2500 rpm = 261.80 rad/s; 29.92 inHg is the standard atmosphere within 0.01 %.
TEST(Units, TurnEverydayNumbers) {
  EXPECT_NEAR(100.0 * kMetersPerSecondPerKnot, 51.4444, 1e-4);
  EXPECT_NEAR(2500.0 * kRadiansPerSecondPerRpm, 261.799, 1e-3);
  EXPECT_NEAR(29.92 * kPascalsPerInchOfMercury, 101325.0, 10.0);
  EXPECT_NEAR(10000.0 * kMetersPerFoot, 3048.0, 1e-9);
}

TEST(Units, TurnFahrenheit) {
  EXPECT_NEAR(kKelvinAtZeroFahrenheit + 212.0 * kKelvinPerFahrenheit, 373.15, 1e-9);
  EXPECT_NEAR(kCelsiusAtZeroFahrenheit + 212.0 * kKelvinPerFahrenheit, 100.0, 1e-9);
}

TEST(Seconds, AreNanosecondsToTheNearest) {
  EXPECT_EQ(toNanoseconds(1.5), 1'500'000'000);
  EXPECT_EQ(toNanoseconds(2.01), 2'010'000'000);  // 2.01 * 1e9 is 2009999999.9999998 in doubles
  EXPECT_EQ(toNanoseconds(-2.01), -2'010'000'000);
  EXPECT_EQ(toNanoseconds(1.0 / 3.0), 333'333'333);
  EXPECT_DOUBLE_EQ(toSeconds(1'500'000'000), 1.5);
  EXPECT_DOUBLE_EQ(toSeconds(-1), -1e-9);
}

}  // namespace
}  // namespace xplane_bridge::core
