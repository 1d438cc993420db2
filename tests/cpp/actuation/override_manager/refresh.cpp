#include "fixture.hpp"

namespace xplane_bridge {
namespace {

// --------------------------------------------------------------------------------------------------- refresh()

TEST_F(OverrideManagerTest, LostDatagramIsMadeGoodByTheRefresh) {
  sim_.loseMessages(1);
  manager_.setRequired({kJoystick});
  EXPECT_EQ(sim_.value(kJoystick), 0.0F);
  sim_.run(1.0);
  EXPECT_TRUE(manager_.releasedByOthers().empty()) << "it has never been shown set";
  manager_.refresh();
  EXPECT_EQ(sim_.value(kJoystick), 1.0F);
}

TEST_F(OverrideManagerTest, RefreshRepeatsWhatIsSetButForFailures) {
  manager_.setRequired({kJoystick});
  manager_.acquire(OverrideHolder::kSurfaces, core::kSurfaceOverride);
  manager_.acquire(OverrideHolder::kFailures, kFailure, 6.0F, false);
  EXPECT_EQ(manager_.active(), (Names{core::kSurfaceOverride, kJoystick}));
  EXPECT_EQ(sim_.subscribed(), std::multiset<std::string>{kJoystick}) << "the other two are watched by their holders";
  sim_.clearMessages();
  manager_.refresh();
  EXPECT_EQ(sim_.writes(), (Writes{{kJoystick, 1.0F}, {core::kSurfaceOverride, 1.0F}}));
}

TEST_F(OverrideManagerTest, WhatXPlaneShowsReleasedIsNotTakenBack) {
  manager_.setRequired({kJoystick});
  sim_.run(0.2);
  sim_.set(kJoystick, 0.0F);
  sim_.run(0.12);  // one answer, so it is not known yet which client did
  manager_.refresh();
  EXPECT_EQ(sim_.value(kJoystick), 0.0F);
}

TEST_F(OverrideManagerTest, JournalEntryThatWasTakenOutIsWrittenAnew) {
  manager_.setRequired({kJoystick});
  sim_.journal()->remove({std::string("override:") + kJoystick});  // as the panic tool does
  manager_.refresh();
  EXPECT_TRUE(inJournal().empty()) << "not looked at every second";
  manager_.forgetShown();
  manager_.refresh();
  EXPECT_EQ(inJournal(), Names{kJoystick});
}

TEST_F(OverrideManagerTest, RefreshThatCannotWriteTheJournalDoesNotSet) {
  manager_.setRequired({kJoystick});
  manager_.forgetShown();
  sim_.restart();
  sim_.set(kJoystick, 0.0F);
  sim_.breakJournal();
  manager_.refresh();
  EXPECT_EQ(sim_.value(kJoystick), 0.0F);
  ASSERT_EQ(reports_.size(), 2U);
  EXPECT_FALSE(reports_.back().second);
}

}  // namespace
}  // namespace xplane_bridge
