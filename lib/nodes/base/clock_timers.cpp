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
    // An alarm that is set anew while it is being called must go off again, a slow periodic timer must not.
    if (timer_->is_alarm) timer_->waiting = false;
    timer_->callback();
    if (!timer_->is_alarm) timer_->waiting = false;
    return Success;
  }

 private:
  std::shared_ptr<Timer> timer_;
};

ClockTimers::ClockTimers(core::Clock clock, ros::CallbackQueueInterface* queue)
    : clock_(std::move(clock)), queue_(queue) {}

ClockTimers::~ClockTimers() { stop(); }

void ClockTimers::addTimer(std::function<void()> callback, bool is_alarm) {
  if (thread_.joinable()) {
    throw std::logic_error("a timer is added after the timers were started");
  }
  timers_.push_back(std::make_shared<Timer>());
  timers_.back()->callback = std::move(callback);
  timers_.back()->is_alarm = is_alarm;
}

void ClockTimers::add(double period, std::function<void()> callback) {
  addTimer(std::move(callback), false);
  schedule_.add(clock_.steady_ns(), core::toNanoseconds(period));
}

core::TimerSchedule::Timer ClockTimers::addAlarm(std::function<void()> callback) {
  addTimer(std::move(callback), true);
  return schedule_.addAlarm();
}

void ClockTimers::setAlarm(core::TimerSchedule::Timer alarm, std::int64_t due_ns) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    schedule_.setAlarm(alarm, due_ns);
    alarm_set_ = true;
  }
  changed_.notifyAll();
}

void ClockTimers::start() {
  if (!timers_.empty()) {
    thread_ = std::thread([this] { run(); });
  }
}

std::optional<std::int64_t> ClockTimers::next() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return stopped_ ? std::nullopt : schedule_.next();
}

void ClockTimers::runDue() {
  std::vector<core::TimerSchedule::Timer> due;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (stopped_) {
      return;
    }
    due = schedule_.takeDue(clock_.steady_ns());
  }
  for (const core::TimerSchedule::Timer timer : due) {
    timers_[timer]->callback();
  }
}

void ClockTimers::restart() {
  const std::lock_guard<std::mutex> lock(mutex_);
  schedule_.restart(clock_.steady_ns());
}

void ClockTimers::stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopped_ = true;
  }
  changed_.notifyAll();
  if (thread_.joinable()) {
    thread_.join();
    queue_->removeByID(id());
  }
}

void ClockTimers::run() {
  std::unique_lock<std::mutex> lock(mutex_);
  const auto changed = [this] { return stopped_ || alarm_set_; };
  while (!stopped_) {
    alarm_set_ = false;
    if (const auto next = schedule_.next()) {
      changed_.waitUntil(&lock, core::Deadline::at(clock_, *next), changed);
    } else {
      changed_.wait(&lock, changed);
    }
    if (stopped_) {
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
