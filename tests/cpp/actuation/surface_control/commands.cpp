#include "fixture.hpp"

namespace xplane_bridge {
namespace {

// ------------------------------------------------------------------------------------------------ control/surfaces

TEST_F(SurfaceControlTest, CommandIsReportedWhenSentAndWhenShown) {
  ASSERT_FALSE(surfaces_.command({FakeAirframe::kLeft}, {6.0F}, 7));
  sim_.frame();
  ASSERT_EQ(echoes_.size(), 1U);
  EXPECT_EQ(echoes_[0].sequence, 7U);
  EXPECT_FALSE(echoes_[0].read_back);
  EXPECT_TRUE(std::isnan(echoes_[0].frames));
  // Five frames to 6 deg; the frame after shows it.
  sim_.run(0.1);
  EXPECT_EQ(echoes_.size(), 1U);
  EXPECT_FLOAT_EQ(sim_.value(kLeft), 6.0F);
  sim_.frame();
  ASSERT_EQ(echoes_.size(), 2U);
  EXPECT_EQ(echoes_[1].sequence, 7U);
  EXPECT_TRUE(echoes_[1].read_back);
  EXPECT_NEAR(echoes_[1].frames, 6.0, 0.01);
  ASSERT_EQ(surfaces_.individuallyDriven().size(), 1U);
  EXPECT_EQ(surfaces_.individuallyDriven()[0].surface, kLeftNumber);
}

TEST_F(SurfaceControlTest, CommandThatIsOvertakenIsNotReportedAsShown) {
  ASSERT_FALSE(surfaces_.command({FakeAirframe::kLeft}, {12.0F}, 1));
  sim_.frame();
  ASSERT_FALSE(surfaces_.command({FakeAirframe::kLeft}, {6.0F}, 2));
  sim_.run(0.3);
  ASSERT_EQ(echoes_.size(), 3U);
  EXPECT_EQ(echoes_[2].sequence, 2U);
  EXPECT_TRUE(echoes_[2].read_back);
}

TEST_F(SurfaceControlTest, CommandsThatEndGoBackToTheStickWithoutAJump) {
  airframe_.setStick(-0.25);  // the left aileron at -5 deg
  sim_.frame();
  for (const bool by_an_empty_list : {true, false}) {
    ASSERT_FALSE(surfaces_.command({FakeAirframe::kLeft}, {6.0F}, 1));
    sim_.run(0.3);
    ASSERT_FLOAT_EQ(sim_.value(kLeft), 6.0F);
    sim_.clearMessages();
    if (by_an_empty_list) {
      EXPECT_FALSE(surfaces_.command({}, {}, 2));
    } else {
      surfaces_.endCommands();
    }
    sim_.frame();
    EXPECT_EQ(written(kLeft), std::vector<float>{4.8F}) << "with the next frame";
    sim_.run(0.16);
    EXPECT_NEAR(sim_.value(kLeft), -4.8, 1e-5) << "eight frames later, and given back from there";
    sim_.run(0.04);
    EXPECT_EQ(state(), State::kIdle);
    EXPECT_FLOAT_EQ(sim_.value(kLeft), -5.0F);
  }
}

TEST_F(SurfaceControlTest, AnotherClientThatReleasesTheOverrideUnderACommandIsReportedOnce) {
  drive();
  sim_.set(kSurfaceOverride, 0.0F);
  sim_.frame();
  EXPECT_FALSE(surfaces_.takeReleasedByAnother()) << "a failure has no mode";
  sim_.run(1.2);  // its mixing is checked again
  ASSERT_FALSE(surfaces_.command({FakeAirframe::kLeft}, {6.0F}, 1));
  sim_.run(0.2);
  ASSERT_EQ(state(), State::kDriving);
  sim_.set(kSurfaceOverride, 0.0F);
  sim_.frame();
  EXPECT_TRUE(surfaces_.takeReleasedByAnother());
  EXPECT_FALSE(surfaces_.takeReleasedByAnother());
}

TEST_F(SurfaceControlTest, CommandsThatMayNotFlyAreCounted) {
  surfaces_.refuseCommand("the mode is MANUAL");
  EXPECT_EQ(surfaces_.status().commands_refused, 1U);
  EXPECT_EQ(surfaces_.status().last_refusal, "the mode is MANUAL");
}

TEST_F(SurfaceControlTest, FailureIsStrongerThanACommand) {
  surfaces_.setFailures({stuckAt(6.0)});
  ASSERT_FALSE(surfaces_.command({FakeAirframe::kLeft}, {-6.0F}, 1));
  sim_.run(0.3);
  EXPECT_EQ(sim_.value(kLeft), 6.0F);
}

TEST_F(SurfaceControlTest, LagIsMeasuredInFrames) {
  drive();
  airframe_.setStick(0.5);
  sim_.run(0.1);
  EXPECT_NEAR(surfaces_.lagFrames(), 1.0, 0.01);
  surfaces_.setFailures({});
  sim_.run(0.1);
  EXPECT_TRUE(std::isnan(surfaces_.lagFrames()));
}

// ------------------------------------------------------------------------------------------------ excitations

TEST_F(SurfaceControlTest, OffsetIsAddedFromTheNextFrame) {
  airframe_.setStick(0.25);
  sim_.frame();
  ASSERT_EQ(surfaces_.beginOffset(kLeftNumber, 3.0), "");
  sim_.run(0.1);
  EXPECT_EQ(surfaces_.setOffset(3.0), "");
  sim_.frame();
  EXPECT_FLOAT_EQ(sim_.value(kLeft), 8.0F);
  EXPECT_FLOAT_EQ(sim_.value(kRight), -5.0F);
  surfaces_.clearOffset();
  sim_.run(0.1);
  EXPECT_EQ(state(), State::kIdle);
  EXPECT_EQ(surfaces_.setOffset(1.0), "") << "it was asked for: nothing is lost";
}

TEST_F(SurfaceControlTest, OffsetIsRefusedWhereItCannotAct) {
  EXPECT_EQ(surfaces_.beginOffset(kLeftNumber, 20.5),
            "amplitude is 20.5 deg: expected at most half of its travel, 20.0");
  surfaces_.setFailures({stuckAt(6.0)});
  EXPECT_EQ(surfaces_.beginOffset(kLeftNumber, 2.0), "aileron1_wing2_left is broken");
  blocked_ = noLink();
  sim_.frame();
  EXPECT_EQ(surfaces_.beginOffset(kLeftNumber, 2.0), "X-Plane is not connected");
}

TEST_F(SurfaceControlTest, OffsetEndsWhenItsSurfaceBreaks) {
  ASSERT_EQ(surfaces_.beginOffset(kLeftNumber, 3.0), "");
  sim_.run(0.1);
  surfaces_.setFailures({stuckAt(6.0)});
  EXPECT_EQ(surfaces_.setOffset(1.0), "aileron1_wing2_left is broken");
}

}  // namespace
}  // namespace xplane_bridge
