#include "xplane_bridge/core/base/timer_schedule.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

namespace xplane_bridge::core {
namespace {

constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

}  // namespace

TimerSchedule::Timer TimerSchedule::add(std::int64_t now_ns, std::int64_t period_ns) {
  if (period_ns <= 0) {
    throw std::invalid_argument("the period of a timer is " + std::to_string(period_ns) + " ns: expected more than 0");
  }
  timers_.push_back({now_ns + period_ns, period_ns});
  return timers_.size() - 1;
}

TimerSchedule::Timer TimerSchedule::addAlarm() {
  timers_.push_back({kNever, 0});
  return timers_.size() - 1;
}

void TimerSchedule::setAlarm(Timer alarm, std::int64_t due_ns) {
  if (alarm >= timers_.size() || timers_[alarm].period_ns != 0) {
    throw std::invalid_argument("timer " + std::to_string(alarm) + " is no alarm");
  }
  timers_[alarm].due_ns = due_ns;
}

void TimerSchedule::restart(std::int64_t now_ns) {
  for (Entry& entry : timers_) {
    if (entry.period_ns != 0) {
      entry.due_ns = now_ns + entry.period_ns;
    }
  }
}

std::optional<std::int64_t> TimerSchedule::next() const {
  const auto first = std::min_element(timers_.begin(), timers_.end(),
                                      [](const Entry& a, const Entry& b) { return a.due_ns < b.due_ns; });
  return first == timers_.end() || first->due_ns == kNever ? std::nullopt : std::optional<std::int64_t>(first->due_ns);
}

std::vector<TimerSchedule::Timer> TimerSchedule::takeDue(std::int64_t now_ns) {
  std::vector<Timer> due;
  for (Timer timer = 0; timer < timers_.size(); ++timer) {
    if (timers_[timer].due_ns <= now_ns) {
      due.push_back(timer);
    }
  }
  std::stable_sort(due.begin(), due.end(), [this](Timer a, Timer b) { return timers_[a].due_ns < timers_[b].due_ns; });
  for (const Timer timer : due) {
    Entry& entry = timers_[timer];
    if (entry.period_ns == 0) {
      entry.due_ns = kNever;
      continue;
    }
    entry.due_ns += ((now_ns - entry.due_ns) / entry.period_ns + 1) * entry.period_ns;
  }
  return due;
}

}  // namespace xplane_bridge::core
