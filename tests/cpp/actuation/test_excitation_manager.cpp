#include "xplane_bridge/actuation/excitation_manager.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "actuation/driven_surfaces_test.hpp"
#include "xplane_bridge/actuation/link_condition.hpp"

namespace xplane_bridge {
namespace {

using core::Channel;
using core::FakeAirframe;
using core::ResultCode;

using Axes = std::vector<core::ChannelSet>;

const std::string kLeft = FakeAirframe::dataref(FakeAirframe::kLeft);
const std::size_t kLeftNumber = core::surfaceNumber(FakeAirframe::kLeft).value();

core::ChannelSet only(Channel channel) {
  core::ChannelSet out;
  out.set(core::index(channel));
  return out;
}

ExcitationRequest doubletOn(const std::string& target, double amplitude = 0.2) {
  ExcitationRequest out;
  out.kind = "doublet";
  out.target = target;
  out.amplitude = amplitude;
  out.duration = 2.0;
  return out;
}

/// Expectations are worked out by hand: a doublet of 2 s is +A for a second and -A for the next.
class ExcitationManagerTest : public DrivenSurfacesTest {
 protected:
  ExcitationManagerTest() {
    watch_.roll_deg = 3.0;
    watch_.pitch_deg = -2.0;
    sim_.on_frame = [this] {
      watch_.sim_time = static_cast<double>(sim_.value("sim/time/total_running_time_sec"));
      excited_ = manager_.onFrame(watch_);
      eachFrame();
    };
    sim_.frame();
  }

  RequestResult inject(const ExcitationRequest& request) {
    return manager_.inject(request, manager_.plan(request), "node/inject", watch_, refusal_, commanded_);
  }
  std::string wrongWith(const ExcitationRequest& request) const { return manager_.plan(request).wrong; }
  void start(const std::string& target, double amplitude) {
    const RequestResult result = inject(doubletOn(target, amplitude));
    ASSERT_EQ(result.code, ResultCode::kAccepted) << result.text;
  }

