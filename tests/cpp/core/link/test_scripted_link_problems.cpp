// What the link says of an X-Plane that does not answer.

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <netdb.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "scripted_link.hpp"

namespace {
bool resolves = true;  // whether the name server answers
}

/// In place of the system's.
extern "C" int getaddrinfo(const char* name, const char* service, const addrinfo* hints, addrinfo** found) {
  static const auto of_system = reinterpret_cast<decltype(&getaddrinfo)>(dlsym(RTLD_NEXT, "getaddrinfo"));
  return resolves ? of_system(name, service, hints, found) : EAI_AGAIN;
}

namespace xplane_bridge::core {
namespace {

TEST_F(ScriptedLink, ASearchInVainIsWarnedOfOnceAndGivesTheReason) {
  using Line = std::pair<LogLevel, std::string>;
  makeLink();
  runUntil(4900 * kMs);
  EXPECT_EQ(log_, (std::vector<Line>{{LogLevel::kInfo, "looking for X-Plane at 10.1.2.3:49000, host '10.1.2.3'"}}));
  EXPECT_EQ(link_->status().reason, "waiting for the first answer of 10.1.2.3:49000");
  EXPECT_TRUE(link_->status().problems.empty());
  runUntil(20'000 * kMs);
  ASSERT_EQ(link_->status().problems.size(), 1U);
  const std::string problem = link_->status().problems[0];
  EXPECT_EQ(problem.rfind("no answer from 10.1.2.3:49000: start X-Plane", 0), 0U) << problem;
  EXPECT_EQ(link_->status().reason, problem);
  ASSERT_EQ(log_.size(), 2U) << "once, not every time it is looked at";
  EXPECT_EQ(log_[1], Line(LogLevel::kWarn, problem));
  arriveStatus(20'100 * kMs, 50.0F);
  runUntil(20'200 * kMs);
  EXPECT_EQ(link_->status().reason, "X-Plane answers");
  EXPECT_TRUE(link_->status().problems.empty());
}

TEST_F(ScriptedLink, AnswersFromAnotherAddressAreNamed) {
  makeLink();
  for (int k = 1; k < 100; ++k) {
    arrive(100 * k * kMs, "control", rref({{0, 115501.0F}}), {0x0A020203U, 49000});
  }
  runUntil(1000 * kMs);
  const std::string problem =
      "answers come from 10.2.2.3, but 10.1.2.3 is configured: X-Plane's computer has several addresses, or it is "
      "another one; set the parameter host to 10.2.2.3";
  EXPECT_EQ(link_->status().state, LinkState::kSearching);
  EXPECT_EQ(link_->status().problems, std::vector<std::string>{problem});
  EXPECT_EQ(link_->status().reason, problem);
  runUntil(9000 * kMs);
  EXPECT_EQ(link_->status().problems, std::vector<std::string>{problem}) << "not that nothing answers";
  arriveStatus(10'000 * kMs, 50.0F);
  runUntil(10'100 * kMs);
  EXPECT_TRUE(link_->status().problems.empty());
}

TEST_F(ScriptedLink, AnotherComputersXPlaneIsNotTheOneThatIsGone) {
  SimLinkOptions options = defaults();
  options.host = "";
  options.listen_for_beacon = true;
  for (const bool from_the_start : {false, true}) {  // it begins while ours is gone, or begins again
    wire_ = std::make_shared<ScriptedHub::Wire>();
    makeLink(options);
    const Endpoint neighbours{0x0A010204U, 49000};
    for (int k = 0; k < 500; ++k) {
      const int now = 100 * k;
      const bool ours = now <= 20'000 || now >= 40'000;
      if (k % 10 == 0 && ours) {
        arrive(now * kMs, "beacon", beacon(), kXPlane);
      }
      if (k % 10 == 5 && (now > 26'000 || (from_the_start && now > 8000 && now < 19'000))) {
        arrive(now * kMs, "beacon", beacon("lab-2"), neighbours);
      }
      if (now > 2000 && ours) {
        arriveStatus(now * kMs, 50.0F);
      }
    }
    runUntil(39'000 * kMs);
    EXPECT_EQ(link_->status().state, LinkState::kLost);
    EXPECT_EQ(link_->status().peer, kXPlane);
    EXPECT_EQ(link_->status().problems,
              (std::vector<std::string>{"the X-Plane at 10.1.2.3:49000 is gone, and lab-2 (10.1.2.4:49000, version "
                                        "122015) is on another computer: to go on with that one, set the parameter "
                                        "host to it"}));
    EXPECT_EQ(link_->status().reason, "X-Plane has been silent for long: " + link_->status().problems[0]);
    for (const auto& each : wire_->sent) {
      EXPECT_NE(each.to, neighbours);
    }
    runUntil(42'000 * kMs);
    EXPECT_EQ(link_->status().state, LinkState::kConnected);
    EXPECT_TRUE(link_->status().problems.empty());
    flight_.reset();
    link_.reset();
  }
}

TEST_F(ScriptedLink, DataWithoutAnswersIsOneWayAndItsVersionIsTheOption) {
  for (const std::int32_t given : {0, 122015}) {
    wire_ = std::make_shared<ScriptedHub::Wire>();
    makeLink(withRows(given));
    for (int k = 0; k < 100; ++k) {
      arrive((1000 + 50 * k) * kMs, "data", data(1.0F));
      if (k == 80) {
        arriveStatus(5000 * kMs, 50.0F);
      }
    }
    runUntil(2900 * kMs);
    EXPECT_FALSE(link_->status().one_way) << "it may still answer";
    EXPECT_FALSE(link_->status().version.known());
    runUntil(4000 * kMs);
    LinkStatus status = link_->status();
    EXPECT_EQ(status.state, LinkState::kConnected);
    EXPECT_TRUE(status.one_way);
    EXPECT_EQ(status.version.number, given);
    ASSERT_EQ(status.problems.size(), given == 0 ? 2U : 1U);
    EXPECT_EQ(status.problems[0].rfind("X-Plane sends Data Output, but nothing answers on 10.1.2.3:49000", 0), 0U);
    if (given == 0) {
      EXPECT_NE(status.problems[1].find("set the parameter xplane_version"), std::string::npos);
    }
    EXPECT_TRUE(link_->unansweredDatarefs().empty()) << "that is said of X-Plane, not of each dataref";
    runUntil(5500 * kMs);
    status = link_->status();
    EXPECT_FALSE(status.one_way);
    EXPECT_EQ(status.version.number, 115501) << "what X-Plane says itself";
    EXPECT_TRUE(status.problems.empty());
    flight_.reset();
    link_.reset();
  }
}

TEST_F(ScriptedLink, OneThatNeverAnswersIsNotTakenForTheOneThatDid) {
  for (const std::int32_t given : {0, 122015}) {
    wire_ = std::make_shared<ScriptedHub::Wire>();
    makeLink(withRows(given));
    arriveStatus(1000 * kMs, 50.0F);
    for (int k = 0; k < 100; ++k) arrive((20'000 + 50 * k) * kMs, "data", data(1.0F));
    runUntil(19'000 * kMs);
    ASSERT_EQ(link_->status().state, LinkState::kLost);
    EXPECT_EQ(link_->status().version.number, 115501);
    runUntil(21'000 * kMs);
    EXPECT_EQ(link_->status().version.number, 115501) << "it may still answer";
    runUntil(24'000 * kMs);
    EXPECT_TRUE(link_->status().one_way);
    EXPECT_EQ(link_->status().version.number, given);
    runUntil(26'000 * kMs);
    EXPECT_EQ(link_->status().version.number, given) << "in a silence, too";
    flight_.reset();
    link_.reset();
  }
}

TEST_F(ScriptedLink, ARefusalCountsForSomeSeconds) {
  const auto says = [this](const std::string& text) {
    const LinkStatus status = link_->status();
    return status.problems.size() == 1 && status.problems[0].find(text) != std::string::npos;
  };
  makeLink();
  wire_->refused = 1;  // X-Plane has not been started
  runUntil(5500 * kMs);
  EXPECT_TRUE(says("Accept incoming connections")) << "the refusal was 5 s ago";
  wire_->refused = 2;
  runUntil(6000 * kMs);
  EXPECT_TRUE(says("nothing listens on the port: start X-Plane, or set port"));
  runUntil(10'000 * kMs);
  EXPECT_TRUE(says("nothing listens on the port"));
  runUntil(11'000 * kMs);
  EXPECT_TRUE(says("Accept incoming connections")) << "started, and silent";
}

TEST_F(ScriptedLink, ARefusalIsNotThatOfThePeerThatIsFoundNext) {
  SimLinkOptions options = defaults();
  options.host = "";
  options.listen_for_beacon = true;
  makeLink(options);
  const Endpoint next{0x0A010204U, 49000};
  for (int k = 0; k < 30; ++k) {
    arrive(1000 * k * kMs, "beacon", k < 8 ? beacon() : beacon("lab-2"), k < 8 ? kXPlane : next);
  }
  while (link_->status().peer != next) {
    ASSERT_LT(wire_->now_ns, 30'000 * kMs);
    ++wire_->refused;
    link_->step(20);
  }
  ASSERT_EQ(link_->status().problems.size(), 1U);
  const std::string problem = link_->status().problems[0];
  EXPECT_EQ(problem.rfind("no answer from 10.1.2.4:49000: start X-Plane; check the address", 0), 0U) << problem;
}

TEST_F(ScriptedLink, ThatNoDataComesIsSaidOfOneThatAnswersOnly) {
  makeLink(withRows());
  for (int k = 0; k < 100; ++k) arriveStatus((1000 + 100 * k) * kMs, 50.0F + 0.1F * static_cast<float>(k));
  runUntil(10'500 * kMs);
  ASSERT_EQ(link_->status().problems.size(), 1U);
  EXPECT_EQ(link_->status().problems[0].rfind("no DATA arrives", 0), 0U) << link_->status().problems[0];
  runUntil(40'000 * kMs);
  EXPECT_EQ(link_->status().state, LinkState::kLost);
  EXPECT_TRUE(link_->status().problems.empty());
  EXPECT_EQ(link_->status().reason, "X-Plane has been silent for long");
}

TEST_F(ScriptedLink, ANameThatCouldNotBeResolvedIsNoProblemOnceXPlaneAnswersAgain) {
  SimLinkOptions options = defaults();
  options.host = "localhost";
  makeLink(options);
  const Endpoint here{kLoopbackAddress, 49000};
  arrive(100 * kMs, "control", rref({{0, 115501.0F}, {1, 0.0F}, {2, 50.0F}}), here);
  runUntil(200 * kMs);
  ASSERT_EQ(link_->status().state, LinkState::kConnected);
  resolves = false;
  runUntil(20'000 * kMs);
  resolves = true;
  ASSERT_EQ(link_->status().state, LinkState::kLost);
  const std::string failure = "host 'localhost'";
  ASSERT_FALSE(link_->status().problems.empty());
  EXPECT_EQ(link_->status().problems[0].rfind(failure, 0), 0U) << link_->status().problems[0];
  arrive(20'100 * kMs, "control", rref({{0, 115501.0F}, {1, 0.0F}, {2, 70.0F}}), here);
  runUntil(20'200 * kMs);
  EXPECT_EQ(link_->status().state, LinkState::kConnected);
  EXPECT_EQ(link_->status().problems, std::vector<std::string>{});
}

}  // namespace
}  // namespace xplane_bridge::core
