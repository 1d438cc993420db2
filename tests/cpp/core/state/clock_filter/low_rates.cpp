// Samples that come once a second or a few times.

#include "xplane_bridge/core/state/clock_filter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../jittered_frames.hpp"

namespace xplane_bridge::core {
namespace {

/// What a filter made of a minute of samples, from ten seconds on.
struct Outcome {
  int unfitted = 0;
  int restarts = 0;        ///< of the fit
  double stamp_off = 0.0;  ///< root mean square [s]
  double ratio_off = 0.0;  ///< largest [-]
};

/// @param ratio of simulator time: below 1, X-Plane's frames last longer than the 0.05 s that it simulates of them
Outcome minuteAt(int rate, double ratio, double jitter) {
  ClockFilter filter(ClockFilter::Options::atRate(rate));
  std::mt19937 random(1);
  std::exponential_distribution<double> extra(1.0);
  Outcome out;
  int judged = 0;
  for (int i = 0; i < 60 * rate; ++i) {
    const double host = static_cast<double>(i) / rate;
    ClockSample sample;
    sample.receive_ns = kStart + ns(host + jitter * extra(random));
    sample.sim_time = static_cast<float>(100.0 + ratio * host);
    sample.frame_period = ratio < 1.0 ? 0.05F : 1.0F / 60.0F;
    const ClockEstimate estimate = filter.update(sample);
    EXPECT_TRUE(estimate.usable);
    if (host < 10.0) continue;
    ++judged;
    out.unfitted += filter.fitted() ? 0 : 1;
    out.restarts += estimate.event == ClockEvent::kGap || estimate.event == ClockEvent::kRateChanged ? 1 : 0;
    const double off = static_cast<double>(estimate.stamp_ns - kStart) * 1e-9 - host;
    out.stamp_off += off * off;
    out.ratio_off = std::max(out.ratio_off, std::abs(filter.timeRatio() - ratio));
  }
  out.stamp_off = std::sqrt(out.stamp_off / judged);
  return out;
}

TEST(ClockFilterAtLowRates, IsFittedAndKnowsTheRatio) {
  for (const int rate : {1, 2, 3, 5}) {
    for (const double ratio : {1.0, 0.5}) {
      const Outcome out = minuteAt(rate, ratio, 1e-3);
      EXPECT_EQ(out.unfitted, 0) << rate << "/s, " << ratio;
      EXPECT_EQ(out.restarts, 0) << rate << "/s, " << ratio;
      EXPECT_LT(out.stamp_off, 3e-3) << rate << "/s, " << ratio;
      EXPECT_LT(out.ratio_off, 2e-3) << rate << "/s, " << ratio;
    }
  }
}

// A wireless link: at these rates two late samples in a row are no sign that simulator time runs otherwise.
TEST(ClockFilterAtLowRates, JitterDoesNotStartTheFitAnew) {
  for (const int rate : {1, 2, 3, 5}) {
    const Outcome out = minuteAt(rate, 1.0, 1e-2);
    EXPECT_EQ(out.unfitted, 0) << rate << "/s";
    EXPECT_EQ(out.restarts, 0) << rate << "/s";
    EXPECT_LT(out.stamp_off, 5e-3) << rate << "/s";
  }
}

/// Time accelerated for twenty seconds, and the two minutes behind.
/// @return samples from the acceleration's end up to the last one with a wrong stamp
int wrongAfterAcceleration(int rate, double acceleration) {
  constexpr double kBegin = 60.0, kEnd = 80.0, kUntil = 200.0, kTolerance = 0.03;  // [s]
  ClockFilter filter(ClockFilter::Options::atRate(rate));
  std::mt19937 random(1);
  std::exponential_distribution<double> extra(1.0);
  int behind = 0, wrong = 0;
  for (int i = 0; i < static_cast<int>(kUntil) * rate; ++i) {
    const double host = static_cast<double>(i) / rate;
    const bool accelerated = host >= kBegin && host < kEnd;
    ClockSample sample;
    sample.receive_ns = kStart + ns(host + 2e-3 * extra(random));
    sample.sim_time =
        static_cast<float>(100.0 + host + (acceleration - 1.0) * (std::clamp(host, kBegin, kEnd) - kBegin));
    sample.acceleration = accelerated ? static_cast<float>(acceleration) : 1.0F;
    sample.frame_period = sample.acceleration / 60.0F;
    const ClockEstimate estimate = filter.update(sample);
    EXPECT_TRUE(estimate.usable);
    if (host < kEnd) continue;
    ++behind;
    if (std::abs(static_cast<double>(estimate.stamp_ns - kStart) * 1e-9 - host) > kTolerance) wrong = behind;
  }
  EXPECT_NEAR(filter.timeRatio(), 1.0, 2e-3) << rate << "/s, " << acceleration;
  return wrong;
}

TEST(ClockFilterAtLowRates, StampsAreRightSoonAfterTimeAcceleration) {
  for (const int rate : {1, 2, 3, 4, 5, 6, 8, 10}) {
    for (const double acceleration : {2.0, 4.0, 16.0}) {
      EXPECT_LE(wrongAfterAcceleration(rate, acceleration), 5) << rate << "/s, " << acceleration;
    }
  }
}

TEST(ClockFilterAtLowRates, ALongSilenceStillStartsTheFitAnew) {
  ClockFilter filter(ClockFilter::Options::atRate(1));
  ClockSample sample;
  ClockEvent event = ClockEvent::kNone;
  for (int i = 0; i < 10; ++i) {
    sample.receive_ns = kStart + ns(i);
    sample.sim_time = static_cast<float>(100 + i);
    event = filter.update(sample).event;
  }
  EXPECT_EQ(event, ClockEvent::kNone);
  sample.receive_ns += ns(4.0);
  sample.sim_time += 1.0F;
  EXPECT_EQ(filter.update(sample).event, ClockEvent::kGap);
}

TEST(ClockFilterAtLowRates, AtTheFrameRateAllIsAsWithoutARate) {
  const ClockFilter::Options at_rate = ClockFilter::Options::atRate(60);
  const ClockFilter::Options without;
  EXPECT_EQ(at_rate.gap, without.gap);
  EXPECT_EQ(at_rate.rate_change_after, without.rate_change_after);
  EXPECT_EQ(at_rate.slip_after, without.slip_after);
  EXPECT_EQ(at_rate.window, without.window);
}

TEST(ClockFilter, TheTimeRatioIsNotKnownBeforeTheFitAndWhilePaused) {
  ClockFilter filter;
  Simulator simulator({});
  filter.update(simulator.frame());
  EXPECT_TRUE(std::isnan(filter.timeRatio()));
  run(simulator, filter, 1.0);
  EXPECT_EQ(filter.timeRatio(), 1.0);
  simulator.paused = true;
  filter.update(simulator.frame());
  EXPECT_TRUE(std::isnan(filter.timeRatio()));
}

TEST(ClockFilter, TheTimeRatioIsOneWhereReceiveTimesAreTheFramesOwn) {
  ClockFilter::Options options;
  options.exact = true;
  ClockFilter filter(options);
  Simulator simulator({});
  run(simulator, filter, 1.0);
  EXPECT_EQ(filter.timeRatio(), 1.0);
}

}  // namespace
}  // namespace xplane_bridge::core
