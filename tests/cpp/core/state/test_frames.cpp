#include "xplane_bridge/core/state/frames.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kTight = 1e-12;

EulerAngles degrees(double roll, double pitch, double heading) {
  return {roll * kRadiansPerDegree, pitch * kRadiansPerDegree, heading * kRadiansPerDegree};
}

Matrix3d rotateX(double angle) { return Eigen::AngleAxisd(angle, Vector3d::UnitX()).toRotationMatrix(); }
Matrix3d rotateY(double angle) { return Eigen::AngleAxisd(angle, Vector3d::UnitY()).toRotationMatrix(); }
Matrix3d rotateZ(double angle) { return Eigen::AngleAxisd(angle, Vector3d::UnitZ()).toRotationMatrix(); }

/// The same rotation, whichever sign the quaternion has.
void expectSameRotation(const Quaterniond& a, const Quaterniond& b, double tolerance) {
  EXPECT_NEAR(a.angularDistance(b), 0.0, tolerance) << a.coeffs().transpose() << " / " << b.coeffs().transpose();
}

// --- angles ---

TEST(Wrap, KeepsTheRange) {
  EXPECT_DOUBLE_EQ(wrap180(180.0), -180.0);
  EXPECT_DOUBLE_EQ(wrap180(-180.0), -180.0);
  EXPECT_DOUBLE_EQ(wrap180(190.0), -170.0);
  EXPECT_DOUBLE_EQ(wrap180(-550.0), 170.0);
  EXPECT_DOUBLE_EQ(wrap360(-0.5), 359.5);
  EXPECT_DOUBLE_EQ(wrap360(360.0), 0.0);
  EXPECT_DOUBLE_EQ(wrap360(725.0), 5.0);
  EXPECT_LT(wrap360(-1e-20), 360.0);
  EXPECT_NEAR(wrapPi(3.5), 3.5 - 2.0 * kPi, kTight);
}

// --- attitude: roll 20 deg, pitch -10 deg, heading 250 deg ---
//
// By hand: R = Rz(250) Ry(-10) Rx(20); R11 = cos250 cos(-10) = -0.34202 * 0.98481 = -0.33682; R31 = -sin(-10) =
// 0.17365; R32 = cos(-10) sin 20 = 0.33682; R33 = cos(-10) cos 20 = 0.92542. The whole matrix and the quaternions are
// from scipy.spatial.transform.Rotation.from_euler("ZYX", ...), an independent implementation.

TEST(Attitude, RotationMatrixMatchesHandWorkedNumbers) {
  Matrix3d expected;
  expected << -0.33682409, 0.9033352, -0.26558436,  //
      -0.92541658, -0.26558436, 0.27031298,         //
      0.17364818, 0.33682409, 0.92541658;
  EXPECT_TRUE(rotationNedFrd(degrees(20.0, -10.0, 250.0)).isApprox(expected, 1e-7));
}

TEST(Attitude, QuaternionMatchesHandWorkedNumbers) {
  const Quaterniond q = quaternionNedFrd(degrees(20.0, -10.0, 250.0));
  EXPECT_NEAR(q.w(), 0.57511045, 1e-8);
  EXPECT_NEAR(q.x(), 0.02891232, 1e-8);
  EXPECT_NEAR(q.y(), -0.19093399, 1e-8);
  EXPECT_NEAR(q.z(), -0.79495676, 1e-8);
}

TEST(Attitude, EnuFluQuaternionMatchesHandWorkedNumbers) {
  const Quaterniond q = quaternionEnuFlu(quaternionNedFrd(degrees(20.0, -10.0, 250.0)));
  EXPECT_NEAR(q.w(), 0.15545482, 1e-8);
  EXPECT_NEAR(q.x(), 0.11456662, 1e-8);
  EXPECT_NEAR(q.y(), -0.15545482, 1e-8);
  EXPECT_NEAR(q.z(), -0.96878382, 1e-8);
}

