#include "xplane_bridge/core/link/leftover_subscriptions.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "sim_link_rig.hpp"

namespace xplane_bridge::core {
namespace {

using Indices = std::map<std::int32_t, std::string>;

class LeftoverSubscriptionsTest : public SimLinkRig {
 protected:
  Journal journalOf(const FakeXPlane& sim, const JournalOwner& owner) const {
    return *Journal(journalPath(folder_, "127.0.0.1", sim.port()), owner)
                .ofSubscriptions({kLoopbackAddress, sim.port()});
  }
  static JournalOwner killed(const std::string& node) {
    JournalOwner owner = thisProcess(node);
    owner.start_ticks += 1;
    return owner;
  }
  /// What X-Plane sends to this port.
  static Indices sentTo(const FakeXPlane& sim, std::uint16_t port) {
    const auto found = sim.subscriptions.find({INADDR_LOOPBACK, port});
    return found == sim.subscriptions.end() ? Indices() : found->second;
  }
  /// A port that no program has.
  static std::uint16_t freePort() { return UdpSocket(UdpSocketOptions()).localPort(); }
};

TEST_F(LeftoverSubscriptionsTest, JournalNamesEveryPortWhileTheLinkLives) {
  FakeXPlane sim;
  sim.datarefs["a/b"] = 1.0F;
  makeLink(optionsFor(sim));
  const int id = subscribe({"test", {"a/b", "c/d"}, 50, 0});
  link_->setRposRate(20);
  ASSERT_GE(runUntil([&] { return datagrams_[id] > 0 && rpos_datagrams_ > 0; }, 1.0, {&sim}), 0.0);
  const std::vector<JournalEntry> entries = journalOf(sim, thisProcess("/test")).own();
  ASSERT_EQ(entries.size(), 1U);
  EXPECT_TRUE(Journal(journalPath(folder_, "127.0.0.1", sim.port()), thisProcess("/test")).entries().empty())
      << "a file of their own: what is to be undone at once is not behind them";
  EXPECT_EQ(entries[0].purpose, kSubscriptionsPurpose);
  ASSERT_EQ(entries[0].subscriptions.size(), 3U) << "the link's own, the group, the position";
  for (const JournalSubscription& each : entries[0].subscriptions) {
    if (each.rpos) {
      EXPECT_EQ(sim.rpos_clients, (std::set<FakeXPlane::Address>{{INADDR_LOOPBACK, each.port}}));
      continue;
    }
    Indices expected;
    for (std::size_t i = 0; i < each.datarefs.size(); ++i) {
      expected[static_cast<std::int32_t>(i)] = each.datarefs[i];
    }
    EXPECT_EQ(sentTo(sim, each.port), expected);
  }
  subscriptions_.clear();
  run(0.2, {&sim});
  EXPECT_EQ(journalOf(sim, thisProcess("/test")).own()[0].subscriptions.size(), 2U);
  EXPECT_TRUE(link_->stop(1.0));
  EXPECT_TRUE(journalOf(sim, thisProcess("/test")).entries().empty());
}

TEST_F(LeftoverSubscriptionsTest, WhatAKilledRunOfTheSameNodeHasLeftIsEnded) {
  FakeXPlane sim;
  sim.datarefs["a/b"] = sim.datarefs["c/d"] = 1.0F;
  const std::uint16_t port = freePort(), rpos_port = freePort(), others_port = freePort();
  sim.subscriptions[{INADDR_LOOPBACK, port}] = {{0, "a/b"}, {1, "c/d"}};
  sim.subscriptions[{INADDR_LOOPBACK, others_port}] = {{0, "a/b"}};
  sim.rpos_clients.insert({INADDR_LOOPBACK, rpos_port});
  journalOf(sim, killed("/test"))
      .record("subscriptions:/test:1", kSubscriptionsPurpose, {},
              {{port, {"a/b", "c/d"}, false}, {rpos_port, {}, true}});
  journalOf(sim, killed("/other"))
      .record("subscriptions:/other:2", kSubscriptionsPurpose, {}, {{others_port, {"a/b"}}});
  makeLink(optionsFor(sim));
  ASSERT_GE(runUntil([&] { return sentTo(sim, port).empty() && sim.rpos_clients.empty(); }, 1.0, {&sim}), 0.0);
  EXPECT_EQ(sentTo(sim, others_port), (Indices{{0, "a/b"}})) << "another node's, which ends it itself";
  run(3.0, {&sim});
  const std::vector<JournalEntry> entries = journalOf(sim, thisProcess("/test")).entries();
  ASSERT_EQ(entries.size(), 2U);
  EXPECT_EQ(entries[0].id, "subscriptions:/other:2");
  EXPECT_EQ(entries[1].owner, thisProcess("/test")) << "this run's own";
  UdpSocketOptions again;
  again.bind_port = port;
  EXPECT_NO_THROW(UdpSocket{again}) << "the port is given back";
}

TEST_F(LeftoverSubscriptionsTest, LostRequestsAreSentAgain) {
  FakeXPlane sim;
  sim.datarefs["a/b"] = 1.0F;
  const std::uint16_t port = freePort();
  sim.subscriptions[{INADDR_LOOPBACK, port}] = {{0, "a/b"}};
  journalOf(sim, killed("/test")).record("subscriptions:/test:1", kSubscriptionsPurpose, {}, {{port, {"a/b"}}});
  makeLink(optionsFor(sim));
  ASSERT_GE(runUntil([&] { return sentTo(sim, port).empty(); }, 1.0, {&sim}), 0.0);
  sim.subscriptions[{INADDR_LOOPBACK, port}] = {{0, "a/b"}};  // as if the request had not arrived
  EXPECT_GE(runUntil([&] { return sentTo(sim, port).empty(); }, 3.0, {&sim}), 0.0);
}

TEST_F(LeftoverSubscriptionsTest, WhatWasBeingReadEndsThoughNoJournalHasIt) {
  constexpr std::int32_t kReadIndex = 1000;
  FakeXPlane sim;
  sim.datarefs["a/b"] = 1.0F;
  const std::uint16_t port = freePort();
  sim.subscriptions[{INADDR_LOOPBACK, port}] = {{0, "a/b"}, {kReadIndex, "a/b"}, {kReadIndex + 63, "a/b"}};
  journalOf(sim, killed("/test")).record("subscriptions:/test:1", kSubscriptionsPurpose, {}, {{port, {"a/b"}}});
  makeLink(optionsFor(sim));
  EXPECT_GE(runUntil([&] { return sentTo(sim, port).empty(); }, 4.0, {&sim}), 0.0);
  run(3.0, {&sim});
  const std::vector<JournalEntry> entries = journalOf(sim, thisProcess("/test")).entries();
  ASSERT_EQ(entries.size(), 1U);
  EXPECT_EQ(entries[0].owner, thisProcess("/test")) << "this run's own";
}

TEST_F(LeftoverSubscriptionsTest, APortThatAnotherProgramHasNowIsSaid) {
  FakeXPlane sim;
  const UdpSocket taken{UdpSocketOptions()};
  journalOf(sim, killed("/test"))
      .record("subscriptions:/test:1", kSubscriptionsPurpose, {}, {{taken.localPort(), {"a/b"}}});
  makeLink(optionsFor(sim));
  run(1.0, {&sim});
  EXPECT_TRUE(std::any_of(log_.begin(), log_.end(), [&](const std::string& line) {
    return line.find("cannot be ended") != std::string::npos &&
           line.find(std::to_string(taken.localPort())) != std::string::npos;
  }));
  EXPECT_EQ(link_->status().state, LinkState::kConnected);
}

}  // namespace
}  // namespace xplane_bridge::core
