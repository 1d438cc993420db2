#include "fixture.hpp"

namespace xplane_bridge {
namespace {

TEST_F(SurfaceIdentificationTest, EndsAtEachLimit) {
  struct Case {
    std::string dataref;
    float value;
    std::string why;
  };
  // 21 m/s of airspeed less is 40.8 kt less.
  const std::vector<Case> cases{
      {kPosition + "true_phi", 31.0F, "31.0 deg is beyond the limit of 30.0 deg"},
      {kPosition + "true_theta", -21.0F, "-21.0 deg is beyond the limit of 20.0 deg"},
      {kPosition + "Prad", 0.8F, "45.8 deg/s is beyond the limit of 40.0 deg/s"},
      {kPosition + "indicated_airspeed", 89.0F, "a change of airspeed by -21.1 m/s is beyond the limit of 10.0 m/s"},
      {kPosition + "y_agl", 100.0F, "the height above ground is 100.0 m: expected at least 150.0 m"},
  };
  for (const Case& each : cases) {
    events_.clear();
    reserved_ = 0;
    beginSignal();
    const float before = sim_.value(each.dataref);
    sim_.set(each.dataref, each.value);
    run(0.1);
    expectGivenUp(each.why);
    sim_.set(each.dataref, before);
    run(0.1);
  }
}

TEST_F(SurfaceIdentificationTest, TakesTheLimitsOfTheRequest) {
  IdentificationRequest request;
  request.max_roll_deg = 8.0;
  request.max_pitch_deg = 7.0;
  request.max_rate_deg_s = 5.0;
  request.max_airspeed_change = 2.0;
  request.min_height = 950.0;
  EXPECT_EQ(refusal(request), "the height above ground is 900.0 m: expected at least 950.0 m");
  request.min_height = 850.0;
  const std::vector<std::pair<std::string, float>> cases{
      {"true_phi", 9.0F}, {"true_theta", 8.0F}, {"Prad", 0.1F}, {"indicated_airspeed", 124.0F}, {"y_agl", 840.0F}};
  for (const auto& [name, value] : cases) {
    events_.clear();
    reserved_ = 0;
    begin(request);
    run(1.5);
    ASSERT_EQ(outcome().text, "");
    const float before = sim_.value(kPosition + name);
    sim_.set(kPosition + name, value);
    run(0.1);
    expectGivenUp("");
    sim_.set(kPosition + name, before);
    run(0.1);
  }
}

TEST_F(SurfaceIdentificationTest, EndsWhereTheFlightDoesNotStaySteadyBeforeTheFirstSignal) {
  begin();
  run(0.5);
  sim_.set(kPosition + "elevation", 1006.0F);
  run(0.1);
  expectGivenUp("6.0 m of height in a second");
}

TEST_F(SurfaceIdentificationTest, EndsWhereTheParkedAircraftRollsOn) {
  sim_.set(kOnGround, 1.0F);
  sim_.set(kPosition + "groundspeed", 0.0F);
  run(0.1);
  beginSignal();
  sim_.set(kPosition + "groundspeed", 2.0F);
  run(0.1);
  expectGivenUp("the aircraft does not stand any more");
}

TEST_F(SurfaceIdentificationTest, EndsWithACrash) {
  beginSignal();
  sim_.set("sim/flightmodel2/misc/has_crashed", 1.0F);
  run(0.1);
  expectGivenUp("the aircraft has crashed");
}

TEST_F(SurfaceIdentificationTest, EndsWithAFailureOfTheControls) {
  beginSignal();
  breakAtOnce("rel_conlock");
  run(0.1);
  expectGivenUp("rel_conlock is broken: clear_failures repairs it");
}

TEST_F(SurfaceIdentificationTest, EndsWithTheMode) {
  beginSignal();
  actuation_->path().requestMode({1, 2, "test", 0.0});
  run(0.1);
  expectGivenUp("the mode changed");
}

TEST_F(SurfaceIdentificationTest, EndsWithTheSurfacesOfAnotherProgram) {
  beginSignal();
  sim_.set(core::kSurfaceOverride, 1.0F);
  run(0.1);
  sim_.set(core::kSurfaceOverride, 0.0F);
  expectGivenUp("another program has set override_control_surfaces");
}

TEST_F(SurfaceIdentificationTest, EndsWithAnotherAircraft) {
  beginSignal();
  showAircraft("QUAD");
  run(1.5);
  expectGivenUp("another aircraft was loaded");
}

TEST_F(SurfaceIdentificationTest, EndsWithTheLink) {
  beginSignal();
  sim_.setState(core::LinkState::kLost);
  actuation_->onLink(sim_.status());
  EXPECT_EQ(outcome().text, "identify_surfaces is given up: nothing is sent: X-Plane is not connected");
}

TEST_F(SurfaceIdentificationTest, IsStoppedDuringASignalAndBetweenTwo) {
  ExcitationRequest stop;
  stop.kind = "stop";
  beginSignal();
  EXPECT_EQ(actuation_->inject(stop, "pilot").result.text, "identify_surfaces is stopped");
  expectGivenUp("stopped by pilot");
  events_.clear();
  reserved_ = 0;
  begin();
  run(0.3);
  EXPECT_EQ(actuation_->inject(stop, "pilot").result.code, ResultCode::kAccepted);
  expectGivenUp("stopped by pilot");
}

TEST_F(SurfaceIdentificationTest, AStickThatStandsFarOffByThenIsNotReachedAcross) {
  begin();
  run(0.5);
  pilot_ = {0.0, 0.6, 0.0};
  run(8.0);
  expectGivenUp("pitch stands at 0.6 of full stick: trim it first");
}

TEST_F(SurfaceIdentificationTest, StandsStillWhilePaused) {
  beginSignal();
  sim_.setState(core::LinkState::kPaused);
  actuation_->onLink(sim_.status());
  run(20.0);
  EXPECT_EQ(outcome().text, "");
  sim_.setState(core::LinkState::kConnected);
  actuation_->onLink(sim_.status());
  run(15.0);
  EXPECT_TRUE(outcome().success) << outcome().text;
}

}  // namespace
}  // namespace xplane_bridge
