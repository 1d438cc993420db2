#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "journal_file.hpp"
#include "sim_link_rig.hpp"
#include "xplane_bridge/core/link/sim_link.hpp"

namespace xplane_bridge::core {
namespace {

TEST_F(SimLinkTest, FoundByBeacon) {
  FakeXPlane sim;
  beacons_ = true;
  makeLink(optionsForBeacon());
  const double took = runUntilState(LinkState::kConnected, 5.0, {&sim});
  EXPECT_GE(took, 1.0) << "a second X-Plane is given time to announce itself";
  EXPECT_LE(took, 1.6);
  run(0.1, {&sim});
  EXPECT_EQ(link_->status().peer.port, sim.port());
  EXPECT_EQ(link_->status().computer_name, "fake-" + std::to_string(sim.port()));
  ASSERT_EQ(link_->status().beacons.size(), 1U);
  EXPECT_GT(link_->counters().beacons, 0U);
}

TEST_F(SimLinkTest, NoBeaconIsSaid) {
  makeLink(optionsForBeacon());
  run(4.9, {});
  EXPECT_TRUE(link_->status().problems.empty()) << "X-Plane may be starting";
  run(0.2, {});
  EXPECT_TRUE(hasProblem("no X-Plane announces itself"));
}

TEST_F(SimLinkTest, SeveralBeaconsAreListedInsteadOfChosenFrom) {
  FakeXPlane first;
  FakeXPlane second;
  beacons_ = true;
  makeLink(optionsForBeacon());
  run(4.0, {&first, &second});
  EXPECT_EQ(link_->status().state, LinkState::kSearching);
  EXPECT_FALSE(link_->status().peer.valid());
  EXPECT_TRUE(hasProblem(std::to_string(first.port())));
  EXPECT_TRUE(hasProblem(std::to_string(second.port())));
  EXPECT_TRUE(hasProblem("set the parameter host"));
  // One of them ends: no doubt is left.
  EXPECT_GE(runUntilState(LinkState::kConnected, 6.0, {&second}), 0.0);
  EXPECT_EQ(link_->status().peer.port, second.port());
}

TEST_F(SimLinkTest, OtherProgramsBeaconsAreIgnored) {
  FakeXPlane sim;
  makeLink(optionsForBeacon());
  for (int i = 0; i < 5; ++i) {
    sim.sendBeacon(link_->beaconPort(), "external visual", 2);
    run(1.0, {&sim});
  }
  EXPECT_EQ(link_->status().state, LinkState::kSearching);
  EXPECT_TRUE(link_->status().beacons.empty());
}

TEST_F(SimLinkTest, LostWhenTheBeaconIsGoneToo) {
  FakeXPlane sim;
  beacons_ = true;
  makeLink(optionsForBeacon());
  ASSERT_GE(runUntilState(LinkState::kConnected, 5.0, {&sim}), 0.0);
  const double lost = runUntilState(LinkState::kLost, 9.0, {});
  EXPECT_GT(lost, 1.0);
  EXPECT_LE(lost, 2.7) << "well before lost_after";
}

TEST_F(SimLinkTest, BeaconWithoutAnswersKeepsTheLinkStale) {
  FakeXPlane sim;
  beacons_ = true;
  makeLink(optionsForBeacon());
  ASSERT_GE(runUntilState(LinkState::kConnected, 5.0, {&sim}), 0.0);
  sim.subscriptions.clear();
  for (int i = 0; i < 5; ++i) {
    sim.sendBeacon(link_->beaconPort(), "fake-" + std::to_string(sim.port()));
    run(1.0, {});
    EXPECT_EQ(link_->status().state, LinkState::kStale);
  }
}

TEST_F(SimLinkTest, FollowsARestartOnAnotherPort) {
  auto sim = std::make_unique<FakeXPlane>();
  beacons_ = true;
  makeLink(optionsForBeacon());
  const int id = subscribe(group({"a/b"}));
  sim->datarefs["a/b"] = 1.0F;
  ASSERT_GE(runUntil([&] { return datagrams_[id] > 0; }, 5.0, {sim.get()}), 0.0);
  FakeXPlane other;  // before the old port is free again
  sim.reset();
  run(2.0, {});
  other.datarefs["a/b"] = 2.0F;
  const double back = runUntil([&] { return values_[{id, 0}] == 2.0F; }, 5.0, {&other});
  EXPECT_GE(back, 0.0);
  EXPECT_LE(back, 1.0);
  EXPECT_EQ(link_->status().peer.port, other.port());
  EXPECT_EQ(link_->status().epoch, 2U);
}

TEST_F(SimLinkTest, WhatItHasNotedGoesWithXPlaneToAnotherPort) {
  auto sim = std::make_unique<FakeXPlane>();
  beacons_ = true;
  SimLinkOptions options = optionsForBeacon();
  options.data_output.enabled = true;
  options.data_output.rows = {3};
  makeLink(options);
  const std::shared_ptr<Journal> old = [&] {
    runUntil([&] { return data_datagrams_ > 0; }, 5.0, {sim.get()});
    return link_->journal();
  }();
  ASSERT_NE(old, nullptr);
  old->record("override:a/b", "override", {UndoDref{"a/b", 0.0F}});
  const Endpoint old_peer = link_->status().peer;
  ASSERT_EQ(old->own().size(), 2U) << "and Data Output";
  Journal(old->path(), {"/crashed", 4'000'000, 1, old->self().boot_id, old->self().computer})
      .record("override:c/d", "override", {UndoDref{"c/d", 0.0F}});
  FakeXPlane other;  // before the old port is free again
  sim.reset();
  ASSERT_GE(runUntilState(LinkState::kLost, 5.0, {}), 0.0);
  ASSERT_GE(runUntil([&] { return link_->status().peer.port == other.port(); }, 5.0, {&other}), 0.0);
  const std::shared_ptr<Journal> now = link_->journal();
  EXPECT_EQ(now->own().size(), 2U) << "for the guardian, before X-Plane answers";
  EXPECT_TRUE(old->own().empty());
  old->record("override:e/f", "override", {UndoDref{"e/f", 0.0F}});  // by a thread that had the old one in its hand
  ASSERT_GE(runUntilState(LinkState::kConnected, 5.0, {&other}), 0.0);
  run(0.5, {&other});
  EXPECT_EQ(now->own().size(), 3U);
  EXPECT_EQ(now->ofSubscriptions(link_->status().peer)->own().size(), 1U);
  EXPECT_TRUE(old->ofSubscriptions(old_peer)->entries().empty());
  ASSERT_EQ(old->entries().size(), 1U);
  EXPECT_EQ(old->entries()[0].owner.node, "/crashed") << "another process's stays";
}

TEST_F(SimLinkTest, WhatItHasNotedIsMovedOnceNoProcessHasTheJournalLocked) {
  auto sim = std::make_unique<FakeXPlane>();
  beacons_ = true;
  makeLink(optionsForBeacon());
  ASSERT_GE(runUntilState(LinkState::kConnected, 5.0, {sim.get()}), 0.0);
  const std::shared_ptr<Journal> old = link_->journal();
  old->record("override:a/b", "override", {UndoDref{"a/b", 0.0F}});
  FakeXPlane other;  // before the old port is free again
  sim.reset();
  auto held = std::make_unique<HeldLock>(journalPath(folder_, "127.0.0.1", other.port()));
  ASSERT_GE(runUntilState(LinkState::kLost, 5.0, {}), 0.0);
  ASSERT_GE(runUntilState(LinkState::kConnected, 5.0, {&other}), 0.0);
  run(1.0, {&other});
  const std::shared_ptr<Journal> now = link_->journal();
  ASSERT_NE(now->path(), old->path());
  EXPECT_TRUE(now->own().empty());
  EXPECT_EQ(old->own().size(), 1U);
  EXPECT_EQ(std::count_if(log_.begin(), log_.end(),
                          [](const std::string& line) { return line.find("has it locked") != std::string::npos; }),
            1);
  held.reset();
  run(0.3, {&other});
  EXPECT_EQ(now->own().size(), 1U);
  EXPECT_TRUE(old->entries().empty());
}

TEST_F(SimLinkTest, NeverJumpsToAnXPlaneThatWasThereAllAlong) {
  FakeXPlane ours;
  FakeXPlane neighbours;
  beacons_ = true;
  makeLink(optionsForBeacon());
  ASSERT_GE(runUntilState(LinkState::kConnected, 5.0, {&ours}), 0.0);
  run(3.0, {&ours, &neighbours});
  EXPECT_EQ(link_->status().peer.port, ours.port());
  run(20.0, {&neighbours});
  EXPECT_EQ(link_->status().state, LinkState::kLost);
  EXPECT_EQ(link_->status().peer.port, ours.port());
  EXPECT_GE(runUntilState(LinkState::kConnected, 2.0, {&ours, &neighbours}), 0.0);
  EXPECT_EQ(link_->status().peer.port, ours.port());
}

TEST_F(SimLinkTest, WrongPortIsSaidWhenTheBeaconKnowsBetter) {
  FakeXPlane sim;
  SimLinkOptions options = optionsForBeacon();
  options.host = "127.0.0.1";
  options.port = static_cast<std::uint16_t>(sim.port() ^ 1U);
  beacons_ = true;
  makeLink(options);
  run(2.0, {&sim});
  EXPECT_TRUE(hasProblem("listens on port " + std::to_string(sim.port())));
}

}  // namespace
}  // namespace xplane_bridge::core
