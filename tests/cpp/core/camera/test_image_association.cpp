#include "xplane_bridge/core/camera/image_association.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <set>
#include <stdexcept>
#include <vector>

namespace core = xplane_bridge::core;
using core::PairingMethod;

namespace {

core::SimFrame frameAt(double sim_time, double period = 1.0 / 60.0, std::uint32_t epoch = 0, bool paused = false) {
  return {sim_time, static_cast<float>(sim_time), period, paused, epoch};
}

core::StateKey stateAt(std::uint64_t id, double sim_time, std::uint32_t epoch = 0, bool paused = false) {
  return {id, static_cast<float>(sim_time), static_cast<std::int64_t>(sim_time * 1e9), epoch, paused};
}

core::ImageMoment momentAt(double sim_time, std::uint32_t epoch = 0) {
  core::ImageMoment moment;
  moment.sim_time = sim_time;
  moment.uncertainty = 0.0005;
  moment.epoch = epoch;
  moment.host_time_ns = static_cast<std::int64_t>(sim_time * 1e9);
  return moment;
}

/// Frames and states 0..count-1 at `fps` from `start`; the state's id is the frame number.
void feed(core::ImageAssociator& associator, int count, double fps, double start = 0.0, int state_every = 1) {
  for (int k = 0; k < count; ++k) {
    associator.addFrame(frameAt(start + k / fps, 1.0 / fps));
    if (k % state_every == 0) associator.addState(stateAt(static_cast<std::uint64_t>(k), start + k / fps));
  }
}

}  // namespace

TEST(ImageAssociator, RefusesOptionsThatCannotWork) {
  core::ImageAssociatorOptions options;
  options.max_gap = 0.0;
  EXPECT_THROW(core::ImageAssociator{options}, std::invalid_argument);
}

TEST(ImageAssociator, TakesTheStateOfTheFrameShown) {
  core::ImageAssociator associator;
  feed(associator, 60, 60.0);
  const auto answer = associator.associate(momentAt(30.0 / 60.0 + 0.004), false);
  EXPECT_EQ(answer.method, PairingMethod::kFrame);
  EXPECT_EQ(answer.id, 30U);
  EXPECT_NEAR(answer.frame_offset, 0.004, 1e-9);
  EXPECT_NEAR(answer.state_offset, 0.0, 1e-7);
  EXPECT_FALSE(answer.ambiguous);
  EXPECT_EQ(core::pairingQuality(momentAt(0.5), answer), 0U);
}

TEST(ImageAssociator, WaitsForTheStateOfTheFrameAndOnlyThen) {
  core::ImageAssociator associator;
  feed(associator, 10, 60.0);
  associator.addFrame(frameAt(10.0 / 60.0));
  EXPECT_TRUE(associator.associate(momentAt(10.0 / 60.0 + 0.002), false).pending);
  EXPECT_EQ(associator.counters().images, 0U);
  associator.addState(stateAt(10, 10.0 / 60.0));
  const auto answer = associator.associate(momentAt(10.0 / 60.0 + 0.002), false);
  EXPECT_FALSE(answer.pending);
  EXPECT_EQ(answer.id, 10U);
  EXPECT_EQ(associator.counters().images, 1U);
}

TEST(ImageAssociator, WaitsForAFrameThatMayBeNearer) {
  core::ImageAssociator associator;
  feed(associator, 10, 60.0);
  const auto moment = momentAt(9.8 / 60.0);
  EXPECT_TRUE(associator.associate(moment, false).pending);
  associator.addFrame(frameAt(10.0 / 60.0));
  associator.addState(stateAt(10, 10.0 / 60.0));
  EXPECT_EQ(associator.associate(moment, false).id, 10U);
}

TEST(ImageAssociator, FallsBackToTheNearestStateAtTheDeadlineAndSaysSo) {
  core::ImageAssociator associator;
  feed(associator, 10, 60.0);
  associator.addFrame(frameAt(10.0 / 60.0));
  const auto answer = associator.associate(momentAt(10.0 / 60.0), true);
  EXPECT_EQ(answer.method, PairingMethod::kNearestFrame);
  EXPECT_EQ(answer.id, 9U);
  EXPECT_NEAR(answer.state_offset, -1.0 / 60.0, 1e-6);
  EXPECT_EQ(core::pairingQuality(momentAt(10.0 / 60.0), answer), static_cast<std::uint32_t>(core::kQualityOffFrame));
}

