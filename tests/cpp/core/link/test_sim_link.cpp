#include "xplane_bridge/core/link/sim_link.hpp"

#include <gtest/gtest.h>
#include <poll.h>

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

TEST_F(ThreadedSimLink, IsSteppedByOthersWhenItsDescriptorIsReadable) {
  ASSERT_GE(link_->fd(), 0);
  link_->startDriven();
  EXPECT_THROW(link_->start(), std::logic_error);
  std::atomic<bool> over{false};
  std::thread stepping([&] {
    while (!over) {
      pollfd readable{link_->fd(), POLLIN, 0};
      const bool due = poll(&readable, 1, link_->patienceMs()) == 0 || link_->receive();
      if (due) link_->step(0);
    }
  });
  EXPECT_EQ(link_->read({"sim/version/xplane_internal_version"}, 5.0)[0], 115501.0F);
  over = true;
  stepping.join();
  EXPECT_TRUE(link_->stop(2.0));
  EXPECT_THROW(link_->read({"a/b"}, 0.1), std::logic_error) << "nothing would ever come";
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

TEST_F(ThreadedSimLink, EndsItsSubscriptionsAtThePaceOfSlowFrames) {
  sim_.stopThread();
  sim_.datarefs["sim/operation/misc/frame_rate_period"] = 0.05F;
  RrefGroup many{"many", {}, kEveryFrameRateHz, 0};
  for (int i = 0; i < 170; ++i) {
    many.datarefs.push_back("x/y[" + std::to_string(i) + "]");
    sim_.datarefs[many.datarefs.back()] = 1.0F;
  }
  sim_.startThread();
  std::atomic<bool> complete{false};
  const Subscription subscription =
      link_->subscribe(many, [&](const RrefView& view, const ReceiveInfo&) { complete = view.size() == 170; });
  link_->start();
  ASSERT_TRUE(link_->waitUntil([&] { return complete.load(); }, 10.0));
  EXPECT_TRUE(link_->stop(0.1)) << "far less than 5 batches, 2 frames of 50 ms apart";
  sim_.stopThread();
  for (const auto& [client, indices] : sim_.subscriptions) {
    EXPECT_TRUE(indices.empty()) << indices.size() << " are left";
  }
}

TEST_F(ThreadedSimLink, StopsAlsoWhenNoXPlaneAnswers) {
  link_->start();
  sim_.stopThread();
  link_->stop(0.5);
  EXPECT_THROW(link_->read({"a/b"}, 0.1), std::logic_error);
}

}  // namespace
}  // namespace xplane_bridge::core
