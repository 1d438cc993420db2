#include "xplane_bridge/core/link/journal.hpp"

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <ifaddrs.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <future>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "journal_file.hpp"

static bool lists_addresses = true;  // whether the system does

/// In place of the system's.
extern "C" int getifaddrs(ifaddrs** list) {
  static const auto of_system = reinterpret_cast<decltype(&getifaddrs)>(dlsym(RTLD_NEXT, "getifaddrs"));
  return lists_addresses ? of_system(list) : -1;
}

namespace xplane_bridge::core {
namespace {

namespace fs = std::filesystem;

class JournalTest : public testing::Test {
 protected:
  JournalTest() {
    std::string pattern = (fs::temp_directory_path() / "journal-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    path_ = folder_ + "/nested/10.0.0.1_49000.json";
  }
  ~JournalTest() override { fs::remove_all(folder_); }

  Journal journal(const std::string& node = "/rx") const { return Journal(path_, thisProcess(node)); }

  void writeFile(const std::string& text) const {
    fs::create_directories(fs::path(path_).parent_path());
    std::ofstream(path_) << text;
  }

  nlohmann::json readFile() const { return nlohmann::json::parse(std::ifstream(path_)); }

  std::string folder_;
  std::string path_;
};

const std::vector<UndoOperation> kReleaseJoystick = {UndoDref{"sim/operation/override/override_joystick", 0.0F}};

JournalOwner deadOwner() {
  JournalOwner owner = thisProcess("/crashed");
  owner.start_ticks += 1;  // the number belongs to another process now
  return owner;
}

TEST_F(JournalTest, NoFileIsAnEmptyJournal) {
  EXPECT_TRUE(journal().entries().empty());
  EXPECT_FALSE(fs::exists(path_));
}

TEST_F(JournalTest, WritesTheDocumentedFormat) {
  DataRow row;
  row.index = 25;
  row.values[0] = 0.5F;
  journal("/tx").record(
      "a", "override",
      {UndoDref{"x/y[2]", -2.0F}, UndoData{row}, UndoUsel{{3, 17}}, UndoIse4{kIse4DataOutput, "192.168.1.7", 49003}});
  const nlohmann::json document = readFile();
  EXPECT_EQ(document.at("format"), "xplane_bridge journal");
  EXPECT_EQ(document.at("version"), 1);
  ASSERT_EQ(document.at("entries").size(), 1U);
  const nlohmann::json& entry = document.at("entries").at(0);
  EXPECT_EQ(entry.at("id"), "a");
  EXPECT_EQ(entry.at("purpose"), "override");
  EXPECT_EQ(entry.at("owner").at("node"), "/tx");
  EXPECT_EQ(entry.at("owner").at("pid"), getpid());
  EXPECT_EQ(entry.at("owner").at("boot_id").get<std::string>().size(), 36U);
  const nlohmann::json expected = nlohmann::json::parse(R"([
    {"op": "dref", "path": "x/y[2]", "value": -2.0},
    {"op": "data", "row": 25, "values": [0.5, -999.0, -999.0, -999.0, -999.0, -999.0, -999.0, -999.0]},
    {"op": "usel", "rows": [3, 17]},
    {"op": "ise4_off", "target": 64, "address": "192.168.1.7", "port": 49003}])");
  EXPECT_EQ(entry.at("undo"), expected);
}

TEST_F(JournalTest, PauseAndWhatIsNotReadBackAreWrittenAndReadAsDocumented) {
  journal().record("a", "pause", {UndoPause{}, UndoDref{"lever", 0.5F, false}, UndoDref{"override", 0.0F}});
  const nlohmann::json expected = nlohmann::json::parse(R"([
    {"op": "resume"},
    {"op": "dref", "path": "lever", "value": 0.5, "confirm": false},
    {"op": "dref", "path": "override", "value": 0.0}])");
  EXPECT_EQ(readFile().at("entries").at(0).at("undo"), expected);
  const std::vector<UndoOperation> undo = journal().entries().at(0).undo;
  EXPECT_TRUE(std::holds_alternative<UndoPause>(undo.at(0)));
  EXPECT_FALSE(std::get<UndoDref>(undo.at(1)).confirm);
  EXPECT_TRUE(std::get<UndoDref>(undo.at(2)).confirm);
  std::array<std::uint8_t, kMaxUndoSize> buffer{};
  EXPECT_FALSE(encodeUndo(buffer, UndoPause{}).ok()) << "what X-Plane shows decides on the datagram";
}

TEST_F(JournalTest, ReadsWhatItWrote) {
  journal().record("a", "data_output", {UndoUsel{{1}}, UndoDref{"rate", 20.5F}});
  const std::vector<JournalEntry> entries = journal().entries();
  ASSERT_EQ(entries.size(), 1U);
  EXPECT_EQ(entries[0].purpose, "data_output");
  EXPECT_EQ(entries[0].owner, thisProcess(""));
  ASSERT_EQ(entries[0].undo.size(), 2U);
  EXPECT_EQ(std::get<UndoUsel>(entries[0].undo[0]).rows, std::vector<std::int32_t>{1});
  EXPECT_EQ(std::get<UndoDref>(entries[0].undo[1]).value, 20.5F);
}

TEST_F(JournalTest, ReplacesById) {
  journal().record("a", "override", kReleaseJoystick);
  journal().record("b", "override", kReleaseJoystick);
  journal().record("a", "override", {UndoDref{"other", 1.0F}});
  const std::vector<JournalEntry> entries = journal().entries();
  ASSERT_EQ(entries.size(), 2U);
  EXPECT_EQ(std::get<UndoDref>(entries[0].undo[0]).path, "other");
}

TEST_F(JournalTest, WhatTwoHoldIsGivenBackByTheLastOfThem) {
  JournalOwner other = thisProcess("/tx");
  other.pid = 1;
  const auto of = [this](const JournalOwner& owner) {
    return Journal(path_, owner, [](const JournalOwner&) { return true; });
  };
  Journal tx = of(other), capture = of(thisProcess("/capture"));
  tx.record("view:camera", "override", {UndoDref{"offset", 2.0F}, UndoDref{"field_of_view", 72.0F}});
  capture.record("field_of_view", "field_of_view", {UndoDref{"field_of_view", 72.0F}});
  EXPECT_EQ(valueBefore(tx.entries(), "field_of_view"), 72.0F);
  EXPECT_EQ(valueBefore(tx.entries(), "another"), std::nullopt);

  const std::vector<UndoOperation> left = tx.handOver("view:camera");
  ASSERT_EQ(left.size(), 1U);
  EXPECT_EQ(std::get<UndoDref>(left[0]).path, "offset");
  ASSERT_EQ(tx.own().size(), 1U);
  EXPECT_EQ(tx.own()[0].undo.size(), 1U);
  EXPECT_EQ(capture.handOver("field_of_view").size(), 1U) << "it is the last one";
  EXPECT_EQ(capture.own().size(), 1U) << "to be removed once it is undone";
  EXPECT_TRUE(capture.handOver("unknown").empty());
}

TEST_F(JournalTest, WhatIsHandedOverWholeLeavesNoEntry) {
  JournalOwner other = thisProcess("/tx");
  other.pid = 1;
  const auto of = [this](const JournalOwner& owner, bool alive) {
    return Journal(path_, owner, [alive](const JournalOwner&) { return alive; });
  };
  of(other, true).record("view:camera", "override", {UndoDref{"field_of_view", 72.0F}});
  of(thisProcess("/capture"), true).record("field_of_view", "field_of_view", {UndoDref{"field_of_view", 72.0F}});
  EXPECT_EQ(of(other, false).handOver("view:camera").size(), 1U) << "who crashed gives nothing back";
  EXPECT_TRUE(of(other, true).handOver("view:camera").empty());
  ASSERT_EQ(journal().entries().size(), 1U);
  EXPECT_EQ(journal().entries()[0].id, "field_of_view");
}

TEST_F(JournalTest, FileGoesWithItsLastEntry) {
  journal().record("a", "override", kReleaseJoystick);
  journal().record("b", "override", kReleaseJoystick);
  journal().remove({"a", "never there"});
  EXPECT_EQ(journal().entries().size(), 1U);
  journal().remove({"b"});
  EXPECT_FALSE(fs::exists(path_));
}

TEST_F(JournalTest, OrphansAreThoseOfDeadProcessesAndOnePurpose) {
  Journal(path_, deadOwner()).record("dead", "override", kReleaseJoystick);
  Journal(path_, deadOwner()).record("dead-other", "data_output", kReleaseJoystick);
  journal().record("own", "override", kReleaseJoystick);
  const Journal judge(path_, JournalOwner{"/next", 1, 2, "boot", "pc"});
  const std::vector<JournalEntry> orphans = judge.orphans("override");
  ASSERT_EQ(orphans.size(), 1U);
  EXPECT_EQ(orphans[0].id, "dead");
  EXPECT_EQ(orphans[0].owner.node, "/crashed");
  ASSERT_EQ(journal().own().size(), 1U);
  EXPECT_EQ(journal().own()[0].id, "own");
}

TEST_F(JournalTest, EntryOfARunningProcessIsNotTaken) {
  journal("/first").record("a", "override", kReleaseJoystick);
  Journal other(path_, JournalOwner{"/second", 1, 2, "boot", "pc"});
  try {
    other.record("a", "override", kReleaseJoystick);
    FAIL() << "the entry's owner (this test) runs";
  } catch (const JournalTakenError& error) {
    EXPECT_NE(std::string(error.what()).find("/first"), std::string::npos) << error.what();
  }
  EXPECT_EQ(journal().entries()[0].owner.node, "/first");
}

TEST_F(JournalTest, SeveralAreWrittenAtOnce) {
  journal().record("b", "override", kReleaseJoystick);
  const Replacements replacements(fs::path(path_).parent_path().string());
  journal().record({{"a", "override", kReleaseJoystick}, {"b", "override", {UndoDref{"other", 1.0F}}}, {"c", "x", {}}});
  EXPECT_EQ(replacements.count(), 1U);
  const std::vector<JournalEntry> entries = journal().entries();
  ASSERT_EQ(entries.size(), 3U);
  EXPECT_EQ(entries[0].id, "b");
  EXPECT_EQ(std::get<UndoDref>(entries[0].undo[0]).path, "other");
  EXPECT_EQ(entries[1].id, "a");
  EXPECT_EQ(entries[2].purpose, "x");
  EXPECT_EQ(entries[2].owner, thisProcess(""));
  journal().record({});
  EXPECT_EQ(replacements.count(), 0U);
}

TEST_F(JournalTest, OfSeveralNoneIsWrittenWhereOneIsTaken) {
  journal("/first").record("b", "override", kReleaseJoystick);
  Journal other(path_, JournalOwner{"/second", 1, 2, "boot", "pc"});
  EXPECT_THROW(other.record({{"a", "override", kReleaseJoystick}, {"b", "override", kReleaseJoystick}}),
               JournalTakenError);
  ASSERT_EQ(journal().entries().size(), 1U);
  EXPECT_EQ(journal().entries()[0].owner.node, "/first");
}

TEST_F(JournalTest, WhatIsNoNumberIsRefusedAndTheOthersStay) {
  journal().record("good", "override", kReleaseJoystick);
  DataRow row;
  row.index = 25;
  row.values[3] = std::numeric_limits<float>::infinity();
  const std::vector<UndoOperation> wrong = {UndoDref{"x/y", std::numeric_limits<float>::quiet_NaN()}, UndoData{row}};
  const std::vector<std::string> words = {"nan as what x/y is", "inf as what row 25 is"};
  for (std::size_t i = 0; i < wrong.size(); ++i) {
    try {
      journal().record({{"fine", "override", kReleaseJoystick}, {"wrong", "override", {wrong[i]}}});
      FAIL() << "JSON has no such number";
    } catch (const JournalError& error) {
      EXPECT_NE(std::string(error.what()).find(words[i]), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("expected a finite number"), std::string::npos) << error.what();
    }
  }
  ASSERT_EQ(journal().entries().size(), 1U);
  EXPECT_EQ(journal().entries()[0].id, "good");
}

TEST_F(JournalTest, ReadingWaitsForNoLock) {
  Journal(path_, deadOwner()).record("dead", "override", kReleaseJoystick);
  journal().record("own", "override", kReleaseJoystick);
  std::future<std::size_t> found;  // waited for once the lock is free
  const HeldLock held(path_);
  found = std::async(std::launch::async, [this] {
    const Journal judge(path_, JournalOwner{"/next", 1, 2, "boot", "pc"});
    return judge.entries().size() + judge.orphans("override").size() + journal().own().size();
  });
  ASSERT_EQ(found.wait_for(std::chrono::seconds(20)), std::future_status::ready);
  EXPECT_EQ(found.get(), 4U);
}

TEST_F(JournalTest, DamagedFileIsNotMovedWhileAnotherProcessHasTheLock) {
  writeFile("[]");
  {
    const HeldLock held(path_);
    EXPECT_THROW(journal().entries(), JournalError);
    EXPECT_TRUE(fs::exists(path_));
  }
  EXPECT_THROW(journal().entries(), JournalError);
  EXPECT_FALSE(fs::exists(path_));
}

TEST_F(JournalTest, ThatDoesNotWaitRefusesToWriteWhileItIsLocked) {
  journal().record("a", "override", kReleaseJoystick);
  Journal hasty(path_, thisProcess("/hasty"), {}, false);
  {
    const HeldLock held(path_);
    EXPECT_THROW(hasty.record("b", "override", kReleaseJoystick), JournalError);
    EXPECT_THROW(hasty.remove({"a"}), JournalError);
    EXPECT_THROW(hasty.removeUndone(hasty.entries()), JournalError);
  }
  hasty.record("b", "override", kReleaseJoystick);
  hasty.remove({"a"});
  ASSERT_EQ(journal().entries().size(), 1U);
  EXPECT_EQ(journal().entries()[0].id, "b");
}

TEST_F(JournalTest, WhyAnEntryIsLeftIsKeptUntilItIsTakenAnew) {
  Journal(path_, deadOwner()).record("dead", "override", kReleaseJoystick);
  for (const char* id : {"a", "b"}) journal().record(id, "override", kReleaseJoystick);
  journal().leave({"a", "dead", "never there"}, "X-Plane went first");
  std::vector<std::string> left;
  for (const JournalEntry& entry : journal().entries()) left.push_back(entry.left);
  EXPECT_EQ(left, (std::vector<std::string>{"", "X-Plane went first", ""})) << "of one's own only";
  EXPECT_FALSE(readFile().at("entries").at(2).contains("left"));
  journal().record("a", "override", kReleaseJoystick);
  EXPECT_EQ(journal().entries()[1].left, "");
}

TEST_F(JournalTest, EntryOfADeadProcessIsTakenOver) {
  Journal(path_, deadOwner()).record("a", "override", kReleaseJoystick);
  journal("/next").record("a", "override", kReleaseJoystick);
  ASSERT_EQ(journal().entries().size(), 1U);
  EXPECT_EQ(journal().entries()[0].owner.node, "/next");
}

TEST_F(JournalTest, WhatWasUndoneIsRemovedUnlessAnotherProcessHasTakenItOver) {
  for (const char* id : {"a", "b"}) Journal(path_, deadOwner()).record(id, "override", kReleaseJoystick);
  const std::vector<JournalEntry> orphans = journal().orphans("override");
  ASSERT_EQ(orphans.size(), 2U);
  journal("/next").record("a", "override", kReleaseJoystick);  // while they are being undone
  journal("/next").removeUndone(orphans);
  ASSERT_EQ(journal().entries().size(), 1U);
  EXPECT_EQ(journal().entries()[0].id, "a");
  EXPECT_EQ(journal().entries()[0].owner.node, "/next");
}

TEST_F(JournalTest, DamagedFileIsSetAsideAndSaid) {
  for (const char* text : {"{\"format\": \"xplane_b", "[]", "{\"format\": \"something else\"}", "",
                           "{\"format\": \"xplane_bridge journal\", \"version\": 1, \"entries\": [{\"id\": 3}]}",
                           "{\"format\": \"xplane_bridge journal\", \"version\": 1e50}"}) {
    writeFile(text);
    const Journal damaged = journal();
    try {
      damaged.entries();
      FAIL() << "accepted: " << text;
    } catch (const JournalError& error) {
      EXPECT_NE(std::string(error.what()).find(".damaged-"), std::string::npos) << error.what();
    }
    EXPECT_TRUE(damaged.entries().empty()) << "usable afterwards";
  }
  EXPECT_TRUE(fs::exists(path_ + ".damaged-1"));
  EXPECT_TRUE(fs::exists(path_ + ".damaged-6"));
}

TEST_F(JournalTest, NewerVersionIsLeftAlone) {
  writeFile(R"({"format": "xplane_bridge journal", "version": 2, "entries": []})");
  EXPECT_THROW(journal().entries(), JournalError);
  EXPECT_THROW(journal().record("a", "override", kReleaseJoystick), JournalError);
  EXPECT_EQ(readFile().at("version"), 2);
}

TEST_F(JournalTest, UnwritableFolderIsSaid) {
  std::ofstream(folder_ + "/nested") << "a file where the folder should be";
  EXPECT_THROW(journal().record("a", "override", kReleaseJoystick), JournalError);
}

TEST_F(JournalTest, ProcessesDoNotLoseEachOthersEntries) {
  constexpr int kProcesses = 4;
  constexpr int kEach = 15;
  std::vector<pid_t> children;
  for (int process = 0; process < kProcesses; ++process) {
    const pid_t child = fork();
    if (child == 0) {
      for (int i = 0; i < kEach; ++i) {
        journal().record(std::to_string(process) + ":" + std::to_string(i), "override", kReleaseJoystick);
      }
      _exit(0);
    }
    children.push_back(child);
  }
  for (const pid_t child : children) {
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_EQ(status, 0);
  }
  std::set<std::string> ids;
  for (const JournalEntry& entry : journal().entries()) {
    ids.insert(entry.id);
  }
  EXPECT_EQ(ids.size(), static_cast<std::size_t>(kProcesses * kEach));
  EXPECT_EQ(journal().orphans("override").size(), ids.size()) << "their processes have ended";
}

TEST(JournalPath, HoldsOnlyFileCharacters) {
  EXPECT_EQ(journalPath("/home/u/.ros/xplane_bridge", "192.168.1.5", 49000),
            "/home/u/.ros/xplane_bridge/192.168.1.5_49000.json");
  EXPECT_EQ(journalPath("/f", "../sim pc", 1), "/f/..-sim-pc_1.json");
}

TEST_F(JournalTest, AnAdoptedEntryIsMergedUnlessAnotherProcessThatRunsHoldsIt) {
  const JournalOwner running{"/runs", 1, 2, "boot", "pc"};
  journal().record("own", "override", {UndoDref{"fov", 1.0F}});
  Journal(path_, deadOwner()).record("gone", "data_output", {UndoUsel{{3}}, UndoDref{"rate", 20.0F}});
  Journal(path_, running).record("held", "override", {UndoDref{"fov", 1.0F}});
  Journal from(folder_ + "/10.0.0.2_49000.json", thisProcess("/rx"));
  from.record({{"own", "override", {UndoDref{"lever", 0.5F}, UndoDref{"fov", 9.0F}}},
               {"gone", "data_output", {UndoUsel{{3, 5}}, UndoDref{"rate", 99.0F}, UndoIse4{64, "1.2.3.4", 5}}},
               {"held", "override", {UndoDref{"lever", 0.5F}}},
               {"new", "override", {UndoPause{}}}});
  from.removeUndone(journal().adopt(from.own()));
  ASSERT_EQ(from.entries().size(), 1U);
  EXPECT_EQ(from.entries()[0].id, "held") << "it has not been taken";
  std::map<std::string, nlohmann::json> found;
  const nlohmann::json document = readFile();
  for (const nlohmann::json& entry : document.at("entries")) found[entry.at("id")] = entry.at("undo");
  const nlohmann::json expected = nlohmann::json::parse(R"({
    "own": [{"op": "dref", "path": "lever", "value": 0.5}, {"op": "dref", "path": "fov", "value": 1.0}],
    "gone": [{"op": "usel", "rows": [3, 5]}, {"op": "dref", "path": "rate", "value": 20.0},
             {"op": "ise4_off", "target": 64, "address": "1.2.3.4", "port": 5}],
    "held": [{"op": "dref", "path": "fov", "value": 1.0}],
    "new": [{"op": "resume"}]})");
  EXPECT_EQ(nlohmann::json(found), expected);
  EXPECT_EQ(journal().own().size(), 3U);
}

