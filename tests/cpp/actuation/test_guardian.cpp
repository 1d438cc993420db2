#include "xplane_bridge/actuation/guardian.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "fake_simulator.hpp"
#include "fake_xplane.hpp"
#include "journal_file.hpp"
#include "xplane_bridge/actuation/pausing.hpp"

namespace xplane_bridge {
namespace {

constexpr const char* kJoystick = "sim/operation/override/override_joystick";

GuardianOrders read(const std::string& text) {
  GuardianOrders orders;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) orders.take(line);
  return orders;
}

TEST(GuardianOrdersTest, LastPeerCounts) {
  const GuardianOrders orders = read("peer 10.0.0.1 49000 /a/b.json\npeer 10.0.0.2 49010 /data/a user/c d.json\n");
  EXPECT_EQ(orders.address, "10.0.0.2");
  EXPECT_EQ(orders.port, 49010);
  EXPECT_EQ(orders.journal, "/data/a user/c d.json");
  EXPECT_FALSE(orders.dismissed);
}

TEST(GuardianOrdersTest, ByeDismisses) {
  EXPECT_TRUE(read("bye\n").dismissed);
  const GuardianOrders orders = read("peer 10.0.0.1 49000 /a/b.json\nbye\n");
  EXPECT_TRUE(orders.dismissed);
  EXPECT_EQ(orders.journal, "/a/b.json");
}

TEST(GuardianOrdersTest, DeadParentSaysNothing) {
  const GuardianOrders orders = read("");
  EXPECT_FALSE(orders.dismissed);
  EXPECT_TRUE(orders.journal.empty());
}

TEST(GuardianOrdersTest, WhatIsNoOrderLeavesTheLastOne) {
  for (const char* wrong : {"peer", "peer 10.0.0.9", "peer 10.0.0.9 49", "peer 10.0.0.9 0 /x", "peer 10.0.0.9 65536 /x",
                            "peer 10.0.0.9 port /x", "by", "\n", "peers 10.0.0.9 49000 /x"}) {
    const GuardianOrders orders = read(std::string("peer 10.0.0.1 49000 /a/b.json\n") + wrong);
    EXPECT_EQ(orders.address, "10.0.0.1") << wrong;
    EXPECT_EQ(orders.port, 49000) << wrong;
    EXPECT_EQ(orders.journal, "/a/b.json") << wrong;
    EXPECT_FALSE(orders.dismissed) << wrong;
  }
}

TEST(GuardianOrdersTest, BeatsAreExpectedFromTheFirstOnUntilARest) {
  EXPECT_EQ(read("peer 10.0.0.1 49000 /a/b.json\n").hang_timeout, 0.0);
  const GuardianOrders beating = read("beat 1.5\nbeat 1.5\nbeat\nbeat 0\nbeat x\n");
  EXPECT_EQ(beating.hang_timeout, 1.5);
  EXPECT_EQ(beating.beats, 2U);
  EXPECT_EQ(read("beat 1.5\nrest\n").hang_timeout, 0.0);
}

TEST(HangWatchTest, HangsOnceAfterTheTimeout) {
  HangWatch watch;
  for (int i = 0; i < 19; ++i) EXPECT_FALSE(watch.passed(0.05, 1.0)) << i;
  EXPECT_TRUE(watch.passed(0.06, 1.0));
  EXPECT_FALSE(watch.passed(5.0, 1.0)) << "said once";
  watch.beat();
  for (int i = 0; i < 19; ++i) EXPECT_FALSE(watch.passed(0.05, 1.0)) << i;
  EXPECT_TRUE(watch.passed(0.06, 1.0)) << "again";
}

TEST(HangWatchTest, EachBeatBeginsAnew) {
  HangWatch watch;
  for (int i = 0; i < 100; ++i) {
    EXPECT_FALSE(watch.passed(0.09, 1.0));
    if (i % 10 == 9) watch.beat();
  }
}

TEST(HangWatchTest, TimeInWhichTheGuardianDidNotRunIsNotTheParents) {
  HangWatch watch;
  for (int i = 0; i < 9; ++i) EXPECT_FALSE(watch.passed(3.0, 1.0)) << "a computer that is too busy for both";
  watch.beat();
  EXPECT_FALSE(watch.passed(60.0, 1.0)) << "it was suspended";
}

TEST(HangWatchTest, NothingHangsWhereNoBeatIsExpected) {
  HangWatch watch;
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(watch.passed(0.1, 0.0));
}

/// Another process that has set an override.
class GuardedProcess : public testing::Test {
 protected:
  GuardedProcess() : path_(sim_.folder() + "/guarded.json") {
    int written[2];
    EXPECT_EQ(pipe(written), 0);
    child_ = fork();
    if (child_ == 0) {
      core::Journal(path_, core::thisProcess("/tx_node"))
          .record("one", kOverridePurpose, {core::UndoDref{kJoystick, 0.0F}});
      close(written[1]);
      for (;;) pause();
    }
    close(written[1]);
    char end = 0;
    EXPECT_EQ(::read(written[0], &end, 1), 0);  // the child has closed its end: the entry is there
    close(written[0]);
  }
  ~GuardedProcess() override {
    kill(child_, SIGKILL);
    waitpid(child_, nullptr, 0);
  }

