#include "fixture.hpp"

namespace xplane_bridge {
namespace {

// ------------------------------------------------------------------------------------------------- releaseAll()

TEST_F(OverrideManagerTest, ReleaseAllGivesBackEverythingForGood) {
  manager_.setRequired({kJoystick, kThrottles});
  manager_.acquire(OverrideHolder::kFailures, kFailure, 6.0F, false);
  manager_.setRequired({kJoystick});  // the throttles' release is pending
  reports_.clear();
  EXPECT_TRUE(manager_.releaseAll(1.0));
  for (const char* dataref : {kJoystick, kThrottles, kFailure}) EXPECT_EQ(sim_.value(dataref), 0.0F) << dataref;
  EXPECT_TRUE(inJournal().empty());
  EXPECT_TRUE(manager_.active().empty());
  EXPECT_FALSE(manager_.releasesPending());
  EXPECT_TRUE(sim_.subscribed().empty());
  EXPECT_EQ(reports_, (Reports{{"released rel_elv_L_jam, override_joystick, override_throttles", true}}));
  sim_.clearMessages();
  manager_.setRequired({kJoystick});
  EXPECT_FALSE(manager_.acquire(OverrideHolder::kRequest, kThrottles));
  manager_.refresh();
  EXPECT_TRUE(sim_.messages().empty());
}

TEST_F(OverrideManagerTest, ReleaseAllSaysWhatCouldNotBeSeen) {
  manager_.setRequired({kJoystick});
  sim_.setReadOnly(kJoystick);
  reports_.clear();
  EXPECT_FALSE(manager_.releaseAll(0.5));
  EXPECT_EQ(inJournal(), Names{kJoystick}) << "for the guardian and the next start";
  EXPECT_FALSE(manager_.releaseAll(0.5));
  EXPECT_EQ(reports_, (Reports{{"override_joystick could not be seen released; it stays in the journal", false}}))
      << "said once";
  sim_.setReadOnly(kJoystick, false);
  EXPECT_TRUE(manager_.releaseAll(0.5));
  EXPECT_TRUE(inJournal().empty());
}

TEST_F(OverrideManagerTest, WhatReleaseAllHasSeenLeavesTheJournalWhateverElseHasNot) {
  manager_.acquire(OverrideHolder::kRequest, kUnknown, 1.0F);
  manager_.setRequired({kJoystick, "DATA row 8"});
  reports_.clear();
  EXPECT_FALSE(manager_.releaseAll(0.5));
  EXPECT_EQ(inJournal(), Names{kUnknown});
  EXPECT_EQ(sim_.journal()->entries()[0].left, "X-Plane did not show it released");
  EXPECT_EQ(reports_, (Reports{{"released DATA row 8, override_joystick", true},
                               {"override_joystik could not be seen released; it stays in the journal", false}}));
  sim_.set(kJoystick, 1.0F);  // by another program
  EXPECT_FALSE(manager_.releaseAll(0.5));
  EXPECT_EQ(sim_.value(kJoystick), 1.0F);
}

TEST_F(OverrideManagerTest, NothingLeavesTheJournalBecauseOfSilence) {
  manager_.setRequired({kJoystick, "DATA row 8"});
  sim_.setState(core::LinkState::kLost);
  EXPECT_FALSE(manager_.releaseAll(0.5));
  EXPECT_EQ(sim_.journal()->entries().size(), 2U) << "the row cannot be read back, but nothing was";
}

TEST_F(OverrideManagerTest, XPlaneThatWentFirstIsNoCrashOfOurs) {
  manager_.setRequired({kJoystick});
  sim_.setState(core::LinkState::kLost);
  reports_.clear();
  EXPECT_FALSE(manager_.releaseAll(0.5));
  EXPECT_EQ(inJournal(), Names{kJoystick}) << "it may only have been silent";
  EXPECT_EQ(sim_.journal()->entries()[0].left, "X-Plane went first") << "for the next start";
  ASSERT_EQ(reports_.size(), 1U);
  EXPECT_EQ(reports_[0].first.find("override_joystick could not be released, because X-Plane went first, or is silent"),
            0U);
  EXPECT_TRUE(reports_[0].second);
  EXPECT_FALSE(manager_.releaseAll(0.5));
  EXPECT_EQ(reports_.size(), 1U) << "said once";
  sim_.setState(core::LinkState::kConnected);
  EXPECT_TRUE(manager_.releaseAll(0.5));
  EXPECT_EQ(sim_.value(kJoystick), 0.0F);
  EXPECT_TRUE(inJournal().empty());
}

TEST_F(OverrideManagerTest, ReleaseAllOfNothingIsDone) {
  EXPECT_TRUE(manager_.releaseAll(0.5));
  EXPECT_TRUE(sim_.messages().empty());
  EXPECT_TRUE(reports_.empty());
}

// -------------------------------------------------------------------------------------------- releaseLeftovers()

TEST_F(OverrideManagerTest, LeftoversOfACrashedRunAreReleased) {
  crashedRunHas(kJoystick);
  EXPECT_TRUE(manager_.releaseLeftovers(1.0));
  EXPECT_EQ(sim_.value(kJoystick), 0.0F);
  EXPECT_TRUE(inJournal().empty());
  EXPECT_EQ(reports_.back(),
            (std::pair<std::string, bool>{"released override_joystick left by a run that crashed", true}));
}

TEST_F(OverrideManagerTest, LeftoversAreReportedByTheirCause) {
  crashedRunHas(kJoystick);
  core::Journal gone = sim_.journalOfAnother();
  gone.record("override:" + std::string(kThrottles), kOverridePurpose, {core::UndoDref{kThrottles, 0.0F}});
  gone.leave({"override:" + std::string(kThrottles)}, "X-Plane went first");
  sim_.setState(core::LinkState::kLost);
  EXPECT_FALSE(manager_.releaseLeftovers(0.5));
  sim_.setState(core::LinkState::kConnected);
  EXPECT_TRUE(manager_.releaseLeftovers(0.5));
  ASSERT_EQ(reports_.size(), 2U);
  EXPECT_FALSE(reports_[0].second);
  const std::string what =
      "override_joystick left by a run that crashed, "
      "override_throttles left because X-Plane went first";
  EXPECT_EQ(reports_[0].first.find(what + " could not be released, because X-Plane went first, or is silent"), 0U);
  EXPECT_EQ(reports_[1].first, "released " + what);
}

TEST_F(OverrideManagerTest, WhatItsRunHasReportedIsNotReportedAgain) {
  core::Journal gone = sim_.journalOfAnother();
  gone.record("override:x", kOverridePurpose, {core::UndoDref{kJoystick, 0.0F}});
  gone.leave({"override:x"}, "X-Plane went first");
  sim_.setState(core::LinkState::kLost);
  EXPECT_FALSE(manager_.releaseLeftovers(0.5));
  EXPECT_TRUE(reports_.empty());
}

TEST_F(OverrideManagerTest, NoLeftoversIsDoneAtOnce) {
  sim_.journalOfAnother(true).record("override:x", kOverridePurpose, {core::UndoDref{kJoystick, 0.0F}});
  sim_.journalOfAnother().record("field_of_view", "field_of_view", {core::UndoDref{kThrottles, 0.0F}});
  const double begin = sim_.time();
  EXPECT_TRUE(manager_.releaseLeftovers(1.0));
  EXPECT_TRUE(sim_.messages().empty()) << "one process runs, the other's is not an override";
  EXPECT_EQ(sim_.time(), begin);
}

TEST_F(OverrideManagerTest, LeftoversStayUntilXPlaneShowsThemReleased) {
  crashedRunHas(kJoystick);
  sim_.setReadOnly(kJoystick);
  EXPECT_FALSE(manager_.releaseLeftovers(0.5));
  EXPECT_FALSE(manager_.releaseLeftovers(0.5));
  EXPECT_EQ(inJournal(), Names{kJoystick});
  ASSERT_EQ(reports_.size(), 1U) << "said once";
  EXPECT_FALSE(reports_[0].second);
  sim_.setReadOnly(kJoystick, false);
  EXPECT_TRUE(manager_.releaseLeftovers(0.5));
  EXPECT_TRUE(inJournal().empty());
}

TEST_F(OverrideManagerTest, LeftoverThatThisXPlaneDoesNotHaveHoldsUpNoOther) {
  crashedRunHas(kJoystick);
  sim_.journalOfAnother().record("override:" + std::string(kUnknown), kOverridePurpose,
                                 {core::UndoDref{kJoystick, 0.0F}, core::UndoDref{kUnknown, 0.0F}});
  EXPECT_FALSE(manager_.releaseLeftovers(0.5));
  EXPECT_EQ(inJournal(), (Names{kJoystick, kUnknown})) << "an entry of two is undone when both are shown";
  EXPECT_EQ(sim_.journal()->entries().size(), 1U);
  EXPECT_EQ(reports_, (Reports{{"released override_joystick left by a run that crashed", true},
                               {"override_joystik left by a run that crashed could not be seen released; it stays in "
                                "the journal",
                                false}}));
}

TEST_F(OverrideManagerTest, LeftoverTakenOverMeanwhileStaysInTheJournal) {
  crashedRunHas(kJoystick);
  const core::Subscription meanwhile =
      sim_.subscribe({"meanwhile", {kJoystick}, 10, 0}, [this](const core::RrefView&, const core::ReceiveInfo&) {
        sim_.loseMessages(1);  // so that X-Plane shows the release nevertheless
        manager_.setRequired({kJoystick});
      });
  EXPECT_TRUE(manager_.releaseLeftovers(0.5));
  ASSERT_EQ(inJournal(), Names{kJoystick});
  EXPECT_EQ(sim_.journal()->own().size(), 1U);
  EXPECT_EQ(manager_.active(), Names{kJoystick});
}

TEST_F(OverrideManagerTest, LeftoverThatThisRunHasSetMeanwhileStaysSet) {
  sim_.setAll({kJoystick, kThrottle12}, 1.0F);
  sim_.journalOfAnother().record("override:" + std::string(kJoystick), kOverridePurpose,
                                 {core::UndoDref{kThrottle12, 0.3F, false}, core::UndoDref{kJoystick, 0.0F}});
  // While X-Plane is asked whether it is released already: it has a lever to be written first.
  sim_.on_frame = [this] { manager_.setRequired({kJoystick}); };
  EXPECT_TRUE(manager_.releaseLeftovers(1.0));
  EXPECT_EQ(sim_.writes(), (Writes{{kJoystick, 1.0F}}));
  EXPECT_EQ(sim_.journal()->own().size(), 1U);
  EXPECT_EQ(reports_, (Reports{{"set override_joystick", true}}));
}

TEST_F(OverrideManagerTest, LeftoverThatAnotherPartOfThisRunHasTakenOverIsNotUndone) {
  const std::vector<core::UndoOperation> undo = {core::UndoDref{kThrottle12, 0.3F, false},
                                                 core::UndoDref{kJoystick, 0.0F}};
  sim_.setAll({kJoystick, kThrottle12}, 1.0F);
  sim_.journalOfAnother().record("wind", kOverridePurpose, undo);
  // While X-Plane is asked whether it is undone already.
  sim_.on_frame = [this, &undo] { sim_.journal()->record("wind", kOverridePurpose, undo); };
  EXPECT_TRUE(manager_.releaseLeftovers(1.0));
  EXPECT_TRUE(sim_.messages().empty());
  EXPECT_EQ(sim_.journal()->own().size(), 1U);
  EXPECT_TRUE(reports_.empty());
}

TEST_F(OverrideManagerTest, LeftoverThatAnotherPartOfThisRunTakesOverAfterItsReleaseIsNoneAnyMore) {
  const std::vector<core::UndoOperation> undo = {core::UndoDref{kJoystick, 0.0F}};
  sim_.set(kJoystick, 1.0F);
  sim_.setReadOnly(kJoystick);  // so that its release is waited for
  sim_.journalOfAnother().record("wind", kOverridePurpose, undo);
  sim_.on_frame = [this, &undo] { sim_.journal()->record("wind", kOverridePurpose, undo); };
  EXPECT_TRUE(manager_.releaseLeftovers(0.5));
  EXPECT_EQ(sim_.journal()->own().size(), 1U);
  EXPECT_TRUE(reports_.empty());
}

TEST_F(OverrideManagerTest, LeftoverThatThisRunSetsAfterItsReleaseIsNoneAnyMore) {
  crashedRunHas(kJoystick);
  sim_.on_frame = [this] { manager_.setRequired({kJoystick}); };
  EXPECT_TRUE(manager_.releaseLeftovers(0.5)) << "X-Plane does not show it released";
  EXPECT_EQ(sim_.writes(), (Writes{{kJoystick, 0.0F}, {kJoystick, 1.0F}}));
  EXPECT_EQ(reports_, (Reports{{"set override_joystick", true}}));
}

TEST_F(OverrideManagerTest, LeftoversNeedAnXPlane) {
  sim_.forgetPeer();
  EXPECT_FALSE(manager_.releaseLeftovers(0.5));
}

}  // namespace
}  // namespace xplane_bridge
