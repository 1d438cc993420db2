#include "xplane_bridge/actuation/override_manager.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "fake_simulator.hpp"
#include "xplane_bridge/core/control/control_channels.hpp"

namespace xplane_bridge {
namespace {

using Names = std::vector<std::string>;
using Writes = std::vector<std::pair<std::string, float>>;
using Reports = std::vector<std::pair<std::string, bool>>;

constexpr const char* kJoystick = "sim/operation/override/override_joystick";
constexpr const char* kThrottles = "sim/operation/override/override_throttles";
constexpr const char* kFailure = "sim/operation/failures/rel_elv_L_jam";
constexpr const char* kThrottle12 = "sim/flightmodel/engine/ENGN_thro_override[0]";

/// Expectations are worked out by hand from the contract in override_manager.hpp: overrides are 1 while set and 0 when
/// given back, X-Plane is asked at 10 Hz, and five answers in a row confirm a release.
class OverrideManagerTest : public testing::Test {
 protected:
  OverrideManagerTest() { sim_.setAll({kJoystick, kThrottles, core::kSurfaceOverride, kFailure}, 0.0F); }

  /// Entries of the journal by what they give back.
  Names inJournal() {
    Names out;
    for (const core::JournalEntry& entry : sim_.journal()->entries()) {
      for (const core::UndoOperation& operation : entry.undo) out.push_back(std::get<core::UndoDref>(operation).path);
    }
    std::sort(out.begin(), out.end());
    return out;
  }
  void crashedRunHas(const std::string& dataref) {
    sim_.set(dataref, 1.0F);
    sim_.journalOfAnother().record("override:" + dataref, kOverridePurpose, {core::UndoDref{dataref, 0.0F}});
  }
  /// Half a second and a bit, so that X-Plane has answered six times.
  void letSixAnswersPass() { sim_.run(0.56); }

