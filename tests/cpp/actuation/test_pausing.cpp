#include "xplane_bridge/actuation/pausing.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include "fake_simulator.hpp"
#include "xplane_bridge/core/simulator/simulator_settings.hpp"

namespace xplane_bridge {
namespace {

using Names = std::vector<std::string>;

constexpr double kTimeout = 1.0;
const std::string kToggle = "sim/operation/pause_toggle";
constexpr core::SimulatorVersion k1208{120800}, k1210{121000};

bool never() { return false; }

/// Pauses and resumes as X-Plane does, one frame after a command comes.
void obey(core::FakeSimulator* sim) {
  sim->on_message = [sim](const core::FakeSimulator::Message& message) {
    if (message.label != "CMND") return;
    const bool was = sim->status().paused.value_or(false);
    const bool pause = message.path == kToggle ? !was : message.path == "sim/operation/pause_on";
    sim->setState(pause ? core::LinkState::kPaused : core::LinkState::kConnected);
  };
}

TEST(Pausing, TogglesOnce) {
  core::FakeSimulator sim(k1208);
  obey(&sim);
  EXPECT_EQ(setPaused(&sim, true, kTimeout, never), PauseOutcome::kFollowed);
  EXPECT_EQ(sim.commands(), Names{kToggle});
  EXPECT_EQ(sim.status().paused, true);
  EXPECT_EQ(setPaused(&sim, false, kTimeout, never), PauseOutcome::kFollowed);
  EXPECT_EQ(sim.commands(), (Names{kToggle, kToggle}));
  EXPECT_EQ(sim.status().paused, false);
}

TEST(Pausing, SendsNothingWhereItIsSoAlready) {
  core::FakeSimulator sim(core::kXPlane11);
  obey(&sim);
  EXPECT_EQ(setPaused(&sim, false, kTimeout, never), PauseOutcome::kWasSo);
  sim.setState(core::LinkState::kPaused);
  EXPECT_EQ(setPaused(&sim, true, kTimeout, never), PauseOutcome::kWasSo);
  EXPECT_TRUE(sim.commands().empty());
}

TEST(Pausing, NeverRepeatsAToggle) {
  core::FakeSimulator sim(core::kXPlane11);  // it does not obey
  const double began = sim.time();
  EXPECT_EQ(setPaused(&sim, true, kTimeout, never), PauseOutcome::kNotFollowed);
  EXPECT_EQ(sim.commands(), Names{kToggle});
  EXPECT_NEAR(sim.time() - began, kTimeout, 3 * core::FakeSimulator::kFrame);
}

TEST(Pausing, GoesByWhatXPlaneShowsNowNotByWhatTheLinkHasHeard) {
  core::FakeSimulator sim(core::kXPlane11);
  obey(&sim);
  // Its user has paused it; the link's status is still that of before.
  sim.set(core::kPausedDataref, 1.0F);
  EXPECT_EQ(setPaused(&sim, true, kTimeout, never), PauseOutcome::kNotFollowed) << "the link never hears of it";
  EXPECT_TRUE(sim.commands().empty()) << "a toggle would have resumed it";
}

TEST(Pausing, HasCommandsOfItsOwnFrom12_10) {
  core::FakeSimulator sim(k1210);
  obey(&sim);
  EXPECT_EQ(setPaused(&sim, true, kTimeout, never), PauseOutcome::kFollowed);
  EXPECT_EQ(setPaused(&sim, false, kTimeout, never), PauseOutcome::kFollowed);
  EXPECT_EQ(sim.commands(), (Names{"sim/operation/pause_on", "sim/operation/pause_off"}));
}

TEST(Pausing, TwoThatAskAtOnceToggleOnce) {
  core::FakeSimulator sim(core::kXPlane11);
  obey(&sim);
  std::promise<void> both_would;
  PauseOutcome second = PauseOutcome::kUnknown;
  std::thread another;
  const auto before = [&] {
    another = std::thread([&] { second = setPaused(&sim, true, kTimeout, never, [&] { both_would.set_value(); }); });
    both_would.get_future().wait_for(std::chrono::milliseconds(200));
  };
  EXPECT_EQ(setPaused(&sim, true, kTimeout, never, before), PauseOutcome::kFollowed);
  another.join();
  EXPECT_EQ(second, PauseOutcome::kWasSo);
  EXPECT_EQ(sim.commands(), Names{kToggle});
}

TEST(Pausing, SendsNothingWhereXPlaneDoesNotReportIt) {
  core::FakeSimulator sim(core::kXPlane11);
  sim.setState(core::LinkState::kStale);
  EXPECT_EQ(setPaused(&sim, true, kTimeout, never), PauseOutcome::kUnknown);
  EXPECT_TRUE(sim.commands().empty());
}

TEST(Pausing, DoesNotWaitOnceItIsGivenUp) {
  core::FakeSimulator sim(core::kXPlane11);
  const double began = sim.time();
  EXPECT_EQ(setPaused(&sim, true, kTimeout, [] { return true; }), PauseOutcome::kNotFollowed);
  EXPECT_LT(sim.time() - began, 3 * core::FakeSimulator::kFrame);
  EXPECT_EQ(sim.commands(), Names{kToggle});
}

TEST(Pausing, WhatComesBeforeIsCalledOnlyWhereSomethingIsSent) {
  core::FakeSimulator sim(core::kXPlane11);
  obey(&sim);
  int calls = 0;
  const auto count = [&] {
    ++calls;
    EXPECT_TRUE(sim.commands().empty());
  };
  setPaused(&sim, false, kTimeout, never, count);
  EXPECT_EQ(calls, 0);
  setPaused(&sim, true, kTimeout, never, count);
  EXPECT_EQ(calls, 1);
}

TEST(ResumeLeftovers, LetsGoOnWhatACrashedRunHasPaused) {
  core::FakeSimulator sim(core::kXPlane11);
  obey(&sim);
  sim.setState(core::LinkState::kPaused);
  EXPECT_TRUE(resumeLeftovers(&sim, kTimeout)) << "nothing is left";
  EXPECT_TRUE(sim.commands().empty()) << "a pause of the user's";
  sim.journalOfAnother().record("pause:one", kPausePurpose, {core::UndoPause{}});
  EXPECT_TRUE(resumeLeftovers(&sim, kTimeout));
  EXPECT_EQ(sim.commands(), Names{kToggle});
  EXPECT_TRUE(sim.journal()->entries().empty());
}

TEST(ResumeLeftovers, SendsNothingToAnXPlaneThatRuns) {
  core::FakeSimulator sim(core::kXPlane11);
  sim.journalOfAnother().record("pause:one", kPausePurpose, {core::UndoPause{}});
  EXPECT_TRUE(resumeLeftovers(&sim, kTimeout));
  EXPECT_TRUE(sim.commands().empty());
  EXPECT_TRUE(sim.journal()->entries().empty());
}

TEST(ResumeLeftovers, IsKeptWhereXPlaneDoesNotFollow) {
  core::FakeSimulator sim(core::kXPlane11);
  sim.setState(core::LinkState::kPaused);
  sim.journalOfAnother().record("pause:one", kPausePurpose, {core::UndoPause{}});
  EXPECT_FALSE(resumeLeftovers(&sim, kTimeout));
  EXPECT_EQ(sim.journal()->entries().size(), 1U);
}

TEST(ResumeLeftovers, PauseOfARunThatLivesIsItsOwn) {
  core::FakeSimulator sim(core::kXPlane11);
  obey(&sim);
  sim.setState(core::LinkState::kPaused);
  recordPause(&sim);
  sim.journalOfAnother(true).record("pause:alive", kPausePurpose, {core::UndoPause{}});
  EXPECT_TRUE(resumeLeftovers(&sim, kTimeout));
  EXPECT_TRUE(sim.commands().empty());
  EXPECT_EQ(sim.journal()->entries().size(), 2U);
  forgetPause(&sim);
  EXPECT_EQ(sim.journal()->entries().size(), 1U);
}

}  // namespace
}  // namespace xplane_bridge
