#include "xplane_bridge/core/base/timer_schedule.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

namespace xplane_bridge::core {
namespace {

using Timers = std::vector<TimerSchedule::Timer>;

TEST(TimerSchedule, BeginsOnePeriodLater) {
  TimerSchedule schedule;
  EXPECT_EQ(schedule.next(), std::nullopt);
  schedule.add(1000, 20);
  EXPECT_EQ(schedule.next(), 1020);
  EXPECT_EQ(schedule.takeDue(1019), Timers{});
  EXPECT_EQ(schedule.takeDue(1020), Timers{0});
  EXPECT_EQ(schedule.next(), 1040);
}

TEST(TimerSchedule, NamesThemByTheTimesTheyWereDue) {
  TimerSchedule schedule;
  schedule.add(0, 50);
  schedule.add(0, 20);
  schedule.add(0, 50);
  schedule.add(0, 30);
  EXPECT_EQ(schedule.next(), 20);
  EXPECT_EQ(schedule.takeDue(55), (Timers{1, 3, 0, 2}));
  EXPECT_EQ(schedule.next(), 60);
  EXPECT_EQ(schedule.takeDue(60), (Timers{1, 3}));
}

TEST(TimerSchedule, DoesNotMakeUpForMissedTimes) {
  TimerSchedule schedule;
  schedule.add(0, 20);
  EXPECT_EQ(schedule.takeDue(75), Timers{0});  // was due at 20, 40 and 60
  EXPECT_EQ(schedule.takeDue(79), Timers{});
  EXPECT_EQ(schedule.takeDue(80), Timers{0});
  EXPECT_EQ(schedule.takeDue(100), Timers{0});
}

TEST(TimerSchedule, AnAlarmIsDueOnceEachTimeItIsSet) {
  TimerSchedule schedule;
  const auto alarm = schedule.addAlarm();
  EXPECT_EQ(schedule.next(), std::nullopt);
  EXPECT_EQ(schedule.takeDue(1000), Timers{});
  schedule.setAlarm(alarm, 1020);
  schedule.setAlarm(alarm, 1010);  // instead
  EXPECT_EQ(schedule.next(), 1010);
  EXPECT_EQ(schedule.takeDue(1009), Timers{});
  EXPECT_EQ(schedule.takeDue(1030), Timers{alarm});
  EXPECT_EQ(schedule.next(), std::nullopt);
  EXPECT_EQ(schedule.takeDue(2000), Timers{});
  schedule.setAlarm(alarm, 500);  // over already
  EXPECT_EQ(schedule.takeDue(2000), Timers{alarm});
}

TEST(TimerSchedule, SetsAlarmsOnly) {
  TimerSchedule schedule;
  const auto timer = schedule.add(0, 20);
  EXPECT_THROW(schedule.setAlarm(timer, 10), std::invalid_argument);
  EXPECT_THROW(schedule.setAlarm(7, 10), std::invalid_argument);
}

TEST(TimerSchedule, BeginsAnewWhereItIsRestartedButLeavesAlarmsAsTheyAre) {
  TimerSchedule schedule;
  const auto timer = schedule.add(3, 20);
  const auto alarm = schedule.addAlarm();
  schedule.setAlarm(alarm, 105);
  schedule.restart(100);
  EXPECT_EQ(schedule.takeDue(119), Timers{alarm});
  EXPECT_EQ(schedule.takeDue(120), Timers{timer});
  EXPECT_EQ(schedule.next(), 140);
}

TEST(TimerSchedule, RefusesAPeriodThatIsNone) {
  TimerSchedule schedule;
  EXPECT_THROW(schedule.add(0, 0), std::invalid_argument);
  EXPECT_THROW(schedule.add(0, -1), std::invalid_argument);
}

}  // namespace
}  // namespace xplane_bridge::core