TEST(ImageAssociator, InfersAFrameWhoseDatagramWasLost) {
  core::ImageAssociator associator;
  for (int k = 0; k < 60; ++k) {
    if (k != 30) associator.addFrame(frameAt(k / 60.0));
    associator.addState(stateAt(static_cast<std::uint64_t>(k), k / 60.0));
  }
  const auto answer = associator.associate(momentAt(0.501), false);
  EXPECT_EQ(answer.method, PairingMethod::kFrame);
  EXPECT_EQ(answer.id, 30U);
  EXPECT_TRUE(answer.frame_inferred);
}

TEST(ImageAssociator, KnowsTheTimeOfAFrameThatWasNotHeardByItsState) {
  core::ImageAssociator associator;
  const auto at = [](int k) { return 100.0 + k / 60.0 + (k == 30 ? 0.003 : 0.0); };
  for (int k = 0; k < 60; ++k) {
    if (k != 30) associator.addFrame(frameAt(at(k)));
    associator.addState(stateAt(static_cast<std::uint64_t>(k), at(k)));
  }
  const auto answer = associator.associate(momentAt(at(30) + 0.002), false);
  EXPECT_TRUE(answer.frame_inferred);
  EXPECT_EQ(answer.method, PairingMethod::kFrame);
  EXPECT_EQ(answer.frame_sim_time, static_cast<double>(static_cast<float>(at(30)))) << "the key that others have";
  EXPECT_EQ(answer.state_offset, 0.0);
  EXPECT_NEAR(answer.frame_offset, 0.002, 1e-5);
}

TEST(ImageAssociator, TakesALongFrameForOneFrame) {
  core::ImageAssociator associator;
  // The 31st frame took 30 ms: nearly two of the others, but none was lost.
  for (int k = 0; k < 60; ++k) {
    const double t = k / 60.0 + (k > 30 ? 0.030 - 1.0 / 60.0 : 0.0);
    associator.addFrame(frameAt(t, k == 31 ? 0.030 : 1.0 / 60.0));
    associator.addState(stateAt(static_cast<std::uint64_t>(k), t));
  }
  for (const double late : {0.0, 0.009, 0.014}) {
    const auto answer = associator.associate(momentAt(0.5 + late), false);
    EXPECT_EQ(answer.method, PairingMethod::kFrame);
    EXPECT_EQ(answer.id, 30U);
    EXPECT_FALSE(answer.frame_inferred);
  }
}

TEST(ImageAssociator, NeverMixesWhileStatesComeEveryFrame) {
  core::ImageAssociator associator;
  for (int k = 0; k < 60; ++k) {
    associator.addFrame(frameAt(k / 60.0));
    if (k != 30) associator.addState(stateAt(static_cast<std::uint64_t>(k), k / 60.0));
  }
  const auto answer = associator.associate(momentAt(0.5), false);
  EXPECT_EQ(answer.method, PairingMethod::kNearestFrame);
  EXPECT_EQ(answer.id, answer.id_after);
  EXPECT_NEAR(std::abs(answer.state_offset), 1.0 / 60.0, 1e-6);
}

TEST(ImageAssociator, InterpolatesOnlyBelowTheFrameRateAndFlagsIt) {
  core::ImageAssociator associator;
  feed(associator, 120, 60.0, 100.0, 3);
  EXPECT_NEAR(associator.stateToFrameRatio(), 3.0, 0.01);
  const auto answer = associator.associate(momentAt(100.0 + 61.0 / 60.0), false);
  EXPECT_EQ(answer.method, PairingMethod::kInterpolated);
  EXPECT_EQ(answer.id, 60U);
  EXPECT_EQ(answer.id_after, 63U);
  EXPECT_NEAR(answer.fraction, 1.0 / 3.0, 1e-3);
  EXPECT_EQ(core::pairingQuality(momentAt(0.0), answer), static_cast<std::uint32_t>(core::kQualityInterpolated));
  const auto exact = associator.associate(momentAt(100.0 + 63.0 / 60.0), false);
  EXPECT_EQ(exact.method, PairingMethod::kFrame);
  EXPECT_EQ(exact.id, 63U);
}

