#include "xplane_bridge/core/link/subscription.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace xplane_bridge::core {
namespace {

/// A port that only remembers what it is asked for; the test delivers.
class SubscriptionTest : public testing::Test {
 protected:
  Subscription subscribe(RrefHandler handler, std::shared_ptr<HandlerMutex> mutex = nullptr) {
    delivery_ = std::make_shared<RrefDelivery>(std::move(handler), std::move(mutex));
    return {delivery_,
            [this](std::uint32_t list, const std::optional<RrefGroup>& group) {
              if (group && group->datarefs.empty()) {
                throw std::invalid_argument("empty");
              }
              list_ = list;
              asked_.push_back(group ? group->name : "nothing");
            },
            named("first")};
  }
  Subscription subscribeCounting() {
    return subscribe([this](const RrefView&, const ReceiveInfo&) { ++calls_; });
  }

  static RrefGroup named(const std::string& name) { return {name, {"a/b"}, 10, 0}; }
  void deliver(std::uint32_t list) { delivery_->deliver(list, RrefView(), ReceiveInfo()); }

  std::shared_ptr<RrefDelivery> delivery_;
  std::uint32_t list_ = 0;
  std::vector<std::string> asked_;
  std::atomic<int> calls_{0};
};

TEST_F(SubscriptionTest, EmptyHandleDoesNothing) {
  Subscription empty;
  EXPECT_FALSE(empty);
  empty.reset();
  EXPECT_THROW(empty.replace(named("x")), std::logic_error);
  EXPECT_THROW(subscribe(nullptr), std::invalid_argument);
}

TEST_F(SubscriptionTest, OnlyTheNewestListIsDelivered) {
  Subscription subscription = subscribeCounting();
  const std::uint32_t first = list_;
  deliver(first);
  EXPECT_EQ(calls_, 1);
  subscription.replace(named("second"));
  EXPECT_NE(list_, first);
  deliver(first);
  EXPECT_EQ(calls_, 1) << "a datagram of the old list";
  deliver(list_);
  EXPECT_EQ(calls_, 2);
  EXPECT_EQ(asked_, (std::vector<std::string>{"first", "second"}));
}

TEST_F(SubscriptionTest, RefusedListLeavesTheOldOne) {
  Subscription subscription = subscribeCounting();
  EXPECT_THROW(subscription.replace({"bad", {}, 10, 0}), std::invalid_argument);
  deliver(list_);
  EXPECT_EQ(calls_, 1);
  EXPECT_TRUE(subscription);
}

TEST_F(SubscriptionTest, EndsOnceWhereverTheHandleGoes) {
  {
    Subscription first = subscribeCounting();
    Subscription second = std::move(first);
    EXPECT_FALSE(first);  // NOLINT(bugprone-use-after-move): that it is empty is the point
    EXPECT_TRUE(second);
    deliver(list_);
    EXPECT_EQ(calls_, 1);
    Subscription third;
    third = std::move(second);
    EXPECT_EQ(asked_, std::vector<std::string>{"first"}) << "moving ends nothing";
    third.replace(named("second"));
  }
  EXPECT_EQ(asked_, (std::vector<std::string>{"first", "second", "nothing"}));
  deliver(1);
  deliver(2);
  EXPECT_EQ(calls_, 1);
}

TEST_F(SubscriptionTest, AssigningEndsWhatWasThere) {
  Subscription subscription = subscribeCounting();
  const auto old = delivery_;
  subscription = subscribeCounting();
  EXPECT_EQ(asked_, (std::vector<std::string>{"first", "first", "nothing"}));
  old->deliver(1, RrefView(), ReceiveInfo());
  EXPECT_EQ(calls_, 0);
}

TEST_F(SubscriptionTest, HandlerMayEndItself) {
  Subscription subscription;
  std::vector<int> kept(1000, 7);
  subscription = subscribe([this, &subscription, kept](const RrefView&, const ReceiveInfo&) {
    subscription.reset();
    calls_ += kept.back();  // what it captured is still there
  });
  deliver(1);
  deliver(1);
  EXPECT_EQ(calls_, 7);
}

TEST_F(SubscriptionTest, WaitingDatagramOfTheOldListIsDroppedUnderTheOwnersMutex) {
  const auto mutex = std::make_shared<HandlerMutex>();
  Subscription subscription = subscribe([this](const RrefView&, const ReceiveInfo&) { ++calls_; }, mutex);
  std::thread link;
  {
    const std::lock_guard<HandlerMutex> lock(*mutex);
    link = std::thread([this] { deliver(1); });  // waits for the mutex, or comes to it later
    subscription.replace(named("second"));
  }
  link.join();
  EXPECT_EQ(calls_, 0);
}

TEST_F(SubscriptionTest, ResetWaitsForARunningHandler) {
  std::promise<void> entered;
  std::promise<void> leave;
  std::atomic<bool> left{false};
  Subscription subscription = subscribe([&](const RrefView&, const ReceiveInfo&) {
    entered.set_value();
    leave.get_future().wait();
    left = true;
  });
  std::thread link([this] { deliver(1); });
  entered.get_future().wait();
  auto ended = std::async(std::launch::async, [&] {
    subscription.reset();
    return left.load();
  });
  // A reset() that does not wait has returned by then.
  EXPECT_EQ(ended.wait_for(std::chrono::milliseconds(50)), std::future_status::timeout);
  leave.set_value();
  EXPECT_TRUE(ended.get());
  link.join();
}

}  // namespace
}  // namespace xplane_bridge::core
