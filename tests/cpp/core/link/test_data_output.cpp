#include "xplane_bridge/core/link/data_output.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "sim_link_rig.hpp"

namespace xplane_bridge::core {
namespace {

constexpr const char* kRate = "sim/network/dataout/network_data_rate";

/// Data Output through a whole SimLink: what X-Plane has afterwards is what counts.
class DataOutputTest : public SimLinkRig {
 protected:
  static SimLinkOptions withRows(const FakeXPlane& sim, std::vector<std::int32_t> rows) {
    SimLinkOptions options = optionsFor(sim);
    options.data_output.enabled = true;
    options.data_output.port = 0;
    options.data_output.rows = std::move(rows);
    return options;
  }

  std::string journalFile(const FakeXPlane& sim) const { return journalPath(folder_, "127.0.0.1", sim.port()); }
  bool isSelected(FakeXPlane* sim, int row) const { return sim->datarefs[FakeXPlane::rowPath(row)] != 0.0F; }

  /// Makes the entry as a run that has died would have left it.
  void leaveEntry(const FakeXPlane& sim, const std::vector<UndoOperation>& undo) const {
    JournalOwner dead = thisProcess("/died");
    dead.start_ticks += 1;
    Journal(journalFile(sim), dead).record("data_output", "data_output", undo);
  }

