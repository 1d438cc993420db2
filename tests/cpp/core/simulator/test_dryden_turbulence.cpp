#include "xplane_bridge/core/simulator/dryden_turbulence.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <vector>

namespace xplane_bridge::core {
namespace {

constexpr double kLength = 200.0;  // [m]
const DrydenScales kScales{{kLength, kLength, kLength}, {1.0, 2.0, 3.0}};

TEST(DrydenScales, AreThoseOfTheSpecification) {
  // 100 ft: 0.177 + 0.0823 = 0.2593; ln = -1.34977; 100 ft / exp(-1.61972) = 505.18 ft; exp(0.53991) = 1.71585
  const DrydenScales low = drydenScales(30.48, 10.0);
  EXPECT_NEAR(low.length[0], 153.98, 0.01);
  EXPECT_NEAR(low.length[1], 153.98, 0.01);
  EXPECT_NEAR(low.length[2], 30.48, 1e-9);
  EXPECT_NEAR(low.sigma[0], 1.71585, 1e-4);
  EXPECT_NEAR(low.sigma[1], 1.71585, 1e-4);
  EXPECT_NEAR(low.sigma[2], 1.0, 1e-12);
  // 1000 ft: isotropic
  const DrydenScales top = drydenScales(304.8, 10.0);
  EXPECT_LT((top.length - 304.8).abs().maxCoeff(), 1e-9);
  EXPECT_LT((top.sigma - 1.0).abs().maxCoeff(), 1e-12);
  const DrydenScales between = drydenScales(457.2, 10.0);
  EXPECT_LT((between.length - 419.1).abs().maxCoeff(), 1e-9) << "1375 ft";
  const DrydenScales high = drydenScales(5000.0, 10.0);
  EXPECT_LT((high.length - 533.4).abs().maxCoeff(), 1e-9) << "1750 ft";
  EXPECT_LT((high.sigma - 1.0).abs().maxCoeff(), 1e-12);
  EXPECT_EQ(drydenScales(0.0, 10.0).length[2], drydenScales(3.048, 10.0).length[2]);
}

/// Sums of products `lag` steps apart, over the number of them.
Eigen::Array3d correlation(const std::vector<Eigen::Vector3d>& of, std::size_t lag) {
  Eigen::Array3d sum = Eigen::Array3d::Zero();
  for (std::size_t i = lag; i < of.size(); ++i) sum += of[i].array() * of[i - lag].array();
  return sum / static_cast<double>(of.size() - lag);
}

TEST(DrydenTurbulence, HasItsVarianceAndAutocorrelationAtAnyStep) {
  for (const double share : {0.02, 0.25, 1.5}) {  // of the length, in a step
    DrydenTurbulence turbulence(7);
    std::vector<Eigen::Vector3d> air;
    for (int i = 0; i < 400; ++i) turbulence.step(share * kLength, kScales);
    const std::size_t count = share < 0.1 ? 1'200'000 : 200'000;
    for (std::size_t i = 0; i < count; ++i) air.push_back(turbulence.step(share * kLength, kScales));
    const Eigen::Array3d squared = kScales.sigma * kScales.sigma;
    const Eigen::Array3d variance = correlation(air, 0) / squared;
    EXPECT_LT((variance - 1.0).abs().maxCoeff(), 0.04) << share << ": " << variance.transpose();
    for (const std::size_t lag : {std::size_t{1}, std::size_t{4}, std::size_t{40}}) {
      const double r = share * static_cast<double>(lag);  // over the length
      // Of the specification's spectra: exp(-r/L) along, exp(-r/L) (1 - r / (2 L)) across.
      const Eigen::Array3d wanted{std::exp(-r), std::exp(-r) * (1.0 - 0.5 * r), std::exp(-r) * (1.0 - 0.5 * r)};
      const Eigen::Array3d found = correlation(air, lag) / squared;
      EXPECT_LT((found - wanted).abs().maxCoeff(), 0.04) << share << ", " << lag << ": " << found.transpose();
    }
  }
}

TEST(DrydenTurbulence, RepeatsWithItsSeedAlone) {
  DrydenTurbulence one(3), same(3), another(4);
  double differs = 0.0;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d air = one.step(1.0, kScales);
    EXPECT_EQ(air, same.step(1.0, kScales));
    differs += (air - another.step(1.0, kScales)).norm();
  }
  EXPECT_GT(differs, 1.0);
}

TEST(DrydenTurbulence, StandsWhereTheAircraftDoes) {
  DrydenTurbulence turbulence(3);
  EXPECT_EQ(turbulence.step(0.0, kScales).norm(), 0.0) << "it begins calm";
  const Eigen::Vector3d air = turbulence.step(50.0, kScales);
  EXPECT_GT(air.norm(), 0.0);
  EXPECT_LT((turbulence.step(0.0, kScales) - air).norm(), 1e-12);
}

}  // namespace
}  // namespace xplane_bridge::core
