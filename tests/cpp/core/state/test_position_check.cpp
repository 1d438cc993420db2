#include "xplane_bridge/core/state/position_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

using Eigen::Vector3d;

/// A climbing turn about a point near 37.6 N 126.7 E, ENU of that point [m].
Vector3d turning(double t) {
  constexpr double kRadius = 800.0, kRate = 0.1;
  return {kRadius * std::sin(kRate * t), kRadius * std::cos(kRate * t), 900.0 + 4.0 * t};
}

const TangentFrame kThere(GeoPoint{37.6, 126.7, 0.0});

/// Computed positions at 60 Hz; RPOS at another moment than any of them, moved by `error` (ENU) [m].
PositionCheck fly(const Vector3d& error, double seconds = 3.0) {
  PositionCheck check;
  int n = 0;
  for (double t = 0.0; t < seconds; t += 1.0 / 60.0) {
    check.addComputed(kThere.geoPoint(turning(t)));
    if (++n % 3 == 0) check.addReference(kThere.geoPoint(turning(t + 0.0123) + error));
  }
  return check;
}

TEST(PositionCheck, AgreesAlongTheTrackWithoutTime) {
  const PositionCheck check = fly(Vector3d::Zero());
  EXPECT_EQ(check.verdict(), PositionCheck::Verdict::kAgrees);
  EXPECT_LT(std::abs(check.heightError()), 1e-3);
  EXPECT_LT(check.crossTrackError(), 5e-3);
  EXPECT_GT(check.comparisons(), 10);
}

TEST(PositionCheck, SeesWrongHeight) {
  const PositionCheck check = fly({0.0, 0.0, 0.2});
  EXPECT_EQ(check.verdict(), PositionCheck::Verdict::kDisagrees);
  EXPECT_NEAR(std::abs(check.heightError()), 0.2, 0.02);
}

TEST(PositionCheck, SeesTrackBesideTheTrack) {
  PositionCheck check;
  for (int i = 0; i < 200; ++i) {
    const Vector3d here(60.0 / 60.0 * i, 0.0, 500.0);
    check.addComputed(kThere.geoPoint(here));
    if (i % 3 == 0) check.addReference(kThere.geoPoint(here + Vector3d(0.4, 0.3, 0.0)));
  }
  EXPECT_EQ(check.verdict(), PositionCheck::Verdict::kDisagrees);
  EXPECT_NEAR(check.crossTrackError(), 0.3, 1e-3);
}

TEST(PositionCheck, ParkedAircraftIsComparedToo) {
  PositionCheck check;
  for (int i = 0; i < 100; ++i) {
    check.addComputed(kThere.geoPoint({10.0, 20.0, 1.0}));
    check.addReference(kThere.geoPoint({10.01, 20.0, 1.01}));
  }
  EXPECT_EQ(check.verdict(), PositionCheck::Verdict::kAgrees);
  EXPECT_NEAR(check.crossTrackError(), 0.01, 1e-4);
}

TEST(PositionCheck, HasNoVerdictBeforeEnoughComparisons) {
  PositionCheck check;
  EXPECT_EQ(check.verdict(), PositionCheck::Verdict::kUnknown);
  EXPECT_TRUE(std::isnan(check.heightError()));
  check.addComputed(kThere.geoPoint({0, 0, 0}));
  check.addReference(kThere.geoPoint({0, 0, 0}));
  check.addComputed(kThere.geoPoint({1, 0, 0}));
  check.addComputed(kThere.geoPoint({2, 0, 0}));
  EXPECT_EQ(check.comparisons(), 1);
  EXPECT_EQ(check.verdict(), PositionCheck::Verdict::kUnknown);
}

TEST(PositionCheck, ChangesItsMind) {
  PositionCheck check;
  for (int i = 0; i < 400; ++i) {
    const Vector3d here(i, 0.0, 500.0);
    check.addComputed(kThere.geoPoint(here));
    check.addReference(kThere.geoPoint(here + Vector3d(0, 0, i < 200 ? 0.0 : 1.0)));
    if (i == 199) {
      EXPECT_EQ(check.verdict(), PositionCheck::Verdict::kAgrees);
    }
  }
  EXPECT_EQ(check.verdict(), PositionCheck::Verdict::kDisagrees);
}

/// All verdicts of a minute in level turns of so many g (0: straight), with a position every `period` [s] and RPOS 20
/// times a second, moved by `error` (ENU) [m].
std::set<PositionCheck::Verdict> verdicts(double period, double speed, double lateral_g, const Vector3d& error) {
  const double curvature = lateral_g * 9.80665 / (speed * speed);
  const auto place = [&](double t) {
    const double angle = curvature * speed * t;
    if (curvature == 0.0) return Vector3d(speed * t, 0.0, 1000.0);
    return Vector3d(std::sin(angle) / curvature, (1.0 - std::cos(angle)) / curvature, 1000.0);
  };
  PositionCheck check;
  std::set<PositionCheck::Verdict> out;
  int computed = 0;
  for (int k = 0; k < 60 * 20; ++k) {
    const double now = k / 20.0 + 0.013;
    for (; computed * period <= now; ++computed) check.addComputed(kThere.geoPoint(place(computed * period)));
    check.addReference(kThere.geoPoint(place(now) + error));
    out.insert(check.verdict());
  }
  return out;
}

TEST(PositionCheck, ATurnBetweenFewPositionsIsNoOtherEarth) {
  for (const double period : {0.05, 0.1, 0.2, 0.3, 0.5, 1.0}) {
    for (const double speed : {30.0, 60.0, 120.0, 220.0}) {
      for (const double lateral_g : {0.0, 0.2, 1.0, 2.0, 3.0}) {
        const auto seen = verdicts(period, speed, lateral_g, Vector3d::Zero());
        EXPECT_EQ(seen.count(PositionCheck::Verdict::kDisagrees), 0U)
            << "a position every " << period << " s at " << speed << " m/s, " << lateral_g << " g";
        if (lateral_g < 1.0 || period < 0.2) {
          EXPECT_EQ(seen.count(PositionCheck::Verdict::kAgrees), 1U)
              << "a position every " << period << " s at " << speed << " m/s, " << lateral_g << " g";
        }
      }
    }
  }
}

TEST(PositionCheck, SeesWrongHeightBetweenFewPositions) {
  for (const double speed : {60.0, 220.0}) {
    EXPECT_EQ(verdicts(1.0, speed, 0.0, {0.0, 0.0, 0.2}).count(PositionCheck::Verdict::kDisagrees), 1U);
  }
}

// A wrong radius of the sphere: 26 to 35 m at 39 km (docs/protocol.md 1.8) must not pass.
TEST(PositionCheck, SeesAWrongEarthRadius) {
  const TangentFrame right(GeoPoint{37.5, 127.0, 0.0}, 6378145.0), wrong(GeoPoint{37.5, 127.0, 0.0}, 6371000.0);
  PositionCheck check;
  for (int i = 0; i < 100; ++i) {
    const Vector3d local(-35000.0 + i, 15000.0, 1000.0);
    check.addComputed(wrong.geoPoint(local));
    check.addReference(right.geoPoint(local));
  }
  EXPECT_EQ(check.verdict(), PositionCheck::Verdict::kDisagrees);
}

}  // namespace
}  // namespace xplane_bridge::core
