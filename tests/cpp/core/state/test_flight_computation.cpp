#include "xplane_bridge/core/state/flight_computation.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

using Eigen::Vector3d;
using V = FlightState;

/// An aircraft 29 km from its scenery origin; the numbers of test_frames.cpp (worked out by hand and with numpy).
FlightInputs example() {
  FlightInputs in;
  in.sim_time = 10.0;
  in.frame_period = 0.02;
  in.paused = in.replay = 0.0;
  in.local_position = openglFromEnu({-26465.318786, 11176.754150, 1435.314809});
  in.origin_latitude = 37.5;
  in.origin_longitude = 127.0;
  in.earth_radius = 6378145.0;
  in.latitude = 37.6;
  in.longitude = 126.7;
  in.elevation = 1500.0;
  in.roll_deg = 20.0;
  in.pitch_deg = -10.0;
  in.heading_true_deg = 250.0;
  in.local_velocity = openglFromEnu({60.0, 0.0, 0.0});
  return in;
}

FlightState compute(const FlightInputs& in, AttitudeReference reference = AttitudeReference::kLocalLevel) {
  return computeFlightState(in, localPosition(in), TangentFrame(GeoPoint{37.6, 126.7, 1500.0}), reference);
}

TEST(LocalPosition, MatchesHandWorkedNumbers) {
  const PositionFix fix = localPosition(example());
  EXPECT_EQ(fix.source, PositionSource::kLocalUnchecked);
  EXPECT_NEAR(fix.place.latitude_deg, 37.6, 1e-10);
  EXPECT_NEAR(fix.place.longitude_deg, 126.7, 1e-10);
  EXPECT_NEAR(fix.place.height, 1500.0, 1e-5);
}

TEST(LocalPosition, NeedsAllInputs) {
  FlightInputs in = example();
  in.origin_longitude = kNaN;
  EXPECT_EQ(localPosition(in).source, PositionSource::kNone);
  in = example();
  in.local_position.z() = kNaN;
  EXPECT_EQ(localPosition(in).source, PositionSource::kNone);
  in = example();
  in.origin_latitude = 95.0;
  EXPECT_EQ(localPosition(in).source, PositionSource::kNone);
}

TEST(LocalPosition, UsesTheConstantWhereTheRadiusIsNone) {
  for (const double radius : {0.0, kNaN, 1e30}) {
    FlightInputs in = example();
    in.earth_radius = radius;
    EXPECT_DOUBLE_EQ(usableEarthRadius(in), 6378145.0);
    EXPECT_NEAR(localPosition(in).place.latitude_deg, 37.6, 1e-10);
  }
}

TEST(Float32Position, WrapsAndRefuses) {
  FlightInputs in = example();
  in.longitude = 233.3;
  EXPECT_NEAR(float32Position(in).place.longitude_deg, -126.7, 1e-9);
  in.latitude = 91.0;
  EXPECT_EQ(float32Position(in).source, PositionSource::kNone);
}

// 60 m/s along the origin's east are 0.249 m/s of sinking at the aircraft, and 0.192 m/s to the north.
TEST(ComputeFlightState, TurnsVelocityToTheLocalLevel) {
  const FlightState s = compute(example());
  EXPECT_TRUE(s.has(V::kValidVelocity | V::kValidPosition | V::kValidAttitude));
  EXPECT_NEAR(s.velocity_ned.x(), 0.19168188, 1e-7);
  EXPECT_NEAR(s.velocity_ned.y(), 59.99917753, 1e-7);
  EXPECT_NEAR(s.velocity_ned.z(), 0.24890399, 1e-7);
  EXPECT_NEAR(s.vertical_speed, -0.24890399, 1e-6);
  EXPECT_NEAR(s.velocity_body.norm(), 60.0, 1e-9);
  EXPECT_NEAR(s.position_north, 0.0, 1e-4);
  EXPECT_NEAR(s.position_down, 0.0, 1e-4);
}

