#include "xplane_bridge/nodes/network/immediate_queue.hpp"

#include <functional>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <boost/make_shared.hpp>

namespace xplane_bridge {
namespace {

/// What roscpp puts in for a message.
class Callback : public ros::CallbackInterface {
 public:
  explicit Callback(std::function<CallResult()> called) : called_(std::move(called)) {}
  CallResult call() override { return called_(); }

 private:
  const std::function<CallResult()> called_;
};

class ImmediateQueueTest : public testing::Test {
 protected:
  /// One that writes its number and its thread down.
  ros::CallbackInterfacePtr numbered(int number) {
    return boost::make_shared<Callback>([this, number] {
      called_.push_back(number);
      thread_ = std::this_thread::get_id();
      return ros::CallbackInterface::Success;
    });
  }

  ImmediateQueue queue_;
  std::vector<int> called_;
  std::thread::id thread_;
};

TEST_F(ImmediateQueueTest, ServesOnTheThreadThatPutsIn) {
  queue_.open();
  std::thread network([this] {
    queue_.addCallback(numbered(1), 0);
    EXPECT_EQ(thread_, std::this_thread::get_id());
  });
  network.join();
  EXPECT_EQ(called_, std::vector<int>{1});
}

TEST_F(ImmediateQueueTest, KeepsTheOrderOfWhatCameBeforeItWasOpened) {
  for (int number : {1, 2, 3}) queue_.addCallback(numbered(number), 0);
  EXPECT_TRUE(called_.empty());
  queue_.open();
  queue_.addCallback(numbered(4), 0);
  EXPECT_EQ(called_, (std::vector<int>{1, 2, 3, 4}));
}

TEST_F(ImmediateQueueTest, ForgetsWhatASubscriptionHasLeft) {
  constexpr std::uint64_t kEnded = 7;
  queue_.addCallback(numbered(1), kEnded);
  queue_.addCallback(numbered(2), 8);
  queue_.addCallback(numbered(3), kEnded);
  queue_.removeByID(kEnded);
  queue_.open();
  EXPECT_EQ(called_, std::vector<int>{2});
}

TEST_F(ImmediateQueueTest, AsksAgainWhileTheSubscriptionIsBusy) {
  int asked = 0;
  queue_.open();
  queue_.addCallback(boost::make_shared<Callback>([&asked] {
                       return ++asked < 3 ? ros::CallbackInterface::TryAgain : ros::CallbackInterface::Success;
                     }),
                     0);
  EXPECT_EQ(asked, 3);
}

}  // namespace
}  // namespace xplane_bridge
