#include "xplane_bridge/core/state/clock_filter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/core/base/unknown.hpp"

namespace xplane_bridge::core {
namespace {

/// Stamps of one epoch are at least this far apart.
constexpr std::int64_t kMinStampStepNs = 1000;
/// This many consecutive older samples are no late datagrams any more.
constexpr int kBackwardSamplesForReset = 10;
/// A line of slope 1 is preferred while its mean delay is within this of the best line's: X-Plane takes its frame
/// periods from the same kind of clock as the host, so another slope must be seen to be believed.
constexpr double kUnitSlopeFactor = 1.5;
constexpr double kUnitSlopeMargin = 3e-4;  // [s] what the jitter of a quarter of a second can feign

double floatStep(float value) {
  const float magnitude = std::abs(value);
  return static_cast<double>(std::nextafter(magnitude, std::numeric_limits<float>::infinity())) -
         static_cast<double>(magnitude);
}

bool isKnownPeriod(float period) { return std::isfinite(period) && period > 0.0F; }

}  // namespace

void ReceiveClock::read(std::int64_t now_wall_ns, std::int64_t now_steady_ns) {
  const std::int64_t offset = now_wall_ns - now_steady_ns;
  if (!started_) {
    started_ = true;
    offset_ns_ = best_offset_ns_ = offset;
  }
  best_offset_ns_ = readings_ == 0 ? offset : std::max(best_offset_ns_, offset);
  if (++readings_ == kReadings) {
    readings_ = 0;
    if (std::abs(best_offset_ns_ - offset_ns_) > kStepThresholdNs) {
      offset_ns_ = best_offset_ns_;
      ++steps_;
    }
  }
}

std::int64_t ReceiveClock::toHostTime(std::int64_t kernel_wall_ns, std::int64_t now_wall_ns,
                                      std::int64_t now_steady_ns) {
  read(now_wall_ns, now_steady_ns);
  return now_steady_ns + offset_ns_ - (now_wall_ns - kernel_wall_ns);
}

const char* toString(ClockEvent event) {
  switch (event) {
    case ClockEvent::kNone:
      return "none";
    case ClockEvent::kFirst:
      return "first";
    case ClockEvent::kDuplicate:
      return "duplicate";
    case ClockEvent::kOutOfOrder:
      return "out_of_order";
    case ClockEvent::kPaused:
      return "paused";
    case ClockEvent::kResumed:
      return "resumed";
    case ClockEvent::kGap:
      return "gap";
    case ClockEvent::kRateChanged:
      return "rate_changed";
    case ClockEvent::kSlipped:
      return "slipped";
    case ClockEvent::kReset:
      return "reset";
    case ClockEvent::kReplayStarted:
      return "replay_started";
    case ClockEvent::kReplayEnded:
      return "replay_ended";
    case ClockEvent::kHostClockStep:
      return "host_clock_step";
  }
  return "unknown";
}

ClockEstimate ClockFilter::update(const ClockSample& sample) {
  const double host_step = toSeconds(sample.receive_ns - last_.receive_ns);
  const double sim_step = static_cast<double>(sample.sim_time) - static_cast<double>(last_.sim_time);
  ClockEvent event = ClockEvent::kNone;

  if (!started_) {
    event = ClockEvent::kFirst;
  } else if (host_step < -1e-3) {
    event = ClockEvent::kHostClockStep;
  } else if (raise_epoch_) {
    event = ClockEvent::kReset;
  } else if (sample.replay != replay_) {
    event = sample.replay ? ClockEvent::kReplayStarted : ClockEvent::kReplayEnded;
  } else if (sim_step < 0.0) {
    const bool reset = -sim_step > options_.backward_tolerance || ++backward_samples_ >= kBackwardSamplesForReset;
    event = reset ? ClockEvent::kReset : ClockEvent::kOutOfOrder;
  } else if (isForwardJump(sample, host_step)) {
    event = ClockEvent::kReset;
  } else if (sim_step == 0.0 && !sample.paused && !paused_ && floatStep(sample.sim_time) <= sample.frame_period / 2) {
    event = ClockEvent::kDuplicate;
  } else if (sim_step == 0.0 && !sample.paused && !paused_ && !isKnownPeriod(sample.frame_period)) {
    event = ClockEvent::kDuplicate;
  }

  ClockEstimate estimate;
  if (event == ClockEvent::kDuplicate || event == ClockEvent::kOutOfOrder) {
    estimate.event = event;
    estimate.epoch = epoch_;
    return estimate;
  }

  if (event != ClockEvent::kNone) {
    startEpoch(sample);
  } else {
    backward_samples_ = 0;
    countMissed(sample);
    sim_time_before_ = sim_time_;
    advanceSimTime(sample);
    if (sample.paused != paused_) {
      event = sample.paused ? ClockEvent::kPaused : ClockEvent::kResumed;
      paused_ = sample.paused;
      restartFit(sample);
    } else if (!paused_ && !options_.exact) {
      event = judgeDelay(sample, host_step);
    }
  }
  last_ = sample;
  if (!paused_ && !options_.exact) addToFit(relative(sample));

  estimate.usable = true;
  estimate.event = event;
  estimate.epoch = epoch_;
  estimate.sim_time = sim_time_;
  estimate.stamp_ns = stampOf(sample);
  estimate.uncertainty = uncertainty();
  return estimate;
}

void ClockFilter::countMissed(const ClockSample& sample) {
  if (sample.paused || paused_ || replay_ || !(sample.frame_period > 0.0F)) return;
  // What was not received lasted as long as the frame that was; a hitch is one long frame, and says so.
  const double elapsed = static_cast<double>(sample.sim_time) - static_cast<double>(last_.sim_time);
  const long frames = std::lround(elapsed / static_cast<double>(sample.frame_period));
  if (frames > 1) missed_frames_ += static_cast<std::uint64_t>(frames - 1);
}

void ClockFilter::reset() {
  if (started_) raise_epoch_ = true;
  fitted_ = false;
}

std::optional<double> ClockFilter::simTime(std::int64_t host_ns) const {
  if (!fitted_ || paused_) return std::nullopt;
  const double host = toSeconds(host_ns - host_reference_ns_);
  double sim = (host - offset_) / slope_;
  for (std::size_t i = 0; i < slips_kept_; ++i) {
    const Slip& slip = newestSlip(i);
    if (host >= slip.host_border) break;
    sim = std::min(sim + slip.length / slope_, slip.before);
  }
  return sim_reference_ + sim;
}

std::optional<std::int64_t> ClockFilter::hostTime(double sim_time) const {
  if (!fitted_ || paused_) return std::nullopt;
  const double sim = sim_time - sim_reference_;
  double host = offset_ + slope_ * sim;
  for (std::size_t i = 0; i < slips_kept_ && sim <= newestSlip(i).before; ++i) host -= newestSlip(i).length;
  return host_reference_ns_ + toNanoseconds(host);
}

double ClockFilter::timeRatio() const {
  if (options_.exact) return 1.0;
  if (!fitted_) return kNaN;
  const double span = bucket(count_ - 1).sim - bucket(0).sim;
  double slipped = 0.0;
  for (std::size_t i = 0; i < slips_kept_ && newestSlip(i).before >= bucket(0).sim; ++i) {
    slipped += newestSlip(i).length;
  }
  return span / (slope_ * span + slipped);
}

bool ClockFilter::mayHaveLastedLonger(float simulated, float acceleration) const {
  return !options_.exact && isKnownPeriod(simulated) &&
         static_cast<double>(simulated) >= options_.longest_frame * static_cast<double>(acceleration);
}

double ClockFilter::uncertainty() const {
  if (options_.exact) return 0.0;
  if (fitted_) return fit_spread_ + sim_time_step_;
  return std::max(options_.unfitted_uncertainty, sim_time_step_);
}

bool ClockFilter::isForwardJump(const ClockSample& sample, double host_step) const {
  const double sim_step = static_cast<double>(sample.sim_time) - static_cast<double>(last_.sim_time);
  return sim_step > std::max(host_step, 0.0) * options_.max_time_ratio + options_.forward_jump;
}

void ClockFilter::startEpoch(const ClockSample& sample) {
  if (started_) ++epoch_;
  started_ = true;
  raise_epoch_ = false;
  backward_samples_ = 0;
  paused_ = sample.paused;
  replay_ = sample.replay;
  sim_time_ = static_cast<double>(sample.sim_time);
  sim_time_step_ = 0.0;
  restartFit(sample);
}

void ClockFilter::restartFit(const ClockSample& sample) {
  host_reference_ns_ = sample.receive_ns;
  sim_reference_ = sim_time_;
  first_ = count_ = 0;
  fitted_ = false;
  late_ = false;
  late_run_.active = false;
  slips_kept_ = 0;
}

void ClockFilter::advanceSimTime(const ClockSample& sample) {
  const double raw = static_cast<double>(sample.sim_time);
  const double raw_step = raw - static_cast<double>(last_.sim_time);
  const double quantum = floatStep(sample.sim_time);
  double step = raw_step;
  sim_time_step_ = quantum;
  if (sample.paused && raw_step == 0.0) {
    step = 0.0;
  } else if (isKnownPeriod(sample.frame_period)) {
    const double period = static_cast<double>(sample.frame_period);
    const double frames = std::max(1.0, std::round(raw_step / period));
    if (std::abs(raw_step - period) <= quantum) {
      step = period;
      sim_time_step_ = 0.0;
    } else if (std::abs(raw_step - frames * period) <= quantum) {  // datagrams between were lost
      step = frames * period;
      sim_time_step_ = 0.0;
    }
  }
  // A period is off by half a step of its own, and the sum of many by up to a step of theirs; the raw value by half
  // one. A narrower bound would make single steps differ from the period.
  constexpr double kSteps = 2.0;
  sim_time_ = std::clamp(sim_time_ + step, raw - kSteps * quantum, raw + kSteps * quantum);
}

ClockEvent ClockFilter::judgeDelay(const ClockSample& sample, double host_step) {
  if (!fitted_) {
    if (host_step <= options_.gap) return ClockEvent::kNone;
    restartFit(sample);
    return ClockEvent::kGap;
  }
  const Point point = relative(sample);
  if (host_step > options_.gap && delay(point) > options_.rate_change) {
    restartFit(sample);
    return ClockEvent::kGap;
  }
  if (judgeSlip(sample, point)) {
    late_ = false;
    return ClockEvent::kSlipped;
  }
  if (delay(point) <= options_.rate_change) {
    late_ = false;
    return ClockEvent::kNone;
  }
  if (!late_) {
    late_ = true;
    late_since_ = point.host;
  }
  if (point.host - late_since_ < options_.rate_change_after) return ClockEvent::kNone;
  late_ = false;
  dropBucketsBefore(late_since_);
  return ClockEvent::kRateChanged;
}

bool ClockFilter::judgeSlip(const ClockSample& sample, const Point& point) {
  const double late = delay(point);
  if (late <= options_.slip + fit_spread_) {
    late_run_.active = false;
    return false;
  }
  const double before = sim_time_before_ - sim_reference_;
  // Such a frame says itself that it may have lasted longer; a datagram that was late only moves the line back soon.
  if (mayHaveLastedLonger(sample.frame_period, sample.acceleration)) {
    slip(point, before, late);
    return true;
  }
  const bool even = late_run_.active && std::max(late_run_.most, late) - std::min(late_run_.least, late) <=
                                            options_.slip_evenness + fit_spread_;
  if (!even) {
    late_run_ = {true, point, before, late, late};
    return false;
  }
  late_run_.least = std::min(late_run_.least, late);
  late_run_.most = std::max(late_run_.most, late);
  if (point.host - late_run_.first.host < options_.slip_after) return false;
  slip(late_run_.first, late_run_.before, late_run_.least);
  return true;
}

void ClockFilter::slip(const Point& first, double before, double length) {
  for (std::size_t i = 0; i < count_; ++i) {
    Point& p = buckets_[(first_ + i) % kBuckets];
    if (p.sim < first.sim) p.host += length;
  }
  offset_ += length;
  const double half_frame = 0.5 * slope_ * (first.sim - before);
  slips_[slip_count_++ % kSlips] = {before, offset_ + slope_ * first.sim - half_frame, length};
  slips_kept_ = std::min(slips_kept_ + 1, kSlips);
  late_run_.active = false;
}

void ClockFilter::dropBucketsBefore(double host) {
  while (count_ > 0 && bucket(0).host < host) {
    first_ = (first_ + 1) % kBuckets;
    --count_;
  }
}

ClockFilter::Point ClockFilter::relative(const ClockSample& sample) const {
  return {sim_time_ - sim_reference_, toSeconds(sample.receive_ns - host_reference_ns_)};
}

void ClockFilter::addToFit(const Point& point) {
  const double width = options_.window / static_cast<double>(kBuckets);
  if (count_ == 0 || point.host >= bucket_start_ + width) {
    dropBucketsBefore(point.host - options_.window);
    if (count_ == kBuckets) {
      first_ = (first_ + 1) % kBuckets;
      --count_;
    }
    bucket_start_ = point.host;
    buckets_[(first_ + count_++) % kBuckets] = point;
  } else {
    Point& newest = buckets_[(first_ + count_ - 1) % kBuckets];
    if (delay(point) > delay(newest)) return;
    newest = point;
  }
  fit();
}

void ClockFilter::fit() {
  if (count_ < kMinBuckets || bucket(count_ - 1).host - bucket(0).host < options_.min_span) {
    fitted_ = false;
    return;
  }
  // Of all lines below the points, the closest in sum is the edge of their lower hull that spans their mean.
  std::array<Point, kBuckets> hull;
  std::size_t size = 0;
  double mean_sim = 0.0, unit_offset = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < count_; ++i) {
    const Point& p = bucket(i);
    mean_sim += p.sim / static_cast<double>(count_);
    unit_offset = std::min(unit_offset, p.host - p.sim);
    const auto turnsRight = [&] {
      const Point &a = hull[size - 2], &b = hull[size - 1];
      return (b.sim - a.sim) * (p.host - a.host) - (b.host - a.host) * (p.sim - a.sim) <= 0.0;
    };
    while (size >= 2 && turnsRight()) --size;
    hull[size++] = p;
  }
  std::size_t right = 1;
  while (right + 1 < size && hull[right].sim < mean_sim) ++right;
  const Point &a = hull[right - 1], &b = hull[right];
  if (!(b.sim > a.sim)) {
    fitted_ = false;
    return;
  }
  double slope = (b.host - a.host) / (b.sim - a.sim);
  double offset = a.host - slope * a.sim;

