#include "xplane_bridge/core/control/command_repeat.hpp"

#include <gtest/gtest.h>

namespace xplane_bridge::core {
namespace {

constexpr double kPeriod = 0.02;  // [s]

TEST(CommandRepeat, IsDueAtOnce) { EXPECT_TRUE(CommandRepeat(kPeriod).due(0.0)); }

TEST(CommandRepeat, IsNeverDueBetweenTheMessagesOfAStickThatSendsItsOwn) {
  // Of 50 Hz, as the timer, at each phase of it.
  for (double phase = 0.0; phase < kPeriod; phase += 0.001) {
    CommandRepeat repeat(kPeriod);
    for (int i = 0; i < 10; ++i) {
      repeat.heard(i * kPeriod);
      repeat.sent(i * kPeriod);
      EXPECT_FALSE(repeat.due(i * kPeriod + phase)) << phase;
    }
  }
}

TEST(CommandRepeat, IsDueInEachPeriodOnceTheStickIsSilent) {
  CommandRepeat repeat(kPeriod);
  repeat.heard(0.0);
  repeat.sent(0.0);
  int repeats = 0;
  for (int i = 1; i <= 10; ++i) {
    if (!repeat.due(i * kPeriod)) continue;
    ++repeats;
    repeat.sent(i * kPeriod);
  }
  EXPECT_EQ(repeats, 9) << "all but the first, which comes before the stick's next message could";
}

TEST(CommandRepeat, IsNotDueJustAfterACommand) {
  CommandRepeat repeat(kPeriod);
  repeat.sent(1.0);
  EXPECT_FALSE(repeat.due(1.005));
  EXPECT_TRUE(repeat.due(1.02));
}

}  // namespace
}  // namespace xplane_bridge::core
