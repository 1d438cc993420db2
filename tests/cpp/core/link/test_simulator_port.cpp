#include "xplane_bridge/core/link/simulator_port.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "fake_simulator.hpp"

namespace xplane_bridge::core {
namespace {

using Writes = std::vector<std::pair<std::string, float>>;

/// What the interface does by itself, and that the fake, on which the tests of actuation stand, does what it says.
class SimulatorPortTest : public testing::Test {
 protected:
  Subscription watch(std::vector<std::string> datarefs, std::int32_t rate_hz) {
    return sim_.subscribe({"test", std::move(datarefs), rate_hz, 0},
                          [this](const RrefView& view, const ReceiveInfo& info) {
                            ++datagrams_;
                            last_.clear();
                            for (std::size_t i = 0; i < view.size(); ++i) {
                              last_.emplace_back(view[i].index, view[i].value);
                            }
                            info_ = info;
                          });
  }

  FakeSimulator sim_;
  int datagrams_ = 0;
  std::vector<std::pair<std::int32_t, float>> last_;
  ReceiveInfo info_;
};

TEST_F(SimulatorPortTest, WritesReachTheSimulatorInOrder) {
  sim_.set("a/b", 1.0F);
  EXPECT_EQ(sim_.write("a/b", 2.5F), SendStatus::kSent);
  EXPECT_EQ(sim_.command("sim/operation/pause_toggle"), SendStatus::kSent);
  EXPECT_EQ(sim_.sendUndo(UndoDref{"a/b", 3.0F}), SendStatus::kSent);
  EXPECT_EQ(sim_.sendUndo(UndoUsel{{7}}), SendStatus::kSent);
  EXPECT_EQ(sim_.value("a/b"), 3.0F);
  std::vector<std::string> labels;
  for (const FakeSimulator::Message& message : sim_.messages()) {
    labels.push_back(message.label);
  }
  EXPECT_EQ(labels, (std::vector<std::string>{"DREF", "CMND", "DREF", "USEL"}));
  EXPECT_EQ(sim_.writes(), (Writes{{"a/b", 2.5F}, {"a/b", 3.0F}}));
  EXPECT_EQ(sim_.commands(), std::vector<std::string>{"sim/operation/pause_toggle"});
}

TEST_F(SimulatorPortTest, WhatCannotBeEncodedIsNotSent) {
  EXPECT_EQ(sim_.write("", 1.0F), SendStatus::kNotEncoded);
  EXPECT_EQ(sim_.write("a/b", NAN), SendStatus::kNotEncoded);
  EXPECT_EQ(sim_.command(""), SendStatus::kNotEncoded);
  sim_.forgetPeer();
  EXPECT_EQ(sim_.write("a/b", 1.0F), SendStatus::kNoPeer);
  EXPECT_TRUE(sim_.messages().empty());
  EXPECT_EQ(sim_.journal(), nullptr);
}

TEST_F(SimulatorPortTest, UnknownReadOnlyAndLostWritesChangeNothing) {
  sim_.setAll({"a/b", "c/d"}, 1.0F);
  sim_.setReadOnly("a/b");
  sim_.write("a/b", 2.0F);
  sim_.write("no/such", 2.0F);
  EXPECT_EQ(sim_.value("a/b"), 1.0F);
  EXPECT_THROW(sim_.value("no/such"), std::out_of_range);
  sim_.loseMessages(1);
  sim_.write("c/d", 2.0F);
  EXPECT_EQ(sim_.value("c/d"), 1.0F);
  sim_.write("c/d", 3.0F);
  EXPECT_EQ(sim_.value("c/d"), 3.0F);
  EXPECT_EQ(sim_.writes().size(), 4U);
}

TEST_F(SimulatorPortTest, SubscriptionsComeAtTheirRateWithTheValuesOfTheFrame) {
  sim_.set("a/b", 1.0F);
  const Subscription subscription = watch({"no/such", "a/b"}, 10);
  sim_.frame();
  EXPECT_EQ(last_, (std::vector<std::pair<std::int32_t, float>>{{1, 1.0F}}));
  EXPECT_EQ(info_.steady_ns, sim_.clock().steady_ns());
  EXPECT_EQ(info_.link_epoch, 1U);
  sim_.set("a/b", 2.0F);
  sim_.run(1.0);
  EXPECT_EQ(datagrams_, 11) << "at 10 Hz";
  EXPECT_EQ(last_.front().second, 2.0F);
}

TEST_F(SimulatorPortTest, ReplacedAndEndedSubscriptionsAreNotDelivered) {
  sim_.set("a/b", 1.0F);
  sim_.set("c/d", 2.0F);
  Subscription subscription = watch({"a/b"}, kEveryFrameRateHz);
  subscription.replace({"test", {"c/d"}, kEveryFrameRateHz, 0});
  sim_.frame();
  EXPECT_EQ(last_, (std::vector<std::pair<std::int32_t, float>>{{0, 2.0F}}));
  EXPECT_EQ(sim_.subscribed(), std::multiset<std::string>{"c/d"});
  EXPECT_THROW(subscription.replace({"test", {}, 10, 0}), std::invalid_argument);
  subscription.reset();
  sim_.frame();
  EXPECT_EQ(datagrams_, 1);
  EXPECT_TRUE(sim_.subscribed().empty());
}

TEST_F(SimulatorPortTest, SilentSimulatorDeliversNothing) {
  sim_.set("a/b", 1.0F);
  const Subscription subscription = watch({"a/b"}, kEveryFrameRateHz);
  for (const LinkState state : {LinkState::kStale, LinkState::kLost}) {
    sim_.setState(state);
    sim_.write("a/b", 5.0F);
    sim_.frame();
    EXPECT_EQ(sim_.status().state, state);
  }
  EXPECT_EQ(datagrams_, 0);
  EXPECT_EQ(sim_.value("a/b"), 1.0F);
  sim_.setState(LinkState::kConnected);
  EXPECT_EQ(sim_.status().epoch, 2U) << "came back after LOST";
  sim_.restart();
  EXPECT_EQ(sim_.status().epoch, 3U);
  sim_.setState(LinkState::kPaused);
  sim_.frame();
  EXPECT_EQ(datagrams_, 1) << "a paused X-Plane answers";
}

TEST_F(SimulatorPortTest, WaitingReadsLetFramesPass) {
  sim_.set("a/b", 1.0F);
  const double begin = sim_.time();
  EXPECT_EQ(sim_.read({"a/b"}, 1.0), (std::vector<DatarefValue>{1.0F}));
  EXPECT_NEAR(sim_.time() - begin, FakeSimulator::kFrame, 1e-9);
  EXPECT_EQ(sim_.read({"a/b", "no/such"}, 1.0), (std::vector<DatarefValue>{1.0F, std::nullopt}));
  EXPECT_NEAR(sim_.time() - begin, 1.0 + FakeSimulator::kFrame, 1e-9);
  int frames = 0;
  const Subscription counting =
      sim_.subscribe({"count", {"a/b"}, kEveryFrameRateHz, 0}, [&](const RrefView&, const ReceiveInfo&) {
        if (++frames == 10) {
          sim_.set("a/b", 4.0F);
        }
      });
  EXPECT_EQ(sim_.waitForDataref("a/b", 4.0F, 0.1F, 1.0), std::make_pair(true, DatarefValue(4.0F)));
  EXPECT_EQ(frames, 10);
  EXPECT_EQ(sim_.waitForDataref("a/b", 9.0F, 0.1F, 0.1), std::make_pair(false, DatarefValue(4.0F)));
  EXPECT_EQ(sim_.waitForDataref("no/such", 9.0F, 0.1F, 0.1), std::make_pair(false, DatarefValue()));
}

TEST_F(SimulatorPortTest, WaitsForAConditionFrameByFrame) {
  sim_.set("a/b", 1.0F);
  const Subscription counting = watch({"a/b"}, kEveryFrameRateHz);
  const auto five = [this] { return datagrams_ == 5; };
  EXPECT_TRUE(sim_.waitUntil(five, 1.0));
  const double begin = sim_.time();
  EXPECT_TRUE(sim_.waitUntil(five, 1.0));
  EXPECT_EQ(sim_.time(), begin) << "it was true already";
  EXPECT_FALSE(sim_.waitUntil([] { return false; }, 0.5));
  EXPECT_NEAR(sim_.time() - begin, 0.5, 1e-9);
}

TEST_F(SimulatorPortTest, UndoIsReadBack) {
  sim_.setAll({"a/b", "c/d"}, 1.0F);
  EXPECT_TRUE(sim_.undo({UndoDref{"a/b", 0.0F}, UndoUsel{{4}}}, 1.0));
  EXPECT_EQ(sim_.value("a/b"), 0.0F);
  EXPECT_TRUE(sim_.undo({}, 1.0));
  EXPECT_TRUE(sim_.waitUntilUndone({UndoDref{"a/b", 0.0F}, UndoUsel{{4}}}, 1.0));
  EXPECT_FALSE(sim_.waitUntilUndone({UndoDref{"c/d", 0.0F}}, 1.0)) << "it was not sent";
  sim_.setReadOnly("c/d");
  EXPECT_FALSE(sim_.undo({UndoDref{"a/b", 0.0F}, UndoDref{"c/d", 0.0F}}, 1.0));
  EXPECT_FALSE(sim_.undo({UndoDref{"no/such", 0.0F}}, 1.0));
  sim_.forgetPeer();
  EXPECT_FALSE(sim_.undo({UndoDref{"a/b", 0.0F}}, 1.0)) << "it cannot even be sent";
}

TEST_F(SimulatorPortTest, ReadsInTheBackgroundEndWithAFrame) {
  std::optional<std::vector<DatarefValue>> values;
  const auto keep = [&](const std::vector<DatarefValue>& read) { values = read; };
  sim_.set("a/b", 1.0F);
  sim_.read({"a/b"}, 1.0, keep);
  EXPECT_FALSE(values.has_value());
  sim_.frame();
  EXPECT_EQ(values, (std::vector<DatarefValue>{1.0F}));
  values.reset();
  sim_.read({"no/such"}, 0.5, keep);
  sim_.run(0.48);
  EXPECT_FALSE(values.has_value());
  sim_.frame();
  EXPECT_EQ(values, std::vector<DatarefValue>(1));
  EXPECT_THROW(sim_.read({""}, 0.5, keep), std::invalid_argument);
}

TEST_F(SimulatorPortTest, HandlersMustNotWait) {
  sim_.set("a/b", 1.0F);
  const Subscription subscription =
      sim_.subscribe({"waits", {"a/b"}, kEveryFrameRateHz, 0}, [&](const RrefView&, const ReceiveInfo&) {
        EXPECT_THROW(sim_.read({"a/b"}, 0.1), std::logic_error);
        ++datagrams_;
      });
  sim_.frame();
  EXPECT_EQ(datagrams_, 1);
}

TEST_F(SimulatorPortTest, JournalIsARealOne) {
  sim_.journal()->record("one", "override", {UndoDref{"a/b", 0.0F}});
  EXPECT_EQ(sim_.journal()->own().size(), 1U);
  sim_.journalOfAnother().record("two", "override", {UndoDref{"c/d", 0.0F}});
  ASSERT_EQ(sim_.journal()->orphans("override").size(), 1U);
  EXPECT_EQ(sim_.journal()->orphans("override")[0].id, "two");
  sim_.journalOfAnother(true).record("two", "override", {UndoDref{"c/d", 0.0F}});
  EXPECT_TRUE(sim_.journal()->orphans("override").empty()) << "that one runs";
  sim_.breakJournal();
  EXPECT_THROW(sim_.journal()->record("three", "override", {UndoDref{"a/b", 0.0F}}), JournalError);
  sim_.breakJournal(false);
  EXPECT_EQ(sim_.journal()->entries().size(), 2U);
}

TEST_F(SimulatorPortTest, SubscriptionsMayOutliveThePort) {
  Subscription subscription;
  {
    FakeSimulator short_lived;
    subscription = short_lived.subscribe({"x", {"a/b"}, 1, 0}, [](const RrefView&, const ReceiveInfo&) {});
  }
  subscription.replace({"x", {"c/d"}, 1, 0});
  subscription.reset();
}

}  // namespace
}  // namespace xplane_bridge::core