class JournalsIn : public JournalTest {
 protected:
  std::string fileOf(std::uint32_t address) {
    return fs::path(journals_({address, 49000})->path()).filename().string();
  }
  /// Another of this computer's addresses than the loopback's; 0: it has none.
  static std::uint32_t otherAddress() {
    for (const std::uint32_t address : ownAddresses()) {
      if (!isSameHost(address, kLoopbackAddress)) return address;
    }
    return 0;
  }

  std::vector<std::string> log_;
  JournalFactory journals_ =
      journalsIn(folder_, "/node", [this](LogLevel, const std::string& text) { log_.push_back(text); });
};

TEST_F(JournalsIn, NamesTheFileAfterThePeer) {
  EXPECT_EQ(fileOf(0xC0A80105U), "192.168.1.5_49000.json");
  const Endpoint peer{0xC0A80105U, 49000};
  EXPECT_EQ(journals_(peer)->self().node, "/node");
}

TEST_F(JournalsIn, AnXPlaneOfThisComputerHasOneFileWhicheverAddressItIsCalledBy) {
  EXPECT_EQ(fileOf(0x7F000101U), "127.0.0.1_49000.json");
  for (const std::uint32_t address : ownAddresses()) EXPECT_EQ(fileOf(address), "127.0.0.1_49000.json");
}

