#include "fixture.hpp"

namespace xplane_bridge {
namespace {

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
  block("the aircraft is not the one of the configuration");
  sim_.run(0.1);
  sim_.clearMessages();
  sim_.run(1.0);
  EXPECT_TRUE(sim_.messages().empty());
  EXPECT_EQ(surfaces_.blockReason(), blocked_->text);
  blocked_.reset();
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

}  // namespace
}  // namespace xplane_bridge