  core::FakeSimulator sim_;  // for its folder
  std::string path_;
  pid_t child_ = -1;
};

TEST_F(GuardedProcess, EntriesOfALivingProcessAreLeftAloneUnlessItIsTheParent) {
  EXPECT_TRUE(guardedJournal(path_, child_ + 1)->orphans(kOverridePurpose).empty());
  EXPECT_EQ(guardedJournal(path_, child_)->orphans(kOverridePurpose).size(), 1U);
}

TEST_F(GuardedProcess, ParentThatHasNotBeenWaitedForCountsAsGone) {
  kill(child_, SIGKILL);
  siginfo_t ended{};
  ASSERT_EQ(waitid(P_PID, static_cast<id_t>(child_), &ended, WEXITED | WNOWAIT), 0);  // and stays as a zombie
  EXPECT_EQ(guardedJournal(path_, child_ + 1)->orphans(kOverridePurpose).size(), 1U)
      << "for the guardian of another process";
  EXPECT_EQ(guardedJournal(path_, child_)->orphans(kOverridePurpose).size(), 1U);
}

TEST_F(GuardedProcess, ProcessOfAnotherContainerWithTheParentsNumberIsLeftAlone) {
  const core::JournalEntry before = core::Journal(path_, core::thisProcess("/test")).entries().at(0);
  core::JournalOwner other = before.owner;
  other.start_ticks += 1;
  const std::string path = sim_.folder() + "/other.json";
  core::Journal(path, other).record("two", kOverridePurpose, {core::UndoDref{kJoystick, 0.0F}});
  const OwnerByte byte(path, other);
  byte.lock();
  EXPECT_TRUE(guardedJournal(path, child_)->orphans(kOverridePurpose).empty());
}

class ReleaseLeftBehind : public testing::Test {
 protected:
  ReleaseLeftBehind() {
    sim_.set(kJoystick, 1.0F);
    sim_.journalOfAnother().record("one", kOverridePurpose, {core::UndoDref{kJoystick, 0.0F}});
  }
  bool release() {
    return releaseLeftBehind(&sim_, 2.0, [this](const std::string&, bool success) { successes_.push_back(success); });
  }

