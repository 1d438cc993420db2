#include "xplane_bridge/core/link/journal_owner.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "journal_file.hpp"
#include "xplane_bridge/core/link/journal.hpp"

namespace xplane_bridge::core {
namespace {

namespace fs = std::filesystem;

class JournalOwnerTest : public testing::Test {
 protected:
  JournalOwnerTest() {
    std::string pattern = (fs::temp_directory_path() / "owners-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    journal_ = folder_ + "/127.0.0.1_49000.json";
  }
  ~JournalOwnerTest() override { fs::remove_all(folder_); }

  /// A process of another container: of this boot, and no process has its number here.
  static JournalOwner ofAnotherContainer() {
    JournalOwner owner = thisProcess("/xplane/tx_node");
    owner.pid = 57;
    owner.start_ticks += 1;
    return owner;
  }

  std::string folder_;
  std::string journal_;
};

TEST_F(JournalOwnerTest, AliveMeansTheSameProcess) {
  const JournalOwner self = thisProcess("/me");
  EXPECT_TRUE(isAlive(self, journal_));
  EXPECT_TRUE(isProcess(self, getpid()));
  EXPECT_FALSE(isProcess(self, getppid()));
  JournalOwner reused = self;
  reused.start_ticks += 5;
  EXPECT_FALSE(isAlive(reused, journal_));
  EXPECT_FALSE(isProcess(reused, getpid()));
  JournalOwner unknown = self;
  unknown.pid = 0x7FFFFFF0;
  EXPECT_FALSE(isAlive(unknown, journal_));
  unknown.start_ticks = 0;
  EXPECT_FALSE(isAlive(unknown, journal_));
  JournalOwner before_reboot = self;
  before_reboot.boot_id = "another";
  EXPECT_FALSE(isAlive(before_reboot, journal_));
  JournalOwner elsewhere = before_reboot;
  elsewhere.computer = "another-computer";
  EXPECT_TRUE(isAlive(elsewhere, journal_));
}

TEST_F(JournalOwnerTest, OfAnotherContainerIsAliveWhileItHasItsByteLocked) {
  const JournalOwner owner = ofAnotherContainer();
  EXPECT_FALSE(isAlive(owner, journal_));
  const OwnerByte byte(journal_, owner);
  byte.lock();
  EXPECT_TRUE(isAlive(owner, journal_));
  JournalOwner earlier = owner;
  earlier.start_ticks -= 1000;
  EXPECT_FALSE(isAlive(earlier, journal_)) << "of a container before, in the same place";
  byte.unlock();
  EXPECT_FALSE(isAlive(owner, journal_)) << "killed, or its container was removed";
}

TEST_F(JournalOwnerTest, OfAnotherContainerKeepsItsEntry) {
  Journal(journal_, ofAnotherContainer()).record("a", "override", {UndoDref{"x/y", 0.0F}});
  const OwnerByte byte(journal_, ofAnotherContainer());
  byte.lock();
  Journal here(journal_, thisProcess("/second"));
  EXPECT_TRUE(here.orphans("override").empty());
  EXPECT_THROW(here.record("a", "override", {UndoDref{"x/y", 0.0F}}), JournalTakenError);
  byte.unlock();
  EXPECT_EQ(here.orphans("override").size(), 1U);
}

TEST_F(JournalOwnerTest, IsShownAliveFromItsFirstEntryUntilItIsKilled) {
  int written[2];
  ASSERT_EQ(pipe(written), 0);
  const pid_t child = fork();
  if (child == 0) {
    for (const char* id : {"a", "b"}) {
      Journal(journal_, thisProcess("/child")).record(id, "override", {UndoDref{"x/y", 0.0F}});
    }
    close(written[1]);
    for (;;) pause();
  }
  close(written[1]);
  char end = 0;
  EXPECT_EQ(read(written[0], &end, 1), 0);  // the child has closed its end: the entries are there
  close(written[0]);
  const JournalOwner owner = Journal(journal_, thisProcess("/here")).entries().at(0).owner;
  const OwnerByte byte(journal_, owner);
  EXPECT_TRUE(byte.isLockedByAnother());
  kill(child, SIGKILL);
  siginfo_t ended{};
  ASSERT_EQ(waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOWAIT), 0);  // and stays as a zombie
  EXPECT_FALSE(byte.isLockedByAnother());
  EXPECT_FALSE(isAlive(owner, journal_)) << "a zombie does nothing any more";
  EXPECT_TRUE(isProcess(owner, child));
  waitpid(child, nullptr, 0);
  EXPECT_FALSE(isProcess(owner, child));
}

}  // namespace
}  // namespace xplane_bridge::core
