#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/base/thread_turns.hpp"

namespace xplane_bridge {

/// A thread that does one piece of work after the other, in its turns.
class TurnWorker {
 public:
  explicit TurnWorker(std::shared_ptr<core::ThreadTurns> turns)
      : seat_(std::move(turns)), thread_([this] { loop(); }) {}
  /// What has not begun is dropped; waits for what has.
  ~TurnWorker() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ends_ = true;
    }
    changed_.notifyAll();
    seat_.letEnd();
    thread_.join();
  }
  TurnWorker(const TurnWorker&) = delete;
  TurnWorker& operator=(const TurnWorker&) = delete;

  /// `work` must not throw.
  void add(std::function<void()> work) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      work_.push_back(std::move(work));
    }
    changed_.notifyAll();
  }

 private:
  void loop() {
    const core::ThreadSeat::Taken turns(&seat_);
    std::unique_lock<std::mutex> lock(mutex_);
    for (;;) {
      changed_.wait(&lock, [this] { return ends_ || !work_.empty(); });
      if (ends_) return;
      const std::function<void()> work = std::move(work_.front());
      work_.pop_front();
      lock.unlock();
      work();
      lock.lock();
    }
  }

  std::mutex mutex_;
  core::ClockCondition changed_;
  std::deque<std::function<void()>> work_;
  bool ends_ = false;
  core::ThreadSeat seat_;
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace xplane_bridge
