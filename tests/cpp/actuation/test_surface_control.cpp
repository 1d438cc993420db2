#include "xplane_bridge/actuation/surface_control.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "driven_surfaces_test.hpp"
#include "xplane_bridge/actuation/mixing_files.hpp"

namespace xplane_bridge {
namespace {

using core::FakeAirframe;
using core::kSurfaceOverride;
using core::SurfaceFault;
using State = SurfaceControlState;
using Names = std::vector<std::string>;
using Writes = std::vector<std::pair<std::string, float>>;

const std::string kLeft = FakeAirframe::dataref(FakeAirframe::kLeft);
const std::string kRight = FakeAirframe::dataref(FakeAirframe::kRight);
const std::string kElevator = FakeAirframe::dataref(FakeAirframe::kElevator);
const std::string kRudder = FakeAirframe::dataref(FakeAirframe::kRudder);
const std::size_t kLeftNumber = core::surfaceNumber(FakeAirframe::kLeft).value();

/// Expectations are worked out by hand from the mixing of FakeAirframe, frames of 0.02 s and the driver's 60 deg/s: a
/// driven surface moves by 1.2 deg a frame.
class SurfaceControlTest : public DrivenSurfacesTest {
 protected:
  explicit SurfaceControlTest(core::SimulatorVersion version = core::kXPlane11) : DrivenSurfacesTest(version) {}