TEST_F(JournalsIn, SubscriptionsAreOfTheAddressThatIsAsked) {
  const auto file = [this](std::uint32_t address) {
    const Endpoint peer{address, 49000};
    return fs::path(journals_(peer)->ofSubscriptions(peer)->path()).filename().string();
  };
  EXPECT_EQ(file(0x7F000101U), "127.0.0.1_49000_subscriptions.json");
  if (const std::uint32_t other = otherAddress(); other != 0) {
    const std::string named = Endpoint{other, 0}.addressString();
    EXPECT_EQ(file(other), named + "_49000_subscriptions.json");
  }
}

TEST_F(JournalsIn, TakesOverWhatAnEarlierVersionHasLeftUnderAnotherAddress) {
  const std::uint32_t other = otherAddress();
  if (other == 0) GTEST_SKIP() << "this computer has no address but the loopback's";
  const std::string earlier = journalPath(folder_, Endpoint{other, 0}.addressString(), 49000);
  Journal(earlier, deadOwner()).record("left", "override", kReleaseJoystick);
  Journal(earlier, thisProcess("/runs")).record("runs", "override", kReleaseJoystick);
  Journal(earlier, deadOwner()).record("held", "override", kReleaseJoystick);
  const std::string now = journalPath(folder_, "127.0.0.1", 49000);
  Journal(now, thisProcess("/runs")).record("held", "override", kReleaseJoystick);
  {
    const HeldLock held(now);
    journals_({kLoopbackAddress, 49000});
    ASSERT_EQ(log_.size(), 1U);
    EXPECT_NE(log_[0].find("another process has it locked"), std::string::npos) << log_[0];
    log_.clear();
  }
  const std::shared_ptr<Journal> journal = journals_({kLoopbackAddress, 49000});
  ASSERT_EQ(journal->orphans("override").size(), 1U);
  EXPECT_EQ(journal->orphans("override")[0].id, "left");
  ASSERT_EQ(Journal(earlier, deadOwner()).entries().size(), 2U);
  EXPECT_EQ(Journal(earlier, deadOwner()).entries()[0].id, "runs");
  EXPECT_EQ(Journal(earlier, deadOwner()).entries()[1].id, "held") << "until its place is free";
  EXPECT_TRUE(log_.empty());
  std::ofstream(earlier) << "{";
  journals_({kLoopbackAddress, 49000});
  ASSERT_EQ(log_.size(), 1U);
  EXPECT_NE(log_[0].find("cannot be understood"), std::string::npos) << log_[0];
}

