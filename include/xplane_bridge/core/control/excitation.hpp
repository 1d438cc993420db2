#pragma once

/// Test signals for system identification and delay estimation, and the state machine that plays one safely.
///
/// Signals are functions of simulator time since the start, so they stand still while X-Plane is paused and do not
/// depend on the rate at which they are sampled. No randomness beyond the given seed: the same specification gives the
/// same signal on every machine.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/core/base/message_constants.hpp"

namespace xplane_bridge::core {

// The shapes (ExcitationShape), A the amplitude. Doublet: +A for the first half of `duration`, then -A. 3-2-1-1: +A for
// 3/7 of `duration`, -A for 2/7, +A for 1/7, -A for 1/7. Multisine: equal-power harmonics of 1/`duration` within the
// band, Schroeder phases (low crest factor); with `interleave` only every so many-th of them, so that multisines of
// different `interleave_offset` are orthogonal over `duration`. Chirp: logarithmic sweep from `frequency_min` to
// `frequency_max`.

/// What to play. Defaults are a usable roll multisine.
struct ExcitationSpec {
  ExcitationShape shape = ExcitationShape::kMultisine;
  double amplitude = 0.1;         ///< peak, in the unit of the target (axis: -1..1; surface: deg); > 0
  double duration = 20.0;         ///< [s] of the whole signal; > 0, up to 600
  double frequency_min = 0.1;     ///< [Hz] lower end of the band
  double frequency_max = 2.0;     ///< [Hz] upper end of the band
  std::uint32_t seed = 0;         ///< shifts the multisine in time: another realisation, the same spectrum and peak
  int interleave = 1;             ///< multisine: every so many-th harmonic of the band; >= 1
  int interleave_offset = 0;      ///< multisine: harmonics left out at its lower end; 0 to interleave - 1
  double fade = 0.5;              ///< [s] raised-cosine fade in and out of multisine and chirp; not used by the pulses
  double roll_limit_deg = 45.0;   ///< |roll| beyond which the excitation is aborted; > 0
  double pitch_limit_deg = 20.0;  ///< |pitch| beyond which the excitation is aborted; > 0
};

/// First thing wrong with the specification (field, given value, expected), or nullopt.
std::optional<std::string> validate(const ExcitationSpec& spec);

/// A signal over time. Immutable. Making a multisine takes up to half a second, for its peak.
class ExcitationSignal {
 public:
  /// Throws std::invalid_argument with validate()'s text.
  explicit ExcitationSignal(const ExcitationSpec& spec);

  const ExcitationSpec& spec() const { return spec_; }
  double duration() const { return spec_.duration; }  ///< [s]

  /// Value at `t` [s] since the start; 0 outside [0, duration).
  double value(double t) const;

  /// [Hz] of each component of a multisine; empty for the other shapes.
  const std::vector<double>& frequencies() const { return frequencies_; }

 private:
  double multisine(double t) const;
  double chirp(double t) const;
  double window(double t) const;

  ExcitationSpec spec_;
  std::vector<double> frequencies_;
  std::vector<double> phases_;
  double scale_ = 1.0;
};

enum class ExcitationPhase : std::uint8_t { kIdle, kRunning, kDone, kAborted };

const char* toString(ExcitationPhase phase);

/// Plays signals, which begin and end together, against simulator time and stops them where the aircraft leaves the
/// allowed attitude. Duration and limits are the first signal's.
class ExcitationRunner {
 public:
  /// Starts at simulator time `sim_time` [s]. Throws std::invalid_argument (time unknown, no signal) or
  /// std::logic_error (some run already).
  void start(const std::vector<ExcitationSignal>& signals, double sim_time);

  /// Advances to `sim_time` [s] with the present attitude [deg] and returns what to add to each target's command, in
  /// the order of the signals.
  /// A non-finite attitude, or simulator time running backwards (reset, replay) by more than kOvertaking, aborts.
  const std::vector<double>& step(double sim_time, double roll_deg, double pitch_deg);

  /// Ends a running excitation; the reason is kept for the label. Without one running, nothing happens.
  void abort(const std::string& reason);

  ExcitationPhase phase() const { return phase_; }
  const std::string& reason() const { return reason_; }          ///< why it was aborted; else empty
  const std::vector<double>& values() const { return values_; }  ///< as returned by the last step

 private:
  std::vector<ExcitationSignal> signals_;
  ExcitationPhase phase_ = ExcitationPhase::kIdle;
  std::string reason_;
  double start_time_ = 0.0;
  double last_time_ = 0.0;
  std::vector<double> values_;
};

}  // namespace xplane_bridge::core