  core::FakeSimulator sim_;
  std::vector<bool> successes_;
};

TEST_F(ReleaseLeftBehind, GivesBackAndClearsTheJournal) {
  EXPECT_TRUE(release());
  EXPECT_EQ(sim_.value(kJoystick), 0.0F);
  EXPECT_TRUE(sim_.journal()->entries().empty());
  EXPECT_EQ(successes_, std::vector<bool>{true});
}

TEST_F(ReleaseLeftBehind, LetsXPlaneGoOn) {
  sim_.setState(core::LinkState::kPaused);
  sim_.journalOfAnother().record("two", kPausePurpose, {core::UndoPause{}});
  sim_.on_message = [this](const core::FakeSimulator::Message& message) {
    if (message.label == "CMND") sim_.setState(core::LinkState::kConnected);
  };
  EXPECT_TRUE(release());
  EXPECT_EQ(sim_.commands(), std::vector<std::string>{"sim/operation/pause_toggle"});
  EXPECT_TRUE(sim_.journal()->entries().empty());
}

TEST_F(ReleaseLeftBehind, LetsXPlaneGoOnThoughAnOverrideIsNotShownReleased) {
  sim_.setState(core::LinkState::kPaused);
  sim_.setReadOnly(kJoystick);
  sim_.journalOfAnother().record("two", kPausePurpose, {core::UndoPause{}});
  sim_.on_message = [this](const core::FakeSimulator::Message& message) {
    if (message.label == "CMND") sim_.setState(core::LinkState::kConnected);
  };
  EXPECT_FALSE(release());
  EXPECT_EQ(sim_.status().state, core::LinkState::kConnected);
  EXPECT_EQ(sim_.journal()->entries().size(), 1U);
}

TEST_F(ReleaseLeftBehind, LostDatagramIsSentAgain) {
  sim_.loseMessages(2);
  EXPECT_TRUE(release());
  EXPECT_EQ(sim_.value(kJoystick), 0.0F);
  EXPECT_EQ(sim_.messages().size(), 3U);
}

TEST_F(ReleaseLeftBehind, GivesUpWhenItsTimeIsOver) {
  sim_.setState(core::LinkState::kLost);
  const double begin = sim_.time();
  EXPECT_FALSE(release());
  EXPECT_NEAR(sim_.time() - begin, 2.0, 0.1);
  EXPECT_EQ(sim_.journal()->entries().size(), 1U) << "for the next start";
  EXPECT_EQ(successes_, std::vector<bool>{false});
}

TEST_F(ReleaseLeftBehind, GivesUpWhereXPlaneIsNotFound) {
  sim_.forgetPeer();
  EXPECT_FALSE(release());
  EXPECT_TRUE(sim_.messages().empty());
}

/// X-Plane with the journal that a guardian has.
class GuardedSimulator : public core::FakeSimulator {
 public:
  std::shared_ptr<core::Journal> journal() const override {
    return guardedJournal(path(), journalOfAnother().self().pid);
  }
  std::string path() const { return folder() + "/journal.json"; }
};

TEST(ReleaseOfWhoHangs, XPlaneIsGivenBackBeforeTheJournalIsFree) {
  GuardedSimulator sim;
  sim.set(kJoystick, 1.0F);
  sim.setState(core::LinkState::kPaused);
  sim.on_message = [&sim](const core::FakeSimulator::Message& message) {
    if (message.label == "CMND") sim.setState(core::LinkState::kConnected);
  };
  sim.journalOfAnother().record("one", kOverridePurpose, {core::UndoDref{kJoystick, 0.0F}});
  sim.journalOfAnother().record("two", kPausePurpose, {core::UndoPause{}});
  std::vector<std::string> failures;
  const auto report = [&failures](const std::string& text, bool success) {
    if (!success) failures.push_back(text);
  };
  auto held = std::make_unique<HeldLock>(sim.path());
  const double begin = sim.time();
  EXPECT_FALSE(releaseLeftBehind(&sim, 2.0, report));
  EXPECT_NEAR(sim.time() - begin, 2.0, 0.2);
  EXPECT_EQ(sim.value(kJoystick), 0.0F);
  EXPECT_EQ(sim.status().state, core::LinkState::kConnected);
  EXPECT_EQ(sim.commands().size(), 1U) << "of toggles a second one would pause it again";
  ASSERT_EQ(failures.size(), 1U);
  EXPECT_NE(failures[0].find("journal.json: another process has it locked"), std::string::npos) << failures[0];
  EXPECT_EQ(sim.journal()->entries().size(), 2U) << "for the next start";
  const double again = sim.time();
  sim.on_frame = [&] {
    if (sim.time() > again + 1.0) held.reset();
  };
  EXPECT_TRUE(releaseLeftBehind(&sim, 2.0, report));
  EXPECT_NEAR(sim.time() - again, 1.1, 0.2);
  EXPECT_TRUE(sim.journal()->entries().empty());
  EXPECT_EQ(failures.size(), 1U);
}

// ------------------------------------------------------------------------------------- the program override_guardian

/// This process with its guardian, which is the program that lies beside the test. X-Plane answers by UDP.
class GuardianProcess : public testing::Test {
 protected:
  struct Flown {
    Flown() {
      std::string pattern = (std::filesystem::temp_directory_path() / "guardian-XXXXXX").string();
      folder = mkdtemp(pattern.data());
      xplane.datarefs[kJoystick] = 1.0F;
      journal().record("one", kOverridePurpose, {core::UndoDref{kJoystick, 0.0F}});
      guardian->start();
      guardian->setPeer({core::kLoopbackAddress, xplane.port()}, folder + "/journal.json");
      xplane.startThread();
    }
    ~Flown() { std::filesystem::remove_all(folder); }
    Flown(const Flown&) = delete;
    Flown& operator=(const Flown&) = delete;