// REP 103: level, nose east is the identity; nose north is a quarter turn left (+90 deg about up).
TEST(Attitude, EnuFluCardinalDirections) {
  expectSameRotation(quaternionEnuFlu(quaternionNedFrd(degrees(0, 0, 90))), Quaterniond::Identity(), kTight);
  expectSameRotation(quaternionEnuFlu(quaternionNedFrd(degrees(0, 0, 0))), Quaterniond(rotateZ(kPi / 2.0)), kTight);
  const Vector3d nose_up = quaternionEnuFlu(quaternionNedFrd(degrees(0, 30, 90))) * Vector3d::UnitX();
  EXPECT_NEAR(nose_up.x(), std::cos(kPi / 6.0), kTight);
  EXPECT_NEAR(nose_up.z(), 0.5, kTight);
}

TEST(Attitude, GridAgreesWithElementaryRotations) {
  for (double roll = -180; roll <= 180; roll += 30) {
    for (double pitch = -90; pitch <= 90; pitch += 15) {
      for (double heading = 0; heading <= 360; heading += 30) {
        SCOPED_TRACE(testing::Message() << roll << " " << pitch << " " << heading);
        const EulerAngles a = degrees(roll, pitch, heading);
        const Matrix3d expected = rotateZ(a.heading) * rotateY(a.pitch) * rotateX(a.roll);
        EXPECT_TRUE(rotationNedFrd(a).isApprox(expected, 1e-12));
        const Quaterniond q = quaternionNedFrd(a);
        EXPECT_GE(q.w(), 0.0);
        EXPECT_TRUE(q.toRotationMatrix().isApprox(expected, 1e-12));
        const Matrix3d enu_flu = rotateZ(kPi / 2.0 - a.heading) * rotateY(-a.pitch) * rotateX(a.roll);
        EXPECT_TRUE(quaternionEnuFlu(q).toRotationMatrix().isApprox(enu_flu, 1e-12));
      }
    }
  }
}

TEST(Attitude, EulerAnglesAreRecovered) {
  for (double roll = -179; roll <= 179; roll += 17.9) {
    for (double pitch = -89.9; pitch <= 89.9; pitch += 8.99) {
      for (double heading = -179; heading <= 179; heading += 17.9) {
        const EulerAngles a = degrees(roll, pitch, heading);
        const EulerAngles b = eulerAngles(rotationNedFrd(a));
        ASSERT_NEAR(a.roll, b.roll, 1e-9);
        ASSERT_NEAR(a.pitch, b.pitch, 1e-9);
        ASSERT_NEAR(a.heading, b.heading, 1e-9);
      }
    }
  }
}

TEST(Attitude, StraightUpAndDownKeepTheRotation) {
  for (const double pitch : {-90.0, 90.0}) {
    for (double heading = 0; heading < 360; heading += 45) {
      const Matrix3d R = rotateZ(heading * kRadiansPerDegree) * rotateY(pitch * kRadiansPerDegree) * rotateX(0.7);
      const EulerAngles a = eulerAngles(R);
      EXPECT_NEAR(a.pitch, pitch * kRadiansPerDegree, 1e-7);
      EXPECT_DOUBLE_EQ(a.roll, 0.0);
      EXPECT_TRUE(rotationNedFrd(a).isApprox(R, 1e-7));
    }
  }
}

// --- Euler rates, same attitude, p q r = 0.1, 0.2, -0.3 ---
//
// By hand: turn = q sin20 + r cos20 = 0.068404 - 0.281908 = -0.213504; roll rate = 0.1 + turn tan(-10) = 0.137646;
// pitch rate = q cos20 - r sin20 = 0.187939 + 0.102606 = 0.290545; heading rate = turn / cos(-10) = -0.216797.
TEST(EulerRates, MatchHandWorkedNumbers) {
  const Vector3d rates = eulerRates(degrees(20.0, -10.0, 250.0), {0.1, 0.2, -0.3});
  EXPECT_NEAR(rates.x(), 0.1376464729, 1e-9);
  EXPECT_NEAR(rates.y(), 0.2905445672, 1e-9);
  EXPECT_NEAR(rates.z(), -0.2167973972, 1e-9);
}

