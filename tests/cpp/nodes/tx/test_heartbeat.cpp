#include "xplane_bridge/nodes/tx/heartbeat.hpp"

#include <atomic>
#include <chrono>
#include <future>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace xplane_bridge {
namespace {

class HeartbeatTest : public testing::Test {
 protected:
  /// Its guardian has acted where acted_ is set; what follows ends when relieved_ is.
  void start() {
    Heartbeat::Hooks hooks;
    hooks.beat = [this] { steps_.emplace_back("beat"); };
    hooks.acted = [this] { return acted_.exchange(false); };
    hooks.on_hang = [this] {
      hung_.set_value();
      relieved_.get_future().wait();
      steps_.emplace_back("relieved");
    };
    heartbeat_.start(std::move(hooks));
  }

  Heartbeat heartbeat_;
  std::atomic<bool> acted_{false};
  std::promise<void> hung_, relieved_;
  std::vector<std::string> steps_;
};

TEST_F(HeartbeatTest, DoesNothingBeforeItIsStarted) {
  heartbeat_.beat();
  heartbeat_.look();
}

TEST_F(HeartbeatTest, ALookShowsNoLife) {
  start();
  heartbeat_.look();
  EXPECT_TRUE(steps_.empty());
  heartbeat_.beat();
  EXPECT_EQ(steps_, std::vector<std::string>{"beat"});
}

TEST_F(HeartbeatTest, AfterAHangWhatFollowsComesBeforeTheBeat) {
  start();
  acted_ = true;
  relieved_.set_value();
  heartbeat_.beat();
  EXPECT_EQ(steps_, (std::vector<std::string>{"relieved", "beat"}));
}

TEST_F(HeartbeatTest, AnotherThreadGoesOnOnlyWhenWhatFollowsIsDone) {
  start();
  acted_ = true;
  const auto timers = std::async(std::launch::async, [this] { heartbeat_.look(); });
  hung_.get_future().wait();
  std::promise<void> looks;
  const auto commands = std::async(std::launch::async, [this, &looks] {
    looks.set_value();
    heartbeat_.look();
    steps_.emplace_back("command");
  });
  looks.get_future().wait();
  EXPECT_EQ(commands.wait_for(std::chrono::milliseconds(50)), std::future_status::timeout);
  relieved_.set_value();
  commands.wait();
  timers.wait();
  EXPECT_EQ(steps_, (std::vector<std::string>{"relieved", "command"}));
}

}  // namespace
}  // namespace xplane_bridge