    core::Journal journal() const { return {folder + "/journal.json", core::thisProcess("/test")}; }
    /// What X-Plane has in the end.
    float shown() {
      xplane.stopThread();
      return xplane.datarefs[kJoystick];
    }

    std::string folder;
    FakeXPlane xplane;
    std::unique_ptr<Guardian> guardian = std::make_unique<Guardian>();
  };

  static bool comes(const std::function<bool()>& condition) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!condition()) {
      if (std::chrono::steady_clock::now() > end) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return true;
  }
  static bool undone(const Flown& flown) {
    return comes([&flown] { return flown.journal().entries().empty(); });
  }
};

TEST_F(GuardianProcess, DismissedItEndsAndLeavesEverything) {
  Flown flown;
  EXPECT_TRUE(flown.guardian->running());
  flown.guardian->beat(60.0);
  EXPECT_FALSE(flown.guardian->hasActed());
  flown.guardian->dismiss();
  EXPECT_FALSE(flown.guardian->running());
  EXPECT_EQ(flown.journal().entries().size(), 1U);
  EXPECT_EQ(flown.shown(), 1.0F);
}

TEST_F(GuardianProcess, UndoesWhatADeadParentHasLeft) {
  Flown flown;
  flown.guardian.reset();  // without a word, as a process that is killed
  EXPECT_TRUE(undone(flown));
  EXPECT_EQ(flown.shown(), 0.0F);
}

TEST_F(GuardianProcess, GivesBackWhatAParentHasSetThatHangsWithTheJournalsLock) {
  Flown flown;
  {
    const HeldLock held(flown.folder + "/journal.json");
    flown.guardian->beat(0.5);
    const auto released = [&flown] {
      const bool out = flown.shown() == 0.0F;
      flown.xplane.startThread();
      return out;
    };
    EXPECT_TRUE(comes(released));
    EXPECT_EQ(flown.journal().entries().size(), 1U);
  }
  flown.guardian.reset();
  EXPECT_TRUE(undone(flown));
}

TEST_F(GuardianProcess, UndoesWhatAParentThatHangsHasSetAndReportsItWhenItRunsAgain) {
  Flown flown, resting;
  resting.guardian->beat(1.0);
  resting.guardian->rest();
  flown.guardian->beat(2.0);
  EXPECT_FALSE(flown.guardian->hasActed());
  EXPECT_TRUE(undone(flown));
  EXPECT_TRUE(comes([&flown] { return flown.guardian->hasActed(); }));
  EXPECT_FALSE(flown.guardian->hasActed()) << "that was asked";
  EXPECT_FALSE(resting.guardian->hasActed());
  EXPECT_EQ(resting.journal().entries().size(), 1U) << "who rests does not hang";
  flown.guardian->dismiss();
  resting.guardian->dismiss();
  EXPECT_EQ(flown.shown(), 0.0F);
  EXPECT_EQ(resting.shown(), 1.0F);
}

}  // namespace
}  // namespace xplane_bridge
