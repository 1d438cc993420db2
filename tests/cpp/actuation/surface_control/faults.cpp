#include "fixture.hpp"

namespace xplane_bridge {
namespace {

// ------------------------------------------------------------------------------------------------ every kind of fault

struct FaultCase {
  core::SurfaceFailure failure;
  float after_tenth;  // [deg] of the left aileron, 5 frames after taking over at 5 deg, stick at a quarter
  float at_last;      // [deg] with the stick at half then
};

TEST_F(SurfaceControlTest, EachFaultBringsTheSurfaceWhereItSays) {
  const std::vector<FaultCase> cases{
      {{kLeftNumber, SurfaceFault::kStuck, {}}, 5.0F, 5.0F},
      {{kLeftNumber, SurfaceFault::kStuck, 8.0}, 8.0F, 8.0F},
      {{kLeftNumber, SurfaceFault::kHardOverUp, {}}, -1.0F, -20.0F},
      {{kLeftNumber, SurfaceFault::kHardOverDown, {}}, 11.0F, 20.0F},
      {{kLeftNumber, SurfaceFault::kCentred, {}}, 0.0F, 0.0F},
      {{kLeftNumber, SurfaceFault::kReduced, 0.4}, 2.0F, 4.0F},
      {{kLeftNumber, SurfaceFault::kSlow, 1.0}, 5.0F, 6.0F},
  };
  for (const FaultCase& each : cases) {
    SCOPED_TRACE(core::toString(each.failure.fault));
    airframe_.setStick(0.25);
    sim_.run(1.2);
    ASSERT_EQ(surfaces_.blockReason(), "");
    surfaces_.setFailures({each.failure});
    sim_.frame();  // takes
    sim_.run(0.1);
    EXPECT_NEAR(sim_.value(kLeft), each.after_tenth, 1e-4);
    airframe_.setStick(0.5);
    sim_.run(1.0);
    EXPECT_NEAR(sim_.value(kLeft), each.at_last, 1e-4);
    EXPECT_NEAR(sim_.value(kRight), -10.0, 1e-4);
    surfaces_.setFailures({});
    sim_.run(0.6);  // 30 deg at most, back to the law
    ASSERT_EQ(state(), State::kIdle);
  }
}

TEST_F(SurfaceControlTest, FloatingSurfaceTrailsWithTheFlow) {
  drive();
  sim_.set("sim/flightmodel/position/alpha", 10.0F);
  surfaces_.setFailures({{kLeftNumber, SurfaceFault::kFloating, {}}});
  sim_.run(5.0);
  EXPECT_NEAR(sim_.value(kLeft), -3.0, 1e-3);  // 0.3 of alpha, trailing edge up
}

TEST_F(SurfaceControlTest, FloatingRudderTrailsWithWindFromTheLeftWhereBetaIsPositive) {
  drive();
  sim_.set("sim/flightmodel/position/beta", 10.0F);
  surfaces_.setFailures({{core::surfaceNumber(FakeAirframe::kRudder).value(), SurfaceFault::kFloating, {}}});
  sim_.run(5.0);
  EXPECT_NEAR(sim_.value(kRudder), 3.0, 1e-3);  // 0.3 of it, trailing edge right: away from the wind
}

TEST_F(SurfaceControlTestOfOtherBeta, FloatingRudderTrailsTheOtherWay) {
  drive();
  sim_.set("sim/flightmodel/position/beta", 10.0F);
  surfaces_.setFailures({{core::surfaceNumber(FakeAirframe::kRudder).value(), SurfaceFault::kFloating, {}}});
  sim_.run(5.0);
  EXPECT_NEAR(sim_.value(kRudder), -3.0, 1e-3);
}

}  // namespace
}  // namespace xplane_bridge
