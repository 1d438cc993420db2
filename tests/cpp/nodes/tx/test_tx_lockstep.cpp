#include "xplane_bridge/nodes/tx/tx_lockstep.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace xplane_bridge {
namespace {

ros::Time stamp(std::uint32_t frame) { return {1000U + frame, 0U}; }

LockstepOptions options() {
  LockstepOptions out;
  out.participants = {"player"};
  return out;
}

void open(TxLockstep* lockstep, std::uint32_t frame) {
  core::LockstepFrame each;
  each.number = frame;
  lockstep->open(each, stamp(frame));
}

/// Frame k is stamped 1000 + k seconds; there is one participant.
class TxLockstepTest : public testing::Test {
 protected:
  void open(std::uint32_t frame) { xplane_bridge::open(&lockstep_, frame); }
  void request(const std::string& who, std::uint32_t frame, int topic, const std::string& what) {
    lockstep_.takeRequest(who, stamp(frame), topic, [this, what] { done_.push_back(what); });
  }
  /// What is carried out at the end of the present frame.
  std::vector<std::string> close() {
    done_.clear();
    lockstep_.close();
    return done_;
  }
  std::vector<std::string> fly(std::uint32_t frame) {
    open(frame);
    return close();
  }

  using Texts = std::vector<std::string>;

  std::vector<std::string> done_;
  TxLockstep lockstep_{options(), core::hostClock(), stamp(0), [] {}, [](const std::string&) {}};
};

TEST_F(TxLockstepTest, ARequestIsCarriedOutInTheSecondFrameAfterItsOwnWheneverItComes) {
  fly(1);
  open(2);
  request("/player", 2, 0, "in time");
  EXPECT_EQ(close(), Texts{});
  open(3);
  request("/player", 2, 0, "late");
  EXPECT_EQ(close(), Texts{});
  open(4);
  request("/player", 2, 0, "later");
  EXPECT_EQ(close(), (Texts{"in time", "late", "later"}));
  EXPECT_EQ(fly(5), Texts{});
}

TEST_F(TxLockstepTest, WhatBecameOfAStepStandsAlsoWhereTheNextOnesEndBeforeItsCallerLooks) {
  fly(1);
  const auto answer = [this](std::uint32_t frame) {
    for (const char* who : {"/rx_node", "/player"}) lockstep_.takeDone(who, stamp(frame), "");
    return lockstep_.ready();
  };
  const auto first = lockstep_.step(1);
  open(2);
  EXPECT_TRUE(answer(2));
  close();
  open(3);
  EXPECT_FALSE(answer(3)) << "it is held";
  const auto second = lockstep_.step(5);
  const auto third = lockstep_.step(1);
  EXPECT_TRUE(lockstep_.ready());
  close();
  open(4);
  EXPECT_FALSE(answer(4)) << "it is held";
  EXPECT_EQ(lockstep_.waitUntilHeld(first), TxLockstep::Held::kHeld);
  EXPECT_EQ(lockstep_.waitUntilHeld(second), TxLockstep::Held::kReplaced);
  EXPECT_EQ(lockstep_.waitUntilHeld(third), TxLockstep::Held::kHeld);
}

TEST_F(TxLockstepTest, RequestsThatAreDueTogetherHaveAnOrderOfTheirOwn) {
  fly(1);
  open(2);
  request("/stranger", 2, 0, "stranger");
  request("/player", 2, 1, "traffic");
  request("/player", 2, 0, "mode");
  request("/player", 1, 1, "before");
  EXPECT_EQ(close(), Texts{});
  EXPECT_EQ(fly(3), Texts{"before"});
  EXPECT_EQ(fly(4), (Texts{"mode", "traffic", "stranger"}));
}

TEST_F(TxLockstepTest, ARequestAnswersNoFrame) {
  open(1);
  request("/player", 1, 0, "mode");
  lockstep_.takeDone("/rx_node", stamp(1), "");
  EXPECT_FALSE(lockstep_.ready());
  lockstep_.takeDone("/player", stamp(1), "");
  EXPECT_TRUE(lockstep_.ready());
}

/// What the watchdog says once its time is over, which no clock of the host's makes so.
class TxLockstepWatchdogTest : public testing::Test {
 protected:
  core::Clock clock() {
    return {[this] { return now_ns_.load(); }, [this] { return now_ns_.load(); }, waiters_};
  }
  void passTime(double seconds) {
    now_ns_ += core::toNanoseconds(seconds);
    waiters_->wake(now_ns_);
  }
  /// What it says, without the time.
  std::string said() {
    std::future<std::string> text = said_.get_future();
    do {  // the watchdog may begin to wait after time has passed
      passTime(options().watchdog + 1.0);
    } while (text.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready);
    const std::string whole = text.get();
    return whole.substr(whole.find(" s ") + 3);
  }

  std::atomic<std::int64_t> now_ns_{0};
  std::shared_ptr<core::ClockWaiters> waiters_ = std::make_shared<core::ClockWaiters>();
  std::promise<std::string> said_;
  bool is_said_ = false;
  TxLockstep lockstep_{options(), clock(), stamp(0), [] {},
                       [this](const std::string& text) {
                         if (!std::exchange(is_said_, true)) said_.set_value(text);
                       }};
};

TEST_F(TxLockstepWatchdogTest, ANodeThatWaitsForTheSimulatorNamesItself) {
  lockstep_.takeDone("/rx_node", stamp(0), kLockstepFrame0);
  EXPECT_EQ(said(), "frame 0 was not answered by tx_node itself, which waits for the simulator's answers");
}

TEST_F(TxLockstepWatchdogTest, ANodeThatHasNotHandledAFrameDoesNotBlameTheSimulator) {
  open(&lockstep_, 1);
  lockstep_.takeDone("/rx_node", stamp(1), "");
  lockstep_.takeDone("/player", stamp(1), "");
  EXPECT_EQ(said(), "frame 1 was not answered by tx_node itself");
}

TEST_F(TxLockstepWatchdogTest, AllWhoHaveNotAnsweredAreNamedWithTheirReasons) {
  open(&lockstep_, 1);
  EXPECT_FALSE(lockstep_.ready());
  lockstep_.takeDone("/player", stamp(1), std::string(kLockstepWaits) + "a file");
  EXPECT_EQ(said(), "frame 1 was not answered by rx_node, player, which waits for a file");
}

TEST_F(TxLockstepWatchdogTest, ASimulatorThatDoesNotGoOnIsNamed) {
  lockstep_.takeDone("/rx_node", stamp(0), kLockstepFrame0);
  EXPECT_TRUE(lockstep_.ready());
  EXPECT_EQ(said(), "the simulator has not gone on from frame 0");
}

}  // namespace
}  // namespace xplane_bridge
