#include "surface_control/fixture.hpp"

namespace xplane_bridge {
namespace {

// ------------------------------------------------------------------------------------------------ the four states

TEST_F(SurfaceControlTest, NothingIsSentWhileNothingNeedsTheSurfaces) {
  airframe_.setStick(0.5);
  sim_.run(2.0);
  EXPECT_TRUE(sim_.messages().empty());
  EXPECT_EQ(state(), State::kIdle);
  EXPECT_FALSE(surfaces_.driving());
}

TEST_F(SurfaceControlTest, TakingSendsWhatIsShownAheadOfTheOverride) {
  airframe_.setStick(0.25);  // ailerons at 5 and -5 deg
  sim_.frame();
  Names in_journal;
  sim_.on_message = [&](const core::FakeSimulator::Message& message) {
    if (message.path == kSurfaceOverride && in_journal.empty()) {
      for (const auto& entry : sim_.journal()->entries()) in_journal.push_back(entry.id);
    }
  };
  surfaces_.setFailures({stuckAt(5.0)});
  sim_.frame();
  EXPECT_EQ(state(), State::kTaking);
  const Writes snapshot{{kLeft, 5.0F}, {kRight, -5.0F}, {kElevator, 0.0F}, {kRudder, 0.0F}};
  Writes expected = snapshot;
  expected.emplace_back(kSurfaceOverride, 1.0F);
  expected.insert(expected.end(), snapshot.begin(), snapshot.end());
  EXPECT_EQ(sim_.writes(), expected);
  EXPECT_EQ(in_journal, Names{std::string("override:") + kSurfaceOverride});
  EXPECT_TRUE(reports_.empty());
}

TEST_F(SurfaceControlTest, DrivesOnceXPlaneShowsTheOverride) {
  airframe_.setStick(0.25);
  sim_.frame();
  surfaces_.setFailures({stuckAt(8.0)});
  sim_.frame();
  sim_.frame();
  EXPECT_EQ(state(), State::kDriving);
  EXPECT_EQ(reports_, (Reports{{"the surfaces are driven by their identified mixing", true}}));
  EXPECT_FLOAT_EQ(sim_.value(kLeft), 6.2F);  // from 5
  EXPECT_FLOAT_EQ(sim_.value(kRight), -5.0F);
  airframe_.setStick(0.5, 0.25, 0.5);
  sim_.run(0.4);
  EXPECT_FLOAT_EQ(sim_.value(kLeft), 8.0F) << "stuck";
  EXPECT_FLOAT_EQ(sim_.value(kRight), -10.0F);
  EXPECT_FLOAT_EQ(sim_.value(kElevator), -4.0F);
  EXPECT_FLOAT_EQ(sim_.value(kRudder), 12.0F);
  EXPECT_TRUE(surfaces_.follows(kLeftNumber));
}

TEST_F(SurfaceControlTest, OwnCommandsActWithoutWaitingForXPlanesStick) {
  drive();
  surfaces_.setStick({0.5, std::nan(""), std::nan("")});
  airframe_.setStick(-1.0, 0.5);
  sim_.run(0.4);
  EXPECT_FLOAT_EQ(sim_.value(kRight), -10.0F);
  EXPECT_FLOAT_EQ(sim_.value(kElevator), -8.0F) << "X-Plane's own stick, where nothing is commanded";
}

TEST_F(SurfaceControlTest, OverrideIsRepeatedWhileXPlaneDoesNotShowIt) {
  surfaces_.setFailures({stuckAt(6.0)});
  sim_.on_message = [this](const core::FakeSimulator::Message& message) {
    if (message.path == kSurfaceOverride && written(kSurfaceOverride).empty()) sim_.loseMessages(1);
  };
  sim_.frame();
  EXPECT_EQ(sim_.value(kSurfaceOverride), 0.0F);
  sim_.frame();
  EXPECT_EQ(state(), State::kTaking);
  sim_.frame();
  EXPECT_EQ(state(), State::kDriving);
}

TEST_F(SurfaceControlTest, GivesBackWhatIsNotNeededAnyMoreOnceItIsBackOnTheLaw) {
  drive();
  surfaces_.setFailures({});
  EXPECT_TRUE(surfaces_.givingBack());
  sim_.run(0.1);
  const std::vector<float> way = written(kLeft);
  const std::vector<double> expected{4.8, 3.6, 2.4, 1.2, 0.0};  // from 6 deg, no jump
  ASSERT_EQ(way.size(), expected.size());
  for (std::size_t i = 0; i < way.size(); ++i) EXPECT_NEAR(way[i], expected[i], 1e-5);
  EXPECT_EQ(state(), State::kDriving);
  sim_.clearMessages();
  sim_.frame();
  EXPECT_EQ(state(), State::kReleasing);
  EXPECT_EQ(sim_.writes(), (Writes{{kSurfaceOverride, 0.0F}}));
  EXPECT_TRUE(surfaces_.driving());
  sim_.frame();
  EXPECT_EQ(state(), State::kIdle);
  EXPECT_FALSE(surfaces_.givingBack());
  EXPECT_EQ(reports_, (Reports{{"X-Plane drives the surfaces again", true}}));
  EXPECT_TRUE(overrides_.releasesPending()) << "its journal entry stays until the release has been read back";
  sim_.run(1.0);
  EXPECT_EQ(reports_.size(), 1U) << "all of them follow the stick";
}

TEST_F(SurfaceControlTest, GivesBackWithinTwoSecondsWhateverTheStickDoes) {
  drive();
  surfaces_.setFailures({});
  for (int i = 0; i < 99; ++i) {
    surfaces_.setStick({i % 2 == 0 ? 1.0 : -1.0, 0.0, 0.0});  // no surface can follow that
    sim_.frame();
  }
  EXPECT_EQ(state(), State::kDriving);
  sim_.run(0.1);
  EXPECT_EQ(state(), State::kIdle);
}

TEST_F(SurfaceControlTest, WhatEndsInAPauseIsGivenBackAfterIt) {
  drive();
  setLink(core::LinkState::kPaused);
  surfaces_.setFailures({});
  sim_.run(5.0);
  EXPECT_EQ(state(), State::kDriving);
  EXPECT_EQ(sim_.value(kLeft), 6.0F);
  setLink(core::LinkState::kConnected);
  sim_.frame();
  EXPECT_EQ(sim_.value(kLeft), 4.8F) << "on its way";
  sim_.run(0.2);
  EXPECT_EQ(state(), State::kIdle);
}

TEST_F(SurfaceControlTest, WhatMayNotBeDrivenIsGivenBackInAPauseToo) {
  drive();
  setLink(core::LinkState::kPaused);
  surfaces_.setFailures({});
  block("the aircraft is not the one of the configuration");
  sim_.run(0.1);
  EXPECT_EQ(state(), State::kIdle);
}

TEST_F(SurfaceControlTest, WhatIsNeededAgainWhileReleasingGoesOnFromThere) {
  drive();
  airframe_.setStick(0.5);
  sim_.setReadOnly(kSurfaceOverride);
  surfaces_.setFailures({});
  sim_.run(0.3);
  ASSERT_EQ(state(), State::kReleasing);
  sim_.setReadOnly(kSurfaceOverride, false);
  sim_.clearMessages();
  surfaces_.setFailures({stuckAt(6.0)});
  sim_.frame();
  EXPECT_EQ(state(), State::kTaking);
  EXPECT_EQ(written(kLeft).front(), 10.0F) << "not from the middle: the same driver goes on";
  sim_.run(0.1);
  EXPECT_EQ(state(), State::kDriving);
}

TEST_F(SurfaceControlTest, ReleaseThatIsNotShownEndsAfterTwoSeconds) {
  drive();
  sim_.setReadOnly(kSurfaceOverride);
  surfaces_.setFailures({});
  sim_.run(0.12);  // five frames back to the law, and the one that gives back
  ASSERT_EQ(state(), State::kReleasing);
  sim_.run(1.96);
  EXPECT_EQ(state(), State::kReleasing);
  sim_.run(0.1);
  EXPECT_EQ(state(), State::kIdle);
  const std::string why =
      "tx_node's release of override_control_surfaces is not shown yet, and is repeated; where that lasts, another "
      "program sets it and must give it back";
  EXPECT_EQ(reports_, (Reports{{"X-Plane still shows the surface override: " + why, false}}));
  EXPECT_EQ(surfaces_.blockReason(), why);
  sim_.setReadOnly(kSurfaceOverride, false);
  overrides_.confirmReleases(1.0);
  sim_.set(kSurfaceOverride, 1.0F);
  sim_.frame();
  EXPECT_EQ(surfaces_.blockReason(), "another program has set override_control_surfaces and must give it back");
}

TEST_F(SurfaceControlTest, OverrideOfSetDatarefStaysSetAndIsNamed) {
  drive();
  ASSERT_TRUE(overrides_.acquire(OverrideHolder::kRequest, kSurfaceOverride));
  surfaces_.setFailures({});
  sim_.run(2.2);
  EXPECT_EQ(state(), State::kIdle);
  EXPECT_EQ(sim_.value(kSurfaceOverride), 1.0F);
  const std::string why = "set_dataref has set override_control_surfaces: set it to 0 by set_dataref first";
  EXPECT_EQ(reports_, (Reports{{"X-Plane still shows the surface override: " + why, false}}));
  EXPECT_EQ(surfaces_.blockReason(), why);
  EXPECT_EQ(surfaces_.beginIdentification(), why);
}

TEST_F(SurfaceControlTest, SurfaceThatXPlaneLeavesStandingIsReported) {
  drive();
  airframe_.setStanding(FakeAirframe::kLeft);
  surfaces_.setFailures({});
  sim_.run(0.14);
  ASSERT_EQ(state(), State::kIdle);
  airframe_.setStick(0.5);  // 10 deg
  sim_.run(0.46);
  EXPECT_EQ(reports_.size(), 1U) << "it is given half a second";
  sim_.run(0.1);
  EXPECT_EQ(reports_.back(),
            (std::pair<std::string, bool>{"X-Plane does not drive again: aileron1_wing2_left", false}));
}

TEST_F(SurfaceControlTest, StopEndsDrivingAndLeavesTheOverrideToItsManager) {
  drive();
  surfaces_.stop();
  sim_.run(0.1);
  EXPECT_TRUE(sim_.messages().empty());
  EXPECT_EQ(state(), State::kIdle);
  EXPECT_TRUE(overrides_.releaseAll(1.0));
  EXPECT_EQ(sim_.value(kSurfaceOverride), 0.0F);
}

// ------------------------------------------------------------------------------------------------ refusals

TEST_F(SurfaceControlTest, SaysWhatBlocksIt) {
  blocked_ = noLink();
  sim_.frame();
  EXPECT_EQ(surfaces_.blockReason(), "X-Plane is not connected");
  EXPECT_EQ(surfaces_.refusalFor(kLeftNumber)->code, core::ResultCode::kNoLink);
  EXPECT_EQ(surfaces_.refusalFor(kLeftNumber)->text, "X-Plane is not connected");
  blocked_.reset();
  sim_.set(kSurfaceOverride, 1.0F);
  sim_.frame();
  EXPECT_EQ(surfaces_.blockReason(), "another program has set override_control_surfaces and must give it back");
  sim_.set(kSurfaceOverride, std::numeric_limits<float>::quiet_NaN());
  sim_.frame();
  EXPECT_EQ(surfaces_.blockReason(), "X-Plane does not show its surfaces");
  sim_.set(kSurfaceOverride, 0.0F);
  sim_.frame();
  const auto flap = surfaces_.refusalFor(core::surfaceNumber("flap1_wing1_left").value());
  EXPECT_EQ(flap->code, core::ResultCode::kRefused);
  EXPECT_EQ(flap->text,
            "flap1_wing1_left has not been seen to move: either this aircraft has none, or its handle has to be moved "
            "once; those that moved: aileron1_wing2_left, aileron1_wing2_right, elevator1_left, rudder1_fin1");
  EXPECT_FALSE(surfaces_.refusalFor(kLeftNumber));
  airframe_.hold(FakeAirframe::kRudder, std::nan(""));
  sim_.run(1.2);
  EXPECT_EQ(surfaces_.blockReason(), "X-Plane does not show rudder1_fin1, which the mixing has");
}

TEST_F(SurfaceControlTest, MixingThatDoesNotHoldIsNotDrivenBy) {
  airframe_.hold(FakeAirframe::kRudder, 4.0);
  sim_.run(5.0);
  EXPECT_NE(surfaces_.blockReason().find("rudder1_fin1 stands 4.0 deg off what its mixing says"), std::string::npos)
      << surfaces_.blockReason();
  surfaces_.setFailures({stuckAt(6.0)});
  sim_.run(1.0);
  EXPECT_TRUE(sim_.messages().empty());
  EXPECT_TRUE(surfaces_.status().wanted);
}

TEST_F(SurfaceControlTest, RefusedCommandsSayWhatWasExpected) {
  const auto refusal = [this](const Names& names, const std::vector<float>& angles) {
    return surfaces_.command(names, angles, 1).value_or("taken");
  };
  EXPECT_EQ(refusal({FakeAirframe::kLeft}, {}), "names has 1 entries and deflections_deg 0: expected as many");
  EXPECT_EQ(refusal({"wing"}, {1.0F}), "\"wing\" is no surface: expected a name of docs/control/surfaces.md");
  EXPECT_EQ(refusal({FakeAirframe::kLeft}, {25.0F}),
            "aileron1_wing2_left is 25.0 deg: expected its travel, -21.0..21.0");
  EXPECT_NE(refusal({"flap1_wing1_left"}, {1.0F}).find("has not been seen to move"), std::string::npos);
  blocked_ = noLink();
  sim_.frame();
  EXPECT_EQ(refusal({FakeAirframe::kLeft}, {1.0F}), "X-Plane is not connected");
  EXPECT_EQ(surfaces_.status().commands_refused, 5U);
  EXPECT_EQ(surfaces_.status().last_refusal, "X-Plane is not connected");
  EXPECT_EQ(surfaces_.status().commands_accepted, 0U);
  EXPECT_TRUE(sim_.messages().empty());
}

TEST_F(SurfaceControlTest, RefusedCommandLeavesTheLastOneGoingOn) {
  ASSERT_FALSE(surfaces_.command({FakeAirframe::kLeft}, {4.0F}, 1));
  sim_.run(0.2);
  EXPECT_TRUE(surfaces_.command({FakeAirframe::kLeft}, {25.0F}, 2));
  sim_.run(0.2);
  EXPECT_EQ(sim_.value(kLeft), 4.0F);
}

}  // namespace
}  // namespace xplane_bridge
