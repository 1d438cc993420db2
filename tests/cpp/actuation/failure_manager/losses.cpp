#include "fixture.hpp"

namespace xplane_bridge {
namespace {

// ------------------------------------------------------------------------------------------------ losses in between

TEST_F(FailureManagerTest, WhilePausedItIsAcceptedAndActsLater) {
  setLink(LinkState::kPaused);
  const RequestResult result = set(failed("engine_1"));
  EXPECT_EQ(result.code, ResultCode::kAccepted);
  EXPECT_EQ(result.text, "X-Plane is paused: it acts when it goes on");
  EXPECT_TRUE(result.success());
  sim_.run(10.0);
  setLink(LinkState::kConnected);
  sim_.run(0.1);
  EXPECT_TRUE(label("engine_1").confirmed) << "time stood still for what X-Plane has to show";
}

TEST_F(FailureManagerTest, ShortSilenceIsWaitedThrough) {
  sim_.setReadOnly(kEngine);
  after(0.1, [this] { setLink(LinkState::kStale); });
  after(3.0, [this] {
    sim_.set(kEngine, 6.0F);
    setLink(LinkState::kConnected);
  });
  require(failed("engine_1"));
}

TEST_F(FailureManagerTest, LinkThatGoesWhileTheNameIsAskedForSaysNothingOfTheName) {
  const core::FailureRequest unknown = failed("rel_unknown");
  EXPECT_EQ(set(unknown).code, ResultCode::kNotSupported);
  after(0.1, [this] { setLink(LinkState::kLost); });
  const RequestResult result = set(unknown);
  EXPECT_EQ(result.code, ResultCode::kNoLink) << result.text;
  EXPECT_EQ(result.text, "X-Plane is not connected");
}

TEST_F(FailureManagerTest, LostLinkEndsTheWait) {
  sim_.setReadOnly(kEngine);
  after(0.1, [this] { setLink(LinkState::kLost); });
  const RequestResult result = set(failed("engine_1"));
  EXPECT_EQ(result.code, ResultCode::kTimeout) << "it was sent";
  EXPECT_EQ(result.text, "X-Plane went before it has shown it");
}

TEST_F(FailureManagerTest, EndOfTheNodeEndsTheWait) {
  sim_.setReadOnly(kEngine);
  after(0.1, [this] { failures_.stop(); });
  const double begin = sim_.time();
  EXPECT_EQ(set(failed("engine_1")).text, "tx_node ends before X-Plane has shown it");
  EXPECT_NEAR(sim_.time() - begin, 0.1, 0.05);
}

TEST_F(FailureManagerTest, RestartedXPlaneHasNothingBroken) {
  require(failed("engine_1"));
  require(broken(FakeAirframe::kLeft, "stuck", 6.0));
  sim_.restart();
  sim_.setAll({kEngine, kSurfaceOverride}, 0.0F);
  failures_.onLink(sim_.status());
  surfaces_.onLink(sim_.status());
  failures_.onRestart();
  sim_.run(0.1);
  EXPECT_TRUE(labelNames().empty());
  EXPECT_TRUE(reported("failure of engine_1 has ended: X-Plane was restarted", "", true));
  EXPECT_TRUE(reported("failure of aileron1_wing2_left has ended: X-Plane was restarted", "", true));
  EXPECT_EQ(state(), SurfaceControlState::kIdle);
}

TEST_F(FailureManagerTest, AnotherAircraftEndsWhatIsDriven) {
  require(failed("engine_1"));
  require(broken(FakeAirframe::kLeft, "stuck", 6.0));
  surfaces_.onAircraft("OTHER");
  sim_.run(0.1);
  EXPECT_EQ(labelNames(), Names{"engine_1"}) << "X-Plane keeps its own";
  EXPECT_TRUE(reported("failure of aileron1_wing2_left has ended: another aircraft was loaded", "", true));
  EXPECT_EQ(state(), SurfaceControlState::kIdle);
}

TEST_F(FailureManagerTest, SurfaceOverrideReleasedByAnotherClientEndsWhatIsDriven) {
  require(broken(FakeAirframe::kLeft, "stuck", 6.0));
  sim_.set(kSurfaceOverride, 0.0F);
  sim_.run(0.1);
  EXPECT_TRUE(labelNames().empty());
  sim_.clearMessages();
  sim_.run(10.0);
  EXPECT_TRUE(sim_.messages().empty()) << "it is not taken again";
}

TEST_F(FailureManagerTest, RepairedByTheOverrideManagerNothingIsLabelled) {
  require(failed("engine_1"));
  failures_.stop();
  ASSERT_TRUE(overrides_.releaseAll(1.0));
  failures_.repaired("tx_node ends");
  published_.clear();
  failures_.publish();
  ASSERT_EQ(published_.size(), 1U);
  EXPECT_TRUE(published_[0].labels.empty());
}

TEST_F(FailureManagerTest, OneThatIsGivenBackWhileItIsWaitedForIsNotShown) {
  sim_.setReadOnly(kEngine);
  after(0.3, [this] {
    overrides_.giveBackAll();
    failures_.repaired("tx_node hung");
  });
  const RequestResult result = set(failed("engine_1"));
  EXPECT_EQ(result.code, ResultCode::kTimeout);
  EXPECT_EQ(result.text, "tx_node hung");
}

TEST_F(FailureManagerTest, WhatAHangHasEndedIsReportedArmedOnesToo) {
  require(failed("engine_1"));
  require(broken(FakeAirframe::kLeft, "stuck", 6.0));
  ASSERT_EQ(set(triggered("bus_1", FailureTrigger::kAtAltitudeAbove, 9000.0)).code, ResultCode::kAccepted);
  overrides_.giveBackAll();
  failures_.repaired("tx_node hung");
  sim_.run(0.1);
  for (const std::string name : {"engine_1", "aileron1_wing2_left", "bus_1"}) {
    EXPECT_TRUE(reported("failure of " + name + " has ended: tx_node hung", "", true)) << name;
  }
  ASSERT_FALSE(published_.empty());
  EXPECT_TRUE(published_.back().labels.empty()) << "at once";
  sim_.run(2.0);
  EXPECT_TRUE(labelNames().empty()) << "nor is it taken for the menu's";
  EXPECT_EQ(sim_.value(kEngine), 0.0F);
  EXPECT_EQ(state(), SurfaceControlState::kIdle);
}

}  // namespace
}  // namespace xplane_bridge