TEST(ComputeFlightState, WindDirectionServesWhereNoVectorComes) {
  FlightInputs in = example();
  in.wind_from_deg = 90.0;
  in.wind_speed = 10.0;
  const FlightState s = compute(in);
  EXPECT_TRUE(s.has(V::kValidWind | V::kValidAirVelocity));
  EXPECT_NEAR(s.wind_ned.y(), -10.0, 1e-12);
  EXPECT_NEAR(s.wind_from_deg, 90.0, 1e-5);
  EXPECT_NEAR(s.air_velocity_body.norm(), (s.velocity_ned - s.wind_ned).norm(), 1e-9);
}

TEST(ComputeFlightState, WindVectorIsTurnedToo) {
  FlightInputs in = example();
  in.wind_local = openglFromEnu({60.0, 0.0, 0.0});  // as the velocity: the air moves with the aircraft
  const FlightState s = compute(in);
  EXPECT_TRUE(s.wind_ned.isApprox(s.velocity_ned, 1e-12));
  EXPECT_NEAR(s.air_velocity_body.norm(), 0.0, 1e-9);
}

TEST(ComputeFlightState, AttitudeAgainstTheOriginIsTurned) {
  const FlightInputs in = example();
  const FlightState level = compute(in), origin = compute(in, AttitudeReference::kSceneryOrigin);
  EXPECT_NEAR(level.heading_true_deg, 250.0, 1e-12);
  EXPECT_EQ(origin.has(V::kValidAttitude), true);
  // Tilt and convergence together turn by 0.3162 deg (test_frames.cpp).
  EXPECT_NEAR(level.orientation.angularDistance(origin.orientation) * kDegreesPerRadian, 0.31623, 1e-4);
}

TEST(ComputeFlightState, AirspeedsAreComputedWhereNoneCome) {
  FlightInputs in = example();
  in.indicated_airspeed = 50.0;
  in.true_airspeed = 160.265;
  in.mach = 0.5;
  in.dynamic_pressure = 9453.4825;
  in.air_density = 0.736429;
  FlightState s = compute(in);
  EXPECT_TRUE(s.has(V::kValidAirspeeds | V::kValidAtmosphere));
  EXPECT_NEAR(s.equivalent_airspeed, 124.261, 0.01);
  EXPECT_NEAR(s.calibrated_airspeed, 125.983, 0.01);
  in.equivalent_airspeed = 99.0;
  in.calibrated_airspeed = 98.0;
  s = compute(in);
  EXPECT_EQ(s.equivalent_airspeed, 99.0F);
  EXPECT_EQ(s.calibrated_airspeed, 98.0F);
}

TEST(ComputeFlightState, PressureAltitudeComesFromTheStaticPressure) {
  FlightInputs in = example();
  in.altitude_indicated = 1400.0;
  EXPECT_FALSE(compute(in).has(V::kValidBaro));
  in.static_pressure = 89874.6;
  EXPECT_NEAR(compute(in).altitude_pressure, 1000.0, 0.5);
  in.altitude_pressure = 1234.0;
  EXPECT_NEAR(compute(in).altitude_pressure, 1234.0, 1e-3);
}

TEST(ComputeFlightState, EachGroupNeedsItsInputs) {
  const FlightState s = compute(example());
  EXPECT_EQ(s.valid,
            static_cast<std::uint32_t>(V::kValidSim | V::kValidPosition | V::kValidAttitude | V::kValidVelocity));
  FlightInputs in = example();
  in.roll_deg = kNaN;
  EXPECT_FALSE(compute(in).has(V::kValidAttitude));
  EXPECT_FALSE(compute(in).has(V::kValidVelocity));  // its body components are unknown
  in = example();
  in.paused = kNaN;
  EXPECT_FALSE(compute(in).has(V::kValidSim));
  EXPECT_FALSE(compute(in).paused);
}

TEST(NoFlight, IsAllZeros) {
  FlightInputs in;
  in.local_position.setZero();
  in.origin_latitude = in.origin_longitude = in.latitude = in.longitude = in.elevation = 0.0;
  in.roll_deg = in.pitch_deg = in.heading_true_deg = 0.0;
  EXPECT_TRUE(isNoFlight(in));
  EXPECT_FALSE(isNoFlight(example()));
  in.origin_latitude = 0.5;  // a flight near the Gulf of Guinea has an origin
  EXPECT_FALSE(isNoFlight(in));
}

}  // namespace
}  // namespace xplane_bridge::core
