#include "xplane_bridge/core/state/clock_filter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <vector>

#include "jittered_frames.hpp"
#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

TEST(ClockFilter, FirstSampleStartsEpochZero) {
  ClockFilter filter;
  Simulator simulator({});
  const ClockSample sample = simulator.frame();
  const ClockEstimate estimate = filter.update(sample);
  EXPECT_TRUE(estimate.usable);
  EXPECT_EQ(estimate.event, ClockEvent::kFirst);
  EXPECT_EQ(estimate.epoch, 0U);
  EXPECT_EQ(estimate.stamp_ns, sample.receive_ns);
  EXPECT_DOUBLE_EQ(estimate.sim_time, static_cast<double>(sample.sim_time));
  EXPECT_FALSE(filter.fitted());
  EXPECT_FALSE(filter.simTime(sample.receive_ns).has_value());
}

// So that who integrates over frames finds the same in any flight, whenever X-Plane was started.
TEST(ClockFilter, FramesOfOneLengthAreStepsOfExactlyThat) {
  for (const double rate : {30.0, 50.0, 59.94, 60.0, 100.0, 240.0}) {
    ClockFilter filter;
    ClockSample sample;
    sample.frame_period = static_cast<float>(1.0 / rate);
    double before = filter.update(sample).sim_time;
    int different = 0;
    for (int frame = 1; frame < 60'000; ++frame) {
      const double time = frame / rate;
      sample.sim_time = static_cast<float>(time);
      sample.receive_ns = toNanoseconds(time);
      const double now = filter.update(sample).sim_time;
      different += now - before != static_cast<double>(sample.frame_period) ? 1 : 0;
      before = now;
    }
    EXPECT_EQ(different, 0) << rate;
  }
}

TEST(ClockFilter, WithoutJitterStampsAreExactButForTheDelay) {
  ClockFilter filter;
  Simulator simulator({});
  const auto errors = run(simulator, filter, 10.0);
  EXPECT_TRUE(filter.fitted());
  EXPECT_LT(largest(errors, 60), 2e-4);
  EXPECT_LT(filter.uncertainty(), 1e-4);
}

// 1 ms mean exponential jitter: single arrivals are late by several ms, stamps must not be.
TEST(ClockFilter, TakesOutJitter) {
  ClockFilter filter;
  Simulator::Options options;
  options.jitter = 1e-3;
  Simulator simulator(options);
  const auto errors = run(simulator, filter, 30.0);
  EXPECT_LT(largest(errors, 240), 6e-4);
  double sum = 0.0;
  for (std::size_t i = 240; i < errors.size(); ++i) sum += std::abs(errors[i] - options.delay);
  EXPECT_LT(sum / static_cast<double>(errors.size() - 240), 2e-4);
  EXPECT_LT(filter.uncertainty(), 2e-3);
  EXPECT_GE(filter.uncertainty(), 1e-4);
}

TEST(ClockFilter, FollowsDrift) {
  ClockFilter filter;
  Simulator::Options options;
  options.ratio = 1.0005;  // half a millisecond a second
  options.jitter = 2e-4;
  Simulator simulator(options);
  const auto errors = run(simulator, filter, 60.0);
  EXPECT_LT(largest(errors, 300), 1.5e-3);
  EXPECT_NEAR(filter.timeRatio(), 1.0005, 3e-4);
}

TEST(ClockFilter, RunsWithTimeAcceleration) {
  ClockFilter filter;
  Simulator::Options options;
  options.ratio = 4.0;
  options.jitter = 3e-4;
  Simulator simulator(options);
  const auto errors = run(simulator, filter, 20.0);
  EXPECT_LT(largest(errors, 240), 1.5e-3);
  EXPECT_NEAR(filter.timeRatio(), 4.0, 0.02);
}

// At 4x a frame of 1/60 s is 67 ms of simulator time: no frame longer than X-Plane simulates.
TEST(ClockFilter, ALateDatagramUnderTimeAccelerationIsNoSlip) {
  ClockFilter filter;
  Simulator::Options options;
  options.ratio = 4.0;
  Simulator simulator(options);
  run(simulator, filter, 10.0);
  ClockSample late = simulator.frame();
  late.receive_ns += ns(0.008);
  filter.update(late);
  EXPECT_EQ(filter.slips(), 0U);
  EXPECT_NEAR(*filter.simTime(simulator.trueHost()), simulator.trueSim(), 1e-3);
}

