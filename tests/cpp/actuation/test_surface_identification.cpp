#include "xplane_bridge/actuation/surface_identification.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "fake_airframe.hpp"
#include "fake_simulator.hpp"
#include "xplane_bridge/actuation/actuation.hpp"
#include "xplane_bridge/actuation/mixing_files.hpp"
#include "xplane_bridge/core/failures/failure_names.hpp"

namespace xplane_bridge {
namespace {

using core::EventKind;
using core::FakeAirframe;
using core::ResultCode;

const std::string kPosition = "sim/flightmodel/position/";
constexpr const char* kOnGround = "sim/flightmodel/failures/onground_any";
const std::array<std::string, 3> kSticks{"sim/joystick/yoke_roll_ratio", "sim/joystick/yoke_pitch_ratio",
                                         "sim/joystick/yoke_heading_ratio"};
const std::array<std::string, 3> kOverrides{"sim/operation/override/override_joystick_roll",
                                            "sim/operation/override/override_joystick_pitch",
                                            "sim/operation/override/override_joystick_heading"};

/// An Actuation on a FakeSimulator whose aircraft flies steadily and moves its surfaces as FakeAirframe's mixing says;
/// no mixing is known. A stick that is overridden is where it was written, else where the pilot holds it.
class SurfaceIdentificationTest : public testing::Test {
 protected:
  SurfaceIdentificationTest() {
    sim_.setAll(core::flightWatchDatarefs(), 0.0F);
    sim_.set("sim/time/total_running_time_sec", 100.0F);
    sim_.set(kPosition + "y_agl", 900.0F);
    sim_.set(kPosition + "elevation", 1000.0F);
    sim_.set(kPosition + "indicated_airspeed", 130.0F);
    sim_.set(kPosition + "groundspeed", 70.0F);
    sim_.setAll({kOverrides.begin(), kOverrides.end()}, 0.0F);
    sim_.setAll({kSticks.begin(), kSticks.end()}, 0.0F);
    sim_.setAll(core::simulatorFailures(core::kXPlane11), 0.0F);
    showAircraft("DA62");
    sim_.on_frame = [this] { eachFrame(); };
    ActuationHooks hooks;
    hooks.mode = [](const core::ModeStatus&, double) {};
    hooks.applied = [](const AppliedControls&, const auto&) {};
    hooks.surfaces_applied = [](const SurfaceControl::Echo&, core::FlightMode, const auto&) {};
    hooks.failures = [](const FailureSnapshot&) {};
    hooks.excitation = [this](const ExcitationLabel& label) { labels_.push_back(label); };
    hooks.disturbance = [](const DisturbanceLabel&) {};
    hooks.event = [this](const ActuationEvent& event) { events_.push_back(event); };
    hooks.warn = [](const std::string&) {};
    hooks.journal_problem = [](const std::string&) {};
    hooks.stopping = [] { return false; };
    ActuationOptions options;
    options.surfaces.mixing_folder = folder();
    options.control.arbiter.transition_rate = 1000.0;
    actuation_ = std::make_unique<Actuation>(&sim_, options, std::move(hooks));
    actuation_->onLink(sim_.status());
    run(0.3);
  }

