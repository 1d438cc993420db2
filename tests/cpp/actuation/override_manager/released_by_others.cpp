#include "fixture.hpp"

namespace xplane_bridge {
namespace {

// ------------------------------------------------------------------------------------------- released by others

TEST_F(OverrideManagerTest, ReleaseByAnotherClientIsFoundAfterFiveAnswers) {
  manager_.setRequired({kJoystick, kThrottles});
  sim_.run(0.2);
  EXPECT_TRUE(manager_.releasedByOthers().empty());
  sim_.set(kJoystick, 0.0F);
  sim_.run(0.4);
  EXPECT_TRUE(manager_.releasedByOthers().empty()) << "four answers";
  sim_.run(0.1);
  EXPECT_EQ(manager_.releasedByOthers(), Names{kJoystick});
  EXPECT_EQ(manager_.active(), Names{kThrottles});
  EXPECT_EQ(inJournal(), Names{kThrottles});
  EXPECT_EQ(reports_.back().first, "override_joystick was released by another client");
  EXPECT_EQ(sim_.subscribed(), std::multiset<std::string>{kThrottles});
  EXPECT_TRUE(manager_.releasedByOthers().empty()) << "said once";
  manager_.refresh();
  EXPECT_EQ(sim_.value(kJoystick), 0.0F) << "not set again by itself";
  manager_.setRequired({kJoystick, kThrottles});
  EXPECT_EQ(sim_.value(kJoystick), 1.0F) << "but when it is asked for";
}

TEST_F(OverrideManagerTest, ReleaseThatDoesNotLastIsNone) {
  manager_.setRequired({kJoystick});
  sim_.run(0.2);
  sim_.set(kJoystick, 0.0F);
  sim_.run(0.4);
  sim_.set(kJoystick, 1.0F);
  sim_.run(0.12);
  sim_.set(kJoystick, 0.0F);
  sim_.run(0.4);
  EXPECT_TRUE(manager_.releasedByOthers().empty());
}

TEST_F(OverrideManagerTest, WhatWasAcquiredIsLetGoButStopsNothing) {
  manager_.acquire(OverrideHolder::kFailures, kFailure, 6.0F);
  manager_.acquire(OverrideHolder::kSurfaces, core::kSurfaceOverride);
  sim_.run(0.2);
  sim_.setAll({kFailure, core::kSurfaceOverride}, 0.0F);
  letSixAnswersPass();
  EXPECT_TRUE(manager_.releasedByOthers().empty());
  EXPECT_EQ(manager_.active(), Names{core::kSurfaceOverride}) << "its holder watches that one";
  EXPECT_EQ(reports_, (Reports{{"rel_elv_L_jam was released by another client", true}}));
}

TEST_F(OverrideManagerTest, SurfaceOverrideThatSetDatarefHoldsToo) {
  manager_.acquire(OverrideHolder::kRequest, core::kSurfaceOverride);
  manager_.acquire(OverrideHolder::kSurfaces, core::kSurfaceOverride);
  sim_.run(0.2);
  sim_.set(core::kSurfaceOverride, 0.0F);
  sim_.run(0.12);
  manager_.release(OverrideHolder::kSurfaces, core::kSurfaceOverride);  // as in the frame that shows it
  manager_.refresh();
  EXPECT_EQ(sim_.value(core::kSurfaceOverride), 0.0F) << "not taken back";
  letSixAnswersPass();
  EXPECT_TRUE(manager_.releasedByOthers().empty());
  EXPECT_TRUE(manager_.active().empty());
  EXPECT_EQ(reports_, (Reports{{"override_control_surfaces was released by another client", true}}));
}

TEST_F(OverrideManagerTest, ReleaseByOthersStopsAlsoWhereTheJournalFails) {
  manager_.setRequired({kJoystick});
  sim_.run(0.2);
  sim_.set(kJoystick, 0.0F);
  letSixAnswersPass();
  sim_.breakJournal();
  EXPECT_EQ(manager_.releasedByOthers(), Names{kJoystick});
  EXPECT_TRUE(manager_.active().empty());
  EXPECT_TRUE(std::any_of(reports_.begin(), reports_.end(), [](const auto& report) { return !report.second; }));
  sim_.breakJournal(false);
  EXPECT_EQ(inJournal(), Names{kJoystick});
  EXPECT_TRUE(manager_.releasesPending()) << "so that the entry goes once the journal works again";
  manager_.confirmReleases(1.0);
  EXPECT_TRUE(inJournal().empty());
}

TEST_F(OverrideManagerTest, RestartOfXPlaneIsNoRelease) {
  manager_.setRequired({kJoystick});
  sim_.run(0.2);
  sim_.restart();
  sim_.set(kJoystick, 0.0F);
  manager_.forgetShown();
  sim_.run(1.0);
  EXPECT_TRUE(manager_.releasedByOthers().empty());
  manager_.refresh();
  EXPECT_EQ(sim_.value(kJoystick), 1.0F);
}

TEST_F(OverrideManagerTest, SilenceIsNoRelease) {
  manager_.setRequired({kJoystick});
  sim_.run(0.2);
  for (const core::LinkState state : {core::LinkState::kStale, core::LinkState::kLost}) {
    sim_.setState(state);
    sim_.run(5.0);
    EXPECT_TRUE(manager_.releasedByOthers().empty());
  }
  EXPECT_EQ(manager_.active(), Names{kJoystick});
}

TEST_F(OverrideManagerTest, OwnReleaseIsNotTakenForAnothers) {
  manager_.setRequired({kJoystick, kThrottles});
  sim_.run(0.2);
  manager_.setRequired({kThrottles});
  manager_.setRequired({kJoystick, kThrottles});
  sim_.loseMessages(1);
  manager_.setRequired({kThrottles});
  manager_.setRequired({kJoystick, kThrottles});
  sim_.run(1.0);
  EXPECT_TRUE(manager_.releasedByOthers().empty());
}

// ------------------------------------------------------------------------------------------------- confirming

TEST_F(OverrideManagerTest, ReleaseThatXPlaneDoesNotShowStaysPending) {
  manager_.setRequired({kJoystick});
  sim_.setReadOnly(kJoystick);
  manager_.setRequired({});
  manager_.confirmReleases(0.5);
  EXPECT_TRUE(manager_.releasesPending());
  EXPECT_EQ(inJournal(), Names{kJoystick});
  sim_.setReadOnly(kJoystick, false);
  manager_.confirmReleases(0.5);
  EXPECT_FALSE(manager_.releasesPending());
  EXPECT_TRUE(inJournal().empty());
}

TEST_F(OverrideManagerTest, ReleaseThatCannotBeShownHoldsUpNoOther) {
  manager_.acquire(OverrideHolder::kRequest, kUnknown, 1.0F);
  manager_.setRequired({kJoystick, kThrottles});
  manager_.release(OverrideHolder::kRequest, kUnknown);
  manager_.setRequired({kThrottles});
  manager_.confirmReleases(1.0);
  EXPECT_EQ(inJournal(), (Names{kUnknown, kThrottles}));
  manager_.setRequired({});
  const double began = sim_.time();
  manager_.confirmReleases(1.0);
  EXPECT_LT(sim_.time() - began, 0.1);
  EXPECT_EQ(inJournal(), Names{kUnknown});
  sim_.setAll({kJoystick, kThrottles}, 1.0F);  // by another program
  for (int i = 0; i < 20; ++i) manager_.confirmReleases(1.0);
  EXPECT_EQ(sim_.value(kJoystick), 1.0F);
  EXPECT_EQ(sim_.value(kThrottles), 1.0F);
  EXPECT_EQ(inJournal(), Names{kUnknown}) << "X-Plane has not shown it released";
}

TEST_F(OverrideManagerTest, ReleaseThatIsNotShownIsSentRarelyAfterAWhile) {
  manager_.setRequired({kJoystick});
  sim_.setReadOnly(kJoystick);
  manager_.setRequired({});
  sim_.clearMessages();
  for (double end = sim_.time() + 30.0; sim_.time() < end; sim_.frame()) manager_.confirmReleases(1.0);
  EXPECT_GE(sim_.messages().size(), 8U);
  EXPECT_LE(sim_.messages().size(), 11U);
  sim_.setReadOnly(kJoystick, false);
  for (double end = sim_.time() + 5.1; sim_.time() < end; sim_.frame()) manager_.confirmReleases(1.0);
  EXPECT_TRUE(inJournal().empty());
}

TEST_F(OverrideManagerTest, GivenBackOnceMoreItHasToBeShownOnceMore) {
  manager_.setRequired({kJoystick});
  manager_.setRequired({});
  sim_.loseMessages(1);  // so that X-Plane goes on showing the first release
  const core::Subscription meanwhile =
      sim_.subscribe({"meanwhile", {kJoystick}, 10, 0}, [this](const core::RrefView&, const core::ReceiveInfo&) {
        sim_.loseMessages(2);
        manager_.setRequired({kJoystick});
        manager_.setRequired({});
      });
  manager_.confirmReleases(0.5);
  EXPECT_EQ(inJournal(), Names{kJoystick});
  EXPECT_TRUE(manager_.releasesPending());
}

TEST_F(OverrideManagerTest, LostReleaseIsSentAgain) {
  manager_.setRequired({kJoystick});
  sim_.loseMessages(1);
  manager_.setRequired({});
  EXPECT_EQ(sim_.value(kJoystick), 1.0F);
  manager_.confirmReleases(0.5);
  EXPECT_EQ(sim_.value(kJoystick), 0.0F);
}

TEST_F(OverrideManagerTest, SetAgainWhileItsReleaseIsAwaited) {
  manager_.setRequired({kJoystick});
  manager_.setRequired({});
  const core::Subscription meanwhile =
      sim_.subscribe({"meanwhile", {kJoystick}, 10, 0}, [this](const core::RrefView&, const core::ReceiveInfo&) {
        sim_.loseMessages(1);  // so that X-Plane shows the release nevertheless
        manager_.setRequired({kJoystick});
      });
  manager_.confirmReleases(0.5);
  EXPECT_EQ(inJournal(), Names{kJoystick}) << "it is set, and must be given back after a crash";
  EXPECT_FALSE(manager_.releasesPending());
  EXPECT_EQ(manager_.active(), Names{kJoystick});
}

TEST_F(OverrideManagerTest, ConfirmingWithoutALinkKeepsEverything) {
  manager_.setRequired({kJoystick});
  manager_.setRequired({});
  sim_.setState(core::LinkState::kLost);
  manager_.confirmReleases(0.5);
  EXPECT_TRUE(manager_.releasesPending());
  EXPECT_EQ(inJournal(), Names{kJoystick});
}

}  // namespace
}  // namespace xplane_bridge