// Below 20 fps X-Plane slows simulator time: 15 fps with frames of 0.05 s of simulator time is a ratio of 0.75.
TEST(ClockFilter, SimulatorSlowerThanRealTime) {
  ClockFilter filter;
  Simulator::Options options;
  options.fps = 60.0;
  options.jitter = 2e-4;
  Simulator simulator(options);
  run(simulator, filter, 10.0);
  simulator.setRatio(0.75);
  const auto errors = run(simulator, filter, 20.0);
  EXPECT_EQ(filter.epoch(), 0U);
  EXPECT_LT(largest(errors, 60), 2e-3);  // a second after the change, though the window is longer
  EXPECT_NEAR(filter.timeRatio(), 0.75, 0.01);
}

TEST(ClockFilter, RateChangeIsSeenWithinASecond) {
  ClockFilter filter;
  Simulator simulator({});
  run(simulator, filter, 10.0);
  simulator.setRatio(0.5);
  bool seen = false;
  for (int i = 0; i < 60 && !seen; ++i) seen = filter.update(simulator.frame()).event == ClockEvent::kRateChanged;
  EXPECT_TRUE(seen);
}

// X-Plane simulates 50 ms of a frame that lasts 90: from there on every simulator time comes 40 ms later.
TEST(ClockFilter, StutterMovesTheLineAtOnceAndOnlyFromThereOn) {
  ClockFilter filter;
  Simulator::Options options;
  options.jitter = 2e-4;
  Simulator simulator(options);
  run(simulator, filter, 10.0);
  const double sim_before = simulator.trueSim();
  const std::int64_t host_before = simulator.trueHost();
  const ClockEstimate estimate = filter.update(simulator.stutter(0.05, 0.09));
  EXPECT_EQ(estimate.event, ClockEvent::kSlipped);
  EXPECT_EQ(filter.slips(), 1U);
  EXPECT_NEAR(static_cast<double>(estimate.stamp_ns - simulator.trueHost()), 1e-4 * 1e9, 1e6);
  EXPECT_NEAR(*filter.simTime(simulator.trueHost()), simulator.trueSim(), 1e-3);
  // Three frames before, where pictures of now come from: as before.
  EXPECT_NEAR(*filter.simTime(host_before - ns(0.05)), sim_before - 0.05, 1e-3);
  EXPECT_NEAR(static_cast<double>(*filter.hostTime(sim_before - 0.05) - (host_before - ns(0.05))), 1e-4 * 1e9, 1e6);
  // A picture that the stutter held up still shows the frame before it.
  EXPECT_NEAR(*filter.simTime(host_before + ns(0.02)), sim_before, 1e-3);
  EXPECT_LT(largest(run(simulator, filter, 5.0), 0), 1e-3);
  EXPECT_EQ(filter.slips(), 1U);
  EXPECT_EQ(filter.epoch(), 0U);
}

// 12 frames/s for two seconds, 50 ms of simulator time each: ratio 12 * 0.05 = 0.6.
TEST(ClockFilter, FollowsFramesThatAllLastLongerThanTheySimulate) {
  ClockFilter filter;
  Simulator simulator({});
  run(simulator, filter, 10.0);
  for (int i = 0; i < 60; ++i) {
    const ClockEstimate estimate = filter.update(simulator.stutter(0.05, 1.0 / 12.0));
    ASSERT_TRUE(estimate.usable);
    EXPECT_NEAR(static_cast<double>(estimate.stamp_ns - simulator.trueHost()), 1e-4 * 1e9, 1e6);
  }
  EXPECT_NEAR(filter.timeRatio(), 0.6, 0.02);
  run(simulator, filter, 6.0);
  EXPECT_NEAR(filter.timeRatio(), 1.0, 1e-3);
}

// Without frame periods a slip shows only in that all later samples are late by the same.
TEST(ClockFilter, SlipIsSeenByItsEvennessWhereNoPeriodShowsIt) {
  ClockFilter filter;
  Simulator::Options options;
  options.periods = false;
  options.jitter = 2e-4;
  Simulator simulator(options);
  run(simulator, filter, 10.0);
  const std::int64_t host_before = simulator.trueHost();
  const double sim_before = simulator.trueSim();
  filter.update(simulator.stutter(1.0 / 60.0, 1.0 / 60.0 + 0.008));  // half a frame is left out
  EXPECT_EQ(filter.slips(), 0U);
  for (int i = 0; i < 7; ++i) filter.update(simulator.frame());  // 117 ms
  EXPECT_EQ(filter.slips(), 1U);
  EXPECT_NEAR(*filter.simTime(simulator.trueHost()), simulator.trueSim(), 1e-3);
  EXPECT_NEAR(*filter.simTime(host_before - ns(0.05)), sim_before - 0.05, 1e-3);
  EXPECT_LT(largest(run(simulator, filter, 5.0), 0), 1e-3);
}

