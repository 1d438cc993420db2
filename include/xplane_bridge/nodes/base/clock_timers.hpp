#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include <ros/callback_queue_interface.h>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/base/timer_schedule.hpp"

namespace xplane_bridge {

/// Periodic timers and alarms on a clock, served by a callback queue like messages. A thread of its own waits for the
/// clock and hands over what is due; of one timer at most one call waits in the queue, and times missed meanwhile are
/// left out.
class ClockTimers {
 public:
  ClockTimers(core::Clock clock, ros::CallbackQueueInterface* queue);
  /// stop()
  ~ClockTimers();
  ClockTimers(const ClockTimers&) = delete;
  ClockTimers& operator=(const ClockTimers&) = delete;

  /// A timer that is due every `period` [s] from now on. Only before start(). @throws std::logic_error after it
  void add(double period, std::function<void()> callback);
  /// A timer that is due when it is set. Only before start(). @throws std::logic_error after it
  core::TimerSchedule::Timer addAlarm(std::function<void()> callback);
  /// That one is due at `due_ns` [ns, steady] once, instead of the time it was set to before. From any thread.
  void setAlarm(core::TimerSchedule::Timer alarm, std::int64_t due_ns);
  /// Begins with what is due already.
  void start();
  /// [ns, steady] when one is due next.
  std::optional<std::int64_t> next();
  /// Instead of start(): calls what is due now, on the calling thread.
  void runDue();
  /// Periodic ones begin anew: due one period from now.
  void restart();
  /// No callback begins any more; waits for one that runs.
  void stop();

 private:
  struct Timer {
    std::function<void()> callback;
    bool is_alarm = false;
    std::atomic<bool> waiting{false};  ///< in the queue; of a periodic one, or called just now
  };
  class Call;

  void addTimer(std::function<void()> callback, bool is_alarm);
  void run();
  std::uint64_t id() const { return reinterpret_cast<std::uintptr_t>(this); }

  core::Clock clock_;
  ros::CallbackQueueInterface* queue_;
  core::TimerSchedule schedule_;
  std::vector<std::shared_ptr<Timer>> timers_;
  std::mutex mutex_;
  core::ClockCondition changed_;
  bool stopped_ = false;
  bool alarm_set_ = false;  // since the thread has looked at the schedule
  std::thread thread_;
};

}  // namespace xplane_bridge