  core::FakeSimulator sim_;
  Reports reports_;
  OverrideManager manager_{&sim_,
                           [this](const std::string& text, bool success) { reports_.emplace_back(text, success); }};
};

TEST_F(OverrideManagerTest, WhatWasShownBeforeAReleaseSaysNothingOfTheNextTime) {
  manager_.setRequired({kJoystick});
  letSixAnswersPass();
  manager_.setRequired({});
  sim_.setReadOnly(kJoystick);
  manager_.setRequired({kJoystick});
  letSixAnswersPass();
  EXPECT_TRUE(manager_.releasedByOthers().empty()) << "it has not been shown as set since";
}

// ------------------------------------------------------------------------------------------------ DATA rows

TEST_F(OverrideManagerTest, RowIsInTheJournalAndGetsItsSlotsBack) {
  const auto rowsSent = [this] {
    std::vector<std::int32_t> out;
    for (const auto& message : sim_.messages()) {
      if (message.label != "DATA") continue;
      out.push_back(core::loadLittleEndian<std::int32_t>(message.body.data()));
      for (std::size_t i = 0; i < 8; ++i) {
        EXPECT_EQ(core::loadLittleEndian<float>(message.body.data() + 4 + 4 * i), -999.0F);
      }
    }
    return out;
  };
  const auto entries = [this] { return sim_.journal()->entries(); };
  manager_.setRequired({"DATA row 8"});
  EXPECT_TRUE(sim_.messages().empty()) << "it goes out with the command";
  ASSERT_EQ(entries().size(), 1U);
  EXPECT_EQ(entries()[0].id, "override:DATA row 8");
  ASSERT_EQ(entries()[0].undo.size(), 1U);
  EXPECT_EQ(std::get<core::UndoData>(entries()[0].undo[0]).row.index, 8);
  EXPECT_TRUE(sim_.subscribed().empty()) << "X-Plane does not show who holds it";
  manager_.refresh();
  letSixAnswersPass();
  EXPECT_TRUE(manager_.releasedByOthers().empty());
  EXPECT_TRUE(sim_.messages().empty());
  manager_.setRequired({});
  EXPECT_EQ(rowsSent(), std::vector<std::int32_t>{8});
  manager_.confirmReleases(1.0);
  EXPECT_EQ(rowsSent(), (std::vector<std::int32_t>{8, 8})) << "a datagram may be lost";
  EXPECT_TRUE(entries().empty());
  manager_.setRequired({"DATA row 13"});
  EXPECT_TRUE(manager_.releaseAll(1.0));
  EXPECT_EQ(rowsSent(), (std::vector<std::int32_t>{8, 8, 13}));
  EXPECT_TRUE(entries().empty());
}

// ------------------------------------------------------------------------------------------------ setRequired()

TEST_F(OverrideManagerTest, RequiredOverridesAreSetOnce) {
  manager_.setRequired({kJoystick, kThrottles});
  EXPECT_EQ(sim_.value(kJoystick), 1.0F);
  EXPECT_EQ(sim_.value(kThrottles), 1.0F);
  EXPECT_EQ(manager_.active(), (Names{kJoystick, kThrottles}));
  EXPECT_EQ(reports_, (Reports{{"set override_joystick, override_throttles", true}}));
  manager_.setRequired({kThrottles, kJoystick});
  EXPECT_EQ(sim_.writes(), (Writes{{kJoystick, 1.0F}, {kThrottles, 1.0F}}));
  EXPECT_EQ(reports_.size(), 1U);
}

TEST_F(OverrideManagerTest, JournalComesBeforeTheWrite) {
  Names before_write;
  sim_.on_message = [&](const core::FakeSimulator::Message&) { before_write = inJournal(); };
  manager_.setRequired({kJoystick});
  EXPECT_EQ(before_write, Names{kJoystick});
}

TEST_F(OverrideManagerTest, WhatIsNotRequiredAnyMoreIsGivenBack) {
  manager_.setRequired({kJoystick, kThrottles});
  manager_.setRequired({kThrottles});
  EXPECT_EQ(sim_.value(kJoystick), 0.0F);
  EXPECT_EQ(sim_.value(kThrottles), 1.0F);
  EXPECT_EQ(manager_.active(), Names{kThrottles});
  EXPECT_EQ(reports_.back(), (std::pair<std::string, bool>{"gave back override_joystick", true}));
  EXPECT_TRUE(manager_.releasesPending());
  EXPECT_EQ(inJournal(), (Names{kJoystick, kThrottles})) << "until X-Plane has shown the release";
  manager_.confirmReleases(1.0);
  EXPECT_FALSE(manager_.releasesPending());
  EXPECT_EQ(inJournal(), Names{kThrottles});
}

TEST_F(OverrideManagerTest, NothingIsSetWithoutAJournal) {
  sim_.forgetPeer();
  manager_.setRequired({kJoystick});
  EXPECT_FALSE(manager_.acquire(kThrottles));
  EXPECT_TRUE(manager_.active().empty());
  EXPECT_TRUE(sim_.messages().empty());
  EXPECT_TRUE(reports_.empty());
}

TEST_F(OverrideManagerTest, NothingIsSetThatCannotBeWrittenDown) {
  sim_.breakJournal();
  EXPECT_THROW(manager_.setRequired({kJoystick}), core::JournalError);
  EXPECT_THROW(manager_.acquire(kThrottles), core::JournalError);
  EXPECT_TRUE(sim_.messages().empty());
  EXPECT_TRUE(manager_.active().empty());
  sim_.breakJournal(false);
  manager_.setRequired({kJoystick});
  EXPECT_EQ(sim_.value(kJoystick), 1.0F);
}

TEST_F(OverrideManagerTest, JournalThatFailsBetweenTwoLeavesTheFirstLookedAfter) {
  manager_.setRequired({kThrottles});
  sim_.on_message = [&](const core::FakeSimulator::Message&) { sim_.breakJournal(); };
  EXPECT_THROW(manager_.setRequired({kJoystick, kFailure}), core::JournalError);
  sim_.on_message = nullptr;
  EXPECT_EQ(manager_.active(), Names{kJoystick}) << "the throttles need no journal to be given back";
  EXPECT_EQ(sim_.value(kThrottles), 0.0F);
  EXPECT_EQ(sim_.value(kFailure), 0.0F);
  EXPECT_EQ(sim_.subscribed(), std::multiset<std::string>{kJoystick});
  EXPECT_EQ(reports_, (Reports{{"set override_throttles", true},
                               {"set override_joystick", true},
                               {"gave back override_throttles", true}}));
}

// ---------------------------------------------------------------------------------------- acquire() and release()

TEST_F(OverrideManagerTest, AcquiredIsIndependentOfWhatIsRequired) {
  EXPECT_TRUE(manager_.acquire(kJoystick));
  manager_.setRequired({kJoystick});
  manager_.setRequired({});
  EXPECT_EQ(sim_.value(kJoystick), 1.0F);
  EXPECT_FALSE(manager_.releasesPending());
  manager_.release(kJoystick);
  EXPECT_EQ(sim_.value(kJoystick), 0.0F);
  EXPECT_TRUE(manager_.releasesPending());
  EXPECT_EQ(sim_.writes(), (Writes{{kJoystick, 1.0F}, {kJoystick, 0.0F}}));
}

TEST_F(OverrideManagerTest, RequiredOutlivesItsAcquirer) {
  manager_.setRequired({kJoystick});
  EXPECT_TRUE(manager_.acquire(kJoystick));
  manager_.release(kJoystick);
  EXPECT_EQ(sim_.value(kJoystick), 1.0F);
  EXPECT_EQ(manager_.active(), Names{kJoystick});
}

TEST_F(OverrideManagerTest, ReleasingWhatWasNotAcquiredDoesNothing) {
  manager_.release(kJoystick);
  manager_.setRequired({kThrottles});
  manager_.release(kThrottles);
  EXPECT_EQ(sim_.writes(), (Writes{{kThrottles, 1.0F}}));
}

TEST_F(OverrideManagerTest, EachIsGivenBackInItsOwnWay) {
  sim_.set(kThrottle12, -2.0F);
  EXPECT_TRUE(manager_.acquire(kThrottle12, 0.5F));
  EXPECT_TRUE(manager_.acquire(kFailure, 6.0F, false));
  EXPECT_EQ(sim_.value(kThrottle12), 0.5F);
  manager_.release(kThrottle12);
  manager_.release(kFailure);
  EXPECT_EQ(sim_.value(kThrottle12), -2.0F) << "X-Plane 11's own 'not overridden'";
  EXPECT_EQ(sim_.value(kFailure), 0.0F);
  manager_.confirmReleases(1.0);
  EXPECT_TRUE(inJournal().empty());
}

TEST_F(OverrideManagerTest, AcquiredAnewItTakesTheNewValue) {
  EXPECT_TRUE(manager_.acquire(kFailure, 6.0F));
  EXPECT_TRUE(manager_.acquire(kFailure, 1.0F));
  EXPECT_EQ(sim_.value(kFailure), 1.0F);
  sim_.set(kFailure, 0.0F);
  manager_.refresh();
  EXPECT_EQ(sim_.value(kFailure), 1.0F);
}

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

/// The journal's lock file, held; and how many wait for it.
class HeldLock {
 public:
  explicit HeldLock(const std::string& path) : file_(open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600)) {
    EXPECT_EQ(flock(file_, LOCK_EX), 0);
  }
  ~HeldLock() { close(file_); }
  HeldLock(const HeldLock&) = delete;
  HeldLock& operator=(const HeldLock&) = delete;