// A wireless link: late by up to tens of milliseconds in a row, but unevenly. The line stays where it is.
TEST(ClockFilter, JitterIsNoSlip) {
  ClockFilter filter;
  Simulator::Options options;
  options.jitter = 8e-3;
  Simulator simulator(options);
  const auto errors = run(simulator, filter, 60.0);
  EXPECT_LT(largest(errors, 240), 6e-3);
}

// After nine hours float32 steps by 3.9 ms; at 120 fps that is half a frame. Unwrapped time must keep its even steps.
TEST(ClockFilter, Float32StepsAreTakenOut) {
  ClockFilter filter;
  Simulator::Options options;
  options.sim_start = 33000.0;
  options.fps = 120.0;
  Simulator simulator(options);
  double previous = 0.0, worst_step = 0.0, worst_raw_step = 0.0;
  float previous_raw = 0.0F;
  for (int i = 0; i < 3600; ++i) {
    const ClockSample sample = simulator.frame();
    const ClockEstimate estimate = filter.update(sample);
    ASSERT_TRUE(estimate.usable) << i << " " << toString(estimate.event);
    EXPECT_LE(std::abs(estimate.sim_time - simulator.trueSim()), 0.0040);
    if (i > 0) {
      worst_step = std::max(worst_step, std::abs(estimate.sim_time - previous - 1.0 / 120.0));
      worst_raw_step =
          std::max(worst_raw_step, std::abs(static_cast<double>(sample.sim_time - previous_raw) - 1.0 / 120.0));
    }
    previous = estimate.sim_time;
    previous_raw = sample.sim_time;
  }
  EXPECT_GT(worst_raw_step, 3e-3);
  EXPECT_LT(worst_step, 1e-5);
}

TEST(ClockFilter, StampsStayGoodWithFloat32Steps) {
  ClockFilter filter;
  Simulator::Options options;
  options.sim_start = 60000.0;
  options.fps = 60.0;
  options.period_jitter = 0.1;
  options.jitter = 2e-4;
  Simulator simulator(options);
  const auto errors = run(simulator, filter, 30.0);
  EXPECT_LT(largest(errors, 300), 1e-3);
}

// At 400 fps several frames share one float32 time; they are frames, not duplicates.
TEST(ClockFilter, FramesFasterThanFloat32StepsAreKept) {
  ClockFilter filter;
  Simulator::Options options;
  options.sim_start = 40000.0;
  options.fps = 400.0;
  Simulator simulator(options);
  int usable = 0;
  for (int i = 0; i < 400; ++i) usable += filter.update(simulator.frame()).usable ? 1 : 0;
  EXPECT_EQ(usable, 400);
}

TEST(ClockFilter, LostDatagramsDoNotDisturb) {
  ClockFilter filter;
  Simulator::Options options;
  options.sim_start = 33000.0;
  Simulator simulator(options);
  std::mt19937 random(7);
  double worst = 0.0;
  for (int i = 0; i < 3000; ++i) {
    const ClockSample sample = simulator.frame();
    if (random() % 5 == 0) continue;
    const ClockEstimate estimate = filter.update(sample);
    ASSERT_TRUE(estimate.usable);
    if (i > 300)
      worst = std::max(worst, std::abs(static_cast<double>(estimate.stamp_ns - simulator.trueHost()) * 1e-9));
  }
  EXPECT_LT(worst, 5e-4);
}

TEST(ClockFilter, WithoutFramePeriodsUncertaintyIsTheFloat32Step) {
  ClockFilter filter;
  Simulator::Options options;
  options.sim_start = 33000.0;
  options.periods = false;
  Simulator simulator(options);
  run(simulator, filter, 10.0);
  EXPECT_GT(filter.uncertainty(), 3.9e-3);
}

TEST(ClockFilter, DuplicateIsDropped) {
  ClockFilter filter;
  Simulator simulator({});
  run(simulator, filter, 1.0);
  ClockSample sample = simulator.frame();
  EXPECT_TRUE(filter.update(sample).usable);
  sample.receive_ns += ns(1e-3);
  const ClockEstimate again = filter.update(sample);
  EXPECT_FALSE(again.usable);
  EXPECT_EQ(again.event, ClockEvent::kDuplicate);
}