// dR/dt = R [w]x: rotating a little by w must move the angles by the rates.
TEST(EulerRates, AreTheDerivativeOfTheAngles) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> angle(-1.3, 1.3), rate(-2.0, 2.0);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 200; ++i) {
    const EulerAngles a{2.0 * angle(random), angle(random), 2.0 * angle(random)};
    const Vector3d w(rate(random), rate(random), rate(random));
    const Matrix3d turned = rotationNedFrd(a) * Eigen::AngleAxisd(w.norm() * kStep, w.normalized()).toRotationMatrix();
    const EulerAngles b = eulerAngles(turned);
    const Vector3d expected((b.roll - a.roll) / kStep, (b.pitch - a.pitch) / kStep, (b.heading - a.heading) / kStep);
    ASSERT_TRUE(eulerRates(a, w).isApprox(expected, 1e-4)) << eulerRates(a, w) << "\n" << expected;
  }
}

TEST(EulerRates, AreUnknownStraightUp) {
  const Vector3d at = eulerRates(degrees(0.0, 89.95, 0.0), {0.1, 0.2, 0.3});
  EXPECT_TRUE(std::isnan(at.x()));
  EXPECT_NEAR(at.y(), 0.2, kTight);
  EXPECT_TRUE(std::isnan(at.z()));
  EXPECT_TRUE(eulerRates(degrees(0.0, 89.85, 0.0), {0.1, 0.2, 0.3}).allFinite());
}

// --- axis permutations ---

TEST(Axes, NameEachDirection) {
  EXPECT_EQ(enuFromNed({1, 2, 3}), Vector3d(2, 1, -3));
  EXPECT_EQ(nedFromEnu({2, 1, -3}), Vector3d(1, 2, 3));
  EXPECT_EQ(fluFromFrd({1, 2, 3}), Vector3d(1, -2, -3));
  EXPECT_EQ(frdFromFlu({1, -2, -3}), Vector3d(1, 2, 3));
  // OpenGL: X east, Y up, Z south.
  EXPECT_EQ(enuFromOpengl({1, 2, 3}), Vector3d(1, -3, 2));
  EXPECT_EQ(openglFromEnu({1, -3, 2}), Vector3d(1, 2, 3));
}

// --- air data axes ---

// Same attitude; over ground 30 north, -40 east, 2 down; wind from the east, 10 m/s, so the air moves (0, -10, 0) and
// the air-relative velocity is (30, -30, 2) NED. R^T by it: u = -0.336824*30 + 0.925417*30 + 0.173648*2 = 18.0051, v =
// 0.903335*30 + 0.265584*30 + 0.336824*2 = 35.7412, w = -0.265584*30 - 0.270313*30 + 0.925417*2 = -14.2261.
TEST(AirData, MatchesHandWorkedNumbers) {
  const Vector3d wind = windNedFromDirection(90.0 * kRadiansPerDegree, 10.0);
  EXPECT_TRUE(wind.isApprox(Vector3d(0, -10, 0), 1e-12));
  const Vector3d air = airRelativeVelocity(rotationNedFrd(degrees(20, -10, 250)), {30, -40, 2}, wind);
  EXPECT_NEAR(air.x(), 18.00507104, 1e-6);
  EXPECT_NEAR(air.y(), 35.74123486, 1e-6);
  EXPECT_NEAR(air.z(), -14.22608687, 1e-6);
  const AirAngles angles = airAngles(air);
  EXPECT_NEAR(angles.angle_of_attack * kDegreesPerRadian, -38.31281229, 1e-6);
  EXPECT_NEAR(angles.sideslip * kDegreesPerRadian, 57.29827424, 1e-6);
  EXPECT_NEAR(angles.true_airspeed, std::sqrt(30.0 * 30 + 30 * 30 + 4), 1e-9);
}