TEST(ImageAssociator, NeverInterpolatesAcrossANewOrigin) {
  core::ImageAssociator associator;
  for (int k = 0; k < 60; ++k) {
    associator.addFrame(frameAt(k / 60.0));
    core::StateKey state = stateAt(static_cast<std::uint64_t>(k), k / 60.0);
    state.position_epoch = k > 30 ? 1U : 0U;
    if (k % 3 == 0) associator.addState(state);
  }
  EXPECT_EQ(associator.associate(momentAt(28.0 / 60.0), false).method, PairingMethod::kInterpolated);
  EXPECT_EQ(associator.associate(momentAt(30.0 / 60.0), false).method, PairingMethod::kFrame);
  EXPECT_EQ(associator.associate(momentAt(31.0 / 60.0), false).method, PairingMethod::kNone);
  EXPECT_EQ(associator.associate(momentAt(33.0 / 60.0), false).method, PairingMethod::kFrame);
}

TEST(ImageAssociator, KeepsTheStatesWhereTheWallClockIsSet) {
  for (const std::int64_t step_ns : {8'000'000'000, -8'000'000'000}) {
    core::ImageAssociator associator;
    for (int k = 0; k < 60; ++k) {
      associator.addFrame(frameAt(k / 60.0));
      core::StateKey state = stateAt(static_cast<std::uint64_t>(k), k / 60.0);
      state.stamp_ns += k > 30 ? step_ns : 0;
      associator.addState(state);
    }
    const auto answer = associator.associate(momentAt(28.0 / 60.0), false);
    EXPECT_EQ(answer.method, PairingMethod::kFrame);
    EXPECT_EQ(answer.id, 28U);
  }
}

TEST(ImageAssociator, NeverInterpolatesAcrossAnEpochPauseOrGap) {
  const auto between = [](bool new_epoch, bool pause, double gap) {
    core::ImageAssociator associator;
    for (int k = 0; k < 60; ++k) {
      const double sim_time = k / 60.0 + (k > 30 ? gap : 0.0);
      associator.addFrame(frameAt(sim_time));
      if (k % 3 != 0) continue;
      associator.addState(
          stateAt(static_cast<std::uint64_t>(k), sim_time, new_epoch && k > 30 ? 1U : 0U, pause && k > 30));
    }
    return associator.associate(momentAt(31.0 / 60.0), false);
  };
  EXPECT_EQ(between(false, false, 0.0).method, PairingMethod::kInterpolated);
  for (const auto& answer : {between(true, false, 0.0), between(false, true, 0.0)}) {
    EXPECT_EQ(answer.method, PairingMethod::kNone);
    EXPECT_TRUE(answer.at_edge);
    EXPECT_EQ(core::pairingQuality(momentAt(0.0), answer), core::kQualityStateMissing | core::kQualityEpochEdge);
  }
  const auto gap = between(false, false, 2.0);
  EXPECT_NE(gap.method, PairingMethod::kInterpolated);
}

TEST(ImageAssociator, NeverPairsAcrossTheClockFiltersEpoch) {
  core::ImageAssociator associator;
  feed(associator, 60, 60.0);
  const auto answer = associator.associate(momentAt(0.5, 1), true);
  EXPECT_EQ(answer.method, PairingMethod::kNone);
  EXPECT_FALSE(answer.frame_known);
}

TEST(ImageAssociator, RestartedSimulatorForgetsTheStatesBefore) {
  core::ImageAssociator associator;
  feed(associator, 60, 60.0, 500.0);
  for (int k = 0; k < 60; ++k) {
    associator.addFrame(frameAt(k / 60.0, 1.0 / 60.0, 1));
    associator.addState(stateAt(1000U + static_cast<std::uint64_t>(k), k / 60.0, 1));
  }
  EXPECT_EQ(associator.oldestStateId(), 1000U);
  EXPECT_EQ(associator.associate(momentAt(0.5, 1), false).id, 1030U);
}

TEST(ImageAssociator, PausedPictureTakesTheStateThatStands) {
  core::ImageAssociator associator;
  feed(associator, 60, 60.0);
  core::ImageMoment moment;
  moment.paused_at = 1.0F;
  EXPECT_TRUE(associator.associate(moment, false).pending);
  associator.addState(stateAt(60, 1.0, 0, true));
  const auto answer = associator.associate(moment, false);
  EXPECT_EQ(answer.method, PairingMethod::kPaused);
  EXPECT_EQ(answer.id, 60U);
  EXPECT_EQ(core::pairingQuality(moment, answer), static_cast<std::uint32_t>(core::kQualityPaused));
  associator.addState(stateAt(61, 1.0 + 1.0 / 60.0));
  EXPECT_EQ(associator.associate(moment, true).id, 60U) << "it flies on, but stood at that moment";
}

