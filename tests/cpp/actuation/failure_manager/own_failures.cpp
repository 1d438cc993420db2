#include "fixture.hpp"

namespace xplane_bridge {
namespace {

// ------------------------------------------------------------------------------- X-Plane 12's own failures of surfaces

TEST_F(FailureManagerTest12, XPlanesOwnFailureOfASurfaceIsUsedWhereItActs) {
  airframe_.setStick(0.25);
  sim_.run(0.1);
  sim_.on_message = [this](const core::FakeSimulator::Message& message) {
    if (message.path == kLock && message.value == 6.0F) airframe_.hold(FakeAirframe::kLeft, 5.5);
  };
  after(0.2, [this] { airframe_.setStick(0.5); });
  require(broken(FakeAirframe::kLeft, "stuck"));
  EXPECT_EQ(sim_.value(kLock), 6.0F);
  EXPECT_EQ(state(), SurfaceControlState::kIdle);
  EXPECT_NEAR(label(FakeAirframe::kLeft).value, 5.5, 1e-4) << "where it got stuck";
  requireClear();
  EXPECT_EQ(sim_.value(kLock), 0.0F);
}

TEST_F(FailureManagerTest12, DriverTakesOverWhereXPlanesOwnFailureDoesNotAct) {
  airframe_.setStick(0.25);
  sim_.run(0.1);
  after(0.3, [this] { airframe_.setStick(0.5); });
  const double begin = sim_.time();
  require(broken(FakeAirframe::kLeft, "stuck"));
  EXPECT_TRUE(
      reported("aileron1_wing2_left: X-Plane's own failure does not act as it says, so that tx_node drives the "
               "surfaces",
               kWho, true));
  EXPECT_GE(sim_.time() - begin, 1.0) << "it is given a second";
  EXPECT_EQ(sim_.value(kLock), 0.0F) << "it is repaired";
  EXPECT_EQ(state(), SurfaceControlState::kDriving);
  sim_.run(0.5);
  EXPECT_NEAR(sim_.value(kLeft), 5.0, 1e-4) << "where it was when it was to get stuck";
  EXPECT_NEAR(sim_.value(kRight), -10.0, 1e-4);
  EXPECT_TRUE(label(FakeAirframe::kLeft).confirmed);
}

TEST_F(FailureManagerTest12, DriverTakesOverWhenASurfaceThatStoodStillMovesLater) {
  airframe_.setStick(0.25);
  sim_.run(0.1);
  require(broken(FakeAirframe::kLeft, "stuck"));
  EXPECT_EQ(state(), SurfaceControlState::kIdle) << "it looks stuck";
  airframe_.setStick(0.5);
  sim_.run(0.5);
  airframe_.setStick(0.25);  // not for long
  sim_.run(2.0);
  EXPECT_EQ(state(), SurfaceControlState::kIdle);
  airframe_.setStick(0.5);
  sim_.run(1.5);
  EXPECT_TRUE(
      reported("aileron1_wing2_left: X-Plane's own failure does not act as it says, so that tx_node drives the "
               "surfaces",
               kWho, true));
  EXPECT_EQ(sim_.value(kLock), 0.0F) << "it is repaired";
  EXPECT_EQ(state(), SurfaceControlState::kDriving);
  EXPECT_NEAR(sim_.value(kLeft), 5.0, 1e-4);
  EXPECT_NEAR(sim_.value(kRight), -10.0, 1e-4);
  EXPECT_TRUE(label(FakeAirframe::kLeft).confirmed);
  requireClear();
  airframe_.setStick(0.1);
  sim_.run(2.0);
  EXPECT_EQ(state(), SurfaceControlState::kIdle) << "nothing of it is left";
}

TEST_F(FailureManagerTest12, AReplayIsNoMoveOfAStuckSurface) {
  airframe_.setStick(0.25);
  sim_.run(0.1);
  require(broken(FakeAirframe::kLeft, "stuck"));
  watch_.replay = true;
  airframe_.setStick(0.5);
  sim_.run(3.0);
  airframe_.setStick(0.25);
  sim_.run(0.1);
  watch_.replay = false;
  sim_.run(2.0);
  EXPECT_EQ(state(), SurfaceControlState::kIdle);
  EXPECT_EQ(sim_.value(kLock), 6.0F);
}

TEST_F(FailureManagerTest12, XPlanesFailureStaysWhereTheDriverCannotTakeOverLater) {
  airframe_.setStick(0.25);
  sim_.run(0.1);
  require(broken(FakeAirframe::kLeft, "stuck"));
  block("the aircraft is another one");
  airframe_.setStick(0.5);
  sim_.run(3.0);
  EXPECT_TRUE(
      reported("aileron1_wing2_left: X-Plane's own failure does not act as it says, and tx_node cannot drive the "
               "surface: the aircraft is another one",
               kWho, false));
  EXPECT_EQ(sim_.value(kLock), 6.0F);
  EXPECT_EQ(labelNames().size(), 1U);
}

TEST_F(FailureManagerTest12, DriverTakesOverWhereXPlaneDoesNotShowItsFailure) {
  sim_.setReadOnly(kLock);
  const double begin = sim_.time();
  require(broken(FakeAirframe::kLeft, "stuck"));
  EXPECT_NEAR(sim_.time() - begin, 2.1, 0.15);
  EXPECT_EQ(state(), SurfaceControlState::kDriving);
  requireClear();
  EXPECT_EQ(state(), SurfaceControlState::kIdle);
}

TEST_F(FailureManagerTest12, XPlanesFailureStaysWhereTheDriverCannotTakeOver) {
  airframe_.setStick(0.25);
  sim_.run(0.1);
  after(0.2, [this] { airframe_.setStick(0.5); });
  after(0.3, [this] { block("the aircraft is another one"); });
  const RequestResult result = set(broken(FakeAirframe::kLeft, "stuck"));
  EXPECT_EQ(result.code, ResultCode::kTimeout);
  EXPECT_EQ(result.text,
            "X-Plane's own failure does not act as it says, and tx_node cannot drive the surface: the aircraft is "
            "another one");
  EXPECT_EQ(sim_.value(kLock), 6.0F);
  EXPECT_EQ(labelNames(), Names{FakeAirframe::kLeft});
}

/// X-Plane locks the left aileron three frames after it was asked to; by then it has moved from 5 to 8 deg.
class MovingSurface : public FailureManagerTest12 {
 protected:
  MovingSurface() {
    airframe_.setStick(0.25);
    sim_.run(0.1);
    sim_.on_message = [this](const core::FakeSimulator::Message& message) {
      if (message.path != kLock) return;
      if (message.value == 0.0F) return airframe_.letGo(FakeAirframe::kLeft);
      airframe_.setStick(0.4);
      after(0.06, [this] { airframe_.hold(FakeAirframe::kLeft, 8.0); });
    };
    after(0.3, [this] { airframe_.setStick(0.9); });
  }
  void expectXPlanesLock() {
    require(broken(FakeAirframe::kLeft, "stuck"));
    sim_.run(2.0);
    EXPECT_EQ(sim_.value(kLock), 6.0F);
    EXPECT_EQ(state(), SurfaceControlState::kIdle);
    EXPECT_NEAR(label(FakeAirframe::kLeft).value, 8.0, 1e-4);
    EXPECT_TRUE(label(FakeAirframe::kLeft).confirmed);
  }
};

TEST_F(MovingSurface, IsStuckWhereXPlaneHasLockedIt) { expectXPlanesLock(); }

TEST_F(MovingSurface, IsStuckThereAlsoWhereItsMixingIsNotKnown) {
  surfaces_.onAircraft("OTHER");
  surfaces_.takeAbandoned();
  expectXPlanesLock();
}

TEST_F(FailureManagerTest12, SurfaceThatTheAircraftHasNotIsNotBrokenInTheNameOfAnother) {
  for (const char* kind : {"stuck", "centred", "hard_over_up", "hard_over_down", "gone"}) {
    refused(broken("aileron1_wing1_left", kind), ResultCode::kRefused,
            "aileron1_wing1_left cannot be broken now: aileron1_wing1_left has not been seen to move");
  }
  core::FailureRequest armed = broken("rudder1_fin2", "stuck");
  armed.trigger = static_cast<int>(FailureTrigger::kAtSimTime);
  armed.trigger_value = 5.0;
  refused(armed, ResultCode::kRefused, "rudder1_fin2 has not been seen to move");
  EXPECT_TRUE(sim_.messages().empty());
}

TEST_F(FailureManagerTest12, SurfacesThatXPlaneBreaksTogetherAreNamed) {
  core::MixingModel mixing = FakeAirframe::mixing("WIDE");
  core::SurfaceLaw outer = mixing.laws.front();
  outer.surface = core::surfaceNumber("aileron1_wing3_left").value();
  adopt(mixing, outer);
  const RequestResult left = set(broken(FakeAirframe::kLeft, "stuck"));
  EXPECT_EQ(left.code, ResultCode::kOk);
  EXPECT_EQ(left.text, "X-Plane shows it; X-Plane breaks with it aileron1_wing3_left");
  EXPECT_TRUE(reported("failure: aileron1_wing2_left stuck; X-Plane breaks with it aileron1_wing3_left", kWho, true));
  require(broken(FakeAirframe::kRight, "stuck"));
}

TEST_F(FailureManagerTest12, HardOverOfXPlanesMustReachTheEndOfTheTravel) {
  sim_.on_message = [this](const core::FakeSimulator::Message& message) {
    if (message.path.find("ailn_1_lft_mxup") != std::string::npos && message.value == 6.0F) {
      airframe_.hold(FakeAirframe::kLeft, -19.0);
    }
  };
  require(broken(FakeAirframe::kLeft, "hard_over_up"));
  EXPECT_EQ(state(), SurfaceControlState::kIdle) << "within 2 deg";
}

TEST_F(FailureManagerTest12, ASpoilerOfXPlanesThatIsHardOverUpIsOpen) {
  core::MixingModel mixing = FakeAirframe::mixing("BRAKED");
  core::SurfaceLaw spoiler;
  spoiler.surface = core::surfaceNumber("spoiler1_wing1_left").value();
  spoiler.slopes[static_cast<Eigen::Index>(core::MixingTerm::kSpeedbrake)] = 60.0;
  spoiler.high_deg = 60.0;
  adopt(mixing, spoiler);
  sim_.on_message = [this](const core::FakeSimulator::Message& message) {
    if (message.path.find("rspo_1_lft_mxup") != std::string::npos && message.value == 6.0F) {
      airframe_.hold("spoiler1_wing1_left", 60.0);
    }
  };
  require(broken("spoiler1_wing1_left", "hard_over_up"));
  EXPECT_EQ(state(), SurfaceControlState::kIdle);
}

TEST_F(FailureManagerTest12, WhereXPlanesDoesNotActAnotherSurfaceOfItsSetBreaksAsWellAndTheMenuIsLeftAlone) {
  const std::string up = "sim/operation/failures/rel_fcon_ailn_1_lft_mxup";
  core::MixingModel mixing = FakeAirframe::mixing("WIDE");
  core::SurfaceLaw outer = mixing.laws.front();
  outer.surface = core::surfaceNumber("aileron1_wing3_left").value();
  adopt(mixing, outer);
  sim_.run(1.2);
  EXPECT_EQ(set(broken(FakeAirframe::kLeft, "hard_over_up")).code, ResultCode::kOk);
  EXPECT_EQ(set(broken("aileron1_wing3_left", "hard_over_up")).code, ResultCode::kOk);
  EXPECT_EQ(state(), SurfaceControlState::kDriving);
  sim_.run(1.0);
  sim_.set(up, 6.0F);
  sim_.run(1.1);
  EXPECT_FALSE(label("rel_fcon_ailn_1_lft_mxup").by_bridge);
  requireClear();
  EXPECT_EQ(sim_.value(up), 6.0F);
  EXPECT_EQ(labelNames(), Names{"rel_fcon_ailn_1_lft_mxup"});
}

struct OwnCase {
  std::string kind;
  std::string event;  // the end of X-Plane's own name
  double shown;       // [deg] where X-Plane brings the left aileron, from 5
};
const std::vector<OwnCase> kOwnCases{{"stuck", "lock", 5.0},
                                     {"hard_over_up", "mxup", -20.0},
                                     {"hard_over_down", "mxdn", 20.0},
                                     {"centred", "cntr", 0.0}};

TEST_F(FailureManagerTest12, EachOwnFailureIsBelievedWhereTheSurfaceGoesAsItSays) {
  for (const OwnCase& each : kOwnCases) {
    SCOPED_TRACE(each.kind);
    airframe_.letGo(FakeAirframe::kLeft);
    airframe_.setStick(0.25);
    sim_.run(1.2);
    const std::string own = "sim/operation/failures/rel_fcon_ailn_1_lft_" + each.event;
    sim_.on_message = [&](const core::FakeSimulator::Message& message) {
      if (message.path == own && message.value == 6.0F) airframe_.hold(FakeAirframe::kLeft, each.shown);
    };
    after(0.2, [this] { airframe_.setStick(-0.25); });
    require(broken(FakeAirframe::kLeft, each.kind));
    EXPECT_EQ(sim_.value(own), 6.0F);
    EXPECT_EQ(state(), SurfaceControlState::kIdle);
    requireClear();
    EXPECT_EQ(sim_.value(own), 0.0F);
  }
}

TEST_F(FailureManagerTest12, EachOwnFailureGivesWayToTheDriverWhereTheSurfaceDoesNotGoThere) {
  for (const OwnCase& each : kOwnCases) {
    SCOPED_TRACE(each.kind);
    airframe_.setStick(0.25);
    sim_.run(1.2);
    after(0.2, [this] { airframe_.setStick(-0.25); });
    require(broken(FakeAirframe::kLeft, each.kind));
    EXPECT_EQ(sim_.value("sim/operation/failures/rel_fcon_ailn_1_lft_" + each.event), 0.0F);
    EXPECT_EQ(state(), SurfaceControlState::kDriving);
    sim_.run(1.0);
    EXPECT_NEAR(sim_.value(kLeft), each.shown, 1e-4);
    EXPECT_NEAR(sim_.value(kRight), 5.0, 1e-4);
    requireClear();
  }
}

TEST_F(FailureManagerTest12, LostSurfaceIsXPlanesAlone) {
  require(broken(FakeAirframe::kLeft, "gone"));
  EXPECT_EQ(sim_.value("sim/operation/failures/rel_fcon_ailn_1_lft_gone"), 6.0F);
  requireClear();
  sim_.setReadOnly("sim/operation/failures/rel_fcon_ailn_1_lft_gone");
  const RequestResult result = set(broken(FakeAirframe::kLeft, "gone"));
  EXPECT_EQ(result.code, ResultCode::kTimeout);
  EXPECT_EQ(result.text, "X-Plane does not show it");
}

TEST_F(FailureManagerTest12, WhatXPlaneCannotExpressIsDrivenAtOnce) {
  require(broken(FakeAirframe::kLeft, "reduced", 0.5));
  EXPECT_EQ(state(), SurfaceControlState::kDriving);
}

}  // namespace
}  // namespace xplane_bridge