  core::FlightWatch watch_;
  core::ChannelSet commanded_ = only(Channel::kRoll);
  std::optional<RequestResult> refusal_;
  bool excited_ = false;
  std::vector<ExcitationLabel> labels_;                               // as published
  std::vector<std::tuple<std::string, std::string, bool>> reported_;  // text, who, success
  ExcitationManager manager_{&surfaces_, 45.0, 20.0, [this](const ExcitationLabel& label) { labels_.push_back(label); },
                             [this](const std::string& text, const std::string& who, bool success) {
                               reported_.emplace_back(text, who, success);
                             }};
};

// ------------------------------------------------------------------------------------------------ plan()

TEST_F(ExcitationManagerTest, PlanSaysWhatIsWrongWithARequest) {
  ExcitationRequest request = doubletOn("roll");
  request.kind = "square";
  EXPECT_NE(wrongWith(request).find("kind is \"square\""), std::string::npos) << wrongWith(request);
  EXPECT_EQ(wrongWith(doubletOn("gear")),
            "target is \"gear\"; expected roll, pitch, yaw, throttle or a surface (docs/control/surfaces.md), of a "
            "multisine also "
            "several axes, for example \"roll,pitch\"");
  EXPECT_EQ(wrongWith(doubletOn("roll", 1.1)), "amplitude of an axis must be at most 1 (full travel)");
  EXPECT_EQ(wrongWith(doubletOn(FakeAirframe::kLeft, 1.1)), "") << "degrees";
  request = doubletOn("roll");
  request.duration = 0.0;
  EXPECT_NE(wrongWith(request).find("duration is 0"), std::string::npos) << wrongWith(request);
  EXPECT_EQ(inject(request).code, ResultCode::kRefused);
  EXPECT_EQ(inject(request).text, wrongWith(request));
}

TEST_F(ExcitationManagerTest, PlanKnowsItsTarget) {
  EXPECT_EQ(manager_.plan(doubletOn("roll")).channels, Axes{only(Channel::kRoll)});
  EXPECT_EQ(manager_.plan(doubletOn("pitch")).channels, Axes{only(Channel::kPitch)});
  EXPECT_EQ(manager_.plan(doubletOn("yaw")).channels, Axes{only(Channel::kYaw)});
  const core::ChannelSet levers = manager_.plan(doubletOn("throttle")).channels.front();
  EXPECT_EQ(levers.count(), 8U) << "one lever for each engine";
  EXPECT_EQ(manager_.plan(doubletOn(FakeAirframe::kLeft)).surface, kLeftNumber);
  EXPECT_TRUE(manager_.plan(doubletOn(FakeAirframe::kLeft)).channels.empty());
}

TEST_F(ExcitationManagerTest, MultisineTakesSeveralAxesWithHarmonicsOfTheirOwn) {
  ExcitationRequest request = doubletOn("roll, pitch,yaw");
  EXPECT_EQ(wrongWith(request),
            "target is \"roll, pitch,yaw\"; several axes at once take a multisine, doublet takes one");
  request.kind = "multisine";
  request.duration = 20.0;
  request.frequency_min = 0.1;
  request.frequency_max = 0.6;  // harmonics 2 to 12
  const ExcitationManager::Plan plan = manager_.plan(request);
  EXPECT_EQ(plan.wrong, "");
  EXPECT_EQ(plan.channels, (Axes{only(Channel::kRoll), only(Channel::kPitch), only(Channel::kYaw)}));
  ASSERT_EQ(plan.signals.size(), 3U);
  const std::vector<double> expected[] = {{2, 5, 8, 11}, {3, 6, 9, 12}, {4, 7, 10}};
  for (std::size_t i = 0; i < 3; ++i) {
    std::vector<double> harmonics;
    for (const double frequency : plan.signals[i].frequencies()) harmonics.push_back(std::round(frequency * 20.0));
    EXPECT_EQ(harmonics, expected[i]) << i;
  }
  request.target = "roll,roll";
  EXPECT_EQ(wrongWith(request), "target is \"roll,roll\"; expected each axis once");
  request.target = std::string("roll,") + FakeAirframe::kLeft;
  EXPECT_NE(wrongWith(request).find("expected roll, pitch"), std::string::npos) << wrongWith(request);
  request.target = "roll,";
  EXPECT_NE(wrongWith(request).find("expected roll, pitch"), std::string::npos) << wrongWith(request);
  request.target = "roll,pitch,yaw";
  request.frequency_max = 0.15;
  EXPECT_NE(wrongWith(request).find("for each target"), std::string::npos) << wrongWith(request);
}

TEST_F(ExcitationManagerTest, SeveralAxesRunTogetherEachWithItsOwnSignal) {
  ExcitationRequest request = doubletOn("roll,pitch");
  request.kind = "multisine";
  request.duration = 20.0;
  request.frequency_min = 0.1;
  request.frequency_max = 2.0;
  EXPECT_EQ(inject(request).text,
            "no source commands pitch: an excitation is added to a command (control/manual or auto)");
  commanded_ |= only(Channel::kPitch);
  const ExcitationManager::Plan plan = manager_.plan(request);
  ASSERT_EQ(inject(request).code, ResultCode::kAccepted);
  EXPECT_EQ(labels_.back().target, "roll,pitch");
  sim_.frame();
  sim_.frame();
  EXPECT_TRUE(excited_);
  const core::ChannelExcitation now = manager_.excitation();
  EXPECT_EQ(now.channels, only(Channel::kRoll) | only(Channel::kPitch));
  const double t = watch_.sim_time - labels_.back().start_sim_time;
  ASSERT_GT(t, 0.0);
  EXPECT_EQ(now.values[core::index(Channel::kRoll)], plan.signals[0].value(t));
  EXPECT_EQ(now.values[core::index(Channel::kPitch)], plan.signals[1].value(t));
  EXPECT_NE(now.values[core::index(Channel::kRoll)], now.values[core::index(Channel::kPitch)]);
  EXPECT_EQ(now.values[core::index(Channel::kYaw)], 0.0);
}

TEST_F(ExcitationManagerTest, LimitsAreThoseOfTheAircraftUnlessGiven) {
  ExcitationRequest request = doubletOn("roll");
  EXPECT_EQ(manager_.plan(request).signals.front().spec().roll_limit_deg, 45.0);
  EXPECT_EQ(manager_.plan(request).signals.front().spec().pitch_limit_deg, 20.0);
  request.max_roll_deg = 10.0;
  request.max_pitch_deg = 5.0;
  EXPECT_EQ(manager_.plan(request).signals.front().spec().roll_limit_deg, 10.0);
  EXPECT_EQ(manager_.plan(request).signals.front().spec().pitch_limit_deg, 5.0);
}

TEST_F(ExcitationManagerTest, PlanTakesBandAndSeed) {
  ExcitationRequest request = doubletOn("roll");
  request.frequency_min = 0.5;
  request.frequency_max = 3.0;
  request.seed = 7;
  for (const char* kind : {"multisine", "chirp"}) {
    request.kind = kind;
    request.duration = 20.0;
    const core::ExcitationSpec spec = manager_.plan(request).signals.front().spec();
    EXPECT_EQ(spec.frequency_min, 0.5) << kind;
    EXPECT_EQ(spec.frequency_max, 3.0) << kind;
    EXPECT_EQ(spec.seed, 7U) << kind;
  }
  request.kind = "doublet";
  request.frequency_max = -1.0;
  EXPECT_EQ(wrongWith(request), "") << "it has no band";
}

// ------------------------------------------------------------------------------------------------ an axis

TEST_F(ExcitationManagerTest, AxisWithoutCommandsIsTakenAtItsRest) {
  commanded_.reset();
  ExcitationRequest request = doubletOn("pitch");
  EXPECT_EQ(inject(request).code, ResultCode::kRefused);
  request.rest = 0.125;
  ASSERT_EQ(inject(request).code, ResultCode::kAccepted);
  EXPECT_EQ(manager_.excitation().channels, only(Channel::kPitch));
  EXPECT_EQ(manager_.excitation().rest, 0.125);
}

TEST_F(ExcitationManagerTest, LabelOfTheNextOneBeginsAnew) {
  start("roll", 0.2);
  sim_.run(2.5);
  ASSERT_TRUE(std::isfinite(labels_.back().end_sim_time));
  ExcitationRequest longer = doubletOn("roll");
  longer.duration = 4.0;
  ASSERT_EQ(inject(longer).code, ResultCode::kAccepted);
  EXPECT_TRUE(std::isnan(labels_.back().end_sim_time));
  EXPECT_EQ(labels_.back().duration, 4.0);
  EXPECT_EQ(labels_.back().id, 2U);
}

TEST_F(ExcitationManagerTest, SignalOnAnAxisRunsToItsEnd) {
  ASSERT_EQ(labels_.size(), 1U) << "the label of nothing, for a latched topic";
  EXPECT_FALSE(labels_[0].active);
  EXPECT_EQ(labels_[0].id, 0U);
  const double begin = watch_.sim_time;
  ASSERT_EQ(inject(doubletOn("roll")).code, ResultCode::kAccepted);
  ASSERT_EQ(labels_.size(), 2U);
  EXPECT_TRUE(labels_[1].active);
  EXPECT_EQ(labels_[1].id, 1U);
  EXPECT_EQ(labels_[1].kind, "doublet");
  EXPECT_EQ(labels_[1].target, "roll");
  EXPECT_EQ(labels_[1].result, "running");
  EXPECT_EQ(labels_[1].amplitude, 0.2);
  EXPECT_EQ(labels_[1].start_sim_time, begin);
  EXPECT_TRUE(std::isnan(labels_[1].end_sim_time));
  EXPECT_EQ(manager_.channels(), only(Channel::kRoll));
  sim_.run(0.5);
  EXPECT_TRUE(excited_);
  EXPECT_EQ(manager_.excitation().channels, only(Channel::kRoll));
  EXPECT_EQ(manager_.excitation().values[core::index(Channel::kRoll)], 0.2);
  sim_.run(1.0);
  EXPECT_EQ(manager_.excitation().values[core::index(Channel::kRoll)], -0.2);
  sim_.run(0.6);
  EXPECT_FALSE(manager_.running());
  EXPECT_TRUE(manager_.excitation().channels.none());
  EXPECT_TRUE(manager_.channels().none());
  ASSERT_EQ(labels_.size(), 3U);
  EXPECT_EQ(labels_[2].result, "done");
  EXPECT_FALSE(labels_[2].active);
  EXPECT_NEAR(labels_[2].end_sim_time - begin, 2.0, 0.03);
  EXPECT_EQ(reported_, (decltype(reported_){{"excitation 1: doublet on roll begins", "node/inject", true},
                                            {"excitation 1 on roll: done", "node/inject", true}}));
  EXPECT_FALSE(excited_);
  EXPECT_TRUE(sim_.messages().empty()) << "surfaces have nothing to do with it";
}

TEST_F(ExcitationManagerTest, LastFrameOfASignalStillSendsTheControlsAnew) {
  start("roll", 0.2);
  bool excited_at_end = false;
  while (manager_.running()) {
    sim_.frame();
    excited_at_end = excited_;
  }
  EXPECT_TRUE(excited_at_end);
}

TEST_F(ExcitationManagerTest, LabelHasABandOnlyWhereTheSignalHasOne) {
  ExcitationRequest request = doubletOn("roll");
  request.frequency_min = 0.5;
  request.frequency_max = 2.0;
  request.seed = 7;
  ASSERT_EQ(inject(request).code, ResultCode::kAccepted);
  EXPECT_EQ(manager_.label().frequency_max, 0.0);
  EXPECT_EQ(manager_.label().seed, 7U);
  manager_.abort("enough");
  request.kind = "chirp";
  ASSERT_EQ(inject(request).code, ResultCode::kAccepted);
  EXPECT_EQ(manager_.label().id, 2U);
  EXPECT_EQ(manager_.label().frequency_min, 0.5);
  EXPECT_EQ(manager_.label().frequency_max, 2.0);
}

TEST_F(ExcitationManagerTest, PublishSaysTheLabelOnceMore) {
  start("roll", 0.2);
  manager_.publish();
  EXPECT_EQ(labels_.size(), 3U);
  EXPECT_EQ(labels_[2].id, 1U);
}

// ------------------------------------------------------------------------------------------------ refusals

TEST_F(ExcitationManagerTest, RefusesWhatIsNotSafeNow) {
  const auto refused = [this](const ExcitationRequest& request, ResultCode code, const std::string& text) {
    const std::size_t published = labels_.size();
    const RequestResult result = inject(request);
    EXPECT_EQ(result.code, code);
    EXPECT_EQ(result.text, text);
    EXPECT_EQ(labels_.size(), published);
  };
  ExcitationRequest stop;
  stop.kind = "stop";
  refused(stop, ResultCode::kRefused, "no excitation runs");
  refused(doubletOn("yaw"), ResultCode::kRefused,
          "no source commands yaw: an excitation is added to a command (control/manual or auto)");
  refusal_ = noLink();
  refused(doubletOn("roll"), ResultCode::kNoLink, "X-Plane is not connected");
  refusal_ = RequestResult{ResultCode::kRefused, "tx_node hung: ask for a mode to fly on"};
  refused(doubletOn("roll"), ResultCode::kRefused, "tx_node hung: ask for a mode to fly on");
  refusal_.reset();
  const core::FlightWatch known = watch_;
  for (double core::FlightWatch::*member :
       {&core::FlightWatch::sim_time, &core::FlightWatch::roll_deg, &core::FlightWatch::pitch_deg}) {
    watch_.*member = std::nan("");
    refused(doubletOn("roll"), ResultCode::kNoLink, "X-Plane has not shown the attitude yet");
    watch_ = known;
  }
  watch_.roll_deg = -45.0;
  refused(doubletOn("roll"), ResultCode::kRefused, "the attitude is beyond the limits of the excitation already");
  watch_ = known;
  watch_.pitch_deg = 20.0;
  refused(doubletOn("roll"), ResultCode::kRefused, "the attitude is beyond the limits of the excitation already");
  watch_ = known;
  refused(doubletOn(FakeAirframe::kLeft, 20.5), ResultCode::kRefused,
          "amplitude is 20.5 deg: expected at most half of its travel, 20.0");
  start("roll", 0.2);
  refused(doubletOn("roll"), ResultCode::kRefused, "excitation 1 runs on roll; one at a time: wait for it, or stop it");
  EXPECT_TRUE(manager_.running());
}

// ------------------------------------------------------------------------------------------------ aborts

struct AbortCase {
  std::string name;
  std::function<void(core::FlightWatch*)> change;
  std::string result;
};

TEST_F(ExcitationManagerTest, FlightThatDoesNotFitAborts) {
  const std::vector<AbortCase> cases{
      {"roll", [](auto* watch) { watch->roll_deg = -45.5; }, "aborted: roll -45.5 deg is beyond the limit of 45.0 deg"},
      {"pitch", [](auto* watch) { watch->pitch_deg = 21.0; },
       "aborted: pitch 21.0 deg is beyond the limit of 20.0 deg"},
      {"unknown", [](auto* watch) { watch->roll_deg = std::nan(""); }, "aborted: attitude is unknown"},
      {"restart", [](auto* watch) { watch->sim_time = 1.0; }, "aborted: simulator time ran backwards or is unknown"},
  };
  for (const AbortCase& each : cases) {
    SCOPED_TRACE(each.name);
    start("roll", 0.2);
    sim_.run(0.1);
    core::FlightWatch watch = watch_;
    each.change(&watch);
    EXPECT_TRUE(manager_.onFrame(watch)) << "the controls have to be sent without it";
    EXPECT_FALSE(manager_.running());
    EXPECT_TRUE(manager_.excitation().channels.none());
    EXPECT_EQ(labels_.back().result, each.result);
    EXPECT_FALSE(labels_.back().active);
    EXPECT_FALSE(std::get<2>(reported_.back()));
  }
}

TEST_F(ExcitationManagerTest, OwnerAbortsWithItsReason) {
  manager_.abort("the mode changed");
  EXPECT_EQ(labels_.size(), 1U) << "nothing ran";
  start("roll", 0.2);
  manager_.abort("the mode changed");
  EXPECT_EQ(labels_.back().result, "aborted: the mode changed");
  manager_.abort("the link is lost");
  EXPECT_EQ(labels_.back().result, "aborted: the mode changed") << "it had ended";
  EXPECT_EQ(reported_.back(), (std::tuple<std::string, std::string, bool>{
                                  "excitation 1 on roll: aborted: the mode changed", "node/inject", false}));
}

TEST_F(ExcitationManagerTest, StopEndsTheOneThatRuns) {
  start("roll", 0.2);
  ExcitationRequest stop;
  stop.kind = "stop";
  refusal_ = noLink();
  const RequestResult result = inject(stop);
  EXPECT_EQ(result.code, ResultCode::kAccepted) << "stopping is always possible";
  EXPECT_EQ(result.text, "excitation 1 is stopped");
  EXPECT_EQ(labels_.back().result, "aborted: stopped by node/inject");
}

// ------------------------------------------------------------------------------------------------ a surface

TEST_F(ExcitationManagerTest, SignalOnASurfaceDrivesItAndGivesItBack) {
  airframe_.setStick(0.25);  // left aileron at 5 deg
  sim_.run(0.1);
  start(FakeAirframe::kLeft, 3.0);
  EXPECT_TRUE(manager_.channels().none());
  sim_.run(0.5);
  EXPECT_FALSE(excited_) << "the controls stay as they are";
  EXPECT_EQ(state(), SurfaceControlState::kDriving);
  EXPECT_FLOAT_EQ(sim_.value(kLeft), 8.0F);
  sim_.run(1.0);
  EXPECT_FLOAT_EQ(sim_.value(kLeft), 2.0F);
  sim_.run(0.6);
  EXPECT_EQ(labels_.back().result, "done");
  EXPECT_EQ(state(), SurfaceControlState::kIdle);
  EXPECT_FLOAT_EQ(sim_.value(kLeft), 5.0F);
}

TEST_F(ExcitationManagerTest, AbortedSignalGivesItsSurfaceBack) {
  start(FakeAirframe::kLeft, 3.0);
  sim_.run(0.1);
  manager_.abort("the link is lost");
  sim_.run(0.1);
  EXPECT_EQ(state(), SurfaceControlState::kIdle);
}

TEST_F(ExcitationManagerTest, WhatTheSurfaceSuffersAborts) {
  const auto running = [this] {
    start(FakeAirframe::kLeft, 3.0);
    sim_.run(0.1);
    ASSERT_EQ(state(), SurfaceControlState::kDriving);
  };
  running();
  surfaces_.setFailures({{kLeftNumber, core::SurfaceFault::kStuck, 2.0}});
  sim_.frame();
  EXPECT_EQ(labels_.back().result, "aborted: aileron1_wing2_left is broken");
  surfaces_.setFailures({});
  sim_.run(0.1);
  running();
  sim_.set(core::kSurfaceOverride, 0.0F);
  sim_.run(0.04);
  EXPECT_EQ(labels_.back().result, "aborted: another client has released the surface override");
  sim_.run(1.2);  // the mixing has to be seen to hold once more
  running();
  surfaces_.onAircraft("OTHER");
  sim_.frame();
  EXPECT_EQ(labels_.back().result, "aborted: another aircraft was loaded");
}

TEST_F(ExcitationManagerTest, SurfaceThatCannotBeTakenAborts) {
  sim_.setReadOnly(core::kSurfaceOverride);
  start(FakeAirframe::kLeft, 3.0);
  sim_.run(1.2);
  EXPECT_EQ(labels_.back().result, "aborted: X-Plane does not show the surface override");
}

}  // namespace
}  // namespace xplane_bridge
