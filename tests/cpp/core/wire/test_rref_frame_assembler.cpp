#include "xplane_bridge/core/wire/rref_frame_assembler.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "recorded_flight.hpp"

namespace xplane_bridge::core {
namespace {

constexpr std::int64_t kFrame = 16'666'667;    // [ns]
constexpr std::int64_t kPeriod = 100'000'000;  // of a group at 10/s [ns]

/// A datagram with these indices, value = index + 100 * frame.
Datagram pairs(std::initializer_list<std::int32_t> indices, int frame = 0) {
  Datagram d = Datagram::labelled("RREF,");
  for (const std::int32_t i : indices) d.pair(i, static_cast<float>(i + 100 * frame));
  return d;
}

TEST(RrefFrameAssembler, OneDatagramIsOneSample) {
  RrefFrameAssembler frames(3);
  EXPECT_TRUE(frames.add(pairs({0, 1, 2}).rref(), 1000));
  EXPECT_EQ(frames.values(), (std::vector<float>{0, 1, 2}));
  EXPECT_EQ(frames.receiveTime(), 1000);
  EXPECT_EQ(frames.counters().samples, 1U);
}

TEST(RrefFrameAssembler, OrderOfPairsDoesNotMatter) {
  RrefFrameAssembler frames(3);
  EXPECT_TRUE(frames.add(pairs({2, 0, 1}).rref(), 0));
  EXPECT_EQ(frames.values(), (std::vector<float>{0, 1, 2}));
}

TEST(RrefFrameAssembler, FirstIndexShiftsThePositions) {
  RrefFrameAssembler frames(2, 40);
  EXPECT_TRUE(frames.add(pairs({40, 41}).rref(), 0));
  EXPECT_EQ(frames.values(), (std::vector<float>{40, 41}));
}

TEST(RrefFrameAssembler, PiecesOfOneFrameAreJoined) {
  RrefFrameAssembler frames(5);
  for (int f = 0; f < 3; ++f) {
    EXPECT_FALSE(frames.add(pairs({0, 1, 2}, f).rref(), f * kFrame + 10));
    EXPECT_TRUE(frames.add(pairs({3, 4}, f).rref(), f * kFrame + 90));
    EXPECT_EQ(frames.values()[0], 100.0F * static_cast<float>(f));
    EXPECT_EQ(frames.values()[4], 4.0F + 100.0F * static_cast<float>(f));
    EXPECT_EQ(frames.receiveTime(), f * kFrame + 10);
  }
  EXPECT_EQ(frames.counters().incomplete, 0U);
}

// 20 a second of 30 frames: two of three, for each index other ones.
TEST(RrefFrameAssembler, ADatagramMayCompleteASampleAndBeginTheNext) {
  RrefFrameAssembler frames(2, 0, RrefFrameAssembler::Options::atRate(20));
  int samples = 0;
  for (int frame = 0; frame < 300; ++frame) {
    Datagram datagram = Datagram::labelled("RREF,");
    if (frame % 3 != 0) datagram.pair(0, static_cast<float>(frame));
    if (frame % 3 != 2) datagram.pair(1, static_cast<float>(frame));
    if (!frames.add(datagram.rref(), frame * 2 * kFrame)) continue;
    ++samples;
    EXPECT_LE(std::abs(frames.values()[0] - frames.values()[1]), 1.0F);
  }
  EXPECT_EQ(samples, 200);
  EXPECT_EQ(frames.counters().incomplete, 0U);
}

// 50 a second of 60 frames: a frame that lacks an index is given up, as it would take its value from another frame.
TEST(RrefFrameAssembler, NearTheFrameRateFramesWithAllIndicesAreTheSamples) {
  RrefFrameAssembler frames(2, 0, RrefFrameAssembler::Options::atRate(50));
  int samples = 0;
  for (int frame = 0; frame < 300; ++frame) {
    Datagram datagram = Datagram::labelled("RREF,");
    if (frame % 6 != 0) datagram.pair(0, static_cast<float>(frame));
    if (frame % 6 != 3) datagram.pair(1, static_cast<float>(frame));
    if (!frames.add(datagram.rref(), frame * kFrame)) continue;
    ++samples;
    EXPECT_EQ(frames.values()[0], frames.values()[1]);
  }
  EXPECT_EQ(samples, 200);
  EXPECT_EQ(frames.silentCount(), 0U);
}

TEST(RrefFrameAssembler, LostPieceLosesTheFrameAndNothingElse) {
  RrefFrameAssembler frames(4);
  EXPECT_FALSE(frames.add(pairs({0, 1}, 0).rref(), 0));  // {2, 3} of this frame is lost
  EXPECT_FALSE(frames.add(pairs({0, 1}, 1).rref(), kFrame));
  EXPECT_TRUE(frames.add(pairs({2, 3}, 1).rref(), kFrame + 50));
  EXPECT_EQ(frames.values(), (std::vector<float>{100, 101, 102, 103}));
  EXPECT_EQ(frames.counters().incomplete, 1U);
}

// First half of one frame, second half of the next: each missing its other half. They must never become one sample.
TEST(RrefFrameAssembler, HalvesOfDifferentFramesAreNotJoined) {
  RrefFrameAssembler frames(4);
  EXPECT_FALSE(frames.add(pairs({0, 1}, 0).rref(), 0));
  EXPECT_FALSE(frames.add(pairs({2, 3}, 1).rref(), kFrame));
}

TEST(RrefFrameAssembler, SlowGroupsMayComeInPieces) {
  RrefFrameAssembler frames(3, 0, RrefFrameAssembler::Options::atRate(10));
  for (int f = 0; f < 4; ++f) {
    EXPECT_FALSE(frames.add(pairs({0}, f).rref(), f * kPeriod));
    EXPECT_FALSE(frames.add(pairs({1}, f).rref(), f * kPeriod + kFrame));
    EXPECT_TRUE(frames.add(pairs({2}, f).rref(), f * kPeriod + 2 * kFrame));
  }
}

// Ten a second in six frames of each period: the last piece comes most of a period after the first.
TEST(RrefFrameAssembler, SlowGroupsMayComeInPiecesInEveryFrame) {
  RrefFrameAssembler frames(6, 0, RrefFrameAssembler::Options::atRate(10));
  int samples = 0;
  for (int f = 0; f < 60; ++f) samples += frames.add(pairs({f % 6}).rref(), f * kFrame) ? 1 : 0;
  EXPECT_EQ(samples, 10);
}

TEST(RrefFrameAssembler, PiecesOfASlowGroupAreJoinedOverTheShorterPause) {
  RrefFrameAssembler frames(2, 0, RrefFrameAssembler::Options::atRate(10));
  for (int f = 0; f < 4; ++f) {
    EXPECT_EQ(frames.add(pairs({0}, f).rref(), f * kPeriod), f > 0);
    EXPECT_FALSE(frames.add(pairs({1}, f).rref(), f * kPeriod + 85'000'000));
  }
  EXPECT_EQ(frames.values(), (std::vector<float>{300, 201}));
}

/// Feeds each period's frame in two datagrams, {0, 1, 2} and {3, 4}, of which `comes` says whether it comes.
/// @return how many samples there were; all of one frame each, else a test failure
int feedInTwo(RrefFrameAssembler* frames, const std::function<bool(int frame, bool second)>& comes) {
  int samples = 0;
  for (int f = 0; f < 20; ++f) {
    for (const bool second : {false, true}) {
      if (!comes(f, second)) continue;
      const Datagram datagram = second ? pairs({3, 4}, f) : pairs({0, 1, 2}, f);
      if (!frames->add(datagram.rref(), f * kPeriod + (second ? 10'000 : 0))) continue;
      ++samples;
      EXPECT_EQ(frames->values()[0], 100.0F * static_cast<float>(f));
      EXPECT_EQ(frames->receiveTime(), f * kPeriod);
      if (frames->silentCount() == 0) {
        EXPECT_EQ(frames->values()[4], 4.0F + 100.0F * static_cast<float>(f));
      }
    }
  }
  return samples;
}

TEST(RrefFrameAssembler, ALostBeginningDoesNotJoinTwoPeriods) {
  RrefFrameAssembler frames(5, 0, RrefFrameAssembler::Options::atRate(10));
  EXPECT_EQ(feedInTwo(&frames, [](int frame, bool second) { return frame != 4 || second; }), 19);
  EXPECT_EQ(frames.counters().incomplete, 1U);
}

// As while a long list is still being asked for.
TEST(RrefFrameAssembler, IndicesThatBeginLateDoNotJoinTwoPeriods) {
  RrefFrameAssembler frames(5, 0, RrefFrameAssembler::Options::atRate(10));
  EXPECT_GE(feedInTwo(&frames, [](int frame, bool second) { return frame >= 6 || !second; }), 16);
  EXPECT_EQ(frames.silentCount(), 0U);
}

TEST(RrefFrameAssembler, SilentIndexIsLearntNamedAndDoesNotBlock) {
  RrefFrameAssembler frames(3);
  int samples = 0;
  for (int f = 0; f < 20; ++f) samples += frames.add(pairs({0, 2}, f).rref(), f * kFrame) ? 1 : 0;
  EXPECT_GE(samples, 16);
  EXPECT_TRUE(frames.isSilent(1));
  EXPECT_FALSE(frames.isSilent(0));
  EXPECT_EQ(frames.silentCount(), 1U);
  EXPECT_TRUE(std::isnan(frames.values()[1]));
  EXPECT_EQ(frames.values()[2], 1902.0F);
}

TEST(RrefFrameAssembler, SilentIndexMayWakeUp) {
  RrefFrameAssembler frames(3);
  for (int f = 0; f < 10; ++f) frames.add(pairs({0, 2}, f).rref(), f * kFrame);
  ASSERT_TRUE(frames.isSilent(1));
  EXPECT_TRUE(frames.add(pairs({0, 1, 2}, 10).rref(), 10 * kFrame));
  EXPECT_FALSE(frames.isSilent(1));
  EXPECT_EQ(frames.values()[1], 1001.0F);
}

TEST(RrefFrameAssembler, ResetForgetsSilence) {
  RrefFrameAssembler frames(2);
  for (int f = 0; f < 10; ++f) frames.add(pairs({0}, f).rref(), f * kFrame);
  ASSERT_EQ(frames.silentCount(), 1U);
  frames.reset();
  EXPECT_EQ(frames.silentCount(), 0U);
  EXPECT_FALSE(frames.add(pairs({0}, 11).rref(), 11 * kFrame));
}

TEST(RrefFrameAssembler, DuplicateDatagramIsAnotherSample) {
  RrefFrameAssembler frames(2);
  EXPECT_TRUE(frames.add(pairs({0, 1}).rref(), 0));
  EXPECT_TRUE(frames.add(pairs({0, 1}).rref(), 10));
}

TEST(RrefFrameAssembler, ForeignIndicesAreCounted) {
  RrefFrameAssembler frames(2);
  EXPECT_TRUE(frames.add(pairs({0, 7, -3, 1}).rref(), 0));
  EXPECT_EQ(frames.counters().foreign_index, 2U);
  Datagram extreme = Datagram::labelled("RREF,");
  extreme.pair(std::numeric_limits<std::int32_t>::min(), 1.0F).pair(std::numeric_limits<std::int32_t>::max(), 1.0F);
  EXPECT_FALSE(frames.add(extreme.rref(), 1));
}

TEST(RrefFrameAssembler, NonFiniteValuesAreUnknown) {
  RrefFrameAssembler frames(2);
  Datagram d = Datagram::labelled("RREF,");
  d.pair(0, std::numeric_limits<float>::infinity()).pair(1, 5.0F);
  EXPECT_TRUE(frames.add(d.rref(), 0));
  EXPECT_TRUE(std::isnan(frames.values()[0]));
  EXPECT_EQ(frames.values()[1], 5.0F);
  EXPECT_EQ(frames.counters().non_finite, 1U);
}

// One index left out of one sample must not show the value of the sample before.
TEST(RrefFrameAssembler, OldValuesAreNotCarriedOver) {
  RrefFrameAssembler frames(2);
  for (int f = 0; f < 10; ++f) frames.add(pairs({0}, f).rref(), f * kFrame);
  EXPECT_TRUE(frames.add(pairs({0, 1}, 10).rref(), 10 * kFrame));
  for (int f = 11; f < 20; ++f) frames.add(pairs({0}, f).rref(), f * kFrame);
  EXPECT_TRUE(std::isnan(frames.values()[1]));
}

}  // namespace
}  // namespace xplane_bridge::core
