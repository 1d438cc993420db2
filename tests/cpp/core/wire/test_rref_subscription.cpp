#include "xplane_bridge/core/wire/rref_subscription.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "xplane_bridge/core/base/clock.hpp"

namespace xplane_bridge::core {
namespace {

constexpr std::int64_t kMs = kNanosecondsPerMillisecond;

RrefGroup group(std::vector<std::string> paths, std::int32_t rate_hz = 50) {
  return {"test", std::move(paths), rate_hz, 0};
}

/// An answer with these indices.
class Answer {
 public:
  explicit Answer(const std::vector<std::int32_t>& indices) : bytes_(8 * indices.size(), 0), count_(indices.size()) {
    for (std::size_t i = 0; i < indices.size(); ++i) {
      std::memcpy(bytes_.data() + 8 * i, &indices[i], 4);
    }
  }
  RrefView view() const { return {bytes_.data(), count_}; }

 private:
  std::vector<std::uint8_t> bytes_;
  std::size_t count_;
};

std::vector<std::size_t> allRequests(RrefSubscription* subscription, std::int64_t now_ns, Jitter* jitter) {
  std::vector<std::size_t> requests;
  while (const auto index = subscription->nextRequest(now_ns, jitter)) {
    requests.push_back(*index);
  }
  return requests;
}

TEST(RrefSubscription, AsksNothingBeforeItIsStarted) {
  RrefSubscription subscription(group({"a", "b"}));
  Jitter jitter(1);
  EXPECT_TRUE(allRequests(&subscription, 100'000 * kMs, &jitter).empty());
}

TEST(RrefSubscription, AsksEachOnceThenAgainWhatStaysSilent) {
  RrefSubscription subscription(group({"a", "b", "c"}));
  Jitter jitter(1);
  subscription.restart(0);
  EXPECT_EQ(allRequests(&subscription, 0, &jitter), (std::vector<std::size_t>{0, 1, 2}));
  EXPECT_TRUE(allRequests(&subscription, 300 * kMs, &jitter).empty());
  EXPECT_EQ(subscription.answered(Answer({0, 2}).view(), 300 * kMs), 0U);
  EXPECT_EQ(allRequests(&subscription, 650 * kMs, &jitter), std::vector<std::size_t>{1}) << "after 0.5 s +- 20 %";
  EXPECT_EQ(subscription.repeats(), 1U);
  // Those that had answered and fall silent are asked again, too.
  EXPECT_EQ(allRequests(&subscription, 850 * kMs, &jitter), (std::vector<std::size_t>{0, 2}));
}

TEST(RrefSubscription, RepeatsBecomeRarer) {
  RrefSubscription subscription(group({"a"}));
  Jitter jitter(1);
  subscription.restart(0);
  int requests = 0;
  for (std::int64_t t = 0; t <= 60'000; t += 10) {
    requests += static_cast<int>(allRequests(&subscription, t * kMs, &jitter).size());
  }
  // 0, 0.5, 1.5, 3.5, 7.5, 15.5 (8 s), then every 10 s: 0.5 1 2 4 8 10 10 10 10 ... within 20 %.
  EXPECT_GE(requests, 8);
  EXPECT_LE(requests, 13);
}

TEST(RrefSubscription, SlowGroupsAreGivenTheirTime) {
  RrefSubscription subscription(group({"a"}, 1));
  Jitter jitter(1);
  subscription.restart(0);
  EXPECT_EQ(allRequests(&subscription, 0, &jitter).size(), 1U);
  EXPECT_TRUE(allRequests(&subscription, 2'300 * kMs, &jitter).empty()) << "three periods, 3 s +- 20 %";
  EXPECT_EQ(allRequests(&subscription, 3'700 * kMs, &jitter).size(), 1U);
}

TEST(RrefSubscription, RestartAsksEverythingAtOnceAndSuspendNothing) {
  RrefSubscription subscription(group({"a", "b"}));
  Jitter jitter(1);
  subscription.restart(0);
  allRequests(&subscription, 0, &jitter);
  subscription.answered(Answer({0, 1}).view(), 10 * kMs);
  subscription.suspend();
  EXPECT_TRUE(allRequests(&subscription, 100'000 * kMs, &jitter).empty());
  subscription.restart(100'000 * kMs);
  EXPECT_EQ(allRequests(&subscription, 100'000 * kMs, &jitter).size(), 2U);
}

TEST(RrefSubscription, NamesWhatNeverAnswers) {
  RrefSubscription subscription(group({"a", "b"}));
  Jitter jitter(1);
  subscription.restart(0);
  for (std::int64_t t = 0; t < 5'000; t += 10) {
    allRequests(&subscription, t * kMs, &jitter);
    subscription.answered(Answer({0}).view(), t * kMs);
  }
  EXPECT_EQ(subscription.unanswered(), std::vector<std::string>{"b"});
  subscription.answered(Answer({1}).view(), 5'000 * kMs);
  EXPECT_TRUE(subscription.unanswered().empty());
  subscription.restart(6'000 * kMs);
  EXPECT_TRUE(subscription.unanswered().empty()) << "a new X-Plane has its chance";
}

TEST(RrefSubscription, IsSettledOnceEachHasAnsweredOrWasAskedInVain) {
  RrefSubscription subscription(group({"a", "unknown"}));
  Jitter jitter(1);
  EXPECT_FALSE(subscription.settled()) << "not started";
  subscription.restart(0);
  allRequests(&subscription, 0, &jitter);
  subscription.answered(Answer({0}).view(), 10 * kMs);
  EXPECT_FALSE(subscription.settled());
  for (int seconds = 1; !subscription.settled() && seconds < 20; ++seconds) {
    subscription.answered(Answer({0}).view(), seconds * 1000 * kMs);
    allRequests(&subscription, seconds * 1000 * kMs, &jitter);
  }
  EXPECT_TRUE(subscription.settled());
  EXPECT_EQ(subscription.unanswered(), std::vector<std::string>{"unknown"});
  subscription.restart(30'000 * kMs);
  EXPECT_FALSE(subscription.settled());
}

TEST(RrefSubscription, CountsIndicesItNeverAsked) {
  RrefSubscription subscription(group({"a"}));
  EXPECT_EQ(subscription.answered(Answer({0, 1, -1, 2'000'000'000}).view(), 0), 3U);
}

TEST(RrefSubscription, RefusesBadGroups) {
  EXPECT_THROW(RrefSubscription(group({})), std::invalid_argument);
  EXPECT_THROW(RrefSubscription(group({"a"}, 0)), std::invalid_argument);
  EXPECT_THROW(RrefSubscription(group({"a"}, kEveryFrameRateHz + 1)), std::invalid_argument);
  try {
    RrefSubscription subscription(group({std::string(400, 'x')}));
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("'test'"), std::string::npos) << error.what();
  }
}

TEST(RequestPacer, LetsOneBatchThroughPerSpacing) {
  RequestPacer pacer(100, 0.1);
  Jitter jitter(1);
  EXPECT_EQ(pacer.allowance(0, &jitter), 100U);
  pacer.spend(70);
  EXPECT_EQ(pacer.allowance(10 * kMs, &jitter), 30U);
  pacer.spend(30);
  EXPECT_EQ(pacer.allowance(79 * kMs, &jitter), 0U);
  EXPECT_EQ(pacer.allowance(121 * kMs, &jitter), 100U);
}

TEST(RequestPacer, UrgentRequestsGoBeyondTheBatchAndAreCountedInIt) {
  RequestPacer pacer(38, 0.1);
  Jitter jitter(1);
  EXPECT_EQ(pacer.urgentAllowance(0, &jitter), 100U);
  pacer.spend(70);
  EXPECT_EQ(pacer.urgentAllowance(1 * kMs, &jitter), 30U);
  EXPECT_EQ(pacer.allowance(1 * kMs, &jitter), 0U);
  pacer.setSpacing(0.04);
  EXPECT_EQ(pacer.allowance(79 * kMs, &jitter), 0U) << "the batch that has begun lasts as long as it would have";
  EXPECT_EQ(pacer.allowance(121 * kMs, &jitter), 38U);
  pacer.spend(38);
  EXPECT_EQ(pacer.allowance(121 * kMs + 31 * kMs, &jitter), 0U);
  EXPECT_EQ(pacer.allowance(121 * kMs + 49 * kMs, &jitter), 38U);
}

TEST(Jitter, StaysWithinTwentyPercentAndVaries) {
  Jitter jitter(7);
  std::int64_t least = 1'000'000;
  std::int64_t most = 0;
  for (int i = 0; i < 1000; ++i) {
    const std::int64_t value = jitter.around(100'000);
    least = std::min(least, value);
    most = std::max(most, value);
  }
  EXPECT_GE(least, 80'000);
  EXPECT_LE(most, 120'000);
  EXPECT_LT(least, 85'000);
  EXPECT_GT(most, 115'000);
}

}  // namespace
}  // namespace xplane_bridge::core
