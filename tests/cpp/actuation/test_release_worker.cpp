#include "xplane_bridge/actuation/release_worker.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <string>
#include <vector>

#include "fake_simulator.hpp"
#include "xplane_bridge/actuation/pausing.hpp"
#include "xplane_bridge/core/control/control_rows.hpp"

namespace xplane_bridge {
namespace {

constexpr const char* kJoystick = "sim/operation/override/override_joystick";
constexpr const char* kThrottles = "sim/operation/override/override_throttles";

class ReleaseWorkerTest : public testing::Test {
 protected:
  ReleaseWorkerTest() { sim_.setAll({kJoystick, kThrottles}, 0.0F); }

  void crashedRunHas(const std::string& dataref) {
    sim_.set(dataref, 1.0F);
    sim_.journalOfAnother().record("override:" + dataref, kOverridePurpose, {core::UndoDref{dataref, 0.0F}});
  }
  std::size_t entries() const { return sim_.journal()->entries().size(); }

  core::FakeSimulator sim_;
  std::vector<std::string> problems_;
  std::promise<void> released_;  // for the thread: nothing else of the fake is touched until then
  bool wants_release_ = false;
  OverrideManager overrides_{&sim_, [this](const std::string& text, bool) {
                               if (wants_release_ && text.rfind("released ", 0) == 0) released_.set_value();
                             }};
  ReleaseWorker worker_{&sim_, &overrides_, [this](const std::string& text) { problems_.push_back(text); }};
};

TEST_F(ReleaseWorkerTest, ConfirmsWhatWasGivenBack) {
  overrides_.setRequired({kJoystick});
  overrides_.setRequired({});
  EXPECT_EQ(entries(), 1U) << "until X-Plane has shown it";
  worker_.work();
  EXPECT_EQ(entries(), 0U);
  EXPECT_FALSE(overrides_.releasesPending());
  sim_.clearMessages();
  worker_.work();
  EXPECT_TRUE(sim_.messages().empty()) << "there is no more to do";
}

TEST_F(ReleaseWorkerTest, GivesBackWhatACrashedRunHasLeftInEachXPlane) {
  crashedRunHas(kJoystick);
  worker_.work();
  EXPECT_EQ(sim_.value(kJoystick), 0.0F);
  EXPECT_EQ(entries(), 0U);
  crashedRunHas(kThrottles);
  worker_.work();
  EXPECT_EQ(entries(), 1U) << "in this one it has looked";
  sim_.restart();
  worker_.work();
  EXPECT_EQ(sim_.value(kThrottles), 0.0F);
  EXPECT_EQ(entries(), 0U);
}

TEST_F(ReleaseWorkerTest, NoticesRowsThatAnotherProcessHasGivenBack) {
  overrides_.setRequired({core::rowName(25)});
  sim_.journal()->remove({"override:" + core::rowName(25)});
  worker_.work();
  EXPECT_EQ(overrides_.releasedByOthers(), std::vector<std::string>{core::rowName(25)});
}

TEST_F(ReleaseWorkerTest, TriesAgainWhatXPlaneDoesNotShow) {
  crashedRunHas(kJoystick);
  sim_.setReadOnly(kJoystick);
  worker_.work();
  EXPECT_EQ(entries(), 1U);
  sim_.setReadOnly(kJoystick, false);
  worker_.work();
  EXPECT_EQ(entries(), 0U);
}

TEST_F(ReleaseWorkerTest, LetsXPlaneGoOnThatACrashedRunHasPaused) {
  sim_.setState(core::LinkState::kPaused);
  sim_.journalOfAnother().record("pause:one", kPausePurpose, {core::UndoPause{}});
  worker_.work();
  EXPECT_EQ(entries(), 1U) << "it does not follow";
  sim_.on_message = [this](const core::FakeSimulator::Message& message) {
    if (message.label == "CMND") sim_.setState(core::LinkState::kConnected);
  };
  worker_.work();
  EXPECT_EQ(sim_.status().paused, false);
  EXPECT_EQ(entries(), 0U);
}

TEST_F(ReleaseWorkerTest, LetsXPlaneGoOnThatIsBackFromASilence) {
  worker_.work();
  recordPause(&sim_);
  sim_.setState(core::LinkState::kStale);
  worker_.work();
  leavePause(&sim_);
  const std::uint32_t epoch = sim_.status().epoch;
  sim_.setState(core::LinkState::kPaused);
  sim_.on_message = [this](const core::FakeSimulator::Message& message) {
    if (message.label == "CMND") sim_.setState(core::LinkState::kConnected);
  };
  worker_.work();
  EXPECT_EQ(sim_.status().epoch, epoch) << "it was not lost";
  EXPECT_EQ(sim_.status().paused, false);
  EXPECT_EQ(entries(), 0U);
}

TEST_F(ReleaseWorkerTest, LetsXPlaneGoOnThatHasNotFollowedThoughItWasNeverSilent) {
  worker_.work();
  sim_.setState(core::LinkState::kPaused);
  recordPause(&sim_);
  leavePause(&sim_);
  sim_.on_message = [this](const core::FakeSimulator::Message& message) {
    if (message.label == "CMND") sim_.setState(core::LinkState::kConnected);
  };
  worker_.work();
  EXPECT_EQ(entries(), 1U) << "it has looked already";
  worker_.lookAgain();
  worker_.work();
  EXPECT_EQ(sim_.status().paused, false);
  EXPECT_EQ(entries(), 0U);
}

TEST_F(ReleaseWorkerTest, LetsXPlaneGoOnThoughAnOverrideIsNotShownReleased) {
  sim_.setState(core::LinkState::kPaused);
  sim_.on_message = [this](const core::FakeSimulator::Message& message) {
    if (message.label == "CMND") sim_.setState(core::LinkState::kConnected);
  };
  crashedRunHas(kJoystick);
  crashedRunHas(kThrottles);
  sim_.setReadOnly(kThrottles);
  sim_.journalOfAnother().record("pause:one", kPausePurpose, {core::UndoPause{}});
  worker_.work();
  EXPECT_EQ(sim_.status().paused, false);
  EXPECT_EQ(entries(), 1U) << "of the throttles";
  sim_.set(kJoystick, 1.0F);  // by another program
  worker_.work();
  EXPECT_EQ(sim_.value(kJoystick), 1.0F);
}

TEST_F(ReleaseWorkerTest, TriesRarelyAfterAWhileAndAnewInTheNextXPlane) {
  crashedRunHas(kJoystick);
  sim_.setReadOnly(kJoystick);
  const auto tries = [this] {
    sim_.clearMessages();
    for (double end = sim_.time() + 20.0; sim_.time() < end; sim_.run(0.2)) worker_.work();
    return static_cast<double>(sim_.messages().size());
  };
  EXPECT_NEAR(tries(), 5.0 + 2.0, 1.0);
  EXPECT_NEAR(tries(), 4.0, 1.0);
  sim_.restart();
  EXPECT_NEAR(tries(), 5.0 + 2.0, 1.0);
}

TEST_F(ReleaseWorkerTest, WithoutXPlaneItDoesNotWaitForIt) {
  crashedRunHas(kJoystick);
  sim_.setState(core::LinkState::kLost);
  const double began = sim_.time();
  worker_.work();
  EXPECT_EQ(sim_.time(), began);
  EXPECT_TRUE(sim_.messages().empty());
  EXPECT_EQ(entries(), 1U);
}

TEST_F(ReleaseWorkerTest, WritesDownWhatIsToBeDoneBeforeARelease) {
  overrides_.setRequired({kThrottles});
  overrides_.prepareRelease(kThrottles, {core::UndoDref{"sim/a/lever", 0.5F, false}});
  worker_.work();
  ASSERT_EQ(entries(), 1U);
  EXPECT_EQ(sim_.journal()->entries()[0].undo.size(), 2U);
}

TEST_F(ReleaseWorkerTest, SaysThatTheJournalCannotBeUsedAndGoesOnWhenItCan) {
  crashedRunHas(kJoystick);
  sim_.breakJournal();
  worker_.work();
  ASSERT_EQ(problems_.size(), 1U);
  EXPECT_NE(problems_[0], "");
  sim_.breakJournal(false);
  worker_.work();
  EXPECT_EQ(problems_.size(), 1U);
  EXPECT_EQ(entries(), 0U);
}

TEST_F(ReleaseWorkerTest, ThreadLooksWhenItIsWokenAndEnds) {
  crashedRunHas(kJoystick);
  wants_release_ = true;
  worker_.start();
  worker_.wake();  // the clock stands: the period is never over
  ASSERT_EQ(released_.get_future().wait_for(std::chrono::seconds(60)), std::future_status::ready);
  worker_.stop();
  EXPECT_EQ(sim_.value(kJoystick), 0.0F);
  EXPECT_EQ(entries(), 0U);
}

TEST_F(ReleaseWorkerTest, StoppedItLooksNoMore) {
  crashedRunHas(kJoystick);
  worker_.start();
  worker_.stop();
  worker_.wake();
  EXPECT_EQ(entries(), 1U);
  EXPECT_TRUE(sim_.messages().empty());
}

}  // namespace
}  // namespace xplane_bridge
