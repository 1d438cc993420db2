#include "xplane_bridge/core/camera/pose_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/core/state/frames.hpp"

namespace core = xplane_bridge::core;
using core::AnglesDeg;
using core::CameraSample;
using core::PoseCheck;

namespace {

constexpr double kConvergenceDeg = 0.25;
constexpr double kPeriod = 1.0 / 60.0;  // [s]

AnglesDeg anglesOf(const Eigen::Matrix3d& R) {
  const core::EulerAngles e = core::eulerAngles(R);
  return {e.roll * core::kDegreesPerRadian, e.pitch * core::kDegreesPerRadian, e.heading * core::kDegreesPerRadian};
}

double wire(double value) { return static_cast<float>(value); }

Eigen::Vector3d openglFromNed(const Eigen::Vector3d& v) { return {v.y(), -v.z(), -v.x()}; }

// X-Plane as it might be: a flight with a camera fixed in the aircraft, and how `view_*` are to be read.
class Flight {
 public:
  bool true_axes = false;
  bool frame_before = false;
  double speed = 70.0;      // [m/s]
  double turn_rate = 3.0;   // [deg/s]
  double roll_swing = 0.0;  // [deg], to and fro
  double jitter = 0.0;      // [s] of the frames, deviation
  double view_type = 1024.0;
  AnglesDeg head{0.0, 0.0, 0.0};
  Eigen::Vector3d lever{0.4, -0.3, -1.0};  // [m] forward, right, down
  bool eye_known = true;

  CameraSample next() {
    CameraSample now;
    const double step = kPeriod + jitter * noise_(random_);
    time_ += step;
    const Eigen::Matrix3d body = core::rotation({roll_swing * std::sin(time_), 2.0, 40.0 + turn_rate * time_});
    position_ += body * Eigen::Vector3d(speed * step, 0.0, 0.0);
    // The local level is turned by the convergence against the scenery's axes.
    const Eigen::Matrix3d level = core::rotation({0.0, 0.0, -kConvergenceDeg});
    const Eigen::Matrix3d camera = body * core::rotation(head);
    CameraSample drawn;
    drawn.view = anglesOf(true_axes ? Eigen::Matrix3d(level * camera) : camera);
    drawn.view_position = openglFromNed(position_ + body * lever);
    const CameraSample reported = frame_before && reported_ ? *reported_ : drawn;
    reported_ = drawn;

    now.sim_time = wire(time_);
    now.view_type = view_type;
    now.view = reported.view;
    now.view_position = reported.view_position;
    now.visual_offset = {0.0, 0.0, 0.0};
    now.aircraft = anglesOf(body);
    now.aircraft_true = anglesOf(level * body);
    now.aircraft_position = openglFromNed(position_);
    now.head = head;
    const Eigen::Vector3d aircraft_axes{lever.y(), -lever.z(), -lever.x()};  // right, up, aft
    now.head_position = aircraft_axes;
    if (eye_known) now.eye_position = aircraft_axes;
    for (AnglesDeg* angles : {&now.view, &now.aircraft, &now.aircraft_true}) {
      *angles = {wire(angles->roll), wire(angles->pitch), wire(angles->heading)};
    }
    for (Eigen::Vector3d* vector : {&now.view_position, &now.aircraft_position}) {
      *vector = vector->cast<float>().cast<double>();
    }
    return now;
  }

  // Flies so long. @return the last pose
  core::CheckedPose fly(PoseCheck* check, double seconds) {
    std::optional<core::CheckedPose> pose;
    for (const double end = time_ + seconds; time_ < end;) pose = check->add(next());
    return *pose;
  }

  void expectRight(const core::CheckedPose& checked) const {
    EXPECT_LT(core::angleBetweenDeg(checked.pose.orientation, core::orientationInBase(head)), 0.01);
    EXPECT_LT((checked.pose.position - core::fluFromFrd(lever)).norm(), 0.01) << checked.pose.position.transpose();
  }

 private:
  std::mt19937 random_{7};
  std::normal_distribution<double> noise_;
  double time_ = 100.0;
  Eigen::Vector3d position_{9000.0, -7000.0, -800.0};
  std::optional<CameraSample> reported_;
};

}  // namespace

