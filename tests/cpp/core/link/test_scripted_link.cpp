// SimLink on a list of datagrams instead of sockets, under a clock moved by hand: what a recorded flight needs.

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "scripted_hub.hpp"
#include "xplane_bridge/core/link/sim_link.hpp"

namespace xplane_bridge::core {
namespace {

constexpr Endpoint kXPlane{0x0A010203U, 49000};
constexpr Endpoint kNeighbour{0x0A010204U, 49000};
constexpr std::int64_t kMs = kNanosecondsPerMillisecond;

using Pairs = std::vector<std::pair<std::int32_t, float>>;

std::vector<std::uint8_t> rref(const Pairs& pairs) {
  std::vector<std::uint8_t> bytes = {'R', 'R', 'E', 'F', ','};
  for (const auto& [index, value] : pairs) {
    std::uint8_t pair[8];
    std::memcpy(pair, &index, 4);
    std::memcpy(pair + 4, &value, 4);
    bytes.insert(bytes.end(), pair, pair + 8);
  }
  return bytes;
}

/// What a handler got: steady time, stamp, whether it is the kernel's, epoch, index and value.
using Delivery = std::tuple<std::int64_t, std::int64_t, bool, std::uint32_t, std::int32_t, float>;

class ScriptedLink : public testing::Test {
 protected:
  void makeLink() {
    SimLinkOptions options;
    options.host = "10.1.2.3";
    options.port = 49000;
    options.listen_for_beacon = false;
    SimLinkCallbacks callbacks;
    callbacks.on_state = [this](const LinkStatus& status) {
      if (states_.empty() || states_.back().second != status.state) {
        states_.emplace_back(wire_->now_ns, status.state);
      }
    };
    link_ = std::make_unique<SimLink>(options, callbacks, wire_->clock(), LogFunction{}, JournalFactory{},
                                      std::make_unique<ScriptedHub>(wire_));
    flight_ = link_->subscribe({"flight", {"a/b", "c/d"}, kEveryFrameRateHz, 0},
                               [this](const RrefView& view, const ReceiveInfo& info) {
                                 for (std::size_t i = 0; i < view.size(); ++i) {
                                   delivered_.emplace_back(info.steady_ns, info.stamp_ns, info.kernel_stamp,
                                                           info.link_epoch, view[i].index, view[i].value);
                                 }
                               });
  }

  void arrive(std::int64_t time_ns, const std::string& source, const std::vector<std::uint8_t>& bytes,
              Endpoint from = kXPlane, std::int64_t kernel_stamp_ns = 0) {
    wire_->arrivals.push_back({time_ns, source, bytes, from, kernel_stamp_ns});
  }
  /// The status that the link asks for by itself: version, paused, simulator time.
  void arriveStatus(std::int64_t time_ns, float sim_time) {
    arrive(time_ns, "control", rref({{0, 115501.0F}, {1, 0.0F}, {2, sim_time}}));
  }
  void runUntil(std::int64_t time_ns) {
    while (wire_->now_ns < time_ns) {
      link_->step(20);
    }
  }

