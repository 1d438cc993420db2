#include "xplane_bridge/nodes/network/network_thread_driver.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>

#include <gtest/gtest.h>

namespace xplane_bridge {
namespace {

constexpr int kForever = 3'600'000;  // [ms]
constexpr int kPollMs = 50;
constexpr int kManyPolls = 400;

/// The test's thread is roscpp's network thread; a counter that is not 0 is what there is to read.
class NetworkThreadDriverTest : public testing::Test {
 protected:
  ~NetworkThreadDriverTest() override {
    driver_.reset();
    close(fd_);
  }

  void drive(int patience_ms) {
    const DrivenByNetwork driven{fd_, [this] { return receive(); }, [this] { step(); },
                                 [patience_ms] { return patience_ms; }};
    driver_ = std::make_unique<NetworkThreadDriver>(driven, core::hostClock(), &poll_set_);
  }

  bool receive() {
    EXPECT_EQ(std::this_thread::get_id(), network_);
    ++by_network_;
    take();
    return due_;
  }

  void step() {
    EXPECT_NE(std::this_thread::get_id(), network_);
    {
      std::unique_lock<std::mutex> lock(mutex_);
      ++by_own_;
      changed_.notify_all();
      changed_.wait(lock, [this] { return !held_; });
    }
    take();
  }

  void take() {
    std::uint64_t count = 0;
    if (read(fd_, &count, sizeof count) == sizeof count) got_ += static_cast<int>(count);
  }

  void arrive() const {
    const std::uint64_t one = 1;
    ASSERT_EQ(write(fd_, &one, sizeof one), static_cast<ssize_t>(sizeof one));
  }

  void waitForOwn(int steps) {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this, steps] { return by_own_ >= steps; });
  }

  void hold(bool held) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      held_ = held;
    }
    changed_.notify_all();
  }

  /// As roscpp's network thread does, until `count` have been read.
  void pollUntilGot(int count) {
    for (int i = 0; i < kManyPolls && got_ < count; ++i) poll_set_.update(kPollMs);
  }

  const std::thread::id network_ = std::this_thread::get_id();
  const int fd_ = eventfd(0, EFD_NONBLOCK);
  ros::PollSet poll_set_;
  std::atomic<int> by_network_{0}, got_{0};
  std::mutex mutex_;
  std::condition_variable changed_;
  int by_own_ = 0;
  bool held_ = false;
  bool due_ = false;  // of the network thread
  std::unique_ptr<NetworkThreadDriver> driver_;
};

TEST_F(NetworkThreadDriverTest, ReadsOnTheThreadThatPolls) {
  drive(kForever);
  waitForOwn(1);
  arrive();
  pollUntilGot(1);
  arrive();
  pollUntilGot(2);
  EXPECT_EQ(got_, 2);
  EXPECT_GE(by_network_, 1);
  EXPECT_EQ(by_own_, 1) << "nothing was due";
}

TEST_F(NetworkThreadDriverTest, DoesByItselfWhatIsDue) {
  drive(1);
  arrive();
  waitForOwn(3);
  EXPECT_EQ(got_, 1);
  EXPECT_EQ(by_network_, 0) << "nothing polls";
}

TEST_F(NetworkThreadDriverTest, DoesAtOnceWhatADatagramMakesDue) {
  drive(kForever);
  waitForOwn(1);
  due_ = true;
  arrive();
  pollUntilGot(1);
  if (by_network_ == 0) {  // read by the first step
    arrive();
    pollUntilGot(2);
  }
  waitForOwn(2);
}

TEST_F(NetworkThreadDriverTest, KeepsTheNetworkThreadFromWaiting) {
  hold(true);
  drive(kForever);
  waitForOwn(1);  // and stays there
  arrive();
  poll_set_.update(kPollMs);
  poll_set_.update(1);  // does not listen meanwhile, so that it is not woken again and again
  EXPECT_EQ(by_network_, 0);
  hold(false);
  pollUntilGot(1);
  arrive();
  pollUntilGot(2);
  EXPECT_EQ(got_, 2);
  EXPECT_GE(by_network_, 1) << "it listens again";
}

TEST_F(NetworkThreadDriverTest, EndsWithWhatDrivesIt) {
  drive(kForever);
  waitForOwn(1);
  driver_.reset();
  const int steps = by_network_;
  arrive();
  poll_set_.update(1);
  EXPECT_EQ(by_network_, steps);
  EXPECT_EQ(got_, 0);
}

}  // namespace
}  // namespace xplane_bridge
