#include "xplane_bridge/core/simulator/wind_fields.hpp"

#include <gtest/gtest.h>

namespace xplane_bridge::core {
namespace {

TEST(OneMinusCosine, IsOneInTheMiddleAndNothingOutside) {
  EXPECT_EQ(oneMinusCosine(-1.0, 100.0), 0.0);
  EXPECT_EQ(oneMinusCosine(0.0, 100.0), 0.0);
  EXPECT_NEAR(oneMinusCosine(25.0, 100.0), 0.5, 1e-12);
  EXPECT_NEAR(oneMinusCosine(50.0, 100.0), 1.0, 1e-12);
  EXPECT_NEAR(oneMinusCosine(100.0 / 6.0, 100.0), 0.25, 1e-12) << "(1 - cos 60 deg) / 2";
  EXPECT_EQ(oneMinusCosine(100.0, 100.0), 0.0);
  EXPECT_EQ(oneMinusCosine(150.0, 100.0), 0.0);
}

TEST(LogarithmicShear, RisesWithTheLogarithmOfHeight) {
  const double roughness = 0.6096;  // 2 ft: 20 ft is ten of them
  EXPECT_NEAR(logarithmicShear(10.0, roughness, 6.096), 10.0, 1e-9);
  EXPECT_NEAR(logarithmicShear(10.0, roughness, 60.96), 20.0, 1e-9) << "log10 of 100";
  EXPECT_NEAR(logarithmicShear(10.0, roughness, 0.0), 1.76091, 1e-5) << "log10 of 3 ft / 2 ft";
  EXPECT_NEAR(logarithmicShear(10.0, roughness, 304.8), 26.98970, 1e-5) << "log10 of 500";
  EXPECT_NEAR(logarithmicShear(10.0, roughness, 5000.0), 26.98970, 1e-5) << "as at 1000 ft";
}

TEST(LogarithmicShear, FadesToNothingAtTheRoughnessAndDoesNotTurnBelow) {
  for (const double roughness : {0.95, 1.5, 2.0}) {
    for (const double height : {0.0, 0.9144, roughness}) {
      EXPECT_EQ(logarithmicShear(10.0, roughness, height), 0.0) << roughness << " m, at " << height << " m";
    }
    EXPECT_GT(logarithmicShear(10.0, roughness, roughness + 0.1), 0.0) << roughness << " m";
    EXPECT_NEAR(logarithmicShear(10.0, roughness, 6.096), 10.0, 1e-9) << roughness << " m";
  }
}

TEST(LinearShear, RisesByItsGradient) {
  EXPECT_NEAR(linearShear(8.0, 0.05, 26.096), 9.0, 1e-12);
  EXPECT_NEAR(linearShear(0.0, -0.1, 106.096), -10.0, 1e-12);
}

TEST(MicroburstWind, IsStrongestWhereTheReportSays) {
  const Microburst microburst{1000.0, 15.0, 60.0};
  EXPECT_NEAR(microburstWind(microburst, 1121.2, 0.0, 60.0).x(), 15.0, 0.01);
  for (const double step : {-50.0, 50.0}) {
    EXPECT_LT(microburstWind(microburst, 1121.2 + step, 0.0, 60.0).x(), 14.99);
    EXPECT_LT(microburstWind(microburst, 1121.2, 0.0, 60.0 + 0.3 * step).x(), 14.99);
  }
}

TEST(MicroburstWind, FlowsOutOfItsCentreAndSinksThere) {
  const Microburst microburst{1000.0, 15.0, 60.0};
  EXPECT_GT(microburstWind(microburst, 0.0, 500.0, 60.0).y(), 5.0) << "to the east, east of it";
  EXPECT_LT(microburstWind(microburst, -500.0, 0.0, 60.0).x(), -5.0) << "to the south, south of it";
  const Eigen::Vector3d centre = microburstWind(microburst, 0.0, 0.0, 60.0 / 0.22);
  EXPECT_EQ(centre.x(), 0.0);
  EXPECT_EQ(centre.y(), 0.0);
  // lambda = 15 / (0.2357 * 1000) = 0.0636402 1/s; z* = 272.727 m, epsilon = 21.818 m:
  // lambda (z* (1 - 1/e) - epsilon (1 - exp(-12.5))) = 0.0636402 (172.397 - 21.818)
  EXPECT_NEAR(centre.z(), 9.5829, 1e-3);
  EXPECT_EQ(microburstWind(microburst, 300.0, 400.0, 0.0).norm(), 0.0) << "stagnation on the ground";
}

TEST(MicroburstWind, LosesNoAir) {
  const Microburst microburst{800.0, 12.0, 45.0};
  const double d = 0.01;  // [m]
  for (const double north : {0.0, 150.0, -900.0}) {
    for (const double height : {20.0, 120.0, 600.0}) {
      const auto at = [&](double n, double e, double z) { return microburstWind(microburst, n, 250.0 + e, z); };
      const double divergence = (at(north + d, 0, height) - at(north - d, 0, height)).x() +
                                (at(north, d, height) - at(north, -d, height)).y() -
                                (at(north, 0, height + d) - at(north, 0, height - d)).z();
      EXPECT_NEAR(divergence / (2.0 * d), 0.0, 1e-7) << north << " m north, at " << height << " m";
    }
  }
}

}  // namespace
}  // namespace xplane_bridge::core
