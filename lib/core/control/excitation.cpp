#include "xplane_bridge/core/control/excitation.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <stdexcept>

#include <unsupported/Eigen/FFT>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

constexpr double kMaxDuration = 600.0;        // [s] longer ones are a mistake in the unit
constexpr std::size_t kMaxComponents = 2000;  // bounds the work of one sample
constexpr double kMaxHarmonic = 60000.0;      // 100 Hz for the longest duration; bounds the work of finding the peak
constexpr int kPeakSamplesPerPeriod = 32;     // of the highest component; leaves the true peak within 0.5 %

std::string complaint(const char* field, double given, const char* expected) {
  char text[160];
  std::snprintf(text, sizeof text, "excitation %s is %g: expected %s", field, given, expected);
  return text;
}

bool isPulse(ExcitationShape shape) { return shape == ExcitationShape::kDoublet || shape == ExcitationShape::k3211; }

// The multisine's harmonics of 1/duration within [low, high], both ends included despite rounding.
std::vector<int> harmonicsOf(const ExcitationSpec& s) {
  const int first = std::max(1, static_cast<int>(std::ceil(s.frequency_min * s.duration - 1e-9)));
  const int last = static_cast<int>(std::floor(s.frequency_max * s.duration + 1e-9));
  std::vector<int> out;
  for (int k = first + s.interleave_offset; k <= last; k += s.interleave) out.push_back(k);
  return out;
}

// Uniform in [0, 1) from a seed (SplitMix32's finaliser): the standard library's distributions differ between vendors.
double unitFromSeed(std::uint32_t seed) {
  if (seed == 0) return 0.0;
  std::uint32_t z = seed * 0x9E3779B9u;
  z = (z ^ (z >> 16)) * 0x85EBCA6Bu;
  z = (z ^ (z >> 13)) * 0xC2B2AE35u;
  z ^= z >> 16;
  return static_cast<double>(z) / 4294967296.0;
}

// Greatest magnitude of the sum of cosines of these ascending harmonics with these phases.
double peakOf(const std::vector<int>& harmonics, const std::vector<double>& phases) {
  const int wanted = kPeakSamplesPerPeriod * (harmonics.back() + 1);
  std::size_t samples = 1;
  while (samples < static_cast<std::size_t>(wanted)) samples *= 2;
  std::vector<std::complex<double>> lines(samples), sum;
  for (std::size_t n = 0; n < phases.size(); ++n)
    lines[static_cast<std::size_t>(harmonics[n])] = std::polar(1.0, phases[n]);
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::Unscaled);
  fft.inv(sum, lines);
  double peak = 0.0;
  for (const std::complex<double>& value : sum) peak = std::max(peak, std::abs(value.real()));
  return peak;
}

}  // namespace

const char* toString(ExcitationPhase phase) {
  switch (phase) {
    case ExcitationPhase::kIdle:
      return "idle";
    case ExcitationPhase::kRunning:
      return "running";
    case ExcitationPhase::kDone:
      return "done";
    case ExcitationPhase::kAborted:
      return "aborted";
  }
  return "unknown";
}

std::optional<std::string> validate(const ExcitationSpec& s) {
  const auto positive = [](double v) { return std::isfinite(v) && v > 0.0; };
  if (!positive(s.amplitude)) return complaint("amplitude", s.amplitude, "a value above 0");
  if (!positive(s.roll_limit_deg)) return complaint("roll_limit_deg", s.roll_limit_deg, "an angle above 0 deg");
  if (!positive(s.pitch_limit_deg)) return complaint("pitch_limit_deg", s.pitch_limit_deg, "an angle above 0 deg");
  if (!positive(s.duration) || s.duration > kMaxDuration) {
    return complaint("duration", s.duration, "above 0 and up to 600 s");
  }
  if (isPulse(s.shape)) return std::nullopt;
  if (!positive(s.frequency_min)) return complaint("frequency_min", s.frequency_min, "above 0 Hz");
  if (!std::isfinite(s.frequency_max) || s.frequency_max < s.frequency_min) {
    return complaint("frequency_max", s.frequency_max, "not below frequency_min");
  }
  if (!std::isfinite(s.fade) || s.fade < 0.0 || 2.0 * s.fade > s.duration) {
    return complaint("fade", s.fade, "0 to half the duration");
  }
  if (s.shape == ExcitationShape::kMultisine) {
    if (s.frequency_max * s.duration > kMaxHarmonic) {
      return complaint("frequency_max", s.frequency_max, "at most 60000 / duration");
    }
    if (s.interleave < 1) return complaint("interleave", s.interleave, "1 or more");
    if (s.interleave_offset < 0 || s.interleave_offset >= s.interleave) {
      return complaint("interleave_offset", s.interleave_offset, "0 or more, below interleave");
    }
    const std::size_t count = harmonicsOf(s).size();
    if (count < 1) {
      return complaint("frequency_max", s.frequency_max, "a band that holds a multiple of 1/duration for each target");
    }
    if (count > kMaxComponents) return complaint("duration", s.duration, "at most 2000 harmonics in the band");
  }
  return std::nullopt;
}

