#include "xplane_bridge/nodes/base/clock_timers.hpp"

#include <stdexcept>
#include <utility>

#include <boost/make_shared.hpp>

namespace xplane_bridge {

/// One call of a timer's callback, in the queue.
class ClockTimers::Call : public ros::CallbackInterface {
 public:
  explicit Call(std::shared_ptr<Timer> timer) : timer_(std::move(timer)) {}
  CallResult call() override {
    timer_->callback();
    timer_->waiting = false;
    return Success;
  }

 private:
  std::shared_ptr<Timer> timer_;
};

ClockTimers::ClockTimers(core::Clock clock, ros::CallbackQueueInterface* queue)
    : clock_(std::move(clock)), queue_(queue) {}

ClockTimers::~ClockTimers() { stop(); }

void ClockTimers::add(double period, std::function<void()> callback) {
  if (thread_.joinable()) {
    throw std::logic_error("a timer is added after the timers were started");
  }
  schedule_.add(clock_.steady_ns(), core::toNanoseconds(period));
  timers_.push_back(std::make_shared<Timer>());
  timers_.back()->callback = std::move(callback);
}

void ClockTimers::start() {
  if (!timers_.empty()) {
    thread_ = std::thread([this] { run(); });
  }
}

void ClockTimers::stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopped_ = true;
  }
  stopped_changed_.notifyAll();
  if (thread_.joinable()) {
    thread_.join();
    queue_->removeByID(id());
  }
}

void ClockTimers::run() {
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    const auto next = core::Deadline::at(clock_, *schedule_.next());
    if (stopped_changed_.waitUntil(&lock, next, [this] { return stopped_; })) {
      return;
    }
    for (const core::TimerSchedule::Timer due : schedule_.takeDue(clock_.steady_ns())) {
      if (!timers_[due]->waiting.exchange(true)) {
        queue_->addCallback(boost::make_shared<Call>(timers_[due]), id());
      }
    }
  }
}

}  // namespace xplane_bridge
