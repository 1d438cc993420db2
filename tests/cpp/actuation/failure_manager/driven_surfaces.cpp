#include "fixture.hpp"

namespace xplane_bridge {
namespace {

// ------------------------------------------------------------------------------------------------ driven surfaces

struct SurfaceCase {
  std::string kind;
  std::optional<double> value;
  double shown;  // [deg] after a second with the stick at half, from a quarter
};

TEST_F(FailureManagerTest, EachKindOfASurfaceIsDriven) {
  const std::vector<SurfaceCase> cases{
      {"stuck", {}, 5.0},   {"stuck", 8.0, 8.0},   {"hard_over_up", {}, -20.0}, {"hard_over_down", {}, 20.0},
      {"centred", {}, 0.0}, {"reduced", 0.4, 4.0}, {"slow", 60.0, 10.0},
  };
  for (const SurfaceCase& each : cases) {
    SCOPED_TRACE(each.kind);
    airframe_.setStick(0.25);
    sim_.run(1.2);
    require(broken(FakeAirframe::kLeft, each.kind, each.value));
    EXPECT_TRUE(label(FakeAirframe::kLeft).confirmed);
    EXPECT_EQ(label(FakeAirframe::kLeft).kind, each.kind);
    airframe_.setStick(0.5);
    sim_.run(1.0);
    EXPECT_NEAR(sim_.value(kLeft), each.shown, 1e-4);
    EXPECT_NEAR(sim_.value(kRight), -10.0, 1e-4) << "the others fly on";
    EXPECT_TRUE(failures_.snapshot().surrogate_mixing);
    EXPECT_TRUE(published_.back().surrogate_mixing);
    EXPECT_NEAR(failures_.snapshot().surrogate_lag_frames, 1.0, 0.01);
    requireClear();
    EXPECT_EQ(sim_.value(kSurfaceOverride), 0.0F);
    EXPECT_EQ(state(), SurfaceControlState::kIdle);
  }
}

TEST_F(FailureManagerTest, RepairedInAPauseItRunsBackAfterIt) {
  require(broken(FakeAirframe::kLeft, "stuck", 8.0));
  setLink(LinkState::kPaused);
  const double began = sim_.time();
  const auto done = clear();
  EXPECT_LT(sim_.time() - began, 0.5) << "there is nothing to wait for";
  EXPECT_EQ(done.result.code, ResultCode::kAccepted);
  EXPECT_EQ(done.result.text, "repaired; X-Plane is paused: its surfaces run back when it goes on");
  EXPECT_TRUE(labelNames().empty());
  sim_.run(5.0);
  EXPECT_FLOAT_EQ(sim_.value(kLeft), 8.0F);
  setLink(LinkState::kConnected);
  sim_.run(0.5);
  EXPECT_EQ(state(), SurfaceControlState::kIdle);
  EXPECT_NEAR(sim_.value(kLeft), 0.0, 0.5);
}

TEST_F(FailureManagerTest, LabelShowsWhereASurfaceGotStuck) {
  airframe_.setStick(0.25);
  sim_.run(0.1);
  require(broken(FakeAirframe::kLeft, "stuck"));
  EXPECT_NEAR(label(FakeAirframe::kLeft).value, 5.0, 1e-4);
  require(broken(FakeAirframe::kLeft, "stuck", 8.0));
  EXPECT_EQ(label(FakeAirframe::kLeft).value, 8.0) << "one of the same name is replaced";
  sim_.run(0.2);
  EXPECT_FLOAT_EQ(sim_.value(kLeft), 8.0F);
}

TEST_F(FailureManagerTest, SurfacesThatCannotBeTakenGiveTheFailureUp) {
  sim_.setReadOnly(kSurfaceOverride);
  const RequestResult result = set(broken(FakeAirframe::kLeft, "stuck", 6.0));
  EXPECT_EQ(result.code, ResultCode::kTimeout);
  EXPECT_EQ(result.text, "X-Plane did not let the surfaces be taken over a moment ago");
  EXPECT_TRUE(labelNames().empty());
  sim_.setReadOnly(kSurfaceOverride, false);
  sim_.run(6.0);
  EXPECT_EQ(state(), SurfaceControlState::kIdle) << "nothing needs them any more";
}

TEST_F(FailureManagerTest, SurfaceThatDoesNotFollowGivesTheFailureUp) {
  airframe_.hold(FakeAirframe::kLeft, 0.0);
  const RequestResult result = set(broken(FakeAirframe::kLeft, "stuck", 6.0));
  EXPECT_EQ(result.code, ResultCode::kTimeout);
  EXPECT_EQ(result.text, "X-Plane does not show what is sent to the surface");
}

TEST_F(FailureManagerTest, RepairWaitsUntilXPlaneDrivesTheSurfaces) {
  require(broken(FakeAirframe::kLeft, "stuck", 6.0));
  sim_.setReadOnly(kSurfaceOverride);
  const auto done = clear();
  EXPECT_EQ(done.result.code, ResultCode::kTimeout);
  EXPECT_EQ(done.result.text, std::string("X-Plane still shows ") + kSurfaceOverride);
}

TEST_F(FailureManagerTest, SecondFailureKeepsTheSurfacesDriven) {
  require(broken(FakeAirframe::kLeft, "stuck", 6.0));
  require(broken(FakeAirframe::kRudder, "stuck", 3.0));
  requireClear({FakeAirframe::kLeft});
  EXPECT_EQ(state(), SurfaceControlState::kDriving);
  EXPECT_EQ(sim_.value(kSurfaceOverride), 1.0F);
}

}  // namespace
}  // namespace xplane_bridge
