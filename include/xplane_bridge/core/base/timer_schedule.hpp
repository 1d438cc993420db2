#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace xplane_bridge::core {

/// When timers are due: periodic ones, and alarms that go off once. Times are passed in: it knows neither clocks nor
/// threads.
class TimerSchedule {
 public:
  /// Numbers of the timers, in the order of add().
  using Timer = std::size_t;

  /// A timer that is due every `period_ns` [ns], > 0, for the first time one period after `now_ns`.
  Timer add(std::int64_t now_ns, std::int64_t period_ns);

  /// A timer that is due once for each setAlarm().
  Timer addAlarm();
  /// An alarm is due at `due_ns`, instead of the time it was set to before. @throws std::invalid_argument for a timer
  /// that is no alarm
  void setAlarm(Timer alarm, std::int64_t due_ns);

  /// Periodic timers begin anew: due one period after `now_ns`.
  void restart(std::int64_t now_ns);

  /// [ns] when the next timer is due; nullopt when none will be.
  std::optional<std::int64_t> next() const;

  /// The timers due at `now_ns`, by the times they were due at, those of the same time in the order of add(). A timer
  /// that was due several times since the last call is named once: it goes on with the next of its times after
  /// `now_ns`.
  std::vector<Timer> takeDue(std::int64_t now_ns);

 private:
  struct Entry {
    std::int64_t due_ns;
    std::int64_t period_ns;  // 0: an alarm
  };
  std::vector<Entry> timers_;
};

}  // namespace xplane_bridge::core