TEST(ImageAssociator, PausedPictureTakesNoStateOfAnotherTime) {
  core::ImageAssociator associator;
  feed(associator, 60, 60.0);
  core::ImageMoment moment;
  moment.paused_at = 1.0F;  // whose states were lost
  const auto answer = associator.associate(moment, true);
  EXPECT_EQ(answer.method, PairingMethod::kNone);
  EXPECT_EQ(core::pairingQuality(moment, answer), core::kQualityPaused | core::kQualityStateMissing);
}

TEST(ImageAssociator, PairsByStampWithoutASimulatorClockAndFlagsIt) {
  core::ImageAssociator associator;
  feed(associator, 60, 60.0);
  core::ImageMoment moment;
  moment.host_time_ns = 500000000;
  const auto answer = associator.associate(moment, false);
  EXPECT_EQ(answer.method, PairingMethod::kStamp);
  EXPECT_EQ(answer.id, 30U);
  EXPECT_EQ(core::pairingQuality(moment, answer), core::kQualityOffFrame | core::kQualityClockUnsure);
  moment.host_time_ns = 5000000000;
  EXPECT_TRUE(associator.associate(moment, false).pending);
  EXPECT_EQ(associator.associate(moment, true).method, PairingMethod::kNone);
}

TEST(ImageAssociator, NothingReceivedMeansNoState) {
  core::ImageAssociator associator;
  EXPECT_EQ(associator.associate(momentAt(0.5), true).method, PairingMethod::kNone);
  EXPECT_EQ(associator.counters().without_state, 1U);
}

TEST(ImageAssociator, SaysWhenTheMomentIsHalfWayBetweenFrames) {
  core::ImageAssociator associator;
  feed(associator, 60, 60.0);
  EXPECT_TRUE(associator.associate(momentAt(30.49 / 60.0), false).ambiguous);
  EXPECT_FALSE(associator.associate(momentAt(30.2 / 60.0), false).ambiguous);
}

TEST(ImageAssociator, SaysWhenTheRawFloatCanNoLongerDistinguishFrames) {
  core::ImageAssociator associator;  // at 3e5 s a float32 steps by 1/32 s: two frames at 60 Hz
  feed(associator, 60, 60.0, 300000.0);
  EXPECT_TRUE(associator.associate(momentAt(300000.5), true).ambiguous);
}

TEST(ImageAssociator, KeepsPairingOneWayWhenTheDelayIsOffByAlmostHalfAFrame) {
  core::ImageAssociator associator;
  std::mt19937 random(1);
  std::normal_distribution<double> jitter(0.0, 0.002);
  int wrong = 0;
  for (int k = 0; k < 600; ++k) {
    associator.addFrame(frameAt(k / 60.0));
    associator.addState(stateAt(static_cast<std::uint64_t>(k), k / 60.0));
    if (k < 5) continue;
    const double moment = (k - 3 + 0.42) / 60.0 + jitter(random);
    const auto answer = associator.associate(momentAt(moment), true);
    if (k > 60 && answer.id != static_cast<std::uint64_t>(k - 3)) ++wrong;
  }
  EXPECT_LE(wrong, 3);  // without the running offset about a quarter of the 540 would be off
}

TEST(ImageAssociator, RecoversFromPicturesThatWereLateForAWhile) {
  core::ImageAssociator associator;
  std::mt19937 random(2);
  std::normal_distribution<double> jitter(0.0, 0.001);
  int wrong = 0;
  for (int k = 0; k < 600; ++k) {
    associator.addFrame(frameAt(k / 60.0));
    associator.addState(stateAt(static_cast<std::uint64_t>(k), k / 60.0));
    if (k < 5) continue;
    // More and more late, up to nine tenths of a frame, then a little early.
    const double late = (k < 200 ? 0.9 * std::max(0, k - 100) / 100.0 : -0.1) / 60.0;
    const auto answer = associator.associate(momentAt((k - 3) / 60.0 + late + jitter(random)), true);
    if (k >= 220 && answer.id != static_cast<std::uint64_t>(k - 3)) ++wrong;
  }
  EXPECT_EQ(wrong, 0);
}

