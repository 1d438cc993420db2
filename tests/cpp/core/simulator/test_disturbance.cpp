#include "xplane_bridge/core/simulator/disturbance.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "xplane_bridge/core/simulator/wind_fields.hpp"

namespace xplane_bridge::core {
namespace {

DisturbanceSpec gust() {
  DisturbanceSpec spec;
  spec.from_deg = 270.0;
  spec.speed = 8.0;
  spec.length = 200.0;
  return spec;
}

DisturbanceSpec microburst() {
  DisturbanceSpec spec;
  spec.kind = DisturbanceKind::kMicroburst;
  spec.speed = 15.0;
  spec.latitude_deg = 37.0;
  spec.longitude_deg = 127.0;
  spec.radius = 1000.0;
  spec.height = 60.0;
  return spec;
}

AirPlace at(double time, double height = 100.0) { return {time, 50.0, {37.0, 127.0, height}}; }

TEST(Disturbance, IsRefusedWithWhatWasGivenAndWhatWasExpected) {
  EXPECT_EQ(check(gust()), std::nullopt);
  DisturbanceSpec spec = gust();
  spec.duration = 3.0;
  EXPECT_EQ(check(spec).value_or(""),
            "length is 200 and duration is 3: expected one of both above 0, [m] of air flown through or [s]");
  spec = gust();
  spec.radius = 10.0;
  EXPECT_EQ(check(spec).value_or(""), "radius is 10: expected 0, kind gust does not use it");
  spec = gust();
  spec.speed = 51.0;
  EXPECT_EQ(check(spec).value_or(""), "speed is 51: expected 0..50 [m/s]");
  spec.speed = 0.0;
  EXPECT_EQ(check(spec).value_or(""), "speed and vertical_speed are 0: expected the peak of the gust");
  spec.speed = std::nan("");
  EXPECT_EQ(check(spec).value_or(""), "speed is nan: expected 0..50 [m/s]");
  spec = DisturbanceSpec{};
  spec.kind = DisturbanceKind::kShear;
  EXPECT_EQ(check(spec).value_or(""),
            "gradient is 0 and roughness is 0: expected one of both, for a linear or a logarithmic profile");
  spec = microburst();
  EXPECT_EQ(check(spec), std::nullopt);
  spec.height = 5.0;
  EXPECT_EQ(check(spec).value_or(""), "height is 5: expected 10..1000 [m above ground]");
  spec = microburst();
  spec.latitude_deg = 0.0;
  EXPECT_EQ(check(spec), std::nullopt) << "on the equator";
  spec.longitude_deg = 0.0;
  EXPECT_EQ(check(spec).value_or(""), "no place is given: expected latitude and longitude, of which one is not 0");
}

TEST(Disturbance, WithAVerticalWindIsRefusedUnlessThatMayBeLeftOut) {
  EXPECT_EQ(refusalBy(gust()), std::nullopt);
  DisturbanceSpec spec = gust();
  spec.vertical_speed = 3.0;
  EXPECT_NE(refusalBy(spec).value_or("").find("a gust with a vertical wind cannot be commanded"), std::string::npos);
  spec.horizontal_only = true;
  EXPECT_EQ(refusalBy(spec), std::nullopt);
  EXPECT_NE(refusalBy(microburst()), std::nullopt);
  spec = DisturbanceSpec{};
  spec.kind = DisturbanceKind::kTurbulence;
  EXPECT_NE(refusalBy(spec), std::nullopt);
  spec.kind = DisturbanceKind::kShear;
  EXPECT_EQ(refusalBy(spec), std::nullopt);
}

TEST(Disturbance, GustOfALengthIsFlownThrough) {
  DisturbanceSpec spec = gust();
  spec.vertical_speed = 4.0;
  Disturbance disturbance(spec);
  EXPECT_EQ(disturbance.step(at(0.0)).norm(), 0.0);
  // 50 m/s: 50 m after a second, a quarter of it; from the west: air goes east.
  const Eigen::Vector3d quarter = disturbance.step(at(1.0));
  EXPECT_NEAR(quarter.x(), 0.0, 1e-9);
  EXPECT_NEAR(quarter.y(), 4.0, 1e-9);
  EXPECT_NEAR(quarter.z(), -2.0, 1e-9) << "up";
  EXPECT_NEAR(disturbance.step(at(2.0)).y(), 8.0, 1e-9);
  EXPECT_NEAR(disturbance.step(at(2.0)).y(), 8.0, 1e-9) << "time stands";
  EXPECT_FALSE(disturbance.over());
  EXPECT_EQ(disturbance.step(at(4.0)).norm(), 0.0);
  EXPECT_TRUE(disturbance.over());
}

TEST(Disturbance, GustOfADurationEndsWithIt) {
  DisturbanceSpec spec = gust();
  spec.length = 0.0;
  spec.duration = 6.0;
  Disturbance disturbance(spec);
  EXPECT_NEAR(disturbance.step(at(1.0)).y(), 2.0, 1e-9) << "(1 - cos 60 deg) / 2 of it";
  EXPECT_NEAR(disturbance.step(at(3.0)).y(), 8.0, 1e-9);
  disturbance.step(at(6.0));
  EXPECT_TRUE(disturbance.over());
}

TEST(Disturbance, ShearChangesWithHeightUntilItIsStopped) {
  DisturbanceSpec spec;
  spec.kind = DisturbanceKind::kShear;
  spec.speed = 10.0;
  spec.roughness = 0.6096;
  Disturbance disturbance(spec);  // from the north: air goes south
  EXPECT_NEAR(disturbance.step(at(1.0, 60.96)).x(), -20.0, 1e-9);
  EXPECT_NEAR(disturbance.step(at(1e5, 6.096)).x(), -10.0, 1e-9);
  EXPECT_FALSE(disturbance.over());
}

TEST(Disturbance, TurbulenceIsThatOfItsSpecificationAlongTheWind) {
  DisturbanceSpec spec;
  spec.kind = DisturbanceKind::kTurbulence;
  spec.speed = 10.0;
  spec.from_deg = 180.0;  // air goes north, its right is east
  spec.seed = 5;
  Disturbance disturbance(spec);
  DrydenTurbulence same(5);
  for (int i = 1; i < 50; ++i) {
    const Eigen::Vector3d air = disturbance.step(at(0.02 * i));
    EXPECT_LT((air - same.step(1.0, drydenScales(100.0, 10.0))).norm(), 1e-6) << "50 m/s for 0.02 s";
  }
}

TEST(Disturbance, MicroburstLiesAtItsPlace) {
  Disturbance disturbance(microburst());
  // A degree of latitude on X-Plane's sphere is 111 319.6 m: 1121.2 m north of the centre.
  const Eigen::Vector3d north = disturbance.step({1.0, 50.0, {37.0 + 1121.2 / 111319.6, 127.0, 60.0}});
  EXPECT_NEAR(north.x(), 15.0, 0.01);
  EXPECT_NEAR(north.y(), 0.0, 1e-6);
  const Eigen::Vector3d east = disturbance.step({2.0, 50.0, {37.0, 127.01, 60.0}});
  EXPECT_NEAR(east.y(), microburstWind({1000.0, 15.0, 60.0}, 0.0, 889.04, 60.0).y(), 0.01) << "0.01 deg x cos(37 deg)";
}

}  // namespace
}  // namespace xplane_bridge::core
