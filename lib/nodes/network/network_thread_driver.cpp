#include "xplane_bridge/nodes/network/network_thread_driver.hpp"

#include <poll.h>

#include <atomic>
#include <mutex>
#include <thread>
#include <utility>

namespace xplane_bridge {
namespace {

constexpr double kMillisecond = 1e-3;  // [s]

}  // namespace

class NetworkThreadDriver::Impl {
 public:
  Impl(DrivenByNetwork driven, core::Clock clock, ros::PollSet* poll_set)
      : driven_(std::move(driven)), clock_(std::move(clock)), poll_set_(poll_set) {}

  /// @param self holds this for the network thread
  void begin(const std::shared_ptr<Impl>& self) {
    poll_set_->addSocket(driven_.fd, [self](int) { self->onReadable(); });
    poll_set_->addEvents(driven_.fd, POLLIN);
    thread_ = std::thread([this] { stepWhenDue(); });
  }

  void end() {
    poll_set_->delSocket(driven_.fd);
    {
      const std::lock_guard<std::mutex> turn(turn_);
      const std::lock_guard<std::mutex> lock(mutex_);
      ended_ = true;
    }
    changed_.notifyAll();
    thread_.join();
  }

 private:
  /// On the network thread, which must not wait for the other one: that listens again when its turn is over.
  void onReadable() {
    std::unique_lock<std::mutex> turn(turn_, std::try_to_lock);
    if (!turn) {
      poll_set_->delEvents(driven_.fd, POLLIN);
      passed_over_ = true;
      if (!turn.try_lock()) return;  // whose turn it is now looks at that when it is over
    }
    if (!ended() && driven_.receive()) {
      {
        const std::lock_guard<std::mutex> lock(mutex_);
        due_ = true;
      }
      changed_.notifyAll();
    }
    listenAgain();
  }

  void stepWhenDue() {
    while (!ended()) {
      std::unique_lock<std::mutex> turn(turn_);
      driven_.step();
      const core::Deadline next(clock_, driven_.patience_ms() * kMillisecond);
      turn.unlock();
      listenAgain();
      std::unique_lock<std::mutex> lock(mutex_);
      changed_.waitUntil(&lock, next, [this] { return ended_ || due_; });
      due_ = false;
    }
  }

  bool ended() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return ended_;
  }

  /// Where the network thread has not been served.
  void listenAgain() {
    if (passed_over_.exchange(false)) poll_set_->addEvents(driven_.fd, POLLIN);
  }

  const DrivenByNetwork driven_;
  const core::Clock clock_;
  ros::PollSet* const poll_set_;
  std::atomic<bool> passed_over_{false};
  std::mutex turn_;   // is held while one of the two is at it
  std::mutex mutex_;  // guards the following
  core::ClockCondition changed_;
  bool ended_ = false, due_ = false;
  std::thread thread_;
};

NetworkThreadDriver::NetworkThreadDriver(DrivenByNetwork driven, core::Clock clock, ros::PollSet* poll_set)
    : impl_(std::make_shared<Impl>(std::move(driven), std::move(clock), poll_set)) {
  impl_->begin(impl_);
}

NetworkThreadDriver::~NetworkThreadDriver() { impl_->end(); }

}  // namespace xplane_bridge