  std::shared_ptr<ScriptedHub::Wire> wire_ = std::make_shared<ScriptedHub::Wire>();
  std::vector<std::pair<std::int64_t, LinkState>> states_;
  std::vector<Delivery> delivered_;
  std::unique_ptr<SimLink> link_;
  Subscription flight_;
};

TEST_F(ScriptedLink, StampsAndTimesComeFromTheScript) {
  makeLink();
  arriveStatus(100 * kMs, 50.0F);
  arrive(110 * kMs, "flight", rref({{0, 1.5F}, {1, -2.0F}}), kXPlane, 777);
  arrive(130 * kMs, "flight", rref({{0, 2.5F}}));
  runUntil(200 * kMs);
  EXPECT_EQ(delivered_,
            (std::vector<Delivery>{{110 * kMs, 777, true, 1U, 0, 1.5F},
                                   {110 * kMs, 777, true, 1U, 1, -2.0F},
                                   {130 * kMs, 130 * kMs + ScriptedHub::kSystemMinusSteady, false, 1U, 0, 2.5F}}));
  EXPECT_EQ(link_->status().version, SimulatorVersion{115501});
  EXPECT_EQ(link_->status().sim_time_s, 50.0F);
}

TEST_F(ScriptedLink, AllThatIsSentGoesThroughTheSources) {
  makeLink();
  arriveStatus(100 * kMs, 50.0F);
  runUntil(300 * kMs);
  link_->write("w/x", 0.5F);
  EXPECT_EQ(wire_->opened, (std::vector<std::string>{"control", "flight"}));
  ASSERT_GE(wire_->sent.size(), 6U);
  for (const ScriptedHub::Sent& sent : wire_->sent) {
    EXPECT_EQ(sent.to, kXPlane);
  }
  // RREF, rate 20 and index 0 as little-endian integers, the path.
  const std::vector<std::uint8_t>& first = wire_->sent.front().bytes;
  EXPECT_EQ(std::string(first.begin(), first.begin() + 4), "RREF");
  EXPECT_EQ((std::vector<std::uint8_t>(first.begin() + 5, first.begin() + 13)),
            (std::vector<std::uint8_t>{20, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_STREQ(reinterpret_cast<const char*>(first.data()) + 13, "sim/version/xplane_internal_version");
  EXPECT_EQ(wire_->sent.front().source, "control");
  EXPECT_EQ(wire_->sent.back().source, "control");
  EXPECT_EQ(std::string(wire_->sent.back().bytes.begin(), wire_->sent.back().bytes.begin() + 4), "DREF");
  int asked = 0;
  for (const ScriptedHub::Sent& sent : wire_->sent) {
    if (sent.source == "flight") {
      EXPECT_GE(sent.time_ns, 100 * kMs) << "before X-Plane has answered, only the status is asked for";
      ++asked;
    }
  }
  EXPECT_EQ(asked, 2);
}

TEST_F(ScriptedLink, StatesFollowTheScriptsSilences) {
  makeLink();
  arriveStatus(100 * kMs, 50.0F);
  arriveStatus(1000 * kMs, 51.0F);
  arriveStatus(1200 * kMs, 2.0F);  // its time went back: another run
  runUntil(1300 * kMs);
  ASSERT_EQ(states_.size(), 4U);
  EXPECT_EQ(states_[0].second, LinkState::kSearching);
  EXPECT_EQ(states_[1], std::make_pair(100 * kMs, LinkState::kConnected));
  EXPECT_EQ(states_[2].second, LinkState::kStale);
  EXPECT_GT(states_[2].first, 500 * kMs) << "0.4 s after the last datagram";
  EXPECT_LE(states_[2].first, 525 * kMs);
  EXPECT_EQ(states_[3], std::make_pair(1000 * kMs, LinkState::kConnected));
  EXPECT_EQ(link_->status().epoch, 2U);
}

TEST_F(ScriptedLink, OtherPeoplesDatagramsAndGarbageAreCounted) {
  makeLink();
  arriveStatus(100 * kMs, 50.0F);
  arrive(110 * kMs, "flight", rref({{0, 9.0F}}), kNeighbour);
  arrive(120 * kMs, "flight", {'R', 'R', 'E', 'F', ',', 1, 2, 3});
  arrive(130 * kMs, "flight", {'h', 'e', 'l', 'l', 'o', '!'});
  wire_->dropped = 3;
  runUntil(300 * kMs);
  EXPECT_TRUE(delivered_.empty());
  const LinkCounters counters = link_->counters();
  EXPECT_EQ(counters.strangers, 1U);
  EXPECT_EQ(counters.decode_errors[static_cast<std::size_t>(DecodeError::kUnknownLabel)], 1U);
  EXPECT_EQ(counters.udp.received, 4U);
  EXPECT_EQ(counters.udp.dropped, 6U) << "three of each source";
  wire_->refuses = true;
  EXPECT_EQ(link_->write("w/x", 1.0F), SendStatus::kSocketError);
}

TEST_F(ScriptedLink, SameScriptGivesTheSameDatagrams) {
  std::vector<std::vector<ScriptedHub::Sent>> sent;
  std::vector<std::vector<Delivery>> delivered;
  for (int run = 0; run < 2; ++run) {
    wire_ = std::make_shared<ScriptedHub::Wire>();
    delivered_.clear();
    makeLink();
    for (int frame = 0; frame < 300; ++frame) {
      const std::int64_t time_ns = (100 + 17 * frame) * kMs;
      if (frame < 100 || frame > 150) {  // a silence of 0.85 s
        arriveStatus(time_ns, 50.0F + 0.017F * static_cast<float>(frame));
        arrive(time_ns + 1, "flight", rref({{0, static_cast<float>(frame)}}), kXPlane, time_ns);  // c/d never answers
      }
    }
    runUntil(6000 * kMs);
    flight_.reset();
    link_.reset();
    sent.push_back(wire_->sent);
    delivered.push_back(delivered_);
  }
  EXPECT_GT(sent[0].size(), 20U);
  EXPECT_EQ(sent[0], sent[1]);
  EXPECT_EQ(delivered[0].size(), 249U);
  EXPECT_EQ(delivered[0], delivered[1]);
}

TEST_F(ScriptedLink, CallsBeyondABoundAreCountedInsteadOfKept) {
  makeLink();
  for (int i = 0; i < 2000; ++i) {
    link_->setDataRows({1});  // the link does not step
  }
  runUntil(100 * kMs);
  EXPECT_GT(link_->counters().refused_calls, 900U);
  EXPECT_LT(link_->counters().refused_calls, 1100U);
  const std::uint64_t refused = link_->counters().refused_calls;
  link_->setDataRows({1});
  runUntil(200 * kMs);
  EXPECT_EQ(link_->counters().refused_calls, refused) << "it has caught up";
}

}  // namespace
}  // namespace xplane_bridge::core
