#include "fixture.hpp"

namespace xplane_bridge {
namespace {

TEST_F(SurfaceIdentificationTest, RefusesAFlightThatIsNotSteady) {
  const auto with = [this](const std::string& name, float value) {
    const float before = sim_.value(kPosition + name);
    sim_.set(kPosition + name, value);
    run(0.04);
    const std::string out = refusal();
    sim_.set(kPosition + name, before);
    run(0.04);
    return out;
  };
  const std::string expected = ": stand still on the ground, or fly straight and level first";
  EXPECT_EQ(with("true_phi", -20.0F), "the flight is not steady, roll -20.0 deg and pitch 0.0 deg" + expected);
  EXPECT_EQ(with("true_theta", 14.0F), "the flight is not steady, roll 0.0 deg and pitch 14.0 deg" + expected);
  // 0.2 rad/s
  EXPECT_EQ(with("Prad", 0.2F), "the flight is not steady, it turns at 11.5 deg/s" + expected);
  EXPECT_EQ(with("Qrad", -0.2F), "the flight is not steady, it turns at 11.5 deg/s" + expected);
  EXPECT_EQ(with("Rrad", 0.2F), "the flight is not steady, it turns at 11.5 deg/s" + expected);
  EXPECT_EQ(with("y_agl", 120.0F), "the height above ground is 120.0 m: expected at least 150.0 m");
}

TEST_F(SurfaceIdentificationTest, RefusesAnAircraftThatRolls) {
  sim_.set(kOnGround, 1.0F);
  sim_.set(kPosition + "groundspeed", 5.0F);
  run(0.1);
  EXPECT_EQ(refusal(), "the aircraft rolls at 5.0 m/s: stand still on the ground, or fly straight and level first");
}

TEST_F(SurfaceIdentificationTest, RefusesLimitsThatAreNone) {
  IdentificationRequest request;
  request.max_rate_deg_s = -1.0;
  EXPECT_EQ(refusal(request), "max_rate_deg_s is -1.0: expected 0 (the default) or more");
  request = {};
  request.min_height = std::nan("");
  EXPECT_EQ(refusal(request), "min_height is nan: expected 0 (the default) or more");
}

TEST_F(SurfaceIdentificationTest, RefusesWhileTheControlsAreBrokenAndSaysWhatRepairsThem) {
  const std::string lock = "sim/operation/failures/rel_conlock";
  sim_.set(lock, 6.0F);
  run(1.1);
  EXPECT_EQ(refusal(), "rel_conlock is failed in the simulator: clear_failures with include_simulator repairs it");
  sim_.set(lock, 0.0F);
  run(1.1);
  breakAtOnce("rel_conlock");
  EXPECT_EQ(refusal(), "rel_conlock is broken: clear_failures repairs it");
}

TEST_F(SurfaceIdentificationTest, IsNotKeptByAFailureOfOtherThingsOrByOneThatWaits) {
  sim_.set("sim/operation/failures/rel_pitot", 6.0F);
  core::FailureRequest armed{"rel_conlock", "failed", {}, 1, 1000.0};
  ASSERT_EQ(actuation_->failures().set(armed, "test").code, ResultCode::kAccepted);
  run(1.1);
  begin();
  run(15.0);
  EXPECT_TRUE(outcome().success) << outcome().text;
}

TEST_F(SurfaceIdentificationTest, RefusesAStickFarOffTheMiddle) {
  pilot_ = {0.1, 0.2, -0.6};
  run(0.1);
  EXPECT_EQ(refusal(), "yaw stands at -0.6 of full stick: trim it first");
  pilot_ = {};
  run(0.1);
  begin();
  run(15.0);
  EXPECT_TRUE(outcome().success) << outcome().text;
}

TEST_F(SurfaceIdentificationTest, RefusesWhileSurfacesAreDriven) {
  begin();
  run(15.0);
  ASSERT_TRUE(outcome().success) << outcome().text;
  reserved_ = 0;
  actuation_->path().requestMode({1, 2, "test", 0.0});
  ASSERT_EQ(actuation_->commandSurfaces({FakeAirframe::kLeft}, {2.0F}, 1), "");
  run(0.1);
  EXPECT_EQ(refusal(), "the surfaces are driven one by one: end that first");
  ASSERT_EQ(actuation_->commandSurfaces({}, {}, 2), "");
  run(3.0);
  breakAtOnce(FakeAirframe::kLeft, "centred");
  EXPECT_EQ(refusal(), "aileron1_wing2_left is broken: clear_failures repairs it");
}

TEST_F(SurfaceIdentificationTest, RefusesWhileAnotherProgramHasTheSurfaces) {
  sim_.set(core::kSurfaceOverride, 1.0F);
  run(0.1);
  EXPECT_EQ(refusal(), "another program has set override_control_surfaces and must give it back");
}

TEST_F(SurfaceIdentificationTest, RefusesUnderTheFailsafe) {
  core::ControlCommand command;
  command.fields = core::kFieldRoll;
  actuation_->path().command(core::FlightMode::kManual, command);
  run(2.0);
  EXPECT_EQ(refusal(), "the failsafe flies: its source must be back, or a mode asked for");
}

TEST_F(SurfaceIdentificationTest, RefusesWhilePausedAndWithoutALink) {
  sim_.setState(core::LinkState::kPaused);
  actuation_->onLink(sim_.status());
  EXPECT_EQ(refusal(), "X-Plane is paused: let it run first");
  sim_.setState(core::LinkState::kLost);
  actuation_->onLink(sim_.status());
  EXPECT_EQ(identify().result.code, ResultCode::kNoLink);
}

TEST_F(SurfaceIdentificationTest, RefusesASecondOneAndOtherSignals) {
  ExcitationRequest doublet;
  doublet.kind = "doublet";
  doublet.target = FakeAirframe::kLeft;
  doublet.amplitude = 0.1;
  doublet.duration = 2.0;
  begin();
  EXPECT_EQ(identify().result.text, "an identification runs already: wait for event 1");
  EXPECT_EQ(actuation_->inject(doublet, "other").result.text, "identify_surfaces runs: wait for event 1, or stop it");
  run(15.0);
  ASSERT_TRUE(outcome().success) << outcome().text;
  ASSERT_EQ(actuation_->inject(doublet, "other").result.code, ResultCode::kAccepted);
  reserved_ = 0;
  EXPECT_EQ(refusal(), "an excitation runs: wait for it, or stop it");
}

// ------------------------------------------------------------------------------------------------------- it ends early

}  // namespace
}  // namespace xplane_bridge