  std::string folder() const { return sim_.folder() + "/mixing"; }
  void showAircraft(const std::string& icao) {
    sim_.setAll(core::AircraftIdentityReader::datarefs(), 0.0F);
    for (std::size_t i = 0; i < icao.size(); ++i) {
      sim_.set("sim/aircraft/view/acf_ICAO[" + std::to_string(i) + "]", static_cast<float>(icao[i]));
    }
  }
  void eachFrame() {
    std::array<double, 3> stick{};
    for (std::size_t i = 0; i < 3; ++i) {
      const bool taken = sim_.value(kOverrides[i]) != 0.0F;
      stick[i] = taken ? static_cast<double>(sim_.value(kSticks[i])) : pilot_[i];
      low_[i] = std::min(low_[i], stick[i]);
      high_[i] = std::max(high_[i], stick[i]);
      ever_taken_[i] = ever_taken_[i] || taken;
    }
    airframe_.setStick(stick[0], stick[1], stick[2]);
    airframe_.move();
    if (each_frame_) each_frame_();
  }
  void run(double seconds) {
    for (double end = sim_.time() + seconds - 1e-6; sim_.time() < end;) {
      sim_.frame();
      actuation_->tick();
    }
  }
  Actuation::Identifying identify(const IdentificationRequest& request = {}) {
    return actuation_->identifySurfaces(request, "test", [this] { return ++reserved_; });
  }
  std::string refusal(const IdentificationRequest& request = {}) {
    const auto out = identify(request);
    EXPECT_EQ(out.event_number, 0U) << out.result.text;
    EXPECT_EQ(reserved_, 0U) << "a number of no event";
    return out.result.text;
  }
  void begin(const IdentificationRequest& request = {}) {
    const auto out = identify(request);
    ASSERT_EQ(out.result.code, ResultCode::kAccepted) << out.result.text;
    ASSERT_EQ(out.event_number, 1U);
  }
  /// The promised event; none yet: nothing in it.
  ActuationEvent outcome() const {
    const auto it = std::find_if(events_.begin(), events_.end(), [](const auto& event) { return event.number == 1; });
    return it == events_.end() ? ActuationEvent{} : *it;
  }
  /// Runs until the roll signal moves the stick.
  void beginSignal() {
    begin();
    run(1.5);
    ASSERT_TRUE(labels_.back().active);
    ASSERT_EQ(labels_.back().target, "roll");
  }
  /// It was given up, nothing is moved any more, and what the pilot flies with is his again.
  void expectGivenUp(const std::string& why) {
    EXPECT_FALSE(outcome().success);
    EXPECT_EQ(outcome().text.find("identify_surfaces is given up: "), 0U) << outcome().text;
    EXPECT_NE(outcome().text.find(why), std::string::npos) << outcome().text;
    EXPECT_FALSE(labels_.back().active);
    run(0.2);
    for (const std::string& name : kOverrides) EXPECT_EQ(sim_.value(name), 0.0F) << name;
    EXPECT_NE(actuation_->surfaces().blockReason(), "");
    EXPECT_FALSE(std::filesystem::exists(folder()));
  }
  std::string setCentred() {
    core::FailureRequest request;
    request.name = FakeAirframe::kLeft;
    request.kind = "centred";
    return actuation_->failures().set(request, "test").text;
  }

