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

#include "sim_link_rig.hpp"
#include "xplane_bridge/core/link/sim_link.hpp"

namespace xplane_bridge::core {
namespace {

TEST_F(SimLinkTest, NeverAnsweringDatarefIsNamed) {
  FakeXPlane sim;
  sim.datarefs["a/b"] = 1.0F;
  makeLink(optionsFor(sim));
  const int id = subscribe(group({"a/b", "no/such/dataref"}));
  ASSERT_GE(runUntil([&] { return datagrams_[id] > 0; }, 1.0, {&sim}), 0.0);
  EXPECT_TRUE(link_->unansweredDatarefs().empty()) << "too early to say";
  run(6.0, {&sim});
  EXPECT_EQ(link_->unansweredDatarefs(), std::vector<std::string>{"no/such/dataref"});
  EXPECT_EQ(link_->status().state, LinkState::kConnected);
  sim.datarefs["no/such/dataref"] = 7.0F;  // a plugin was loaded
  run(0.1, {&sim});
  EXPECT_TRUE(link_->unansweredDatarefs().empty());
}

TEST_F(SimLinkTest, AGroupThatEndsInAHitchIsEndedInXPlaneAfterIt) {
  FakeXPlane sim;
  sim.datarefs["a/b"] = sim.datarefs["c/d"] = 1.0F;
  makeLink(optionsFor(sim));
  const auto sent = [&sim] {
    std::size_t datarefs = 0;
    for (const auto& [client, indices] : sim.subscriptions) datarefs += indices.size();
    return datarefs;
  };
  subscribe(group({"a/b"}));
  const int other = subscribe(group({"c/d"}));
  ASSERT_GE(runUntil([&] { return datagrams_[other] > 0; }, 1.0, {&sim}), 0.0);
  const std::size_t before = sent();
  ASSERT_GE(runUntilState(LinkState::kStale, 2.0, {}), 0.0);
  subscriptions_[0].reset();
  subscribe(group({"e/f"}));  // and one that X-Plane never hears of
  subscriptions_[2].reset();
  run(0.1, {});
  EXPECT_EQ(sent(), before);
  run(1.0, {&sim});
  EXPECT_EQ(sent(), before - 1);
  link_->stop(1.0);
  sim.pump();
  EXPECT_EQ(sent(), 0U);
}

TEST_F(SimLinkTest, StoppedInALongSilenceItsSubscriptionsStayInTheJournal) {
  FakeXPlane sim;
  sim.datarefs["a/b"] = 1.0F;
  makeLink(optionsFor(sim));
  const int id = subscribe(group({"a/b"}));
  ASSERT_GE(runUntil([&] { return datagrams_[id] > 0; }, 1.0, {&sim}), 0.0);
  run(0.2, {&sim});
  ASSERT_GE(runUntilState(LinkState::kLost, 20.0, {}), 0.0);  // loading a flight takes longer at times
  link_->stop(1.0);
  EXPECT_EQ(link_->journal()->ofSubscriptions(link_->status().peer)->entries().size(), 1U);
}

TEST_F(SimLinkTest, LostRequestIsRepeated) {
  FakeXPlane sim;
  sim.datarefs["a/b"] = 1.0F;
  sim.datarefs["c/d"] = 1.0F;
  makeLink(optionsFor(sim));
  const int id = subscribe(group({"a/b", "c/d"}));
  ASSERT_GE(runUntil([&] { return datagrams_[id] > 0; }, 1.0, {&sim}), 0.0);
  for (auto& [client, indices] : sim.subscriptions) {
    if (indices.size() == 2) {
      indices.erase(1);
    }
  }
  values_.clear();
  const double took = runUntil([&] { return values_.count({id, 1}) != 0; }, 3.0, {&sim});
  EXPECT_GE(took, 0.0);
  EXPECT_LE(took, 0.7);
}

TEST_F(SimLinkTest, RequestsArePaced) {
  FakeXPlane sim;
  std::vector<std::string> many;
  for (int i = 0; i < 350; ++i) {
    many.push_back("x/y[" + std::to_string(i) + "]");
    sim.datarefs[many.back()] = static_cast<float>(i);
  }
  makeLink(optionsFor(sim));
  const int big = subscribe(group(many));
  const double took = runUntil([&] { return values_.count({big, 349}) != 0; }, 3.0, {&sim});
  EXPECT_GE(took, 0.2) << "10 batches, 2 frames of 15 ms apart";
  EXPECT_LE(took, 0.5);
  EXPECT_LE(most_requests_, 38U);
  // Further apart where frames are longer.
  sim.datarefs["sim/operation/misc/frame_rate_period"] = 0.05F;
  run(0.3, {&sim});
  RrefGroup second = group(many);
  const int slow = subscribe(second);
  const double took_longer = runUntil([&] { return values_.count({slow, 349}) != 0; }, 3.0, {&sim});
  EXPECT_GE(took_longer, 0.75) << "10 batches, 2 frames of 50 ms apart, less 20 %";
  EXPECT_LE(took_longer, 1.3);
}

TEST_F(SimLinkTest, FlightGroupComesFirstAndThreeNodesLoseNoRequest) {
  FakeXPlane sim;
  sim.datarefs["x/y"] = 1.0F;
  const auto datarefs = [&sim](const std::string& name, int count) {
    std::vector<std::string> paths;
    for (int i = 0; i < count; ++i) {
      paths.push_back(name + "[" + std::to_string(i) + "]");
      sim.datarefs[paths.back()] = static_cast<float>(i);
    }
    return paths;
  };
  makeLink(optionsFor(sim));  // as rx_node
  const int mission = subscribe({"mission", datarefs("mission/x", 300), 20, 0});
  const int flight = subscribe({"flight", datarefs("flight/x", 66), kEveryFrameRateHz, kUrgentPriority});
  // As tx_node and capture_node, of the same clock.
  std::vector<std::unique_ptr<SimLink>> others;
  std::vector<Subscription> theirs;
  for (const int count : {540, 100}) {
    others.push_back(std::make_unique<SimLink>(optionsFor(sim), SimLinkCallbacks{}, clock(), LogFunction{}));
    theirs.push_back(others.back()->subscribe({"slow", datarefs("slow/x", count), 20, 1}, [](auto&&...) {}));
  }
  std::size_t missions_before_flight = 0;
  const bool complete = runUntil(
                            [&] {
                              for (const auto& other : others) {
                                other->step(0);
                              }
                              const auto got = [this](int id, int last) { return values_.count({id, last}) != 0; };
                              if (!got(flight, 65)) {
                                missions_before_flight = static_cast<std::size_t>(got(mission, 0));
                              }
                              return got(mission, 299);
                            },
                            3.0, {&sim}) >= 0.0;
  EXPECT_TRUE(complete);
  EXPECT_EQ(missions_before_flight, 0U) << "the flight group is asked for before all others";
  runUntil(
      [&] {
        for (const auto& other : others) {
          other->step(0);
        }
        return false;
      },
      0.6, {&sim});
  EXPECT_EQ(sim.lost_requests, 0U);
  EXPECT_GT(most_requests_, 100U) << "the nodes ask in the same frames";
}

TEST_F(SimLinkTest, ALongReadInVainLeavesTheNextItsTurn) {
  FakeXPlane sim;
  makeLink(optionsFor(sim));
  ASSERT_GE(runUntilState(LinkState::kConnected, 1.0, {&sim}), 0.0);
  std::size_t answered = 0;
  link_->read(std::vector<std::string>(1024, "no/such/dataref"), 2.0,
              [&](const std::vector<DatarefValue>& values) { answered = values.size(); });
  ASSERT_GE(runUntil([&] { return answered > 0; }, 2.1, {&sim}), 0.0);
  for (int k = 0; k < 3; ++k) {
    DatarefValue paused;
    link_->read({"sim/time/paused"}, 1.0, [&](const std::vector<DatarefValue>& values) { paused = values[0]; });
    run(0.2, {&sim});
    EXPECT_EQ(paused, 0.0F);
  }
  run(1.0, {&sim});
  std::size_t left = 0;
  for (const auto& [client, indices] : sim.subscriptions) left += indices.size();
  EXPECT_EQ(left, 4U) << "the link's own";
}

TEST_F(SimLinkTest, ReplacedGroupDeliversOnlyTheNewList) {
  FakeXPlane sim;
  sim.datarefs["a/b"] = 1.0F;
  sim.datarefs["c/d"] = 2.0F;
  makeLink(optionsFor(sim));
  const int id = subscribe(group({"a/b", "a/b"}));
  ASSERT_GE(runUntil([&] { return datagrams_[id] > 0; }, 1.0, {&sim}), 0.0);
  subscriptions_[0].replace(group({"c/d"}));
  link_->step(0);
  values_.clear();
  ASSERT_GE(runUntil([&] { return values_.count({id, 0}) != 0; }, 1.0, {&sim}), 0.0);
  EXPECT_EQ((values_[{id, 0}]), 2.0F);
  run(0.5, {&sim});
  EXPECT_EQ(values_.count({id, 1}), 0U);
  std::size_t subscribed = 0;
  for (const auto& [client, indices] : sim.subscriptions) {
    subscribed += indices.size();
  }
  EXPECT_EQ(subscribed, 5U) << "the old list has been stopped: 4 of the link itself and 1";
}

TEST_F(SimLinkTest, RemovedGroupIsStopped) {
  FakeXPlane sim;
  sim.datarefs["a/b"] = 1.0F;
  makeLink(optionsFor(sim));
  const int id = subscribe(group({"a/b"}));
  ASSERT_GE(runUntil([&] { return datagrams_[id] > 0; }, 1.0, {&sim}), 0.0);
  subscriptions_[0].reset();
  run(0.3, {&sim});
  for (const auto& [client, indices] : sim.subscriptions) {
    EXPECT_TRUE(indices.empty() || indices.size() == 4U);
  }
}

TEST_F(SimLinkTest, HandlerMayEndItsSubscription) {
  FakeXPlane sim;
  sim.datarefs["a/b"] = 1.0F;
  makeLink(optionsFor(sim));
  int calls = 0;
  Subscription once = link_->subscribe(group({"a/b"}), [&](const RrefView&, const ReceiveInfo&) {
    ++calls;
    once.reset();
  });
  ASSERT_GE(runUntil([&] { return calls > 0; }, 1.0, {&sim}), 0.0);
  run(0.3, {&sim});
  EXPECT_EQ(calls, 1);
}

TEST_F(SimLinkTest, SubscriptionsMayOutliveTheLink) {
  FakeXPlane sim;
  makeLink(optionsFor(sim));
  const int id = subscribe(group({"a/b"}));
  run(0.1, {&sim});
  link_.reset();
  subscriptions_[static_cast<std::size_t>(id)].replace(group({"c/d"}));
  subscriptions_.clear();
}

TEST_F(SimLinkTest, SplitDatagramsAreAllDelivered) {
  FakeXPlane sim;
  sim.pairs_per_datagram = 2;
  for (const char* path : {"p/0", "p/1", "p/2", "p/3", "p/4"}) {
    sim.datarefs[path] = 1.0F;
  }
  makeLink(optionsFor(sim));
  const int id = subscribe(group({"p/0", "p/1", "p/2", "p/3", "p/4"}));
  ASSERT_GE(runUntil([&] { return values_.count({id, 4}) != 0; }, 1.0, {&sim}), 0.0);
  EXPECT_EQ(values_.size(), 5U);
}

TEST_F(SimLinkTest, BadGroupsAreRefused) {
  FakeXPlane sim;
  makeLink(optionsFor(sim));
  EXPECT_THROW(subscribe(group({})), std::invalid_argument);
  EXPECT_THROW(subscribe(group({""})), std::invalid_argument);
  EXPECT_THROW(subscribe(group({std::string(400, 'x')})), std::invalid_argument);
  RrefGroup slow = group({"a/b"});
  slow.rate_hz = 0;
  EXPECT_THROW(subscribe(slow), std::invalid_argument);
}

TEST_F(SimLinkTest, StopEndsAllSubscriptions) {
  FakeXPlane sim;
  sim.datarefs["a/b"] = 1.0F;
  SimLinkOptions options = optionsFor(sim);
  options.rpos_rate_hz = 20;
  makeLink(options);
  subscribe(group({"a/b"}));
  ASSERT_GE(runUntil([&] { return rpos_datagrams_ > 0 && !datagrams_.empty(); }, 1.0, {&sim}), 0.0);
  EXPECT_TRUE(link_->stop(1.0));
  sim.pump();
  for (const auto& [client, indices] : sim.subscriptions) {
    EXPECT_TRUE(indices.empty());
  }
  EXPECT_TRUE(sim.rpos_clients.empty());
}

TEST_F(SimLinkTest, RposFlowsStopsAndComesBack) {
  FakeXPlane sim;
  makeLink(optionsFor(sim));
  run(0.3, {&sim});
  EXPECT_EQ(rpos_datagrams_, 0);
  link_->setRposRate(30);
  ASSERT_GE(runUntil([&] { return rpos_datagrams_ > 0; }, 1.0, {&sim}), 0.0);
  EXPECT_EQ(last_rpos_.longitude_deg, 127.5);
  EXPECT_EQ(last_rpos_.latitude_deg, 36.25);
  sim.rpos_clients.clear();  // X-Plane has forgotten it
  run(0.05, {&sim});
  const int before = rpos_datagrams_;
  EXPECT_GE(runUntil([&] { return rpos_datagrams_ > before; }, 2.0, {&sim}), 0.0);
  link_->setRposRate(0);
  run(0.1, {&sim});
  EXPECT_TRUE(sim.rpos_clients.empty());
  EXPECT_THROW(link_->setRposRate(-1), std::invalid_argument);
}

TEST_F(SimLinkTest, APositionStreamWhoseEndIsLostIsEndedAgainAndStillAtTheExit) {
  FakeXPlane sim;
  makeLink(optionsFor(sim));
  link_->setRposRate(30);
  ASSERT_GE(runUntil([&] { return rpos_datagrams_ > 0; }, 1.0, {&sim}), 0.0);
  sim.lost_ends["RPOS"] = 1;
  link_->setRposRate(0);
  run(0.5, {&sim});
  EXPECT_EQ(sim.rpos_clients.size(), 1U) << "the end is lost";
  const int delivered = rpos_datagrams_;
  run(1.0, {&sim});
  EXPECT_TRUE(sim.rpos_clients.empty());
  EXPECT_EQ(rpos_datagrams_, delivered) << "what is not wanted is not delivered";
  const auto ends = std::count(sim.labels.begin(), sim.labels.end(), "RPOS");
  run(3.0, {&sim});
  EXPECT_EQ(std::count(sim.labels.begin(), sim.labels.end(), "RPOS"), ends) << "it has ended";
  link_->setRposRate(30);
  ASSERT_GE(runUntil([&] { return rpos_datagrams_ > delivered; }, 1.0, {&sim}), 0.0);
  sim.lost_ends["RPOS"] = 1;
  link_->setRposRate(0);
  run(0.1, {&sim});
  link_->stop(1.0);
  sim.pump();
  EXPECT_TRUE(sim.rpos_clients.empty());
}

TEST_F(SimLinkTest, ALostEndOfASubscriptionIsMadeGood) {
  FakeXPlane sim;
  const auto sent = [&sim] {
    std::size_t datarefs = 0;
    for (const auto& [client, indices] : sim.subscriptions) datarefs += indices.size();
    return datarefs;
  };
  for (const char* path : {"a/b", "c/d", "e/f"}) sim.datarefs[path] = 1.0F;
  makeLink(optionsFor(sim));
  const int id = subscribe(group({"a/b"}));
  const int other = subscribe(group({"c/d", "e/f"}));
  ASSERT_GE(runUntil([&] { return datagrams_[id] > 0 && datagrams_[other] > 0; }, 1.0, {&sim}), 0.0);
  run(0.1, {&sim});
  ASSERT_EQ(sent(), 7U) << "4 of the link itself";
  sim.lost_ends["RREF"] = 1;
  subscriptions_[0].reset();
  run(0.2, {&sim});
  EXPECT_EQ(sent(), 6U);
  link_->stop(1.0);
  sim.pump();
  EXPECT_EQ(sent(), 0U);
  EXPECT_TRUE(link_->journal()->ofSubscriptions(link_->status().peer)->entries().empty());
}

TEST_F(SimLinkTest, XPlaneConnectIsAskedForThePosition) {
  FakeXPlane sim;
  UdpSocket plugin{UdpSocketOptions{}};
  SimLinkOptions options = optionsFor(sim);
  options.xpc_port = plugin.localPort();
  makeLink(options);
  std::vector<std::uint8_t> question(64);
  Received received;
  const auto asked = [&] {
    return plugin.receive({question.data(), question.size()}, &received) == ReceiveStatus::kReceived;
  };
  ASSERT_GE(runUntil(asked, 2.0, {&sim}), 0.0);
  ASSERT_EQ(received.size, 6U);
  EXPECT_EQ(std::string(question.begin(), question.begin() + 4), "GETP");
  EXPECT_EQ(question[5], 0) << "the user's own aircraft";
  std::vector<std::uint8_t> answer(46, 0);
  std::memcpy(answer.data(), "POSI", 4);
  const double latitude = 47.463627123456;
  std::memcpy(&answer[6], &latitude, sizeof latitude);
  plugin.sendTo({answer.data(), answer.size()}, received.from);
  ASSERT_GE(runUntil([&] { return xpc_datagrams_ > 0; }, 1.0, {&sim}), 0.0);
  EXPECT_EQ(last_xpc_.latitude_deg, latitude);
  EXPECT_GE(runUntil([&] { return link_->counters().xpc_datagrams == 1; }, 1.0, {&sim}), 0.0);
  plugin.sendTo({answer.data(), 45}, received.from);
  const auto short_one = [&] {
    const auto errors = link_->counters().decode_errors;
    return std::any_of(errors.begin(), errors.end(), [](std::uint64_t count) { return count > 0; });
  };
  EXPECT_GE(runUntil(short_one, 1.0, {&sim}), 0.0);
  EXPECT_EQ(xpc_datagrams_, 1);
}

}  // namespace
}  // namespace xplane_bridge::core