TEST(AirData, WindFromTheRightIsPositiveSideslip) {
  const Matrix3d north = rotationNedFrd(degrees(0, 0, 0));
  const Vector3d from_east = windNedFromDirection(kPi / 2.0, 5.0);  // right of a nose to the north
  EXPECT_GT(airAngles(airRelativeVelocity(north, {50, 0, 0}, from_east)).sideslip, 0.05);
  EXPECT_LT(airAngles(airRelativeVelocity(north, {50, 0, 0}, -from_east)).sideslip, -0.05);
}

TEST(AirData, NoseAboveThePathIsPositiveAngleOfAttack) {
  const Vector3d air = airRelativeVelocity(rotationNedFrd(degrees(0, 5, 0)), {50, 0, 0}, Vector3d::Zero());
  EXPECT_NEAR(airAngles(air).angle_of_attack, 5.0 * kRadiansPerDegree, kTight);
}

TEST(AirData, AnglesAreZeroWhenAlmostStill) {
  const AirAngles still = airAngles({0.3, 0.4, -0.2});
  EXPECT_EQ(still.angle_of_attack, 0.0);
  EXPECT_EQ(still.sideslip, 0.0);
  EXPECT_NEAR(still.true_airspeed, std::sqrt(0.29), kTight);
}

TEST(AirData, WindDirectionIsWhereItComesFrom) {
  EXPECT_NEAR(windFromDirectionDeg({-5, 0, 0}), 0.0, 1e-9);
  EXPECT_NEAR(windFromDirectionDeg({0, -5, 0}), 90.0, 1e-9);
  EXPECT_NEAR(windFromDirectionDeg({5, 0, 0}), 180.0, 1e-9);
  EXPECT_NEAR(windFromDirectionDeg({0, 5, 1}), 270.0, 1e-9);
  EXPECT_EQ(windFromDirectionDeg({0, 0, 2}), 0.0);
  for (double from = 0; from < 360; from += 7) {
    EXPECT_NEAR(windFromDirectionDeg(windNedFromDirection(from * kRadiansPerDegree, 8.0)), from, 1e-9);
  }
}

// --- specific force ---

// At rest with nose up 10 deg, rolled right 5 deg, an accelerometer reads minus gravity in body axes:
// -R^T (0, 0, g) = g (sin10, -cos10 sin5, -cos10 cos5) = (1.70290, -0.84173, -9.62091).
// Load factors: axial +sin(pitch) = 0.17365, side -0.08583, normal 0.98106. Row 4 carries +0.17365 axial, the dataref
// g_axil -0.17365 (aft positive).
TEST(SpecificForce, AtRestReadsMinusGravity) {
  const Vector3d expected = -rotationNedFrd(degrees(5, 10, 77)).transpose() * Vector3d(0, 0, kStandardGravity);
  EXPECT_NEAR(expected.x(), 1.70290, 1e-5);
  EXPECT_NEAR(expected.y(), -0.84173, 1e-5);
  EXPECT_NEAR(expected.z(), -9.62091, 1e-5);
  const double axial = 0.17364818, side = -0.08583165, normal = 0.98106026;
  EXPECT_TRUE(
      specificForce(kRowAxialSign * axial, kRowSideSign * side, kRowNormalSign * normal).isApprox(expected, 1e-6));
  EXPECT_TRUE(specificForce(kDatarefAxialSign * -axial, kDatarefSideSign * side, kDatarefNormalSign * normal)
                  .isApprox(expected, 1e-6));
}

// --- X-Plane's sphere ---

