#include <optional>

#include "fixture.hpp"
#include "journal_file.hpp"

namespace xplane_bridge {
namespace {

// ------------------------------------------------------------------------------- what is written before a release

class PreparedRelease : public OverrideManagerTest {
 protected:
  static constexpr const char* kLever = "sim/cockpit2/engine/actuators/throttle_ratio[0]";
  PreparedRelease() { sim_.set(kLever, 0.0F); }
  void prepare(float value) { manager_.prepareRelease(kThrottles, {core::UndoDref{kLever, value, false}}); }
  float recorded() {
    const auto undo = sim_.journal()->entries().at(0).undo;
    return undo.size() == 2 ? std::get<core::UndoDref>(undo[0]).value : -1.0F;
  }
};

TEST_F(PreparedRelease, IsOverWithTheRelease) {
  manager_.setRequired({kThrottles});
  prepare(0.5F);
  manager_.setRequired({});
  manager_.setRequired({kThrottles});
  sim_.clearMessages();
  manager_.setRequired({});
  EXPECT_EQ(sim_.writes(), (Writes{{kThrottles, 0.0F}})) << "the lever was commanded otherwise meanwhile";
}

TEST_F(PreparedRelease, ComesRightBeforeTheRelease) {
  manager_.setRequired({kThrottles});
  prepare(0.5F);
  prepare(0.6F);
  sim_.clearMessages();
  manager_.setRequired({});
  EXPECT_EQ(sim_.writes(), (Writes{{kLever, 0.6F}, {kThrottles, 0.0F}}));
  sim_.set(kLever, 0.2F);
  sim_.clearMessages();
  manager_.confirmReleases(1.0);
  EXPECT_EQ(sim_.writes(), (Writes{{kThrottles, 0.0F}})) << "the lever may be commanded by now";
  EXPECT_TRUE(sim_.journal()->entries().empty());
}

TEST_F(PreparedRelease, IsNotReadBack) {
  sim_.setReadOnly(kLever);
  manager_.setRequired({kThrottles});
  prepare(0.6F);
  EXPECT_TRUE(manager_.releaseAll(1.0));
  EXPECT_EQ(sim_.value(kThrottles), 0.0F);
}

TEST_F(PreparedRelease, ComesAlsoAtTheEnd) {
  manager_.setRequired({kThrottles});
  prepare(0.6F);
  EXPECT_TRUE(manager_.releaseAll(1.0));
  EXPECT_EQ(sim_.value(kLever), 0.6F);
}

TEST_F(PreparedRelease, IsForWhatIsSetOnly) {
  prepare(0.6F);
  manager_.setRequired({kThrottles});
  manager_.setRequired({});
  EXPECT_EQ(sim_.value(kLever), 0.0F);
}

TEST_F(PreparedRelease, GoesToTheJournalOnceASecondWhereItChanges) {
  manager_.setRequired({kThrottles});
  prepare(0.5F);
  EXPECT_EQ(recorded(), -1.0F) << "not by the thread that controls";
  manager_.recordPreparations();
  EXPECT_EQ(recorded(), 0.5F);
  prepare(0.7F);
  sim_.run(0.5);
  manager_.recordPreparations();
  EXPECT_EQ(recorded(), 0.5F);
  sim_.run(0.6);
  manager_.recordPreparations();
  EXPECT_EQ(recorded(), 0.7F);
  prepare(0.705F);
  sim_.run(1.1);
  manager_.recordPreparations();
  EXPECT_EQ(recorded(), 0.7F) << "a hundredth is not worth the disk";
}

TEST_F(PreparedRelease, WrittenDownLateItLeavesNothingOfWhatWasReleasedMeanwhile) {
  manager_.setRequired({kJoystick, kThrottles});
  prepare(0.5F);
  manager_.prepareRelease(kJoystick, {core::UndoDref{kLever, 0.5F, false}});
  std::optional<HeldLock> lock(std::in_place, sim_.folder() + "/journal.json");
  std::thread writing([this] { manager_.recordPreparations(); });  // of the joystick, then of the throttles
  lock->awaitWaiters(1);
  manager_.setRequired({kJoystick});
  std::thread confirming([this] { manager_.confirmReleases(1.0); });
  lock->awaitWaiters(2);
  lock.reset();
  writing.join();
  confirming.join();
  ASSERT_EQ(sim_.journal()->entries().size(), 1U);
  EXPECT_EQ(sim_.journal()->entries()[0].id, std::string("override:") + kJoystick);
}

TEST_F(PreparedRelease, OfACrashedRunIsWrittenWithItsRelease) {
  sim_.set(kThrottles, 1.0F);
  sim_.setReadOnly(kLever, false);
  sim_.journalOfAnother().record(std::string("override:") + kThrottles, kOverridePurpose,
                                 {core::UndoDref{kLever, 0.6F, false}, core::UndoDref{kThrottles, 0.0F}});
  EXPECT_TRUE(manager_.releaseLeftovers(1.0));
  EXPECT_EQ(sim_.writes(), (Writes{{kLever, 0.6F}, {kThrottles, 0.0F}}));
}

TEST_F(PreparedRelease, OfACrashedRunIsNotForAnXPlaneThatWasRestartedSince) {
  sim_.journalOfAnother().record(std::string("override:") + kThrottles, kOverridePurpose,
                                 {core::UndoDref{kLever, 0.6F, false}, core::UndoDref{kThrottles, 0.0F}});
  crashedRunHas(kJoystick);
  EXPECT_TRUE(manager_.releaseLeftovers(1.0));
  EXPECT_EQ(sim_.value(kLever), 0.0F) << "its throttles were not overridden";
  EXPECT_EQ(sim_.value(kJoystick), 0.0F);
  EXPECT_TRUE(sim_.journal()->entries().empty());
}

TEST_F(PreparedRelease, IsOverWithTheFlightAlsoInTheJournal) {
  manager_.setRequired({kThrottles});
  prepare(0.5F);
  manager_.recordPreparations();
  manager_.forgetPreparations();
  manager_.recordPreparations();
  EXPECT_EQ(sim_.journal()->entries().at(0).undo.size(), 1U) << "at once";
  sim_.clearMessages();
  manager_.setRequired({});
  EXPECT_EQ(sim_.writes(), (Writes{{kThrottles, 0.0F}}));
}

TEST_F(OverrideManagerTest, GivenBackByAnotherProcessNothingIsSetAnyMore) {
  manager_.setRequired({kJoystick});
  manager_.acquire(OverrideHolder::kFailures, kFailure, 6.0F, false);
  manager_.giveBackAll();
  EXPECT_TRUE(manager_.active().empty());
  EXPECT_EQ(sim_.value(kFailure), 0.0F);
  manager_.refresh();
  EXPECT_EQ(sim_.value(kJoystick), 0.0F);
  manager_.confirmReleases(1.0);
  EXPECT_TRUE(inJournal().empty());
  manager_.setRequired({kJoystick});
  EXPECT_EQ(sim_.value(kJoystick), 1.0F) << "it may be taken again";
}

}  // namespace
}  // namespace xplane_bridge
