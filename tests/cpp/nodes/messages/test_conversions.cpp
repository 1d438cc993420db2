// Expected numbers were worked out apart from this code: rotation matrices multiplied by hand-written elementary
// rotations, and once more with scipy's Rotation. Attitude: roll -40, pitch 20, true heading 250 degrees; aircraft at
// 38.2 N 128.3 E, 1200 m; origin of `map` at 37.5 N 127 E, 50 m; sphere of 6 378 145 m.

#include "xplane_bridge/nodes/messages/conversions.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

namespace xplane_bridge {
namespace {

const core::TangentFrame kMap({37.5, 127.0, 50.0});
constexpr double kEast = 113737.32590315022;
constexpr double kNorth = 78721.98726339081;
constexpr double kUp = -349.8075825248161;

core::FlightState sampleState() {
  core::FlightState state;
  state.stamp_ns = 1'700'000'000'123'456'789;
  state.valid = core::FlightState::kValidAll;
  state.latitude = 38.2;
  state.longitude = 128.3;
  state.altitude_msl = 1200.0;
  state.position_north = kNorth;
  state.position_east = kEast;
  state.position_down = -kUp;
  state.position_source = core::PositionSource::kLocal;
  state.roll_deg = -40.0;
  state.pitch_deg = 20.0;
  state.heading_true_deg = 250.0;
  state.orientation = Eigen::Quaterniond(0.579447545275577, -0.059528479339501, 0.369503998558946, -0.723991503728176);
  state.angular_velocity = {0.1, -0.2, 0.3};
  state.velocity_body = {60.0, 2.0, -3.0};
  state.specific_force = {1.0, 2.0, -9.0};
  state.wind_ned = {3.0, -4.0, 0.5};
  return state;
}

template <class Quaternion>
void expectQuaternion(const Quaternion& q, double w, double x, double y, double z) {
  // q and -q are the same rotation.
  const double sign = q.w * w + q.x * x + q.y * y + q.z * z < 0.0 ? -1.0 : 1.0;
  EXPECT_NEAR(q.w, sign * w, 1e-12);
  EXPECT_NEAR(q.x, sign * x, 1e-12);
  EXPECT_NEAR(q.y, sign * y, 1e-12);
  EXPECT_NEAR(q.z, sign * z, 1e-12);
}

template <class Vector>
void expectVector(const Vector& v, double x, double y, double z, double tolerance = 1e-9) {
  EXPECT_NEAR(v.x, x, tolerance);
  EXPECT_NEAR(v.y, y, tolerance);
  EXPECT_NEAR(v.z, z, tolerance);
}

template <class Covariance>
void expectDiagonal(const Covariance& covariance, const std::vector<double>& diagonal) {
  const std::size_t size = diagonal.size();
  ASSERT_EQ(covariance.size(), size * size);
  for (std::size_t i = 0; i < covariance.size(); ++i) {
    EXPECT_EQ(covariance[i], i % (size + 1) == 0 ? diagonal[i / (size + 1)] : 0.0) << "[" << i << "]";
  }
}

TEST(Conversions, StampKeepsNanoseconds) {
  const ros::Time stamp = toRosTime(1'700'000'000'123'456'789);
  EXPECT_EQ(stamp.sec, 1'700'000'000U);
  EXPECT_EQ(stamp.nsec, 123'456'789U);
}

TEST(Conversions, FlightStateIsCopiedFieldByField) {
  core::FlightState state = sampleState();
  state.sim_time = 12.5F;
  state.sim_time_unwrapped = 12.5001;
  state.epoch = 3;
  state.paused = true;
  state.beta_deg = -1.5F;
  state.on_ground = true;
  FlightState message;
  toMessage(state, "base_link_frd", &message);
  EXPECT_EQ(message.header.frame_id, "base_link_frd");
  EXPECT_EQ(message.header.stamp.nsec, 123'456'789U);
  EXPECT_EQ(message.valid, FlightState::VALID_ALL);
  EXPECT_EQ(message.sim_time, 12.5F);
  EXPECT_EQ(message.sim_time_unwrapped, 12.5001);
  EXPECT_EQ(message.epoch, 3U);
  EXPECT_TRUE(message.paused);
  EXPECT_FALSE(message.replay);
  EXPECT_TRUE(message.on_ground);
  EXPECT_EQ(message.position_source, FlightState::POSITION_LOCAL);
  EXPECT_EQ(message.heading_true_deg, 250.0);
  EXPECT_EQ(message.beta_deg, -1.5F);
  EXPECT_TRUE(std::isnan(message.mach));
  expectVector(message.velocity_body, 60.0, 2.0, -3.0);
  expectQuaternion(message.orientation, 0.579447545275577, -0.059528479339501, 0.369503998558946, -0.723991503728176);
}

TEST(Conversions, ValidityBitsOfStructAndMessageAgree) {
  EXPECT_EQ(core::FlightState::kValidAll, FlightState::VALID_ALL);
  EXPECT_EQ(core::FlightState::kValidContact, FlightState::VALID_CONTACT);
  EXPECT_EQ(core::FlightState::kValidLoad, FlightState::VALID_LOAD);
  EXPECT_EQ(core::EngineStates::kValidAll, EngineStates::VALID_ALL);
  EXPECT_EQ(core::SurfaceStates::kValidAll, SurfaceStates::VALID_ALL);
  EXPECT_EQ(core::ControlStates::kValidAll, ControlStates::VALID_ALL);
  EXPECT_EQ(core::ElectricalState::kValidAll, ElectricalState::VALID_ALL);
  EXPECT_EQ(core::AutopilotState::kValidAll, AutopilotState::VALID_ALL);
  EXPECT_EQ(core::WarningState::kValidAll, WarningState::VALID_ALL);
  EXPECT_EQ(core::FuelState::kValidAll, FuelState::VALID_ALL);
  EXPECT_EQ(core::SimStatus::kValidAll, SimStatus::VALID_ALL);
  EXPECT_EQ(core::NavigationState::kValidAll, NavigationState::VALID_ALL);
  EXPECT_EQ(core::InstrumentState::kValidAll, InstrumentState::VALID_ALL);
  EXPECT_EQ(core::EnvironmentState::kValidAll, EnvironmentState::VALID_ALL);
  EXPECT_EQ(static_cast<int>(core::PositionSource::kFloat32), static_cast<int>(FlightState::POSITION_FLOAT32));
  EXPECT_EQ(static_cast<int>(core::LinkState::kLost), static_cast<int>(LinkState::LOST));
  EXPECT_EQ(static_cast<int>(core::LinkState::kPaused), static_cast<int>(LinkState::PAUSED));
}

TEST(Conversions, MissionStatesAreCopiedWithTheirArrays) {
  core::SurfaceStates surfaces;
  surfaces.stamp_ns = 2'000'000'000;
  surfaces.sim_time = 7.0F;
  surfaces.epoch = 2;
  surfaces.valid = 5;
  for (std::size_t i = 0; i < surfaces.aileron1.size(); ++i) {
    surfaces.aileron1[i] = static_cast<float>(i);
  }
  surfaces.delta_rudder = -4.0F;
  SurfaceStates message;
  toMessage(surfaces, "base_link_frd", &message);
  EXPECT_EQ(message.header.stamp.sec, 2U);
  EXPECT_EQ(message.sim_time, 7.0F);
  EXPECT_EQ(message.epoch, 2U);
  EXPECT_EQ(message.valid, 5U);
  EXPECT_EQ(message.aileron1[7], 7.0F);
  EXPECT_TRUE(std::isnan(message.rudder[0]));
  EXPECT_EQ(message.delta_rudder, -4.0F);

  core::EngineStates engines;
  engines.count = 2;
  engines.torque[1] = 300.0F;
  EngineStates engine_message;
  toMessage(engines, "f", &engine_message);
  EXPECT_EQ(engine_message.count, 2);
  EXPECT_EQ(engine_message.torque[1], 300.0F);
}

TEST(Conversions, OdometryIsInMapAxesWithTheTwistInFlu) {
  nav_msgs::Odometry odometry;
  ASSERT_TRUE(toOdometry(sampleState(), kMap, FrameNames(), &odometry));
  EXPECT_EQ(odometry.header.frame_id, "map");
  EXPECT_EQ(odometry.child_frame_id, "base_link");
  expectVector(odometry.pose.pose.position, kEast, kNorth, kUp);
  // The level quaternion (see the Imu) turned by tilt and convergence between the two places.
  expectQuaternion(odometry.pose.pose.orientation, 0.104558801074393, -0.230159746465604, 0.297106653589977,
                   -0.920772276199353);
  expectVector(odometry.twist.twist.linear, 60.0, -2.0, 3.0);
  expectVector(odometry.twist.twist.angular, 0.1, 0.2, -0.3);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_GT(odometry.pose.covariance[7 * i], 0.0);
    EXPECT_GT(odometry.twist.covariance[7 * i], 0.0);
  }
  EXPECT_EQ(odometry.pose.covariance[1], 0.0);
}

TEST(Conversions, TransformIsTheOdometryPose) {
  geometry_msgs::TransformStamped transform;
  ASSERT_TRUE(toTransform(sampleState(), kMap, FrameNames(), &transform));
  EXPECT_EQ(transform.header.frame_id, "map");
  EXPECT_EQ(transform.child_frame_id, "base_link");
  expectVector(transform.transform.translation, kEast, kNorth, kUp);
  expectQuaternion(transform.transform.rotation, 0.104558801074393, -0.230159746465604, 0.297106653589977,
                   -0.920772276199353);
}

TEST(Conversions, ImuIsFluWithTheLocalLevelEnuOrientation) {
  sensor_msgs::Imu imu;
  ASSERT_TRUE(toImu(sampleState(), FrameNames(), &imu));
  EXPECT_EQ(imu.header.frame_id, "base_link");
  expectQuaternion(imu.orientation, 0.102208013201379, -0.21918579164189, 0.303371774471259, -0.921670590413897);
  expectVector(imu.angular_velocity, 0.1, 0.2, -0.3);
  expectVector(imu.linear_acceleration, 1.0, -2.0, 9.0);
}

TEST(Conversions, ImuAtRestReadsPlusG) {
  core::FlightState state = sampleState();
  state.orientation = Eigen::Quaterniond(1.0, 0.0, 0.0, 0.0);  // level, nose north
  state.specific_force = {0.0, 0.0, -9.80665};
  sensor_msgs::Imu imu;
  ASSERT_TRUE(toImu(state, FrameNames(), &imu));
  expectVector(imu.linear_acceleration, 0.0, 0.0, 9.80665);
  const double half = std::sqrt(0.5);
  expectQuaternion(imu.orientation, half, 0.0, 0.0, half);  // forward is north: +90 degrees from east
}

TEST(Conversions, NavSatFixAddsTheUndulationAndNothingElse) {
  sensor_msgs::NavSatFix fix;
  ASSERT_TRUE(toNavSatFix(sampleState(), 25.5, FrameNames(), &fix));
  EXPECT_EQ(fix.latitude, 38.2);
  EXPECT_EQ(fix.longitude, 128.3);
  EXPECT_EQ(fix.altitude, 1225.5);
  EXPECT_EQ(fix.header.frame_id, "base_link");
  EXPECT_EQ(fix.status.status, sensor_msgs::NavSatStatus::STATUS_FIX);

  toOrigin(kMap.origin(), 0, 25.5, FrameNames(), &fix);
  EXPECT_EQ(fix.latitude, 37.5);
  EXPECT_EQ(fix.altitude, 75.5);
  EXPECT_EQ(fix.header.frame_id, "map");
}

TEST(Conversions, WindIsTheAirsVelocityInMapAxes) {
  geometry_msgs::TwistWithCovarianceStamped wind;
  ASSERT_TRUE(toWind(sampleState(), kMap, FrameNames(), &wind));
  EXPECT_EQ(wind.header.frame_id, "map");
  expectVector(wind.twist.twist.linear, -4.049975048677818, 2.938070652033296, -0.464158322932753);
  expectVector(wind.twist.twist.angular, 0.0, 0.0, 0.0);

  core::FlightState state = sampleState();
  state.latitude = 37.5;
  state.longitude = 127.0;
  ASSERT_TRUE(toWind(state, kMap, FrameNames(), &wind));
  expectVector(wind.twist.twist.linear, -4.0, 3.0, -0.5);  // at the origin itself: plain ENU
}

TEST(Conversions, NothingIsFilledWhileAnInputIsInvalid) {
  const auto without = [](std::uint32_t bit) {
    core::FlightState state = sampleState();
    state.valid &= ~bit;
    return state;
  };
  nav_msgs::Odometry odometry;
  for (auto bit : {core::FlightState::kValidPosition, core::FlightState::kValidAttitude,
                   core::FlightState::kValidVelocity, core::FlightState::kValidRates}) {
    EXPECT_FALSE(toOdometry(without(bit), kMap, FrameNames(), &odometry));
  }
  EXPECT_EQ(odometry.header.frame_id, "");
  sensor_msgs::Imu imu;
  for (auto bit : {core::FlightState::kValidLoad, core::FlightState::kValidAttitude, core::FlightState::kValidRates}) {
    EXPECT_FALSE(toImu(without(bit), FrameNames(), &imu));
  }
  geometry_msgs::TransformStamped transform;
  EXPECT_FALSE(toTransform(without(core::FlightState::kValidPosition), kMap, FrameNames(), &transform));
  EXPECT_FALSE(toTransform(without(core::FlightState::kValidAttitude), kMap, FrameNames(), &transform));
  sensor_msgs::NavSatFix fix;
  EXPECT_FALSE(toNavSatFix(without(core::FlightState::kValidPosition), 0.0, FrameNames(), &fix));
  geometry_msgs::TwistWithCovarianceStamped wind;
  EXPECT_FALSE(toWind(without(core::FlightState::kValidWind), kMap, FrameNames(), &wind));
}

TEST(Conversions, EachIsStampedWithTheTimeOfItsState) {
  const core::FlightState state = sampleState();
  const ros::Time stamp = toRosTime(state.stamp_ns);
  nav_msgs::Odometry odometry;
  ASSERT_TRUE(toOdometry(state, kMap, FrameNames(), &odometry));
  EXPECT_EQ(odometry.header.stamp, stamp);
  geometry_msgs::TransformStamped transform;
  ASSERT_TRUE(toTransform(state, kMap, FrameNames(), &transform));
  EXPECT_EQ(transform.header.stamp, stamp);
  sensor_msgs::Imu imu;
  ASSERT_TRUE(toImu(state, FrameNames(), &imu));
  EXPECT_EQ(imu.header.stamp, stamp);
  sensor_msgs::NavSatFix fix;
  ASSERT_TRUE(toNavSatFix(state, 0.0, FrameNames(), &fix));
  EXPECT_EQ(fix.header.stamp, stamp);
  geometry_msgs::TwistWithCovarianceStamped wind;
  ASSERT_TRUE(toWind(state, kMap, FrameNames(), &wind));
  EXPECT_EQ(wind.header.stamp, stamp);
  sensor_msgs::NavSatFix origin;
  toOrigin(kMap.origin(), state.stamp_ns, 0.0, FrameNames(), &origin);
  EXPECT_EQ(origin.header.stamp, stamp);
  EXPECT_EQ(baseLinkFrdTransform(FrameNames(), stamp).header.stamp, stamp);
  EXPECT_EQ(mapNedTransform(FrameNames(), stamp).header.stamp, stamp);
}

TEST(Conversions, VariancesAreTheResolutionOfEachQuantity) {
  const core::FlightState state = sampleState();
  nav_msgs::Odometry odometry;
  ASSERT_TRUE(toOdometry(state, kMap, FrameNames(), &odometry));
  expectDiagonal(odometry.pose.covariance, {1e-5, 1e-5, 1e-5, 1e-10, 1e-10, 1e-10});
  expectDiagonal(odometry.twist.covariance, {1e-8, 1e-8, 1e-8, 1e-10, 1e-10, 1e-10});
  sensor_msgs::Imu imu;
  ASSERT_TRUE(toImu(state, FrameNames(), &imu));
  expectDiagonal(imu.orientation_covariance, {1e-10, 1e-10, 1e-10});
  expectDiagonal(imu.angular_velocity_covariance, {1e-10, 1e-10, 1e-10});
  expectDiagonal(imu.linear_acceleration_covariance, {1e-8, 1e-8, 1e-8});
  geometry_msgs::TwistWithCovarianceStamped wind;
  ASSERT_TRUE(toWind(state, kMap, FrameNames(), &wind));
  expectDiagonal(wind.twist.covariance, {1e-4, 1e-4, 1e-4, 0.0, 0.0, 0.0});
}

TEST(Conversions, VarianceOfThePositionGoesByItsSource) {
  using Source = core::PositionSource;
  for (const auto& [source, variance] : std::vector<std::pair<Source, double>>{{Source::kLocal, 1e-5},
                                                                               {Source::kLocalUnchecked, 1e-5},
                                                                               {Source::kRpos, 1e-4},
                                                                               {Source::kXpc, 1e-4},
                                                                               {Source::kFloat32, 0.25}}) {
    SCOPED_TRACE(static_cast<int>(source));
    core::FlightState state = sampleState();
    state.position_source = source;
    sensor_msgs::NavSatFix fix;
    ASSERT_TRUE(toNavSatFix(state, 0.0, FrameNames(), &fix));
    expectDiagonal(fix.position_covariance, {variance, variance, variance});
    EXPECT_EQ(fix.position_covariance_type, sensor_msgs::NavSatFix::COVARIANCE_TYPE_DIAGONAL_KNOWN);
    nav_msgs::Odometry odometry;
    ASSERT_TRUE(toOdometry(state, kMap, FrameNames(), &odometry));
    EXPECT_EQ(odometry.pose.covariance[0], variance);
  }
}

TEST(Conversions, FixAndOriginSayThatTheyAreAFixOfGps) {
  sensor_msgs::NavSatFix fix, origin;
  fix.status.status = origin.status.status = sensor_msgs::NavSatStatus::STATUS_NO_FIX;
  ASSERT_TRUE(toNavSatFix(sampleState(), 0.0, FrameNames(), &fix));
  toOrigin(kMap.origin(), 0, 0.0, FrameNames(), &origin);
  for (const sensor_msgs::NavSatFix& each : {fix, origin}) {
    EXPECT_EQ(each.status.status, sensor_msgs::NavSatStatus::STATUS_FIX);
    EXPECT_EQ(each.status.service, sensor_msgs::NavSatStatus::SERVICE_GPS);
    EXPECT_EQ(each.position_covariance_type, sensor_msgs::NavSatFix::COVARIANCE_TYPE_DIAGONAL_KNOWN);
  }
  EXPECT_EQ(origin.longitude, 127.0);
  expectDiagonal(origin.position_covariance, {0.0, 0.0, 0.0});
}

TEST(Conversions, ATransformHasTheRotationAndTranslationItIsMadeOf) {
  const geometry_msgs::Transform transform = toTransform(Eigen::Quaterniond(0.5, 0.1, -0.7, 0.5), {1.0, 2.0, 3.0});
  expectVector(transform.translation, 1.0, 2.0, 3.0);
  expectQuaternion(transform.rotation, 0.5, 0.1, -0.7, 0.5);
}

TEST(Conversions, StaticFramesSwapTheAxes) {
  const auto turn = [](const geometry_msgs::TransformStamped& transform, const Eigen::Vector3d& v) {
    const auto& q = transform.transform.rotation;
    return Eigen::Vector3d(Eigen::Quaterniond(q.w, q.x, q.y, q.z) * v);
  };
  // A vector given in the child's axes, seen in the parent's.
  const geometry_msgs::TransformStamped frd = baseLinkFrdTransform(FrameNames(), ros::Time(1, 0));
  EXPECT_EQ(frd.header.frame_id, "base_link");
  EXPECT_EQ(frd.child_frame_id, "base_link_frd");
  EXPECT_TRUE(turn(frd, {1.0, 2.0, 3.0}).isApprox(Eigen::Vector3d(1.0, -2.0, -3.0), 1e-12));
  const geometry_msgs::TransformStamped ned = mapNedTransform(FrameNames(), ros::Time(1, 0));
  EXPECT_EQ(ned.header.frame_id, "map");
  EXPECT_EQ(ned.child_frame_id, "map_ned");
  EXPECT_TRUE(turn(ned, {1.0, 2.0, 3.0}).isApprox(Eigen::Vector3d(2.0, 1.0, -3.0), 1e-12));
}

}  // namespace
}  // namespace xplane_bridge