  double mean_delay = 0.0, unit_mean_delay = 0.0;
  for (std::size_t i = 0; i < count_; ++i) {
    const Point& p = bucket(i);
    mean_delay += (p.host - offset - slope * p.sim) / static_cast<double>(count_);
    unit_mean_delay += (p.host - unit_offset - p.sim) / static_cast<double>(count_);
  }
  if (unit_mean_delay <= kUnitSlopeFactor * mean_delay + kUnitSlopeMargin) {
    slope = 1.0;
    offset = unit_offset;
  }
  fitted_ = true;
  slope_ = slope;
  offset_ = offset;

  double squares = 0.0;
  for (std::size_t i = 0; i < count_; ++i) squares += delay(bucket(i)) * delay(bucket(i));
  fit_spread_ = 2.0 * std::sqrt(squares / static_cast<double>(count_));
}

std::int64_t ClockFilter::stampOf(const ClockSample& sample) {
  if (options_.exact) return sample.receive_ns;
  std::int64_t stamp = sample.receive_ns;
  if (const auto host = hostTime(sim_time_)) stamp = std::min(stamp, *host);
  // A new epoch may step back with the host clock; within one, stamps increase whatever the fit does.
  if (stamp_epoch_ == epoch_ && has_stamp_) stamp = std::max(stamp, last_stamp_ns_ + kMinStampStepNs);
  has_stamp_ = true;
  stamp_epoch_ = epoch_;
  last_stamp_ns_ = stamp;
  return stamp;
}

}  // namespace xplane_bridge::core
