// SimLink on a list of datagrams instead of sockets, under a clock moved by hand: what a recorded flight needs.

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "scripted_link.hpp"

namespace xplane_bridge::core {
namespace {

constexpr Endpoint kNeighbour{0x0A010204U, 49000};

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

TEST_F(ScriptedLink, NoOtherProgramOfXPlanesComputerInjectsAState) {
  makeLink(withRows());
  const Endpoint sender{kXPlane.address, 49001}, program{kXPlane.address, 51234};
  arriveStatus(100 * kMs, 50.0F);
  arrive(110 * kMs, "flight", rref({{0, 1.0F}}));
  arrive(110 * kMs, "data", data(1.0F), sender);  // X-Plane's own port for DATA
  arrive(120 * kMs, "flight", rref({{0, 9.0F}}), program);
  arrive(120 * kMs, "data", data(9.0F), program);
  arrive(130 * kMs, "flight", {'h', 'e', 'l', 'l', 'o', '!'}, program);
  arrive(140 * kMs, "flight", rref({{0, 2.0F}}));
  arrive(140 * kMs, "data", data(2.0F), sender);
  runUntil(200 * kMs);
  ASSERT_EQ(delivered_.size(), 2U);
  EXPECT_EQ(std::get<5>(delivered_[1]), 2.0F);
  EXPECT_EQ(rows_, (std::vector<float>{1.0F, 2.0F}));
  EXPECT_EQ(link_->counters().strangers, 3U);
  EXPECT_EQ(link_->status().problems, (std::vector<std::string>{"another program at 10.1.2.3:51234 sends X-Plane's "
                                                                "messages as well: they are dropped"}));
  // After a silence X-Plane may be another run, with other ports.
  const Endpoint other{kXPlane.address, 50001};
  arrive(1000 * kMs, "control", rref({{0, 115501.0F}, {1, 0.0F}, {2, 2.0F}}), other);
  arrive(1010 * kMs, "flight", rref({{0, 3.0F}}), other);
  arrive(1020 * kMs, "flight", rref({{0, 9.0F}}), kXPlane);
  runUntil(1100 * kMs);
  ASSERT_EQ(delivered_.size(), 3U);
  EXPECT_EQ(std::get<5>(delivered_[2]), 3.0F);
}

TEST_F(ScriptedLink, FollowsToTheAddressThatIsLeftOfXPlanesComputer) {
  SimLinkOptions options = defaults();
  options.host = "";
  options.listen_for_beacon = true;
  for (const int joined : {500, 10'500}) {  // the second address is there from the start, or comes later
    wire_ = std::make_shared<ScriptedHub::Wire>();
    makeLink(options);
    const Endpoint second{0x0A020203U, 49000};
    for (int k = 0; k < 400; ++k) {
      const int now = 100 * k;
      if (k % 10 == 0 && now <= 11'000) {
        arrive(now * kMs, "beacon", beacon(), kXPlane);
      }
      if (k % 10 == 5 && now >= joined) {
        arrive(now * kMs, "beacon", beacon(), second);
      }
      if (now > 2000 && now <= 11'000) {
        arriveStatus(now * kMs, 50.0F);
      }
    }
    runUntil(11'000 * kMs);
    EXPECT_EQ(link_->status().state, LinkState::kConnected);
    EXPECT_EQ(link_->status().peer, kXPlane);
    runUntil(13'400 * kMs);
    EXPECT_EQ(link_->status().peer, kXPlane) << "a short silence, as when it loads";
    runUntil(15'000 * kMs);
    EXPECT_EQ(link_->status().peer, second);
    EXPECT_EQ(link_->status().computer_name, "sim");
    EXPECT_EQ(link_->status().reason, "X-Plane has moved to 10.2.2.3:49000");
    EXPECT_EQ(wire_->sent.back().to, second);
    flight_.reset();
    link_.reset();
  }
}

TEST_F(ScriptedLink, AnXPlaneThatAnswersIsKeptWhereverItsBeaconComesFrom) {
  SimLinkOptions options = defaults();
  options.host = "";
  options.listen_for_beacon = true;
  makeLink(options);
  const Endpoint second{0x0A020203U, 49000};
  for (int k = 0; k < 400; ++k) {
    const int now = 100 * k;
    if (k % 10 == 0) {
      arrive(now * kMs, "beacon", beacon(), now <= 3000 ? kXPlane : second);
    }
    if (now > 2000 && now <= 20'000) {
      arriveStatus(now * kMs, 50.0F);
    }
  }
  runUntil(20'000 * kMs);
  EXPECT_EQ(link_->status().peer, kXPlane);
  EXPECT_EQ(link_->status().state, LinkState::kConnected);
  runUntil(22'000 * kMs);
  EXPECT_EQ(link_->status().peer, kXPlane) << "a short silence, as when it loads";
  runUntil(23'000 * kMs);
  EXPECT_EQ(link_->status().peer, second);
}

TEST_F(ScriptedLink, AVersionIsJudgedOnceWhetherXPlaneAnswersItOrTheOptionGivesIt) {
  SimLinkOptions options = withRows(122015);
  std::vector<std::pair<Endpoint, std::int32_t>> judged;
  options.otherwise = [&judged](const Endpoint& peer, std::int32_t number) {
    judged.emplace_back(peer, number);
    return static_cast<std::uint32_t>(number == 122015 ? Otherwise::kRow16 : Otherwise::kVehs);
  };
  makeLink(options);
  for (int k = 0; k < 100; ++k) {
    if (k > 50 && k < 70) continue;  // a silence of 1 s
    arrive((1000 + 50 * k) * kMs, "data", data(1.0F));
    if (k > 80) arriveStatus((1000 + 50 * k) * kMs, 50.0F + 0.05F * static_cast<float>(k));
  }
  const SimulatorVersion by_option{122015, static_cast<std::uint32_t>(Otherwise::kRow16)};
  runUntil(3500 * kMs);
  EXPECT_EQ(link_->status().version, by_option);
  runUntil(4400 * kMs);
  EXPECT_EQ(link_->status().state, LinkState::kStale);
  EXPECT_EQ(link_->status().version, by_option);
  runUntil(4900 * kMs);
  EXPECT_EQ(link_->status().version, by_option);
  runUntil(5500 * kMs);
  EXPECT_EQ(link_->status().version, (SimulatorVersion{115501, static_cast<std::uint32_t>(Otherwise::kVehs)}));
  EXPECT_EQ(judged, (std::vector<std::pair<Endpoint, std::int32_t>>{{kXPlane, 122015}, {kXPlane, 115501}}));
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

TEST_F(ScriptedLink, AtItsEndNoSourceIsLeftForWhichLockstepSendsFences) {
  SimLinkOptions options = defaults();
  options.rpos_rate_hz = 20;
  makeLink(options);
  link_->stop(0.1);  // X-Plane is silent: its group is not ended otherwise
  EXPECT_EQ(wire_->ignored, (std::vector<std::string>{"flight", "control", "rpos"}));
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