  void awaitWaiters(int count) const {
    struct stat of {};
    ASSERT_EQ(fstat(file_, &of), 0);
    const std::string inode = ":" + std::to_string(of.st_ino) + " ";
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(5);
    for (int waiting = 0; waiting < count && std::chrono::steady_clock::now() < end; std::this_thread::yield()) {
      std::ifstream locks("/proc/locks");
      waiting = 0;
      for (std::string line; std::getline(locks, line);) {
        waiting += line.find("->") != std::string::npos && line.find(inode) != std::string::npos ? 1 : 0;
      }
    }
  }

 private:
  int file_;
};

TEST_F(PreparedRelease, WrittenDownLateItLeavesNothingOfWhatWasReleasedMeanwhile) {
  manager_.setRequired({kJoystick, kThrottles});
  prepare(0.5F);
  manager_.prepareRelease(kJoystick, {core::UndoDref{kLever, 0.5F, false}});
  std::optional<HeldLock> lock(std::in_place, sim_.folder() + "/journal.json.lock");
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

TEST_F(OverrideManagerTest, GivenBackByAnotherProcessNothingIsSetAnyMore) {
  manager_.setRequired({kJoystick});
  manager_.acquire(kFailure, 6.0F, false);
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
  manager_.acquire(core::kSurfaceOverride);
  manager_.acquire(kFailure, 6.0F, false);
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
  manager_.acquire(kFailure, 6.0F);
  manager_.acquire(core::kSurfaceOverride);
  sim_.run(0.2);
  sim_.setAll({kFailure, core::kSurfaceOverride}, 0.0F);
  letSixAnswersPass();
  EXPECT_TRUE(manager_.releasedByOthers().empty());
  EXPECT_EQ(manager_.active(), Names{core::kSurfaceOverride}) << "its holder watches that one";
  EXPECT_EQ(reports_, (Reports{{"rel_elv_L_jam was released by another client", true}}));
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

// ------------------------------------------------------------------------------------------------- releaseAll()

TEST_F(OverrideManagerTest, ReleaseAllGivesBackEverythingForGood) {
  manager_.setRequired({kJoystick, kThrottles});
  manager_.acquire(kFailure, 6.0F, false);
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
  EXPECT_FALSE(manager_.acquire(kThrottles));
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

TEST_F(OverrideManagerTest, LeftoversNeedAnXPlane) {
  sim_.forgetPeer();
  EXPECT_FALSE(manager_.releaseLeftovers(0.5));
}

}  // namespace
}  // namespace xplane_bridge