ExcitationSignal::ExcitationSignal(const ExcitationSpec& spec) : spec_(spec) {
  if (const auto wrong = validate(spec)) throw std::invalid_argument(*wrong);
  scale_ = spec.amplitude;
  if (spec.shape != ExcitationShape::kMultisine) return;
  const std::vector<int> harmonics = harmonicsOf(spec);
  const auto count = static_cast<int>(harmonics.size());
  const double shift = 2.0 * kPi * unitFromSeed(spec.seed);
  for (int n = 0; n < count; ++n) {
    const int harmonic = harmonics[static_cast<std::size_t>(n)];
    frequencies_.push_back(harmonic / spec.duration);
    // Schroeder (1970) for a flat spectrum; the seed's time shift turns harmonic k by k times its angle.
    phases_.push_back(std::fmod(-kPi * n * (n + 1.0) / count + shift * harmonic, 2.0 * kPi));
  }
  scale_ = spec.amplitude / peakOf(harmonics, phases_);
}

double ExcitationSignal::multisine(double t) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < frequencies_.size(); ++i) sum += std::cos(2.0 * kPi * frequencies_[i] * t + phases_[i]);
  return scale_ * sum;
}

double ExcitationSignal::chirp(double t) const {
  const double ratio = std::log(spec_.frequency_max / spec_.frequency_min);
  const double cycles = ratio < 1e-9
                            ? spec_.frequency_min * t
                            : spec_.frequency_min * spec_.duration / ratio * std::expm1(ratio * t / spec_.duration);
  return scale_ * std::sin(2.0 * kPi * cycles);
}

double ExcitationSignal::window(double t) const {
  const double edge = std::min(t, spec_.duration - t);
  if (spec_.fade <= 0.0 || edge >= spec_.fade) return 1.0;
  return 0.5 * (1.0 - std::cos(kPi * edge / spec_.fade));
}

double ExcitationSignal::value(double t) const {
  if (!(t >= 0.0) || t >= spec_.duration) return 0.0;
  switch (spec_.shape) {
    case ExcitationShape::kDoublet:
      return t < 0.5 * spec_.duration ? spec_.amplitude : -spec_.amplitude;
    case ExcitationShape::k3211: {
      const double pulses = 7.0 * t / spec_.duration;
      return pulses < 3.0 || (pulses >= 5.0 && pulses < 6.0) ? spec_.amplitude : -spec_.amplitude;
    }
    case ExcitationShape::kMultisine:
      return window(t) * multisine(t);
    case ExcitationShape::kChirp:
      return window(t) * chirp(t);
  }
  return 0.0;
}

void ExcitationRunner::start(const std::vector<ExcitationSignal>& signals, double sim_time) {
  if (phase_ == ExcitationPhase::kRunning) {
    throw std::logic_error(std::string("an excitation is running (") + toString(signals_.front().spec().shape) +
                           "): wait for its end or abort it first");
  }
  if (!std::isfinite(sim_time)) throw std::invalid_argument("excitation needs simulator time, which is not known");
  if (signals.empty()) throw std::invalid_argument("an excitation needs a signal");
  signals_ = signals;
  phase_ = ExcitationPhase::kRunning;
  reason_.clear();
  start_time_ = last_time_ = sim_time;
  values_.assign(signals_.size(), 0.0);
}

const std::vector<double>& ExcitationRunner::step(double sim_time, double roll_deg, double pitch_deg) {
  if (phase_ != ExcitationPhase::kRunning) return values_;
  const ExcitationSpec& spec = signals_.front().spec();
  char text[120];
  if (!std::isfinite(sim_time) || sim_time < last_time_ - kOvertaking) {
    abort("simulator time ran backwards or is unknown");
  } else if (!std::isfinite(roll_deg) || !std::isfinite(pitch_deg)) {
    abort("attitude is unknown");
  } else if (std::abs(roll_deg) > spec.roll_limit_deg) {
    std::snprintf(text, sizeof text, "roll %.1f deg is beyond the limit of %.1f deg", roll_deg, spec.roll_limit_deg);
    abort(text);
  } else if (std::abs(pitch_deg) > spec.pitch_limit_deg) {
    std::snprintf(text, sizeof text, "pitch %.1f deg is beyond the limit of %.1f deg", pitch_deg, spec.pitch_limit_deg);
    abort(text);
  } else if (sim_time - start_time_ >= spec.duration) {
    phase_ = ExcitationPhase::kDone;
    values_.assign(signals_.size(), 0.0);
  } else if (sim_time >= last_time_) {
    for (std::size_t i = 0; i < signals_.size(); ++i) values_[i] = signals_[i].value(sim_time - start_time_);
    last_time_ = sim_time;
  }
  return values_;
}

void ExcitationRunner::abort(const std::string& reason) {
  if (phase_ != ExcitationPhase::kRunning) return;
  phase_ = ExcitationPhase::kAborted;
  reason_ = reason;
  values_.assign(signals_.size(), 0.0);
}

}  // namespace xplane_bridge::core
