#include "xplane_bridge/core/state/air_data.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

// ICAO standard atmosphere, tabulated: 1000 m 89874.6 Pa, 5000 m 54019.9 Pa, 11000 m 22632.1 Pa, 15000 m 12044.6 Pa.
TEST(PressureAltitude, MatchesTheStandardAtmosphere) {
  EXPECT_NEAR(pressureAltitude(101325.0), 0.0, 1e-9);
  EXPECT_NEAR(pressureAltitude(89874.6), 1000.0, 0.5);
  EXPECT_NEAR(pressureAltitude(54019.9), 5000.0, 0.5);
  EXPECT_NEAR(pressureAltitude(22632.1), 11000.0, 0.5);
  EXPECT_NEAR(pressureAltitude(12044.6), 15000.0, 1.0);
  EXPECT_NEAR(pressureAltitude(2511.02), 25000.0, 1.0);
  EXPECT_NEAR(pressureAltitude(868.019), 32000.0, 1.0);
  EXPECT_NEAR(pressureAltitude(277.52), 40000.0, 2.0);
  EXPECT_NEAR(pressureAltitude(110.906), 47000.0, 2.0);
  EXPECT_LT(pressureAltitude(103000.0), -100.0);
}

TEST(PressureAltitude, IsUnknownWithoutPressure) {
  EXPECT_TRUE(std::isnan(pressureAltitude(0.0)));
  EXPECT_TRUE(std::isnan(pressureAltitude(std::nan(""))));
}

// At 5000 m the standard density is 0.736429 kg/m^3: sqrt(0.736429/1.225) = 0.775346.
TEST(EquivalentAirspeed, ScalesWithDensity) {
  EXPECT_NEAR(equivalentAirspeed(100.0, 0.736429), 77.5346, 1e-3);
  EXPECT_DOUBLE_EQ(equivalentAirspeed(100.0, 1.225), 100.0);
}

// Mach 0.5 at 5000 m: p = 54019.9 Pa, q = 0.7 p M^2 = 9453.48 Pa, qc = p ((1.05)^3.5 - 1) = 10059.19 Pa;
// CAS = 340.294 sqrt(5 ((qc/101325 + 1)^(2/7) - 1)) = 125.983 m/s. EAS = 160.265 m/s (speed of sound 320.53) times
// 0.775346 = 124.261: the compressibility correction is 1.7 m/s.
TEST(CalibratedAirspeed, MatchesHandWorkedNumbers) {
  const double p = 54019.9, m = 0.5;
  const double q = 0.7 * p * m * m;
  const double qc = p * (std::pow(1.0 + 0.2 * m * m, 3.5) - 1.0);
  EXPECT_NEAR(impactPressure(q, m), qc, 1e-6);
  const double cas = calibratedAirspeed(qc);
  const double eas = equivalentAirspeed(0.5 * 320.53, 0.736429);
  EXPECT_NEAR(qc, 10059.188, 1e-3);
  EXPECT_NEAR(eas, 124.261, 1e-2);
  EXPECT_NEAR(cas, 125.983, 1e-3);
  EXPECT_GT(cas, eas);  // compressibility
}

TEST(CalibratedAirspeed, IsTrueAirspeedAtSeaLevel) {
  for (const double tas : {20.0, 60.0, 150.0, 250.0}) {
    const double mach = tas / kSeaLevelSoundSpeed;
    const double q = 0.5 * kSeaLevelDensity * tas * tas;
    EXPECT_NEAR(calibratedAirspeed(impactPressure(q, mach)), tas, 2e-4 * tas) << tas;
  }
}

// Behind the shock ahead of the tube (Rayleigh): at Mach 2 qc/p = (1.2 x 4)^3.5 (6/27)^2.5 - 1 = 4.640441; p of 11597
// Pa makes that 53815.2 Pa, by which the isentropic formula is 322 m/s. The sea level's Mach number that has it is
// below 1: 340.294 sqrt(5 ((53815.2/101325 + 1)^(2/7) - 1)) = 273.75 m/s. At sea level it is true airspeed again.
TEST(CalibratedAirspeed, AboveMachOneIsThatOfAPitotTube) {
  EXPECT_NEAR(impactPressure(0.7 * 11597.0 * 4.0, 2.0), 53815.2, 0.1);
  EXPECT_NEAR(calibratedAirspeed(53815.2), 273.752, 0.001);
  EXPECT_NEAR(calibratedAirspeed(impactPressure(0.7 * 22632.0 * 2.56, 1.6)), 293.8, 0.05);
  for (const double mach : {1.0 + 1e-9, 1.2, 2.0, 3.5}) {
    const double q = 0.7 * kSeaLevelPressure * mach * mach;
    EXPECT_NEAR(calibratedAirspeed(impactPressure(q, mach)), mach * kSeaLevelSoundSpeed, 1e-6) << mach;
  }
  EXPECT_TRUE(std::isnan(calibratedAirspeed(std::nan(""))));
  EXPECT_TRUE(std::isinf(calibratedAirspeed(HUGE_VAL)));
}

TEST(CalibratedAirspeed, IsSmoothTowardsStandstillAndOdd) {
  EXPECT_DOUBLE_EQ(calibratedAirspeed(impactPressure(0.0, 0.0)), 0.0);
  EXPECT_NEAR(impactPressure(100.0, std::sqrt(0.999e-3)), impactPressure(100.0, std::sqrt(1.001e-3)), 1e-3);
  EXPECT_DOUBLE_EQ(calibratedAirspeed(-500.0), -calibratedAirspeed(500.0));
}

}  // namespace
}  // namespace xplane_bridge::core