  core::FakeSimulator sim_;
  FakeAirframe airframe_{&sim_};
  std::array<double, 3> pilot_{};  // where the pilot holds the stick
  std::array<double, 3> low_{}, high_{};
  std::array<bool, 3> ever_taken_{};
  std::function<void()> each_frame_;
  std::vector<ExcitationLabel> labels_;
  std::vector<ActuationEvent> events_;
  std::uint32_t reserved_ = 0;
  std::unique_ptr<Actuation> actuation_;
};

// ------------------------------------------------------------------------------------------------------ it succeeds

TEST_F(SurfaceIdentificationTest, FindsTheMixingOfAllSurfacesInFifteenSeconds) {
  EXPECT_NE(setCentred().find("call identify_surfaces"), std::string::npos);
  begin();
  run(15.0);
  ASSERT_TRUE(outcome().success) << outcome().text;
  EXPECT_EQ(outcome().kind, EventKind::kSetting);
  EXPECT_EQ(outcome().who, "test");
  EXPECT_EQ(outcome().text, "the mixing of 4 surfaces of DA62 is identified, kept in " + folder() + "/DA62.yaml");
  EXPECT_EQ(actuation_->surfaces().blockReason(), "") << "single surfaces move at once";
  const auto kept = readMixingFile(folder(), "DA62");
  ASSERT_TRUE(kept);
  const core::MixingModel expected = FakeAirframe::mixing("DA62");
  ASSERT_EQ(kept->laws.size(), expected.laws.size());
  for (std::size_t i = 0; i < expected.laws.size(); ++i) {
    EXPECT_EQ(kept->laws[i].surface, expected.laws[i].surface);
    EXPECT_NEAR((kept->laws[i].slopes - expected.laws[i].slopes).cwiseAbs().maxCoeff(), 0.0, 0.01);
  }
}

TEST_F(SurfaceIdentificationTest, MovesEachAxisALittleAndGivesItBack) {
  begin();
  run(15.0);
  ASSERT_TRUE(outcome().success) << outcome().text;
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_TRUE(ever_taken_[i]);
    EXPECT_EQ(sim_.value(kOverrides[i]), 0.0F) << "the pilot's again";
    // A quarter more than the fifth of full stick that it takes.
    EXPECT_NEAR(high_[i], 0.25, 0.005);
    EXPECT_NEAR(low_[i], -0.25, 0.005);
  }
  std::vector<std::string> done;
  for (const ExcitationLabel& label : labels_) {
    if (label.result == "done") done.push_back(label.target);
  }
  EXPECT_EQ(done, (std::vector<std::string>{"roll", "pitch", "yaw"}));
}

TEST_F(SurfaceIdentificationTest, StartsFromWhereThePilotHoldsTheStick) {
  pilot_ = {0.0, 0.2, 0.0};
  run(1.0);
  begin();
  run(18.0);
  ASSERT_TRUE(outcome().success) << outcome().text;
  EXPECT_NEAR(high_[1], 0.65, 0.01) << "0.2 + 0.25 to the other side of the middle, and as much to this side";
  EXPECT_NEAR(low_[1], -0.25, 0.01);
  EXPECT_NEAR(sim_.value(core::mixingInputDatarefs()[1]), 0.2, 1e-6);
}

TEST_F(SurfaceIdentificationTest, AddsToWhatAControllerFliesAndMovesMoreAgainstIt) {
  // A controller that takes half of the signal away again, as an attitude loop does.
  double answer = 0.0;
  each_frame_ = [&] {
    core::ControlCommand command;
    command.fields = core::kFieldRoll | core::kFieldPitch | core::kFieldYaw;
    command.roll = answer;
    actuation_->path().command(core::FlightMode::kManual, command);
    answer = -0.5 * (static_cast<double>(sim_.value(kSticks[0])) - answer);
  };
  run(0.5);
  begin();
  run(25.0);
  ASSERT_TRUE(outcome().success) << outcome().text;
  EXPECT_GT(std::count_if(labels_.begin(), labels_.end(),
                          [](const auto& label) { return label.target == "roll" && label.result == "done"; }),
            1)
      << "once more, with more";
  EXPECT_EQ(sim_.value(kOverrides[0]), 1.0F) << "the controller flies on";
}

TEST_F(SurfaceIdentificationTest, WorksParked) {
  sim_.set(kOnGround, 1.0F);
  sim_.set(kPosition + "y_agl", 0.0F);
  sim_.set(kPosition + "indicated_airspeed", 0.0F);
  sim_.set(kPosition + "groundspeed", 0.0F);
  run(0.1);
  begin();
  run(15.0);
  EXPECT_TRUE(outcome().success) << outcome().text;
}

TEST_F(SurfaceIdentificationTest, IsNotSavedIfAskedNotTo) {
  IdentificationRequest request;
  request.save = false;
  begin(request);
  run(15.0);
  ASSERT_TRUE(outcome().success) << outcome().text;
  EXPECT_EQ(outcome().text, "the mixing of 4 surfaces of DA62 is identified, not kept in a file, as asked for");
  EXPECT_EQ(actuation_->surfaces().blockReason(), "");
  // Half a minute of stick would be worth a file otherwise.
  each_frame_ = [this] {
    const double angle = 2.0 * sim_.time();
    pilot_ = {0.4 * std::sin(angle), 0.4 * std::sin(1.3 * angle), 0.4 * std::sin(1.7 * angle)};
  };
  run(60.0);
  EXPECT_FALSE(std::filesystem::exists(folder()));
}

TEST_F(SurfaceIdentificationTest, SaysWhatIsMissingWhereASurfaceDoesNotFollow) {
  // The left aileron flutters.
  each_frame_ = [this] {
    sim_.set(FakeAirframe::dataref(FakeAirframe::kLeft), static_cast<float>(3.0 * std::sin(9.0 * sim_.time())));
  };
  begin();
  run(15.0);
  EXPECT_FALSE(outcome().success);
  EXPECT_EQ(outcome().text.find("the mixing is not identified: "), 0U) << outcome().text;
  EXPECT_NE(outcome().text.find("aileron1_wing2_left does not follow"), std::string::npos) << outcome().text;
  EXPECT_FALSE(std::filesystem::exists(folder()));
}

TEST_F(SurfaceIdentificationTest, SaysWhatIsMissingWhereAnAxisDoesNotMove) {
  sim_.setReadOnly(kSticks[2]);
  begin();
  run(25.0);
  EXPECT_FALSE(outcome().success);
  EXPECT_NE(outcome().text.find("yaw right: seen up to 0.00, need 0.20 of full stick"), std::string::npos)
      << outcome().text;
}

TEST_F(SurfaceIdentificationTest, KeepsAMixingThatKnowsMore) {
  writeMixingFile(folder(), FakeAirframe::mixing("QUAD"));
  showAircraft("QUAD");
  run(2.0);
  const auto before = readMixingFile(folder(), "QUAD");
  begin();
  run(15.0);
  EXPECT_TRUE(outcome().success);
  EXPECT_NE(outcome().text.find("the mixing known already holds"), std::string::npos) << outcome().text;
  EXPECT_EQ(core::toText(*readMixingFile(folder(), "QUAD")), core::toText(*before));
}

TEST_F(SurfaceIdentificationTest, ReplacesAMixingThatDoesNotFit) {
  core::MixingModel wrong = FakeAirframe::mixing("QUAD");
  wrong.laws[0].slopes[0] = 8.0;  // its bias
  writeMixingFile(folder(), wrong);
  showAircraft("QUAD");
  run(2.0);
  ASSERT_NE(actuation_->surfaces().blockReason().find("call identify_surfaces"), std::string::npos);
  begin();
  run(15.0);
  ASSERT_TRUE(outcome().success) << outcome().text;
  EXPECT_NEAR(readMixingFile(folder(), "QUAD")->laws[0].slopes[0], 0.0, 0.01);
}

// ---------------------------------------------------------------------------------------------------- it is refused

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

TEST_F(SurfaceIdentificationTest, RefusesWhileAFailureIsSetOrWaits) {
  core::FailureRequest request;
  request.name = "engine_1";
  request.kind = "failed";
  request.trigger = 1;
  request.trigger_value = 1000.0;
  ASSERT_EQ(actuation_->failures().set(request, "test").code, ResultCode::kAccepted);
  EXPECT_EQ(refusal(), "a failure is set: clear_failures first");
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

TEST_F(SurfaceIdentificationTest, EndsWithAFailure) {
  beginSignal();
  core::FailureRequest request;
  request.name = "engine_1";
  request.kind = "failed";
  request.trigger = 1;
  request.trigger_value = 1000.0;
  actuation_->failures().set(request, "test");
  run(0.1);
  expectGivenUp("a failure is set: clear_failures first");
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

TEST_F(SurfaceIdentificationTest, RefusesToReachAcrossAStickThatStandsFarOff) {
  pilot_ = {0.0, 0.6, 0.0};
  run(0.5);
  begin();
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
