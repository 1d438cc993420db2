#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace xplane_bridge {

/// A thread that works on the items pushed to it: when it cannot keep up, the oldest waiting item
/// is dropped and counted, and the caller of pushDroppingOldest never waits.
template <class Item>
class LatestWorker {
 public:
  using Work = std::function<void(Item&)>;

  /// @param capacity items that may wait, >= 1
  LatestWorker(std::size_t capacity, Work work)
      : capacity_(capacity), work_(std::move(work)), thread_([this] { run(); }) {}
  ~LatestWorker() { stop(); }
  LatestWorker(const LatestWorker&) = delete;
  LatestWorker& operator=(const LatestWorker&) = delete;

  /// Hands an item over. @return false when an older one had to be dropped for it
  bool pushDroppingOldest(Item item) {
    bool kept_all = true;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (stopped_) return false;
      if (waiting_.size() >= capacity_) {
        waiting_.pop_front();
        ++dropped_;
        kept_all = false;
      }
      waiting_.push_back(std::move(item));
    }
    changed_.notify_one();
    return kept_all;
  }

  /// Ends the thread; what waits is forgotten.
  void stop() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      stopped_ = true;
    }
    changed_.notify_one();
    if (thread_.joinable()) thread_.join();
  }

  [[nodiscard]] std::uint64_t dropped() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return dropped_;
  }

 private:
  void run() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return stopped_ || !waiting_.empty(); });
      if (stopped_) return;
      Item item = std::move(waiting_.front());
      waiting_.pop_front();
      lock.unlock();
      work_(item);
      lock.lock();
    }
  }

  std::size_t capacity_;
  Work work_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Item> waiting_;
  std::uint64_t dropped_ = 0;
  bool stopped_ = false;
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace xplane_bridge