TEST_F(JournalsIn, WhereTheAddressesOfThisComputerCannotBeListedTheFileIsNamedAfterThePeer) {
  lists_addresses = false;
  EXPECT_NO_THROW(EXPECT_EQ(fileOf(0x7F000101U), "127.0.0.1_49000.json"));
  EXPECT_NO_THROW(EXPECT_EQ(fileOf(0xC0A80105U), "192.168.1.5_49000.json"));
  lists_addresses = true;
  ASSERT_EQ(log_.size(), 2U);
  EXPECT_NE(log_[1].find("whether 192.168.1.5 is this computer"), std::string::npos) << log_[1];
}

TEST(EncodeUndo, GivesTheMessages) {
  std::array<std::uint8_t, kMaxUndoSize> buffer{};
  const auto label = [&buffer] { return std::string(buffer.begin(), buffer.begin() + 4); };
  EXPECT_EQ(*encodeUndo(buffer, UndoDref{"a/b", 1.0F}), 509U);
  EXPECT_EQ(label(), "DREF");
  EXPECT_EQ(*encodeUndo(buffer, UndoData{}), 41U);
  EXPECT_EQ(label(), "DATA");
  EXPECT_EQ(*encodeUndo(buffer, UndoUsel{{1, 2}}), 13U);
  EXPECT_EQ(label(), "USEL");
  EXPECT_EQ(*encodeUndo(buffer, UndoIse4{64, "1.2.3.4", 5}), 37U);
  EXPECT_EQ(label(), "ISE4");
  EXPECT_EQ(buffer[33], 0) << "switched off";
  EXPECT_EQ(encodeUndo(buffer, UndoDref{"", 1.0F}).error(), EncodeError::kEmpty);
}

}  // namespace
}  // namespace xplane_bridge::core