TEST(ClockFilter, LateDatagramIsDropped) {
  ClockFilter filter;
  Simulator simulator({});
  run(simulator, filter, 1.0);
  const ClockSample older = simulator.frame();
  ClockSample newer = simulator.frame();
  EXPECT_TRUE(filter.update(newer).usable);
  ClockSample late = older;
  late.receive_ns = newer.receive_ns + ns(1e-3);
  const ClockEstimate estimate = filter.update(late);
  EXPECT_FALSE(estimate.usable);
  EXPECT_EQ(estimate.event, ClockEvent::kOutOfOrder);
  EXPECT_EQ(filter.epoch(), 0U);
  EXPECT_TRUE(filter.update(simulator.frame()).usable);
}

TEST(ClockFilter, OneVeryLateDatagramDoesNotMoveTheStamps) {
  ClockFilter filter;
  Simulator simulator({});
  run(simulator, filter, 5.0);
  ClockSample sample = simulator.frame();
  const std::int64_t true_host = simulator.trueHost();
  sample.receive_ns += ns(0.2);
  const ClockEstimate estimate = filter.update(sample);
  EXPECT_TRUE(estimate.usable);
  EXPECT_LT(std::abs(estimate.stamp_ns - true_host), ns(1e-3));
}

// A congested link gets free: the fit moves 50 ms earlier, three frames at once. Stamps must not step back.
TEST(ClockFilter, StampsIncreaseWhenTheDelayDrops) {
  ClockFilter filter;
  Simulator simulator({});
  std::int64_t last = 0;
  for (int i = 0; i < 300; ++i) {
    ClockSample sample = simulator.frame();
    if (i < 200) sample.receive_ns += ns(0.05 * std::min(1.0, (200 - i) / 10.0));
    const ClockEstimate estimate = filter.update(sample);
    ASSERT_TRUE(estimate.usable);
    ASSERT_GT(estimate.stamp_ns, last) << i;
    last = estimate.stamp_ns;
  }
  EXPECT_NEAR(static_cast<double>(last - simulator.trueHost()) * 1e-9, 1e-4, 1e-4);
}

// 1000 frames a second under 20 ms of jitter: the fit moves by more than a frame now and then.
TEST(ClockFilter, StampsIncreaseWhereTheFitMovesByMoreThanAFrame) {
  ClockFilter filter;
  Simulator::Options options;
  options.fps = 1000.0;
  options.jitter = 0.02;
  options.period_jitter = 0.3;
  Simulator simulator(options);
  run(simulator, filter, 20.0, 1000.0);
}

TEST(ClockFilter, PauseRestartsTheFitWithinTheEpoch) {
  ClockFilter filter;
  Simulator simulator({});
  run(simulator, filter, 5.0);
  simulator.paused = true;
  const ClockEstimate first = filter.update(simulator.frame());
  EXPECT_EQ(first.event, ClockEvent::kPaused);
  EXPECT_TRUE(filter.paused());
  EXPECT_FALSE(filter.hostTime(first.sim_time).has_value());
  std::int64_t last = first.stamp_ns;
  for (int i = 0; i < 120; ++i) {
    const ClockEstimate estimate = filter.update(simulator.frame());
    EXPECT_TRUE(estimate.usable);
    EXPECT_GT(estimate.stamp_ns, last);
    EXPECT_DOUBLE_EQ(estimate.sim_time, first.sim_time);
    last = estimate.stamp_ns;
  }
  simulator.paused = false;
  const ClockEstimate resumed = filter.update(simulator.frame());
  EXPECT_EQ(resumed.event, ClockEvent::kResumed);
  EXPECT_GT(resumed.stamp_ns, last);
  EXPECT_EQ(resumed.epoch, 0U);
  const auto errors = run(simulator, filter, 5.0);
  EXPECT_LT(largest(errors, 60), 1e-3);
}

TEST(ClockFilter, ReplayRaisesTheEpochAtBothEnds) {
  ClockFilter filter;
  Simulator simulator({});
  run(simulator, filter, 1.0);
  simulator.replay = true;
  ClockEstimate estimate = filter.update(simulator.frame());
  EXPECT_EQ(estimate.event, ClockEvent::kReplayStarted);
  EXPECT_EQ(estimate.epoch, 1U);
  run(simulator, filter, 1.0);
  simulator.replay = false;
  estimate = filter.update(simulator.frame());
  EXPECT_EQ(estimate.event, ClockEvent::kReplayEnded);
  EXPECT_EQ(estimate.epoch, 2U);
}