// Origin 37.5 N 127 E, aircraft 37.6 N 126.7 E at 1500 m, R = 6378145 m. Worked out with explicit matrices and once
// more with numpy (earth-fixed vectors and scipy rotations).
TEST(TangentFrame, MatchesHandWorkedNumbers) {
  const TangentFrame frame(GeoPoint{37.5, 127.0, 0.0}, 6378145.0);
  const Vector3d p = frame.position({37.6, 126.7, 1500.0});
  EXPECT_NEAR(p.x(), -26465.318786, 1e-5);
  EXPECT_NEAR(p.y(), 11176.754150, 1e-5);
  EXPECT_NEAR(p.z(), 1435.314809, 1e-5);
  Matrix3d tilt;
  tilt << 0.99998629, -0.00318745, 0.00415397,  //
      0.0031947, 0.99999339, -0.00173869,       //
      -0.0041484, 0.00175194, 0.99998986;
  EXPECT_TRUE(frame.levelFromFrame(37.6, 126.7).isApprox(tilt, 1e-7));
  // 60 m/s along the origin's east is 0.249 m/s of sinking at the aircraft.
  const Vector3d level = frame.levelFromFrame(37.6, 126.7) * Vector3d(60, 0, 0);
  EXPECT_NEAR(level.x(), 59.99917753, 1e-7);
  EXPECT_NEAR(level.y(), 0.19168188, 1e-7);
  EXPECT_NEAR(level.z(), -0.24890399, 1e-7);
}

// Small distances by the arc: 0.001 deg of latitude is R * 0.001 * pi/180 = 111.3196 m; of longitude at 37.5 N times
// cos 37.5 = 88.3158 m.
TEST(TangentFrame, SmallDistancesAreArcs) {
  const TangentFrame frame(GeoPoint{37.5, 127.0, 0.0});
  EXPECT_NEAR(frame.position({37.501, 127.0, 0.0}).y(), 111.3196, 1e-3);
  EXPECT_NEAR(frame.position({37.5, 127.001, 0.0}).x(), 88.3158, 1e-3);
  EXPECT_NEAR(groundDistance({37.5, 127.0, 0}, {37.501, 127.0, 500}), 111.3196, 1e-3);
}

TEST(TangentFrame, PositionIsRecoveredEverywhere) {
  for (double lat = -85; lat <= 85; lat += 17) {
    for (double lon = -180; lon < 180; lon += 45) {
      const TangentFrame frame(GeoPoint{lat, lon, 120.0});
      for (const Vector3d& p : {Vector3d(0, 0, 0), Vector3d(40000, -30000, 3000), Vector3d(-60000, 50000, 12000)}) {
        const GeoPoint place = frame.geoPoint(p);
        ASSERT_TRUE(frame.position(place).isApprox(p, 1e-9) || (frame.position(place) - p).norm() < 1e-6);
        ASSERT_GE(place.longitude_deg, -180.0);
        ASSERT_LE(place.longitude_deg, 180.0);
      }
    }
  }
}

TEST(TangentFrame, CrossesTheDateLine) {
  const TangentFrame frame(GeoPoint{10.0, 180.0, 0.0});
  const GeoPoint east = frame.geoPoint({1000.0, 0.0, 0.0});
  EXPECT_NEAR(wrap180(east.longitude_deg), -179.99, 0.01);
  EXPECT_NEAR(frame.position(east).x(), 1000.0, 1e-6);
}

// X-Plane moves its scenery origin in flight: the same place then has other local coordinates, other components of the
// same velocity, and must come out as the same latitude, longitude, height, level velocity.
TEST(TangentFrame, OriginJumpChangesNothing) {
  const TangentFrame before(GeoPoint{37.5, 127.0, 0.0}), after(GeoPoint{37.5, 126.0, 0.0});
  const GeoPoint place{37.612345678, 126.512345678, 987.654};
  const Vector3d velocity_level(55.0, -12.0, 3.0);
  const GeoPoint a = before.geoPoint(before.position(place)), b = after.geoPoint(after.position(place));
  EXPECT_NEAR(a.latitude_deg, b.latitude_deg, 1e-11);
  EXPECT_NEAR(a.longitude_deg, b.longitude_deg, 1e-11);
  EXPECT_NEAR(a.height, b.height, 1e-7);
  const auto there = [&](const TangentFrame& f) {
    const Vector3d in_frame = f.frameFromLevel(place.latitude_deg, place.longitude_deg) * velocity_level;
    return Vector3d(f.levelFromFrame(place.latitude_deg, place.longitude_deg) * in_frame);
  };
  EXPECT_TRUE(there(before).isApprox(velocity_level, 1e-12));
  EXPECT_TRUE(there(after).isApprox(velocity_level, 1e-12));
  EXPECT_GT((before.position(place) - after.position(place)).norm(), 1000.0);
}

