#include "xplane_bridge/core/link/sim_link.hpp"

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

namespace xplane_bridge::core {
namespace {

class SimLinkTest : public SimLinkRig {
 protected:
  static RrefGroup group(std::vector<std::string> datarefs) { return {"test", std::move(datarefs), 50, 0}; }
};

// ------------------------------------------------------------------------------------------------ coming up

TEST_F(SimLinkTest, ConnectsAndDeliversAGroup) {
  FakeXPlane sim;
  sim.datarefs["a/b"] = 1.5F;
  sim.datarefs["c/d[2]"] = -2.5F;
  makeLink(optionsFor(sim));
  const int id = subscribe(group({"a/b", "c/d[2]"}));
  EXPECT_EQ(link_->status().state, LinkState::kSearching);
  EXPECT_TRUE(std::isnan(link_->status().silence_s));
  ASSERT_GE(runUntil([&] { return datagrams_[id] > 0; }, 1.0, {&sim}), 0.0);
  EXPECT_EQ((values_[{id, 0}]), 1.5F);
  EXPECT_EQ((values_[{id, 1}]), -2.5F);
  run(0.1, {&sim});
  const LinkStatus status = link_->status();
  EXPECT_EQ(status.state, LinkState::kConnected);
  EXPECT_EQ(status.epoch, 1U);
  EXPECT_EQ(status.peer, (Endpoint{kLoopbackAddress, sim.port()}));
  EXPECT_EQ(status.version.number, 115501);
  EXPECT_EQ(status.paused, false);
  EXPECT_GT(status.sim_time_s.value_or(0.0F), 100.0F);
  EXPECT_TRUE(status.problems.empty());
  EXPECT_TRUE(last_info_.kernel_stamp);
  EXPECT_EQ(last_info_.link_epoch, 1U);
  EXPECT_EQ(states_, (std::vector<LinkState>{LinkState::kSearching, LinkState::kConnected}));
}

TEST_F(SimLinkTest, ComesUpWhenXPlaneStartsLater) {
  auto sim = std::make_unique<FakeXPlane>();
  const std::uint16_t port = sim->port();
  makeLink(optionsFor(*sim));
  sim.reset();
  const int id = subscribe(group({"a/b"}));
  run(5.1, {});
  EXPECT_EQ(link_->status().state, LinkState::kSearching);
  EXPECT_TRUE(hasProblem("nothing listens on the port")) << "loopback refuses, and that is worth saying";
  FakeXPlane late(port);
  late.datarefs["a/b"] = 3.0F;
  const double took = runUntil([&] { return datagrams_[id] > 0; }, 2.0, {&late});
  EXPECT_GE(took, 0.0);
  EXPECT_LE(took, 1.0);
  run(0.1, {&late});
  EXPECT_TRUE(link_->status().problems.empty());
}

TEST_F(SimLinkTest, ZerosBeforeAFlightIsLoadedAreNoVersion) {
  FakeXPlane sim;
  sim.datarefs["sim/version/xplane_internal_version"] = 0.0F;
  sim.datarefs["sim/time/total_running_time_sec"] = 0.0F;
  makeLink(optionsFor(sim));
  ASSERT_GE(runUntilState(LinkState::kConnected, 1.0, {&sim}), 0.0);
  EXPECT_FALSE(link_->status().version.known());
  sim.datarefs["sim/version/xplane_internal_version"] = 122015.0F;
  run(0.2, {&sim});
  EXPECT_EQ(link_->status().version.number, 122015);
}

TEST_F(SimLinkTest, UnresolvableHostIsSaid) {
  SimLinkOptions options;
  options.host = "no-such-host.invalid";
  options.listen_for_beacon = false;
  makeLink(options);
  run(0.1, {});
  EXPECT_EQ(link_->status().state, LinkState::kSearching);
  EXPECT_TRUE(hasProblem("'no-such-host.invalid'"));
  EXPECT_EQ(link_->write("a/b", 1.0F), SendStatus::kNoPeer);
}

TEST_F(SimLinkTest, BadOptionsAreRefused) {
  const auto refused = [this](const std::function<void(SimLinkOptions*)>& spoil) {
    SimLinkOptions options;
    options.host = "127.0.0.1";
    spoil(&options);
    EXPECT_THROW(makeLink(options), std::invalid_argument);
  };
  refused([](SimLinkOptions* o) { o->port = 0; });
  refused([](SimLinkOptions* o) { o->stale_after_s = -1.0; });
  refused([](SimLinkOptions* o) { o->lost_after_s = o->stale_after_s / 2.0; });
  refused([](SimLinkOptions* o) { o->data_output.port = 49001; });
  refused([](SimLinkOptions* o) { o->data_output.rows = {200}; });
  refused([](SimLinkOptions* o) { o->rpos_rate_hz = -1; });
  refused([](SimLinkOptions* o) {
    o->host.clear();
    o->listen_for_beacon = false;
  });
}

// ------------------------------------------------------------------------------------------------ silence and return

TEST_F(SimLinkTest, GapIsStaleAndNothingIsForgotten) {
  FakeXPlane sim;
  sim.datarefs["a/b"] = 1.0F;
  makeLink(optionsFor(sim));
  const int id = subscribe(group({"a/b"}));
  ASSERT_GE(runUntil([&] { return datagrams_[id] > 0; }, 1.0, {&sim}), 0.0);
  const double noticed = runUntilState(LinkState::kStale, 2.0, {});
  EXPECT_GT(noticed, 0.3);
  EXPECT_LE(noticed, 0.5);
  run(4.0, {});
  EXPECT_EQ(link_->status().state, LinkState::kStale);
  EXPECT_NEAR(link_->status().silence_s, 4.0 + noticed, 0.2);
  const int before = datagrams_[id];
  const double back = runUntil([&] { return datagrams_[id] > before; }, 2.0, {&sim});
  EXPECT_GE(back, 0.0);
  EXPECT_LE(back, 0.1) << "the subscription is still alive in X-Plane";
  run(0.1, {&sim});
  EXPECT_EQ(link_->status().state, LinkState::kConnected);
  EXPECT_EQ(link_->status().epoch, 1U);
}

TEST_F(SimLinkTest, RestartedXPlaneIsAskedAgain) {
  FakeXPlane sim;
  sim.datarefs["a/b"] = 1.0F;
  makeLink(optionsFor(sim));
  const int id = subscribe(group({"a/b"}));
  ASSERT_GE(runUntil([&] { return datagrams_[id] > 0; }, 1.0, {&sim}), 0.0);
  ASSERT_GE(runUntilState(LinkState::kStale, 2.0, {}), 0.0);
  sim.restart();
  sim.datarefs["a/b"] = 2.0F;
  const int before = datagrams_[id];
  const double back = runUntil([&] { return datagrams_[id] > before; }, 2.0, {&sim});
  EXPECT_GE(back, 0.0);
  EXPECT_LE(back, 1.0);
  EXPECT_EQ((values_[{id, 0}]), 2.0F);
  run(0.2, {&sim});
  EXPECT_EQ(link_->status().epoch, 2U) << "simulator time went back: another run of X-Plane";
}

TEST_F(SimLinkTest, RestartWithoutSilenceIsNoticedBySimulatorTime) {
  FakeXPlane sim;
  sim.datarefs["a/b"] = 1.0F;
  sim.datarefs["c/d"] = 1.0F;
  makeLink(optionsFor(sim));
  const int first = subscribe(group({"a/b"}));
  ASSERT_GE(runUntil([&] { return datagrams_[first] > 0; }, 1.0, {&sim}), 0.0);
  run(0.5, {&sim});
  // The link's own subscription survives (asked for by a quick client), the group's does not.
  auto kept = sim.subscriptions;
  sim.restart();
  for (auto& [client, indices] : kept) {
    if (indices.count(2) != 0) {
      sim.subscriptions[client] = indices;
    }
  }
  const int before = datagrams_[first];
  const double back = runUntil([&] { return datagrams_[first] > before; }, 2.0, {&sim});
  EXPECT_GE(back, 0.0);
  EXPECT_LE(back, 0.2);
  EXPECT_EQ(link_->status().epoch, 2U);
}

TEST_F(SimLinkTest, LostAfterLongSilenceAndNewEpochOnReturn) {
  FakeXPlane sim;
  SimLinkOptions options = optionsFor(sim);
  options.lost_after_s = 3.0;
  makeLink(options);
  ASSERT_GE(runUntilState(LinkState::kConnected, 1.0, {&sim}), 0.0);
  const double lost = runUntilState(LinkState::kLost, 10.0, {});
  EXPECT_NEAR(lost, 3.0, 0.1);
  const double back = runUntilState(LinkState::kConnected, 2.0, {&sim});
  EXPECT_GE(back, 0.0);
  EXPECT_LE(back, 1.0);
  EXPECT_EQ(link_->status().epoch, 2U);
  EXPECT_EQ(states_, (std::vector<LinkState>{LinkState::kSearching, LinkState::kConnected, LinkState::kStale,
                                             LinkState::kLost, LinkState::kConnected}));
}

TEST_F(SimLinkTest, PauseIsAState) {
  FakeXPlane sim;
  makeLink(optionsFor(sim));
  ASSERT_GE(runUntilState(LinkState::kConnected, 1.0, {&sim}), 0.0);
  sim.datarefs["sim/time/paused"] = 1.0F;
  EXPECT_GE(runUntilState(LinkState::kPaused, 0.5, {&sim}), 0.0);
  sim.datarefs["sim/time/paused"] = 0.0F;
  EXPECT_GE(runUntilState(LinkState::kConnected, 0.5, {&sim}), 0.0);
  EXPECT_EQ(link_->status().epoch, 1U);
}

// ------------------------------------------------------------------------------------------------ beacons

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

// ------------------------------------------------------------------------------------------------ subscriptions

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

// ------------------------------------------------------------------------------------------------ hostile input

TEST_F(SimLinkTest, MalformedDatagramsAreCountedByReason) {
  FakeXPlane sim;
  makeLink(optionsFor(sim));
  ASSERT_GE(runUntilState(LinkState::kConnected, 1.0, {&sim}), 0.0);
  const FakeXPlane::Address client = sim.subscriptions.begin()->first;
  sim.send(client, {'R', 'R'});
  sim.send(client, {'R', 'R', 'E', 'F', ',', 1, 2, 3});
  sim.send(client, {'R', 'R', 'E', 'F', ',', 1, 0, 0, 0, 0, 0, 0, 0, 9});
  sim.send(client, {'R', 'A', 'D', 'R', '5', 1, 0, 0, 0, 0, 0, 0, 0});
  sim.send(client, {'R', 'R', 'E', 'F', ',', 99, 0, 0, 0, 0, 0, 0, 0});
  run(0.1, {&sim});
  const LinkCounters counters = link_->counters();
  const auto errors = [&counters](DecodeError error) {
    return counters.decode_errors[static_cast<std::size_t>(error)];
  };
  EXPECT_EQ(errors(DecodeError::kTooShort), 1U);
  EXPECT_EQ(errors(DecodeError::kBadLength), 1U);
  EXPECT_EQ(errors(DecodeError::kUnknownLabel), 2U) << "RADR, and what is no message at all";
  EXPECT_EQ(counters.unknown_indices, 1U);
  EXPECT_EQ(link_->status().state, LinkState::kConnected);
}

TEST_F(SimLinkTest, StrangersAreCountedAndDropped) {
  FakeXPlane stranger;
  SimLinkOptions options;
  options.host = "192.0.2.1";  // an address that never exists (RFC 5737)
  options.listen_for_beacon = false;
  options.data_output.enabled = true;
  options.data_output.port = 0;
  options.data_output.rows = {3};
  makeLink(options);
  run(0.1, {});
  std::vector<std::uint8_t> data = {'D', 'A', 'T', 'A', '*'};
  data.resize(41);
  stranger.send({INADDR_LOOPBACK, link_->dataPort()}, data);
  run(0.1, {});
  EXPECT_EQ(link_->counters().strangers, 1U);
  EXPECT_EQ(data_datagrams_, 0);
  EXPECT_EQ(link_->status().state, LinkState::kSearching);
}

// ------------------------------------------------------------------------------------------------ reads and writes

TEST_F(SimLinkTest, SendersReachXPlane) {
  FakeXPlane sim;
  makeLink(optionsFor(sim));
  ASSERT_GE(runUntilState(LinkState::kConnected, 1.0, {&sim}), 0.0);
  sim.takeRequests();
  EXPECT_EQ(link_->write("w/x", 0.25F), SendStatus::kSent);
  EXPECT_EQ(link_->command("sim/operation/pause_toggle"), SendStatus::kSent);
  EXPECT_EQ(link_->sendUndo(UndoData{{25, {0.5F}}}), SendStatus::kSent);
  EXPECT_EQ(link_->sendUndo(UndoUsel{{3}}), SendStatus::kSent);
  EXPECT_EQ(link_->write("", 0.25F), SendStatus::kNotEncoded);
  EXPECT_EQ(link_->write("w/x", NAN), SendStatus::kNotEncoded);
  sim.labels.clear();
  sim.takeRequests();
  EXPECT_EQ(sim.labels, (std::vector<std::string>{"DREF", "CMND", "DATA", "USEL"}));
  EXPECT_EQ(sim.datarefs["w/x"], 0.25F);
  EXPECT_EQ(sim.commands, std::vector<std::string>{"sim/operation/pause_toggle"});
}

TEST_F(SimLinkTest, ReadsOnceAndUnsubscribes) {
  FakeXPlane sim;
  sim.datarefs["r/1"] = 11.0F;
  makeLink(optionsFor(sim));
  ASSERT_GE(runUntilState(LinkState::kConnected, 1.0, {&sim}), 0.0);
  std::optional<std::vector<DatarefValue>> values;
  link_->read({"r/1", "no/such"}, 0.5, [&](const std::vector<DatarefValue>& read) { values = read; });
  const double took = runUntil([&] { return values.has_value(); }, 2.0, {&sim});
  EXPECT_NEAR(took, 0.5, 0.02) << "one does not answer: the deadline ends it";
  ASSERT_EQ(values->size(), 2U);
  EXPECT_EQ((*values)[0], 11.0F);
  EXPECT_FALSE((*values)[1].has_value());
  run(0.1, {&sim});
  for (const auto& [client, indices] : sim.subscriptions) {
    EXPECT_LE(indices.size(), 4U) << "only the link's own";
  }
  values.reset();
  sim.datarefs["r/1"] = 12.0F;
  link_->read({"r/1"}, 0.5, [&](const std::vector<DatarefValue>& read) { values = read; });
  EXPECT_LE(runUntil([&] { return values.has_value(); }, 2.0, {&sim}), 0.1);
  EXPECT_EQ((*values)[0], 12.0F) << "the present value, not one of the read before";
  EXPECT_THROW(link_->read({""}, 0.5, [](const std::vector<DatarefValue>&) {}), std::invalid_argument);
}

TEST_F(SimLinkTest, WaitingNeedsTheThread) {
  FakeXPlane sim;
  makeLink(optionsFor(sim));
  EXPECT_THROW(link_->read({"a/b"}, 0.1), std::logic_error);
}

/// The link in its own thread under the real clock, and a fake X-Plane in another.
class ThreadedSimLink : public testing::Test {
 protected:
  ThreadedSimLink() {
    SimLinkOptions options;
    options.host = "127.0.0.1";
    options.port = sim_.port();
    options.listen_for_beacon = false;
    link_ = std::make_unique<SimLink>(options, SimLinkCallbacks{}, hostClock(), LogFunction{});
    sim_.startThread();
  }
  ~ThreadedSimLink() override { link_.reset(); }