  static core::SurfaceFailure stuckAt(double deflection_deg) {
    return {kLeftNumber, SurfaceFault::kStuck, deflection_deg};
  }
  /// The left aileron is broken, and driven at 6 deg.
  void drive() {
    surfaces_.setFailures({stuckAt(6.0)});
    sim_.run(0.2);
    ASSERT_EQ(state(), State::kDriving);
    ASSERT_FLOAT_EQ(sim_.value(kLeft), 6.0F);
    sim_.clearMessages();
    reports_.clear();
  }
};

class SurfaceControlTest12 : public SurfaceControlTest {
 protected:
  SurfaceControlTest12() : SurfaceControlTest(core::kXPlane12) {}
};

core::SimulatorVersion otherwise(core::Otherwise what) {
  return {core::kXPlane11.number, static_cast<std::uint32_t>(what)};
}

class SurfaceControlTestOfOtherBeta : public SurfaceControlTest {
 protected:
  SurfaceControlTestOfOtherBeta() : SurfaceControlTest(otherwise(core::Otherwise::kBetaSign)) {}
};

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

TEST_F(SurfaceControlTest, WhilePausedItGivesBackAtOnce) {
  drive();
  setLink(core::LinkState::kPaused);
  surfaces_.setFailures({});
  sim_.frame();
  EXPECT_EQ(state(), State::kReleasing);
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
  EXPECT_EQ(reports_, (Reports{{"X-Plane still shows the surface override", false}}));
  EXPECT_NE(surfaces_.blockReason().find("another program has set override_control_surfaces"), std::string::npos);
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

// ------------------------------------------------------------------------------------------- what X-Plane does not do

TEST_F(SurfaceControlTest, OverrideThatIsNotShownIsGivenBackAndTriedAgainAfterFiveSeconds) {
  sim_.setReadOnly(kSurfaceOverride);
  ASSERT_FALSE(surfaces_.command({FakeAirframe::kLeft}, {4.0F}, 1));
  ASSERT_EQ(surfaces_.beginOffset(kLeftNumber, 2.0), "");
  surfaces_.setFailures({stuckAt(6.0)});
  sim_.run(1.1);
  EXPECT_EQ(reports_, (Reports{{"X-Plane does not show the surface override: the surfaces are given back", false},
                               {"X-Plane drives the surfaces again", true}}));
  EXPECT_EQ(written(kSurfaceOverride).back(), 0.0F);
  EXPECT_EQ(surfaces_.setOffset(1.0), "X-Plane does not show the surface override");
  EXPECT_EQ(surfaces_.blockReason(), "X-Plane did not let the surfaces be taken over a moment ago");
  sim_.setReadOnly(kSurfaceOverride, false);
  sim_.run(4.8);
  EXPECT_EQ(state(), State::kIdle);
  sim_.run(0.3);
  EXPECT_EQ(state(), State::kDriving) << "the failure still needs it";
  surfaces_.setFailures({});
  sim_.run(0.2);
  EXPECT_EQ(state(), State::kIdle) << "but nothing else does";
}

TEST_F(SurfaceControlTest, UnknownDeflectionIsNotTakenOver) {
  // Right after a sample of the mixing, so that the frame that does not show it is none.
  for (const std::size_t samples = surfaces_.status().samples; surfaces_.status().samples == samples;) sim_.frame();
  ASSERT_EQ(surfaces_.beginOffset(kLeftNumber, 2.0), "");
  airframe_.hold(FakeAirframe::kRudder, std::nan(""));
  sim_.clearMessages();
  sim_.frame();
  EXPECT_EQ(reports_,
            (Reports{{"the surfaces are not taken over: the present deflection of rudder1_fin1 is not known", false}}));
  EXPECT_TRUE(sim_.messages().empty());
  EXPECT_EQ(surfaces_.setOffset(1.0), "the surfaces could not be taken over");
  sim_.run(0.2);
  EXPECT_EQ(surfaces_.blockReason(), "X-Plane did not let the surfaces be taken over a moment ago");
}

TEST_F(SurfaceControlTest, WithoutTheJournalNothingIsTakenOver) {
  sim_.breakJournal();
  ASSERT_EQ(surfaces_.beginOffset(kLeftNumber, 2.0), "");
  surfaces_.setFailures({stuckAt(6.0)});
  sim_.run(4.0);
  EXPECT_EQ(state(), State::kIdle);
  EXPECT_TRUE(written(kSurfaceOverride).empty());
  ASSERT_EQ(reports_.size(), 1U);
  EXPECT_NE(reports_[0].first.find("it could not be given back after a crash, should there be one: "),
            std::string::npos);
  EXPECT_FALSE(reports_[0].second);
  EXPECT_EQ(surfaces_.setOffset(1.0), "the surfaces could not be taken over");
  sim_.breakJournal(false);
  sim_.run(1.2);
  EXPECT_EQ(state(), State::kDriving);
}

TEST_F(SurfaceControlTest, NothingIsTakenOverOnceOverridesHaveEnded) {
  overrides_.releaseAll(1.0);
  surfaces_.setFailures({stuckAt(6.0)});
  sim_.run(1.0);
  EXPECT_EQ(state(), State::kIdle);
  EXPECT_TRUE(written(kSurfaceOverride).empty());
}

TEST_F(SurfaceControlTest, SurfaceThatDoesNotFollowIsNamedAfterASecond) {
  drive();
  airframe_.hold(FakeAirframe::kRight, 3.0);
  sim_.run(0.98);
  EXPECT_TRUE(surfaces_.status().not_following.empty());
  sim_.run(0.1);
  EXPECT_EQ(surfaces_.status().not_following, Names{FakeAirframe::kRight});
  airframe_.letGo(FakeAirframe::kRight);
  sim_.run(0.1);
  EXPECT_TRUE(surfaces_.status().not_following.empty());
}

// ------------------------------------------------------------------------------------------------ losses in between

TEST_F(SurfaceControlTest, AnotherClientThatReleasesTheOverrideEndsEverything) {
  drive();
  ASSERT_FALSE(surfaces_.command({FakeAirframe::kRight}, {4.0F}, 1));
  sim_.set(kSurfaceOverride, 0.0F);
  sim_.frame();
  EXPECT_EQ(surfaces_.takeAbandoned(), "another client has released the surface override");
  EXPECT_EQ(surfaces_.takeAbandoned(), std::nullopt) << "reported once";
  sim_.run(0.1);
  sim_.clearMessages();
  sim_.run(10.0);
  EXPECT_TRUE(sim_.messages().empty()) << "it is not taken again";
  EXPECT_EQ(state(), State::kIdle);
  EXPECT_EQ(reports_, (Reports{{"the surfaces are given back: another client has released the surface override", true},
                               {"X-Plane drives the surfaces again", true}}));
}

TEST_F(SurfaceControlTest, ExcitationLearnsWhyItLostItsSurface) {
  ASSERT_EQ(surfaces_.beginOffset(kLeftNumber, 2.0), "");
  sim_.run(0.1);
  ASSERT_EQ(state(), State::kDriving);
  EXPECT_EQ(surfaces_.setOffset(1.0), "");
  sim_.set(kSurfaceOverride, 0.0F);
  sim_.frame();
  EXPECT_EQ(surfaces_.setOffset(1.0), "another client has released the surface override");
}

TEST_F(SurfaceControlTest, AnotherAircraftEndsEverything) {
  drive();
  surfaces_.onAircraft("TEST");
  EXPECT_EQ(surfaces_.takeAbandoned(), std::nullopt) << "the same aircraft";
  surfaces_.onAircraft("OTHER");
  EXPECT_EQ(surfaces_.takeAbandoned(), "another aircraft was loaded");
  EXPECT_EQ(sim_.value(kSurfaceOverride), 0.0F) << "at once";
  sim_.run(1.2);
  EXPECT_EQ(state(), State::kIdle);
  EXPECT_NE(surfaces_.blockReason().find("is not identified yet"), std::string::npos) << "its mixing is not known";
}

TEST_F(SurfaceControlTest, AnotherAircraftWhileReleasingDoesNotTakeUpTheOldMixing) {
  drive();
  sim_.setReadOnly(kSurfaceOverride);
  surfaces_.onAircraft("OTHER");
  sim_.frame();
  ASSERT_EQ(state(), State::kReleasing);
  surfaces_.setFailures({stuckAt(6.0)});
  sim_.run(0.5);
  EXPECT_EQ(state(), State::kReleasing);
  EXPECT_TRUE(written(kLeft).empty());
}

TEST_F(SurfaceControlTest, RestartedXPlaneIsNotTakenOver) {
  drive();
  sim_.restart();
  sim_.set(kSurfaceOverride, 0.0F);
  surfaces_.onLink(sim_.status());
  sim_.frame();
  EXPECT_EQ(surfaces_.takeAbandoned(), "X-Plane was restarted");
  EXPECT_EQ(state(), State::kIdle);
  EXPECT_TRUE(written(kLeft).empty());
  EXPECT_EQ(surfaces_.blockReason(),
            "the surfaces have not been seen to follow their mixing for half a second of steady stick yet");
}

TEST_F(SurfaceControlTest, ReleasedBySomethingElseItSaysWhy) {
  drive();
  surfaces_.release("another aircraft is being loaded");
  EXPECT_EQ(sim_.value(kSurfaceOverride), 0.0F);
  EXPECT_EQ(surfaces_.takeAbandoned(), "another aircraft is being loaded");
  EXPECT_EQ(reports_, (Reports{{"the surfaces are given back: another aircraft is being loaded", true}}));
}

TEST_F(SurfaceControlTest, SilenceIsWaitedThrough) {
  drive();
  for (const auto silence : {core::LinkState::kStale, core::LinkState::kLost}) {
    SCOPED_TRACE(core::toString(silence));
    setLink(silence);
    sim_.run(5.0);
    EXPECT_TRUE(sim_.messages().empty());
    EXPECT_EQ(state(), State::kDriving);
    setLink(core::LinkState::kConnected);
    sim_.frame();
    EXPECT_EQ(state(), State::kDriving) << "X-Plane still shows the override";
    EXPECT_EQ(written(kLeft), std::vector<float>{6.0F});
    sim_.clearMessages();
  }
}

TEST_F(SurfaceControlTest, NothingIsSentWhileItIsBlocked) {
  drive();
  blocked_ = "the aircraft is not the one of the configuration";
  sim_.run(0.1);
  sim_.clearMessages();
  sim_.run(1.0);
  EXPECT_TRUE(sim_.messages().empty());
  EXPECT_EQ(surfaces_.blockReason(), blocked_);
  blocked_.clear();
  sim_.run(0.1);
  EXPECT_FALSE(written(kLeft).empty());
}

TEST_F(SurfaceControlTest, WhilePausedSurfacesStand) {
  drive();
  setLink(core::LinkState::kPaused);
  surfaces_.setFailures({stuckAt(12.0)});
  sim_.run(1.0);
  EXPECT_EQ(sim_.value(kLeft), 6.0F);
  setLink(core::LinkState::kConnected);
  sim_.run(0.2);
  EXPECT_EQ(sim_.value(kLeft), 12.0F);
}

// ------------------------------------------------------------------------------------------------ refusals

TEST_F(SurfaceControlTest, SaysWhatBlocksIt) {
  blocked_ = "X-Plane is not connected";
  sim_.frame();
  EXPECT_EQ(surfaces_.blockReason(), "X-Plane is not connected");
  EXPECT_EQ(surfaces_.blockReasonFor(kLeftNumber), "X-Plane is not connected");
  blocked_.clear();
  sim_.set(kSurfaceOverride, 1.0F);
  sim_.frame();
  EXPECT_EQ(surfaces_.blockReason(), "another program has set override_control_surfaces and must give it back");
  sim_.set(kSurfaceOverride, std::numeric_limits<float>::quiet_NaN());
  sim_.frame();
  EXPECT_EQ(surfaces_.blockReason(), "X-Plane does not show its surfaces");
  sim_.set(kSurfaceOverride, 0.0F);
  sim_.frame();
  EXPECT_EQ(surfaces_.blockReasonFor(core::surfaceNumber("flap1_wing1_left").value()),
            "flap1_wing1_left has not been seen to move: either this aircraft has none, or its handle has to be moved "
            "once; those that moved: aileron1_wing2_left, aileron1_wing2_right, elevator1_left, rudder1_fin1");
  EXPECT_EQ(surfaces_.blockReasonFor(kLeftNumber), "");
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
  EXPECT_EQ(refusal({"wing"}, {1.0F}), "\"wing\" is no surface: expected a name of docs/surfaces.md");
  EXPECT_EQ(refusal({FakeAirframe::kLeft}, {25.0F}),
            "aileron1_wing2_left is 25.0 deg: expected its travel, -21.0..21.0");
  EXPECT_NE(refusal({"flap1_wing1_left"}, {1.0F}).find("has not been seen to move"), std::string::npos);
  blocked_ = "X-Plane is not connected";
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
  blocked_ = "X-Plane is not connected";
  sim_.frame();
  EXPECT_EQ(surfaces_.beginOffset(kLeftNumber, 2.0), "X-Plane is not connected");
}

TEST_F(SurfaceControlTest, OffsetEndsWhenItsSurfaceBreaks) {
  ASSERT_EQ(surfaces_.beginOffset(kLeftNumber, 3.0), "");
  sim_.run(0.1);
  surfaces_.setFailures({stuckAt(6.0)});
  EXPECT_EQ(surfaces_.setOffset(1.0), "aileron1_wing2_left is broken");
}

// ------------------------------------------------------------------------------------------------ the mixing

TEST_F(SurfaceControlTest, IdentifiedMixingIsKept) {
  surfaces_.onAircraft("NEW");
  for (double time = 0.0; time < 35.0; time += core::FakeSimulator::kFrame) {
    airframe_.setStick(0.4 * std::sin(1.3 * time), 0.4 * std::sin(0.83 * time + 1.0), 0.4 * std::sin(1.9 * time + 2.0));
    sim_.frame();
  }
  const auto kept = readMixingFile(folder(), "NEW");
  ASSERT_TRUE(kept);
  EXPECT_NEAR(kept->lawOf(kLeftNumber)->slopes[static_cast<Eigen::Index>(core::MixingTerm::kRollPlus)], 20.0, 1e-3);
  ASSERT_FALSE(reports_.empty());
  EXPECT_EQ(reports_[0].first.find("the mixing of the surfaces is identified, kept in " + folder()), 0U);
  EXPECT_EQ(surfaces_.blockReason(), "");
}

TEST_F(SurfaceControlTest, MixingThatCannotBeKeptIsStillFlownBy) {
  std::filesystem::remove_all(folder());
  std::ofstream(folder()) << "a file where the folder should be";
  surfaces_.onAircraft("NEW");
  for (double time = 0.0; time < 35.0; time += core::FakeSimulator::kFrame) {
    airframe_.setStick(0.4 * std::sin(1.3 * time), 0.4 * std::sin(0.83 * time + 1.0), 0.4 * std::sin(1.9 * time + 2.0));
    sim_.frame();
  }
  ASSERT_FALSE(reports_.empty());
  EXPECT_EQ(reports_[0].first.find("the mixing of the surfaces is identified, but could not be kept: "), 0U);
  EXPECT_FALSE(reports_[0].second);
  EXPECT_NE(surfaces_.status().file_problem, "");
  EXPECT_EQ(surfaces_.blockReason(), "");
}

TEST_F(SurfaceControlTest, AShippedMixingCountsForExactlyItsAircraftAndWhereThereIsNoOwn) {
  core::MixingModel model = *readMixingFile(folder(), "TEST");
  model.aircraft = "TEST Own one";
  writeMixingFile(shipped(), model);
  surfaces_.onAircraft("OTHER", "OTHER Own one");
  EXPECT_FALSE(surfaces_.status().mixing_known);
  std::filesystem::remove(core::mixingPath(folder(), "TEST"));
  surfaces_.onAircraft("TEST", "TEST Another");
  EXPECT_FALSE(surfaces_.status().mixing_known);
  surfaces_.onAircraft("OTHER");
  surfaces_.onAircraft("TEST", "TEST Own one");
  EXPECT_TRUE(surfaces_.status().mixing_known);
  sim_.run(2.0);
  EXPECT_EQ(surfaces_.blockReason(), "");
  model.aircraft = "TEST";
  model.laws.pop_back();
  writeMixingFile(folder(), model);
  surfaces_.onAircraft("OTHER");
  surfaces_.onAircraft("TEST", "TEST Own one");
  EXPECT_EQ(surfaces_.status().mixed_surfaces.size(), model.laws.size()) << "its own goes first";
}

TEST_F(SurfaceControlTest, FileThatCannotBeReadIsReported) {
  std::ofstream(core::mixingPath(folder(), "BAD")) << "no mixing";
  surfaces_.onAircraft("BAD");
  ASSERT_EQ(reports_.size(), 1U);
  EXPECT_FALSE(reports_[0].second);
  EXPECT_EQ(surfaces_.status().file_problem, reports_[0].first);
  EXPECT_FALSE(surfaces_.status().mixing_known);
  surfaces_.onAircraft("TEST");
  EXPECT_EQ(surfaces_.status().file_problem, "");
}

TEST_F(SurfaceControlTest, NothingIsLearnedWhileXPlaneHasSomethingBroken) {
  sim_.run(2.0);
  const std::size_t samples = surfaces_.status().samples;
  surfaces_.setDisturbed(true);
  sim_.run(2.0);
  EXPECT_EQ(surfaces_.status().samples, samples);
  surfaces_.setDisturbed(false);
  sim_.run(2.0);
  EXPECT_GT(surfaces_.status().samples, samples);
}

TEST_F(SurfaceControlTest, NothingIsLearnedWhileSurfacesAreDriven) {
  drive();
  const std::size_t samples = surfaces_.status().samples;
  sim_.run(2.0);
  EXPECT_EQ(surfaces_.status().samples, samples);
}

TEST_F(SurfaceControlTest12, AsksForTheDatarefsOfTheVersion) {
  const auto expected = core::surfaceWatchDatarefs(core::kXPlane12);
  EXPECT_EQ(sim_.subscribed(), std::multiset<std::string>(expected.begin(), expected.end()));
  drive();
}

}  // namespace
}  // namespace xplane_bridge