TEST(PoseCheck, FindsEachOfTheFourReadings) {
  for (const bool true_axes : {false, true}) {
    for (const bool frame_before : {false, true}) {
      SCOPED_TRACE(testing::Message() << "true axes " << true_axes << ", frame before " << frame_before);
      Flight flight;
      flight.true_axes = true_axes;
      flight.frame_before = frame_before;
      flight.roll_swing = 30.0;
      flight.jitter = 0.002;
      PoseCheck check;
      EXPECT_FALSE(flight.fly(&check, 1.0).sure) << "nothing is proven yet";
      const core::CheckedPose pose = flight.fly(&check, 4.0);
      EXPECT_TRUE(pose.sure) << check.report();
      EXPECT_EQ(check.reading().true_axes, true_axes) << check.report();
      EXPECT_EQ(check.reading().frame_before, frame_before) << check.report();
      flight.expectRight(pose);
    }
  }
}

TEST(PoseCheck, EvenFramesInLevelFlightAreDistinguishedByTheEye) {
  Flight flight;
  flight.frame_before = true;
  PoseCheck check;
  const core::CheckedPose pose = flight.fly(&check, 4.5);
  EXPECT_TRUE(pose.sure);
  flight.expectRight(pose);

  Flight blind;  // nothing says where the eye is: the lever arm stands still either way
  blind.eye_known = false;
  PoseCheck unsure;
  const core::CheckedPose open = blind.fly(&unsure, 10.0);
  EXPECT_FALSE(open.sure);
  EXPECT_NEAR(open.pose.position_uncertainty, 70.0 / 60.0, 0.02) << "one frame's way";
  blind.jitter = 0.002;
  EXPECT_TRUE(blind.fly(&unsure, 4.5).sure) << unsure.report();
}

TEST(PoseCheck, PoseIsOfTheFrameThatItNames) {
  Flight flight;
  flight.frame_before = true;
  flight.jitter = 0.002;
  flight.roll_swing = 60.0;
  PoseCheck check;
  flight.fly(&check, 5.0);
  const CameraSample first = flight.next(), second = flight.next();
  check.add(first);
  EXPECT_EQ(check.add(second)->sim_time, first.sim_time);
}

TEST(PoseCheck, ATurningHeadIsNoMotionOfTheCamera) {
  Flight flight;
  flight.view_type = 1026.0;
  flight.jitter = 0.002;
  PoseCheck check;
  for (int i = 0; i < 300; ++i) {
    flight.head.heading = 60.0 * std::sin(0.05 * i);
    flight.lever.y() = 0.2 * std::sin(0.03 * i);
    check.add(flight.next());
  }
  const auto pose = check.add(flight.next());
  EXPECT_TRUE(pose->sure) << check.report();
  flight.expectRight(*pose);
}

TEST(PoseCheck, ACameraThatWandersInTheCockpitIsUnsure) {
  Flight flight;
  flight.jitter = 0.002;
  PoseCheck check;
  ASSERT_TRUE(flight.fly(&check, 4.5).sure);
  for (int i = 0; i < 300; ++i) {
    flight.lever.x() = 0.4 + 0.1 * std::sin(0.1 * i);  // no dataref shows it
    check.add(flight.next());
  }
  EXPECT_FALSE(check.add(flight.next())->sure);
  EXPECT_GT(check.leverScatter(), 0.15);
  EXPECT_TRUE(flight.fly(&check, 4.5).sure);
}

TEST(PoseCheck, AStandingAircraftNeedsNoProofOfTheFrame) {
  Flight flight;
  flight.speed = flight.turn_rate = 0.0;
  flight.view_type = 1026.0;  // the axes are seen by the head's angles
  PoseCheck check;
  EXPECT_TRUE(flight.fly(&check, 2.5).sure) << check.report();
}

TEST(PoseCheck, WhatWasFoundHoldsInViewsFromOutside) {
  Flight flight;
  flight.frame_before = true;
  flight.jitter = 0.002;
  PoseCheck check;
  flight.fly(&check, 4.5);
  CameraSample outside = flight.next();
  outside.view_type = 1017.0;
  outside.external = true;
  check.add(outside);
  outside = flight.next();
  outside.view_type = 1017.0;
  outside.external = true;
  EXPECT_TRUE(check.add(outside)->sure);
  EXPECT_TRUE(check.reading().frame_before);
  check.reset();
  EXPECT_FALSE(check.add(flight.next())->sure);
}

TEST(PoseCheck, WithoutAnAnswerThereIsNoPose) {
  PoseCheck check;
  EXPECT_FALSE(check.add(CameraSample()).has_value());
}