  bool dataFlowsWithin(double seconds, FakeXPlane* sim) {
    const int before = data_datagrams_;
    return runUntil([&] { return data_datagrams_ > before + 3; }, seconds, {sim}) >= 0.0;
  }
};

TEST_F(DataOutputTest, SetsRowsRateAndTargetAndPutsThemBack) {
  FakeXPlane sim;
  sim.datarefs[FakeXPlane::rowPath(3)] = 1.0F;   // the user's, and wanted
  sim.datarefs[FakeXPlane::rowPath(37)] = 1.0F;  // the user's, not wanted
  makeLink(withRows(sim, {3, 17, 20}));
  ASSERT_TRUE(dataFlowsWithin(3.0, &sim));
  EXPECT_EQ(sim.data_target, (FakeXPlane::Address{INADDR_LOOPBACK, link_->dataPort()}));
  EXPECT_EQ(sim.datarefs[kRate], 99.0F);
  EXPECT_EQ(rows_[17], 1700.0F);
  EXPECT_EQ(rows_[37], 3700.0F) << "what the user has selected comes too";
  EXPECT_TRUE(link_->status().problems.empty());

  const std::vector<JournalEntry> entries = Journal(journalFile(sim), thisProcess("")).entries();
  ASSERT_EQ(entries.size(), 1U);
  ASSERT_EQ(entries[0].undo.size(), 3U);
  EXPECT_EQ(std::get<UndoUsel>(entries[0].undo[0]).rows, (std::vector<std::int32_t>{17, 20}));
  EXPECT_EQ(std::get<UndoDref>(entries[0].undo[1]).path, kRate);
  EXPECT_EQ(std::get<UndoDref>(entries[0].undo[1]).value, 20.0F);
  EXPECT_EQ(std::get<UndoIse4>(entries[0].undo[2]).port, link_->dataPort());

  sim.startThread();
  EXPECT_TRUE(link_->stop(3.0));
  sim.stopThread();
  EXPECT_TRUE(isSelected(&sim, 3));
  EXPECT_FALSE(isSelected(&sim, 17));
  EXPECT_FALSE(isSelected(&sim, 20));
  EXPECT_TRUE(isSelected(&sim, 37));
  EXPECT_EQ(sim.datarefs[kRate], 20.0F);
  EXPECT_FALSE(sim.data_target_on);
  EXPECT_FALSE(std::filesystem::exists(journalFile(sim)));
}

TEST_F(DataOutputTest, NothingIsChangedBeforeItIsWrittenDown) {
  FakeXPlane sim;
  std::filesystem::create_directories(journalFile(sim) + ".new");  // where the file has to be written first
  makeLink(withRows(sim, {17}));
  run(3.0, {&sim});
  EXPECT_FALSE(isSelected(&sim, 17));
  EXPECT_FALSE(sim.data_target_on);
  EXPECT_EQ(sim.datarefs[kRate], 20.0F);
  EXPECT_TRUE(hasProblem("Data Output is not configured"));
}

TEST_F(DataOutputTest, NothingIsChangedThatCannotBeRestored) {
  FakeXPlane sim;
  sim.datarefs.erase(kRate);
  makeLink(withRows(sim, {17}));
  run(4.0, {&sim});
  EXPECT_FALSE(isSelected(&sim, 17));
  EXPECT_FALSE(sim.data_target_on);
  EXPECT_TRUE(hasProblem(kRate));
}

TEST_F(DataOutputTest, WhatAStallLeftUnansweredIsAskedForAgain) {
  FakeXPlane sim;
  makeLink(withRows(sim, {17}));
  ASSERT_GE(runUntilState(LinkState::kConnected, 1.0, {&sim}), 0.0);
  const std::uint32_t epoch = link_->status().epoch;
  run(3.0, {});  // longer than a request is waited for, shorter than what counts as lost
  EXPECT_TRUE(link_->status().problems.empty()) << "X-Plane may only be loading";
  EXPECT_TRUE(dataFlowsWithin(3.0, &sim));
  EXPECT_EQ(link_->status().epoch, epoch);
}

TEST_F(DataOutputTest, RowsThatAStallLeftUnansweredGoBackToo) {
  FakeXPlane sim;
  sim.datarefs.erase(FakeXPlane::rowPath(17));
  makeLink(withRows(sim, {17}));
  ASSERT_GE(runUntilState(LinkState::kConnected, 1.0, {&sim}), 0.0);
  run(0.2, {&sim});  // in which only the rate is answered
  run(3.0, {});
  sim.datarefs[FakeXPlane::rowPath(17)] = 0.0F;
  ASSERT_TRUE(dataFlowsWithin(3.0, &sim));
  const std::vector<JournalEntry> entries = Journal(journalFile(sim), thisProcess("")).entries();
  ASSERT_EQ(entries.size(), 1U);
  EXPECT_TRUE(std::holds_alternative<UndoUsel>(entries[0].undo.at(0)));
}

TEST_F(DataOutputTest, ALateAnswerEndsTheProblem) {
  FakeXPlane sim;
  sim.datarefs.erase(kRate);
  makeLink(withRows(sim, {17}));
  run(20.0, {&sim});
  EXPECT_TRUE(hasProblem(kRate));
  EXPECT_EQ(std::count_if(log_.begin(), log_.end(),
                          [](const std::string& line) { return line.find(kRate) != std::string::npos; }),
            1);
  sim.datarefs[kRate] = 20.0F;
  EXPECT_TRUE(dataFlowsWithin(8.0, &sim));
  EXPECT_TRUE(link_->status().problems.empty());
}

TEST_F(DataOutputTest, RowsOfUnknownStateAreNotTakenAway) {
  FakeXPlane sim;
  sim.datarefs.erase(FakeXPlane::rowPath(17));
  makeLink(withRows(sim, {17}));
  ASSERT_GE(runUntil([&] { return sim.data_target_on; }, 4.0, {&sim}), 0.0);
  const std::vector<JournalEntry> entries = Journal(journalFile(sim), thisProcess("")).entries();
  ASSERT_EQ(entries.size(), 1U);
  EXPECT_TRUE(std::holds_alternative<UndoDref>(entries[0].undo.at(0))) << "no row to be deselected";
}

TEST_F(DataOutputTest, LeftoversOfADeadRunAreAdoptedWithWhatWasBefore) {
  FakeXPlane sim;
  sim.datarefs[kRate] = 99.0F;  // as the dead run has set it
  sim.datarefs[FakeXPlane::rowPath(4)] = 1.0F;
  sim.datarefs[FakeXPlane::rowPath(17)] = 1.0F;
  leaveEntry(sim, {UndoUsel{{4, 17}}, UndoDref{kRate, 12.0F}, UndoIse4{64, "127.0.0.1", 5}});
  makeLink(withRows(sim, {17, 20}));
  ASSERT_TRUE(dataFlowsWithin(3.0, &sim));
  sim.startThread();
  EXPECT_TRUE(link_->stop(3.0));
  sim.stopThread();
  EXPECT_FALSE(isSelected(&sim, 4)) << "selected by the dead run, not wanted by this one";
  EXPECT_FALSE(isSelected(&sim, 17));
  EXPECT_FALSE(isSelected(&sim, 20));
  EXPECT_EQ(sim.datarefs[kRate], 12.0F) << "the user's, not the dead run's";
}

TEST_F(DataOutputTest, LeftoversAreRestoredWithoutDataTransport) {
  FakeXPlane sim;
  sim.datarefs[kRate] = 99.0F;
  sim.datarefs[FakeXPlane::rowPath(4)] = 1.0F;
  sim.data_target_on = true;
  sim.data_target = {INADDR_LOOPBACK, 9};
  leaveEntry(sim, {UndoUsel{{4}}, UndoDref{kRate, 12.0F}, UndoIse4{64, "127.0.0.1", 9}});
  SimLinkOptions options = optionsFor(sim);
  options.data_output.restore_leftovers = true;
  makeLink(options);
  ASSERT_GE(runUntil([&] { return !std::filesystem::exists(journalFile(sim)); }, 4.0, {&sim}), 0.0);
  EXPECT_FALSE(isSelected(&sim, 4));
  EXPECT_EQ(sim.datarefs[kRate], 12.0F);
  EXPECT_FALSE(sim.data_target_on);
}

TEST_F(DataOutputTest, UnreachableXPlaneLeavesTheJournal) {
  FakeXPlane sim;
  makeLink(withRows(sim, {17}));
  ASSERT_TRUE(dataFlowsWithin(3.0, &sim));
  run(1.0, {});
  EXPECT_FALSE(link_->stop(0.2));
  EXPECT_TRUE(std::filesystem::exists(journalFile(sim)));
}

TEST_F(DataOutputTest, TakenBackOnceThenLeftToTheOther) {
  FakeXPlane sim;
  makeLink(withRows(sim, {17}));
  ASSERT_TRUE(dataFlowsWithin(3.0, &sim));
  const FakeXPlane::Address ours = sim.data_target;
  const FakeXPlane::Address other = {INADDR_LOOPBACK, 9};
  sim.data_target = other;
  ASSERT_GE(runUntil([&] { return sim.data_target == ours; }, 3.0, {&sim}), 0.0);
  ASSERT_TRUE(dataFlowsWithin(1.0, &sim));
  EXPECT_TRUE(link_->status().problems.empty());
  sim.data_target = other;
  run(10.0, {&sim});
  EXPECT_EQ(sim.data_target, other) << "no fight over it";
  EXPECT_TRUE(hasProblem("another client owns Data Output"));
  EXPECT_EQ(link_->status().state, LinkState::kConnected);
  sim.data_target = ours;
  ASSERT_TRUE(dataFlowsWithin(1.0, &sim));
  run(0.1, {&sim});
  EXPECT_TRUE(link_->status().problems.empty());
}

TEST_F(DataOutputTest, AnotherClientKeepsItWhenTheLinkEnds) {
  FakeXPlane sim;
  makeLink(withRows(sim, {17}));
  ASSERT_TRUE(dataFlowsWithin(3.0, &sim));
  const FakeXPlane::Address other = {INADDR_LOOPBACK, 9};
  const auto taken = [&] {
    sim.data_target = other;
    return hasProblem("another client owns Data Output");
  };
  ASSERT_GE(runUntil(taken, 10.0, {&sim}), 0.0);
  sim.startThread();
  EXPECT_TRUE(link_->stop(3.0));
  sim.stopThread();
  EXPECT_EQ(sim.data_target, other);
  EXPECT_TRUE(sim.data_target_on);
  EXPECT_TRUE(isSelected(&sim, 17));
  EXPECT_TRUE(link_->journal()->entries().empty());
}

TEST_F(DataOutputTest, OneDatagramASecondIsNoTheft) {
  FakeXPlane sim;
  SimLinkOptions options = withRows(sim, {17});
  options.data_output.rate_hz = 1;
  makeLink(options);
  ASSERT_GE(runUntilState(LinkState::kConnected, 3.0, {&sim}), 0.0);
  sim.ignores_target = true;  // sent by hand, a little late as by a frame
  std::vector<std::uint8_t> datagram{'D', 'A', 'T', 'A', '*'};
  FakeXPlane::append(&datagram, std::int32_t{17});
  for (int i = 0; i < 8; ++i) FakeXPlane::append(&datagram, 1.0F);
  for (int second = 0; second < 8; ++second) {
    sim.send({INADDR_LOOPBACK, link_->dataPort()}, datagram);
    run(1.035, {&sim});
    EXPECT_TRUE(link_->status().problems.empty()) << second;
  }
  EXPECT_EQ(data_datagrams_, 8);
}

TEST_F(DataOutputTest, SilenceDuringAPauseIsNoTheft) {
  FakeXPlane sim;
  makeLink(withRows(sim, {17}));
  ASSERT_TRUE(dataFlowsWithin(3.0, &sim));
  sim.datarefs["sim/time/paused"] = 1.0F;
  sim.labels.clear();
  run(20.0, {&sim});
  for (const std::string& label : sim.labels) {
    EXPECT_NE(label, "ISE4");
  }
  EXPECT_TRUE(link_->status().problems.empty());
  sim.datarefs["sim/time/paused"] = 0.0F;
  EXPECT_TRUE(dataFlowsWithin(0.5, &sim));
}

TEST_F(DataOutputTest, LostSettingsAreRepeatedThenSaid) {
  FakeXPlane sim;
  sim.ignores_target = true;
  makeLink(withRows(sim, {17}));
  run(2.0, {&sim});
  sim.ignores_target = false;
  EXPECT_TRUE(dataFlowsWithin(2.0, &sim)) << "the datagram with the target was lost";

  FakeXPlane deaf;
  deaf.ignores_target = true;
  makeLink(withRows(deaf, {17}));
  run(8.0, {&deaf});
  EXPECT_TRUE(hasProblem("no DATA arrives"));
}

TEST_F(DataOutputTest, DeselectedRowIsSelectedAgain) {
  FakeXPlane sim;
  makeLink(withRows(sim, {17, 20}));
  ASSERT_TRUE(dataFlowsWithin(3.0, &sim));
  sim.datarefs[FakeXPlane::rowPath(20)] = 0.0F;  // another client's USEL
  EXPECT_GE(runUntil([&] { return isSelected(&sim, 20); }, 3.0, {&sim}), 0.0);
}

TEST_F(DataOutputTest, RowsThatXPlaneLacksAreNamed) {
  FakeXPlane sim;
  makeLink(withRows(sim, {17, 150}));  // the fake sends rows 0..138
  run(10.0, {&sim});
  EXPECT_TRUE(hasProblem("rows 150 do not arrive"));
  EXPECT_GT(data_datagrams_, 0);
}

TEST_F(DataOutputTest, RestartedXPlaneIsConfiguredAgainAndRestoredToTheFirstState) {
  FakeXPlane sim;
  makeLink(withRows(sim, {17}));
  ASSERT_TRUE(dataFlowsWithin(3.0, &sim));
  ASSERT_GE(runUntilState(LinkState::kStale, 2.0, {}), 0.0);
  sim.restart();
  sim.data_target_on = false;  // rows and rate were saved in X-Plane's preferences, as ours
  ASSERT_TRUE(dataFlowsWithin(4.0, &sim));
  sim.startThread();
  EXPECT_TRUE(link_->stop(3.0));
  sim.stopThread();
  EXPECT_FALSE(isSelected(&sim, 17));
  EXPECT_EQ(sim.datarefs[kRate], 20.0F);
}

TEST_F(DataOutputTest, MoreRowsLater) {
  FakeXPlane sim;
  makeLink(withRows(sim, {17}));
  ASSERT_TRUE(dataFlowsWithin(3.0, &sim));
  link_->setDataRows({17, 21});
  EXPECT_GE(runUntil([&] { return rows_.count(21) != 0; }, 3.0, {&sim}), 0.0);
  EXPECT_THROW(link_->setDataRows({-1}), std::invalid_argument);
  sim.startThread();
  EXPECT_TRUE(link_->stop(3.0));
  sim.stopThread();
  EXPECT_FALSE(isSelected(&sim, 17));
  EXPECT_FALSE(isSelected(&sim, 21));
}

TEST_F(DataOutputTest, NotConfiguringSaysWhatTheUserHasToDo) {
  FakeXPlane sim;
  UdpSocketOptions any;
  any.bind_address = kLoopbackAddress;
  const std::uint16_t free_port = UdpSocket(any).localPort();
  SimLinkOptions options = withRows(sim, {17});
  options.data_output.configure = false;
  options.data_output.port = free_port;
  makeLink(options);
  run(9.0, {&sim});
  EXPECT_TRUE(hasProblem("select the rows"));
  EXPECT_EQ(std::count_if(log_.begin(), log_.end(),
                          [](const std::string& line) { return line.find("select the rows") != std::string::npos; }),
            1)
      << "once, not every time it is looked at";
  EXPECT_FALSE(isSelected(&sim, 17));
  sim.datarefs[FakeXPlane::rowPath(17)] = 1.0F;
  sim.data_target = {INADDR_LOOPBACK, free_port};
  sim.data_target_on = true;
  EXPECT_TRUE(dataFlowsWithin(1.0, &sim));
  run(0.1, {&sim});
  EXPECT_TRUE(link_->status().problems.empty());
}

TEST_F(DataOutputTest, ConfiguringNeedsAJournal) {
  FakeXPlane sim;
  EXPECT_THROW(SimLink(withRows(sim, {17}), {}, clock(), {}), std::invalid_argument);
}

}  // namespace
}  // namespace xplane_bridge::core