/// A whole flight: the frame every picture really shows is known, swaps jitter, datagrams and states get lost.
struct FlightCase {
  double fps;
  double start;             // [s] simulator time at the first frame
  double swap_jitter;       // [s] 1 sigma
  double lost;              // share of frame datagrams and of states that never arrive
  double dropped_pictures;  // share of frames never shown
};

class WholeFlight : public ::testing::TestWithParam<FlightCase> {};

TEST_P(WholeFlight, EveryPictureGetsItsOwnFrame) {
  const FlightCase flight = GetParam();
  core::ImageAssociator associator;
  std::mt19937 random(7);
  std::normal_distribution<double> jitter(0.0, flight.swap_jitter);
  std::uniform_real_distribution<double> chance(0.0, 1.0);
  const int frames = static_cast<int>(20.0 * flight.fps);
  const double delay_frames = 2.0;
  std::set<int> states_received;
  int shown = 0;
  int right = 0;
  int worst = 0;
  for (int k = 0; k < frames; ++k) {
    const double sim_time = flight.start + k / flight.fps;
    if (chance(random) >= flight.lost) associator.addFrame(frameAt(sim_time, 1.0 / flight.fps));
    if (chance(random) >= flight.lost) {
      associator.addState(stateAt(static_cast<std::uint64_t>(k), sim_time));
      states_received.insert(k);
    }
    const int on_screen = k - static_cast<int>(delay_frames);
    if (on_screen < 2 || chance(random) < flight.dropped_pictures) continue;
    const auto answer = associator.associate(momentAt(flight.start + on_screen / flight.fps + jitter(random)), true);
    ASSERT_NE(answer.method, PairingMethod::kNone);
    EXPECT_NE(answer.method, PairingMethod::kInterpolated);
    const int error = std::abs(static_cast<int>(answer.id) - on_screen);
    worst = std::max(worst, error);
    if (states_received.count(on_screen) == 0) continue;
    ++shown;
    if (error == 0) ++right;
  }
  EXPECT_GT(shown, frames / 2);
  EXPECT_GE(right, static_cast<int>(0.99 * shown)) << right << " of " << shown;
  EXPECT_LE(worst, 2);  // a frame whose neighbour was lost as well
}

INSTANTIATE_TEST_SUITE_P(Rates, WholeFlight,
                         ::testing::Values(FlightCase{45.0, 10.0, 0.003, 0.0, 0.0},
                                           FlightCase{60.0, 10.0, 0.0025, 0.02, 0.02},
                                           FlightCase{75.0, 10.0, 0.002, 0.02, 0.1},
                                           FlightCase{60.0, 30000.0, 0.002, 0.02, 0.0},
                                           FlightCase{30.0, 100.0, 0.004, 0.02, 0.5}));

TEST(Interpolation, AnglesGoTheShortWayRound) {
  EXPECT_NEAR(core::interpolateAngleDeg(179.0, -179.0, 0.5, -180.0), -180.0, 1e-9);
  EXPECT_NEAR(core::interpolateAngleDeg(170.0, -170.0, 0.25, -180.0), 175.0, 1e-9);
  EXPECT_NEAR(core::interpolateAngleDeg(350.0, 20.0, 0.5, 0.0), 5.0, 1e-9);
  EXPECT_NEAR(core::interpolateAngleDeg(350.0, 20.0, 0.2, 0.0), 356.0, 1e-9);
  EXPECT_NEAR(core::interpolateAngleDeg(10.0, 20.0, 0.1, 0.0), 11.0, 1e-9);
}

TEST(Interpolation, AttitudeTurnsAtAConstantRateAlsoWithOppositeSigns) {
  const Eigen::Quaterniond level = Eigen::Quaterniond::Identity();
  const Eigen::Quaterniond banked(Eigen::AngleAxisd(0.6, Eigen::Vector3d::UnitX()));
  const Eigen::Quaterniond flipped(-banked.w(), -banked.x(), -banked.y(), -banked.z());
  for (const auto& target : {banked, flipped}) {
    const Eigen::Quaterniond mid = core::interpolateAttitude(level, target, 0.25);
    EXPECT_NEAR(mid.angularDistance(Eigen::Quaterniond(Eigen::AngleAxisd(0.15, Eigen::Vector3d::UnitX()))), 0.0, 1e-9);
  }
}