TEST(ClockFilter, TimeJumpsRaiseTheEpoch) {
  for (const double jump : {-50.0, -1.5, 30.0}) {
    SCOPED_TRACE(jump);
    ClockFilter filter;
    Simulator simulator({});
    run(simulator, filter, 2.0);
    simulator.jumpSim(jump);
    const ClockSample sample = simulator.frame();
    const ClockEstimate estimate = filter.update(sample);
    EXPECT_EQ(estimate.event, ClockEvent::kReset);
    EXPECT_EQ(estimate.epoch, 1U);
    EXPECT_DOUBLE_EQ(estimate.sim_time, static_cast<double>(sample.sim_time));
  }
}

TEST(ClockFilter, SmallBackwardJumpThatPersistsIsAReset) {
  ClockFilter filter;
  Simulator simulator({});
  run(simulator, filter, 2.0);
  simulator.jumpSim(-0.6);
  std::set<ClockEvent> events;
  for (int i = 0; i < 12; ++i) events.insert(filter.update(simulator.frame()).event);
  EXPECT_EQ(events.count(ClockEvent::kReset), 1U);
  EXPECT_EQ(filter.epoch(), 1U);
}

TEST(ClockFilter, CallerRaisesTheEpoch) {
  ClockFilter filter;
  Simulator simulator({});
  run(simulator, filter, 2.0);
  filter.raiseEpoch();
  EXPECT_EQ(filter.update(simulator.frame()).epoch, 1U);
  EXPECT_EQ(filter.update(simulator.frame()).epoch, 1U);
}

// Scenery load: seconds of silence, in which simulator time hardly moved. No reset, but another offset.
TEST(ClockFilter, GapStartsTheFitAnew) {
  ClockFilter filter;
  Simulator simulator({});
  run(simulator, filter, 5.0);
  simulator.wait(3.0);
  const ClockEstimate estimate = filter.update(simulator.frame());
  EXPECT_EQ(estimate.event, ClockEvent::kGap);
  EXPECT_EQ(estimate.epoch, 0U);
  const auto errors = run(simulator, filter, 3.0);
  EXPECT_LT(largest(errors, 60), 1e-3);
}

TEST(ClockFilter, HostClockStepBackRaisesTheEpoch) {
  ClockFilter filter;
  Simulator simulator({});
  run(simulator, filter, 2.0);
  ClockSample sample = simulator.frame();
  sample.receive_ns -= ns(1.0);
  const ClockEstimate estimate = filter.update(sample);
  EXPECT_EQ(estimate.event, ClockEvent::kHostClockStep);
  EXPECT_EQ(estimate.epoch, 1U);
  EXPECT_EQ(estimate.stamp_ns, sample.receive_ns);
}

// A delay that creeps by 0.2 ms while there is nothing but a quarter second to go by must not be taken for a clock that
// runs slow: at 60 m/s, stamps tilted by 0.07 % make a velocity 0.04 m/s wrong.
TEST(ClockFilter, CreepingDelayDoesNotTiltTheFirstFits) {
  ClockFilter filter;
  int fits = 0;
  for (int i = 0; i < 18; ++i) {
    const double t = i / 60.0;
    ClockSample sample;
    sample.sim_time = static_cast<float>(10.0 + t);
    sample.frame_period = 1.0F / 60.0F;
    sample.receive_ns = kStart + ns(t + 7e-4 * t);
    filter.update(sample);
    if (!filter.fitted()) continue;
    ++fits;
    EXPECT_NEAR(static_cast<double>(*filter.hostTime(11.0 + t) - *filter.hostTime(10.0 + t)) * 1e-9, 1.0, 1e-6);
  }
  EXPECT_GT(fits, 0);
}

TEST(ClockFilter, MapsBothWays) {
  ClockFilter filter;
  Simulator::Options options;
  options.jitter = 2e-4;
  Simulator simulator(options);
  run(simulator, filter, 10.0);
  const std::int64_t host = simulator.trueHost();
  const auto sim = filter.simTime(host);
  ASSERT_TRUE(sim.has_value());
  EXPECT_NEAR(*sim, simulator.trueSim(), 1e-3);
  const auto back = filter.hostTime(*sim);
  ASSERT_TRUE(back.has_value());
  EXPECT_LE(std::abs(*back - host), 2);
}

// --- receive clock ---

}  // namespace
}  // namespace xplane_bridge::core