// The reason for a map on the sphere: position differenced over time equals the twist (body velocity turned by the map
// orientation), also 200 km from the origin.
TEST(TangentFrame, PositionDerivativeEqualsTwist) {
  const TangentFrame map(GeoPoint{37.5, 127.0, 30.0});
  const GeoPoint start{36.0, 128.5, 2000.0};
  const EulerAngles attitude = degrees(15.0, 4.0, 300.0);
  const Vector3d body_frd(70.0, 2.0, 5.0);
  const Vector3d level_ned = rotationNedFrd(attitude) * body_frd;
  const Quaterniond q_map_flu =
      map.orientation(quaternionEnuFlu(quaternionNedFrd(attitude)), start.latitude_deg, start.longitude_deg);
  const Vector3d twist_in_map = q_map_flu * fluFromFrd(body_frd);
  // Move on the sphere for a moment: dlat = vN/r, dlon = vE/(r cos lat).
  constexpr double kStep = 1e-3;
  const double r = kEarthRadius + start.height;
  const GeoPoint end{start.latitude_deg + level_ned.x() * kStep / r * kDegreesPerRadian,
                     start.longitude_deg + level_ned.y() * kStep /
                                               (r * std::cos(start.latitude_deg * kRadiansPerDegree)) *
                                               kDegreesPerRadian,
                     start.height - level_ned.z() * kStep};
  const Vector3d derivative = (map.position(end) - map.position(start)) / kStep;
  EXPECT_TRUE(derivative.isApprox(twist_in_map, 1e-5)) << derivative.transpose() << " / " << twist_in_map.transpose();
  // The level orientation alone would be off by the tilt: 2.2 deg here, metres per second.
  const Vector3d untreated = quaternionEnuFlu(quaternionNedFrd(attitude)) * fluFromFrd(body_frd);
  EXPECT_GT((derivative - untreated).norm(), 0.5);
}

TEST(TangentFrame, OrientationAtTheOriginIsLevel) {
  const TangentFrame map(GeoPoint{-33.0, 151.0, 0.0});
  const Quaterniond level = quaternionEnuFlu(quaternionNedFrd(degrees(10, 20, 30)));
  expectSameRotation(map.orientation(level, -33.0, 151.0), level, 1e-12);
}

// A body aligned with the scenery origin's north-east-down shows, seen from the local level, exactly the tilt.
TEST(LevelAttitude, TakesTheTiltOut) {
  const TangentFrame scenery(GeoPoint{37.5, 127.0, 0.0});
  const EulerAngles level = eulerAngles(levelAttitude(scenery, Matrix3d::Identity(), 37.6, 126.7));
  // Convergence (126.7 - 127) sin 37.55 = -0.18282 deg; all three worked out with scipy from the matrix above.
  EXPECT_NEAR(level.heading * kDegreesPerRadian, -0.18263, 2e-4);
  EXPECT_NEAR(level.pitch * kDegreesPerRadian, 0.10038, 2e-4);
  EXPECT_NEAR(level.roll * kDegreesPerRadian, 0.23769, 2e-4);
  const Matrix3d R = rotationNedFrd(degrees(20, -10, 250));
  EXPECT_TRUE(levelAttitude(scenery, R, 37.5, 127.0).isApprox(R, 1e-12));
}

}  // namespace
}  // namespace xplane_bridge::core