TEST(Interpolation, FollowsAnAnalyticMotionBelowTheFrameRate) {
  // roll = 175 + 20 sin(2 pi 0.5 t) [deg] crosses +-180; states at 20 Hz, pictures at 60: the error of linear
  // interpolation is at most h^2/8 * max|second derivative| = 0.05^2 / 8 * 20 * (2 pi 0.5)^2 = 0.0617 deg.
  const auto roll = [](double t) { return 175.0 + 20.0 * std::sin(M_PI * t); };
  core::ImageAssociator associator;
  std::map<std::uint64_t, double> rolls;
  for (int k = 0; k < 240; ++k) {
    const double t = k / 60.0;
    associator.addFrame(frameAt(t));
    if (k % 3 != 0) continue;
    associator.addState(stateAt(static_cast<std::uint64_t>(k), t));
    rolls[static_cast<std::uint64_t>(k)] = std::remainder(roll(t), 360.0);
  }
  int interpolated = 0;
  for (int k = 120; k < 230; ++k) {
    const auto answer = associator.associate(momentAt(k / 60.0), true);
    if (answer.method == PairingMethod::kInterpolated) ++interpolated;
    const double got =
        core::interpolateAngleDeg(rolls.at(answer.id), rolls.at(answer.id_after), answer.fraction, -180.0);
    EXPECT_NEAR(std::remainder(got - roll(k / 60.0), 360.0), 0.0, 0.07) << k;
    EXPECT_GE(got, -180.0);
    EXPECT_LT(got, 180.0);
  }
  EXPECT_GT(interpolated, 70);
}

TEST(ImageAssociator, AKeyNamesTheFrameWhateverTheClocksSay) {
  core::ImageAssociator associator;
  feed(associator, 60, 60.0, 1000.0);
  auto moment = momentAt(1000.9);  // by the clock it were frame 54
  moment.frame_key = static_cast<float>(1000.0 + 30.0 / 60.0);
  const auto answer = associator.associate(moment, false);
  EXPECT_EQ(answer.method, PairingMethod::kFrame);
  EXPECT_EQ(answer.id, 30U);
  EXPECT_EQ(answer.state_offset, 0.0);
  EXPECT_EQ(answer.frame_sim_time, 1000.5);
  moment.sim_time.reset();  // and without any clock
  EXPECT_EQ(associator.associate(moment, false).id, 30U);
  moment.paused_at = 1.0F;  // or when X-Plane was paused since
  EXPECT_EQ(associator.associate(moment, false).id, 30U);
}

TEST(ImageAssociator, AKeyWhoseStateWasLostIsSaidToBeOffFrame) {
  core::ImageAssociator associator;
  for (int k = 0; k < 60; ++k) {
    associator.addFrame(frameAt(k / 60.0));
    if (k != 30) associator.addState(stateAt(static_cast<std::uint64_t>(k), k / 60.0));
  }
  auto moment = momentAt(0.5);
  moment.frame_key = 0.5F;
  const auto answer = associator.associate(moment, false);
  EXPECT_EQ(answer.method, PairingMethod::kNearestFrame);
  EXPECT_EQ(core::pairingQuality(moment, answer), core::kQualityOffFrame);
}

TEST(ImageAssociator, AKeyWaitsForItsState) {
  core::ImageAssociator associator;
  feed(associator, 30, 60.0);
  auto moment = momentAt(0.5);
  moment.frame_key = 0.5F;
  EXPECT_TRUE(associator.associate(moment, false).pending);
  associator.addState(stateAt(30, 0.5));
  const auto answer = associator.associate(moment, false);
  EXPECT_FALSE(answer.pending);
  EXPECT_EQ(answer.id, 30U);
}

TEST(ImageAssociator, AKeyThatFramesShareAfterADayIsAmbiguous) {
  core::ImageAssociator associator;
  feed(associator, 60, 60.0, 140000.0);  // float32 steps by 15.6 ms there, 0.94 of a frame
  auto moment = momentAt(140000.5);
  moment.frame_key = 140000.5F;
  EXPECT_TRUE(associator.associate(moment, true).ambiguous);
}
