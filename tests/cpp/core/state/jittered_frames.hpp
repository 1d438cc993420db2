#pragma once

/// A simulator whose frames arrive late by chance, for tests of the clock filter.

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "xplane_bridge/core/state/clock_filter.hpp"

namespace xplane_bridge::core {

constexpr std::int64_t kStart = 1700000000'000000000;  // a wall clock time [ns]

inline std::int64_t ns(double seconds) { return static_cast<std::int64_t>(std::llround(seconds * 1e9)); }

/// A simulator with a clock of its own, seen through a network. True times in double.
class Simulator {
 public:
  struct Options {
    double fps = 60.0;
    double sim_start = 100.0;
    double ratio = 1.0;          ///< simulator time over host time
    double delay = 1e-4;         ///< smallest [s]
    double jitter = 0.0;         ///< mean of the exponential part of the delay [s]
    double period_jitter = 0.0;  ///< relative, of frame times
    bool periods = true;         ///< sends the frame period
    unsigned seed = 1;
  };
  explicit Simulator(const Options& options) : options_(options), sim_(options.sim_start), random_(options.seed) {}

  /// Renders a frame. @return what arrives; trueHost() is then the frame's host time.
  ClockSample frame() {
    std::normal_distribution<double> wobble(0.0, options_.period_jitter);
    const double sim_step = options_.ratio / options_.fps * (1.0 + wobble(random_));
    const auto period = static_cast<float>(sim_step);
    if (!paused) sim_ += static_cast<double>(period);
    host_ += sim_step / options_.ratio;
    std::exponential_distribution<double> extra(1.0);
    ClockSample sample;
    const double arrival = host_ + options_.delay + (options_.jitter > 0.0 ? options_.jitter * extra(random_) : 0.0);
    last_arrival_ = std::max(last_arrival_, arrival);  // one socket, in order
    sample.receive_ns = kStart + ns(last_arrival_);
    sample.sim_time = static_cast<float>(sim_);
    sample.frame_period = options_.periods ? period : 0.0F;
    sample.acceleration = timeAcceleration(static_cast<float>(options_.ratio));
    sample.paused = paused;
    sample.replay = replay;
    return sample;
  }
  /// A frame that takes longer than the simulator flies in it.
  ClockSample stutter(double simulated, double lasted) {
    host_ += lasted - 1.0 / options_.fps;
    sim_ += simulated - options_.ratio / options_.fps;
    ClockSample sample = frame();
    sample.frame_period = options_.periods ? static_cast<float>(simulated) : 0.0F;
    return sample;
  }
  std::int64_t trueHost() const { return kStart + ns(host_); }
  double trueSim() const { return sim_; }
  void wait(double seconds) { host_ += seconds; }
  void jumpSim(double seconds) { sim_ += seconds; }
  void setRatio(double ratio) { options_.ratio = ratio; }

  bool paused = false;
  bool replay = false;

 private:
  Options options_;
  double host_ = 0.0;
  double sim_;
  double last_arrival_ = 0.0;
  std::mt19937 random_;
};

/// Runs for a while; every stamp must increase, and none lie after its arrival.
inline std::vector<double> run(Simulator& simulator, ClockFilter& filter, double seconds, double fps = 60.0) {
  std::vector<double> errors;
  std::int64_t last = 0;
  std::uint32_t epoch = filter.epoch();
  for (int i = 0; i < static_cast<int>(seconds * fps); ++i) {
    const ClockSample sample = simulator.frame();
    const ClockEstimate estimate = filter.update(sample);
    if (!estimate.usable) continue;
    if (estimate.epoch == epoch && last != 0) {
      EXPECT_GT(estimate.stamp_ns, last);
    }
    EXPECT_LE(estimate.stamp_ns, sample.receive_ns + 100000);
    last = estimate.stamp_ns;
    epoch = estimate.epoch;
    errors.push_back(static_cast<double>(estimate.stamp_ns - simulator.trueHost()) * 1e-9);
  }
  return errors;
}

inline double largest(const std::vector<double>& values, std::size_t skip) {
  double worst = 0.0;
  for (std::size_t i = skip; i < values.size(); ++i) worst = std::max(worst, std::abs(values[i]));
  return worst;
}

}  // namespace xplane_bridge::core