  FakeXPlane sim_;
  std::unique_ptr<SimLink> link_;
};

TEST_F(ThreadedSimLink, WritesAreReadBack) {
  link_->start();
  EXPECT_THROW(link_->start(), std::logic_error);
  const std::vector<DatarefValue> version = link_->read({"sim/version/xplane_internal_version"}, 5.0);
  ASSERT_EQ(version.size(), 1U);
  EXPECT_EQ(version[0], 115501.0F);
  ASSERT_EQ(link_->write("w/x", 0.75F), SendStatus::kSent);
  const auto [fits, value] = link_->waitForDataref("w/x", 0.75F, 1e-6F, 5.0);
  EXPECT_TRUE(fits);
  EXPECT_EQ(value, 0.75F);
  EXPECT_FALSE(link_->waitForDataref("w/x", 0.0F, 1e-6F, 0.2).first);
  EXPECT_TRUE(link_->undo({UndoDref{"w/x", 0.0F}, UndoUsel{{4}}}, 5.0));
  EXPECT_EQ(link_->read({"w/x"}, 5.0)[0], 0.0F);
  EXPECT_FALSE(link_->read({"no/such"}, 0.1)[0].has_value());
  EXPECT_TRUE(link_->stop(2.0));
  EXPECT_TRUE(link_->stop(2.0)) << "again is harmless";
}

TEST_F(ThreadedSimLink, WaitsForACondition) {
  EXPECT_THROW(link_->waitUntil([] { return true; }, 0.1), std::logic_error) << "nothing would ever come";
  std::atomic<int> datagrams{0};
  const Subscription counting = link_->subscribe({"test", {"sim/time/paused"}, kEveryFrameRateHz, 0},
                                                 [&](const RrefView&, const ReceiveInfo&) { ++datagrams; });
  link_->start();
  EXPECT_TRUE(link_->waitUntil([&] { return datagrams >= 3; }, 5.0));
  EXPECT_FALSE(link_->waitUntil([] { return false; }, 0.05));
  link_->stop(2.0);
}

TEST_F(ThreadedSimLink, StopsAlsoWhenNoXPlaneAnswers) {
  link_->start();
  sim_.stopThread();
  link_->stop(0.5);
  EXPECT_THROW(link_->read({"a/b"}, 0.1), std::logic_error);
}

}  // namespace
}  // namespace xplane_bridge::core
