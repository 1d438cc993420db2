#include "xplane_bridge/actuation/surface_identification.hpp"

#include <algorithm>
#include <cstdio>
#include <optional>
#include <utility>

#include "xplane_bridge/core/base/limits.hpp"
#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge {
namespace {

constexpr std::array<const char*, 3> kAxes = {"roll", "pitch", "yaw"};

// Defaults of the request.
constexpr double kMaxRollDeg = 30.0;
constexpr double kMaxPitchDeg = 20.0;
constexpr double kMaxRateDegS = 40.0;
constexpr double kMaxAirspeedChange = 10.0;  // [m/s]
constexpr double kMinHeight = 150.0;         // [m]

// What counts as parked, and as steady flight.
constexpr double kParkedSpeed = 1.0;     // [m/s]
constexpr double kSteadyRollDeg = 15.0;  // a little less than a standard turn
constexpr double kSteadyPitchDeg = 12.0;
constexpr double kSteadyRateDegS = 6.0;
constexpr double kSteadyClimb = 4.0;  // [m] within kSteadyTime

constexpr double kSteadyTime = 1.0;    // [s] before the first signal
constexpr double kPauseTime = 0.2;     // [s] between two
constexpr double kChecking = 4.0;      // [s] in which the mixing must be seen to hold
constexpr double kMargin = 1.25;       // [-] beyond what is needed: a sine reaches its peak for a moment only
constexpr double kFastest = 1.1;       // [1/s] of stick: samples of a faster one are not used
constexpr double kFrequency = 0.75;    // [Hz] at most
constexpr double kPeriods = 2.0;       // of the sine: its ends are faded
constexpr int kRepeats = 2;            // of an axis that did not move far enough
constexpr double kMostGain = 4.0;      // [-] against a controller
constexpr double kAmplitude = 0.8;     // [-] at most
constexpr double kFarthestRest = 0.5;  // [-] from the middle: beyond, the other side cannot be reached

double orDefault(double value, double fallback) { return value == 0.0 ? fallback : value; }

std::string inWords(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", value);
  return text;
}

std::string beyond(const std::string& what, double value, double limit, const std::string& unit) {
  return what + inWords(value) + unit + " is beyond the limit of " + inWords(limit) + unit;
}

double fastestRate(const core::FlightWatch& watch) {
  return std::max({std::abs(watch.roll_rate_deg_s), std::abs(watch.pitch_rate_deg_s), std::abs(watch.yaw_rate_deg_s)});
}

bool isKnown(const core::FlightWatch& watch) {
  const std::array<double, 9> values{watch.sim_time,        watch.height_agl,       watch.indicated_airspeed,
                                     watch.roll_deg,        watch.pitch_deg,        watch.elevation,
                                     watch.roll_rate_deg_s, watch.pitch_rate_deg_s, watch.yaw_rate_deg_s};
  return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

std::optional<std::string> wrongLimit(const IdentificationRequest& request) {
  const std::array<std::pair<const char*, double>, 5> limits{{{"max_roll_deg", request.max_roll_deg},
                                                              {"max_pitch_deg", request.max_pitch_deg},
                                                              {"max_rate_deg_s", request.max_rate_deg_s},
                                                              {"max_airspeed_change", request.max_airspeed_change},
                                                              {"min_height", request.min_height}}};
  for (const auto& [name, value] : limits) {
    if (std::isfinite(value) && value >= 0.0) continue;
    return std::string(name) + " is " + inWords(value) + ": expected 0 (the default) or more";
  }
  return std::nullopt;
}

}  // namespace

SurfaceIdentification::SurfaceIdentification(SurfaceControl* surfaces, ExcitationManager* excitation,
                                             double max_roll_deg, double max_pitch_deg, Report report)
    : surfaces_(surfaces),
      excitation_(excitation),
      max_roll_deg_(max_roll_deg),
      max_pitch_deg_(max_pitch_deg),
      report_(std::move(report)) {}

// --- conditions ---

/// Why this is neither parked nor steady flight; empty: it is.
std::string SurfaceIdentification::unsteady(const core::FlightWatch& watch) const {
  const std::string expected = ": stand still on the ground, or fly straight and level first";
  if (watch.on_ground) {
    if (watch.ground_speed <= kParkedSpeed) return "";
    return "the aircraft rolls at " + inWords(watch.ground_speed) + " m/s" + expected;
  }
  if (std::abs(watch.roll_deg) > kSteadyRollDeg || std::abs(watch.pitch_deg) > kSteadyPitchDeg) {
    return "the flight is not steady, roll " + inWords(watch.roll_deg) + " deg and pitch " + inWords(watch.pitch_deg) +
           " deg" + expected;
  }
  if (fastestRate(watch) > kSteadyRateDegS) {
    return "the flight is not steady, it turns at " + inWords(fastestRate(watch)) + " deg/s" + expected;
  }
  if (phase_ == Phase::kSteadying && std::abs(watch.elevation - elevation_) > kSteadyClimb) {
    return "the flight is not steady, " + inWords(watch.elevation - elevation_) + " m of height in a second" + expected;
  }
  return "";
}

std::string SurfaceIdentification::beyondLimits(const core::FlightWatch& watch) const {
  if (!isKnown(watch)) return "X-Plane does not show the flight any more";
  if (watch.crashed) return "the aircraft has crashed";
  if (fastestRate(watch) > limits_.max_rate_deg_s) {
    return beyond("", fastestRate(watch), limits_.max_rate_deg_s, " deg/s");
  }
  if (std::abs(watch.roll_deg) > limits_.max_roll_deg) {
    return beyond("roll ", watch.roll_deg, limits_.max_roll_deg, " deg");
  }
  if (std::abs(watch.pitch_deg) > limits_.max_pitch_deg) {
    return beyond("pitch ", watch.pitch_deg, limits_.max_pitch_deg, " deg");
  }
  if (parked_) {
    return watch.on_ground && watch.ground_speed <= kParkedSpeed ? "" : "the aircraft does not stand any more";
  }
  if (std::abs(watch.indicated_airspeed - airspeed_) > limits_.max_airspeed_change) {
    return beyond("a change of airspeed by ", watch.indicated_airspeed - airspeed_, limits_.max_airspeed_change,
                  " m/s");
  }
  if (watch.height_agl < limits_.min_height) {
    return "the height above ground is " + inWords(watch.height_agl) + " m: expected at least " +
           inWords(limits_.min_height) + " m";
  }
  return "";
}

/// Of what decides at the beginning and all the time.
std::string SurfaceIdentification::whyNot(const core::FlightWatch& watch, const IdentificationConditions& now) const {
  if (now.blocked) return now.blocked->text;
  if (now.failsafe) return "the failsafe flies: its source must be back, or a mode asked for";
  if (!now.broken.empty()) return now.broken;
  return beyondLimits(watch);
}

/// Its signal has to go to both sides of the middle.
std::string SurfaceIdentification::offTheMiddle(std::size_t axis) const {
  const double total = surfaces_->sticks().total[axis];
  if (std::abs(total) <= kFarthestRest) return "";
  return std::string(kAxes[axis]) + " stands at " + inWords(total) + " of full stick: trim it first";
}

// --- what it does ---

RequestResult SurfaceIdentification::begin(const IdentificationRequest& request, const std::string& who,
                                           const core::FlightWatch& watch, const IdentificationConditions& now,
                                           const std::function<std::uint32_t()>& reserve) {
  const auto refused = [](const std::string& why) { return RequestResult{core::ResultCode::kRefused, why}; };
  if (running()) return refused("an identification runs already: wait for event " + std::to_string(number_));
  if (const auto wrong = wrongLimit(request)) return refused(*wrong);
  if (excitation_->running()) return refused("an excitation runs: wait for it, or stop it");
  if (now.blocked) return *now.blocked;
  if (!isKnown(watch)) return {core::ResultCode::kNoLink, "X-Plane has not shown the flight yet"};
  limits_ = request;
  limits_.max_roll_deg = orDefault(request.max_roll_deg, std::min(kMaxRollDeg, max_roll_deg_));
  limits_.max_pitch_deg = orDefault(request.max_pitch_deg, std::min(kMaxPitchDeg, max_pitch_deg_));
  limits_.max_rate_deg_s = orDefault(request.max_rate_deg_s, kMaxRateDegS);
  limits_.max_airspeed_change = orDefault(request.max_airspeed_change, kMaxAirspeedChange);
  limits_.min_height = orDefault(request.min_height, kMinHeight);
  parked_ = watch.on_ground;
  airspeed_ = watch.indicated_airspeed;
  elevation_ = watch.elevation;
  if (const std::string why = unsteady(watch); !why.empty()) return refused(why);
  if (const std::string why = whyNot(watch, now); !why.empty()) return refused(why);
  if (const std::string why = surfaces_->beginIdentification(); !why.empty()) return refused(why);
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    const std::string why = offTheMiddle(axis);
    if (why.empty()) continue;
    surfaces_->cancelIdentification();
    return refused(why);
  }
  who_ = who;
  axis_ = 0;
  repeats_ = 0;
  gain_ = 1.0;
  number_ = reserve();
  enter(Phase::kSteadying, watch);
  return {core::ResultCode::kAccepted, "event " + std::to_string(number_) + " will report the outcome"};
}

void SurfaceIdentification::onFrame(const core::FlightWatch& watch, const IdentificationConditions& now) {
  if (!running()) return;
  if (watch.sim_time < phase_since_ - core::kOvertaking) return abort("simulator time ran backwards");
  std::string why = whyNot(watch, now);
  if (why.empty()) why = surfaces_->identificationProblem();
  if (!why.empty()) return abort(why);
  const double time = watch.sim_time - phase_since_;
  const bool begins = axis_ == 0 && repeats_ == 0;
  switch (phase_) {
    case Phase::kIdle:
      break;
    case Phase::kSteadying:
      if (const std::string unsteady_now = begins ? unsteady(watch) : ""; !unsteady_now.empty()) {
        abort(unsteady_now);
      } else if (time >= (begins ? kSteadyTime : kPauseTime)) {
        signal(watch, now);
      }
      break;
    case Phase::kSignal:
      observe();
      if (!excitation_->running()) afterSignal(watch);
      break;
    case Phase::kChecking:
      if (const std::string blocked = surfaces_->blockReason(); blocked.empty()) {
        finish(text_, true);
      } else if (time > kChecking) {
        finish(text_ + ", but does not hold: " + blocked, false);
      }
      break;
  }
}

void SurfaceIdentification::signal(const core::FlightWatch& watch, const IdentificationConditions& now) {
  const SurfaceControl::Sticks sticks = surfaces_->sticks();
  if (const std::string why = offTheMiddle(axis_); !why.empty()) return abort(why);
  wanted_ = kMargin * surfaces_->excursionNeeded() + std::abs(sticks.total[axis_]);
  const double frequency = std::min(kFrequency, kFastest / (2.0 * core::kPi * wanted_));
  ExcitationRequest request;
  request.kind = core::toString(core::ExcitationShape::kChirp);
  request.target = kAxes[axis_];
  request.amplitude = std::min(kAmplitude, gain_ * wanted_);
  request.duration = kPeriods / frequency;
  request.frequency_min = request.frequency_max = frequency;
  request.max_roll_deg = limits_.max_roll_deg;
  request.max_pitch_deg = limits_.max_pitch_deg;
  request.rest = sticks.stick[axis_];
  const RequestResult result =
      excitation_->inject(request, excitation_->plan(request), who_, watch, now.blocked, now.commanded);
  if (result.code != core::ResultCode::kAccepted) return abort(result.text);
  signal_id_ = excitation_->label().id;
  low_ = high_ = 0.0;
  enter(Phase::kSignal, watch);
}

void SurfaceIdentification::observe() {
  const double total = surfaces_->sticks().total[axis_];
  if (!std::isfinite(total)) return;
  low_ = std::min(low_, total);
  high_ = std::max(high_, total);
}

void SurfaceIdentification::afterSignal(const core::FlightWatch& watch) {
  const ExcitationLabel& label = excitation_->label();
  if (label.id != signal_id_ || label.result != "done") return abort("its signal is " + label.result);
  const double needed = surfaces_->excursionNeeded();
  if (std::min(-low_, high_) < needed && repeats_ < kRepeats) {
    ++repeats_;
    const double reached = std::max(0.5 * (high_ - low_), 0.01);
    gain_ = std::clamp(gain_ * wanted_ / reached, 1.0, kMostGain);
    return enter(Phase::kSteadying, watch);
  }
  repeats_ = 0;
  gain_ = 1.0;
  if (++axis_ == kAxes.size()) return conclude(watch);
  enter(Phase::kSteadying, watch);
}

void SurfaceIdentification::conclude(const core::FlightWatch& watch) {
  const SurfaceControl::Identified found = surfaces_->concludeIdentification(limits_.save);
  if (!found.good) return finish(found.text, false);
  text_ = found.text;
  enter(Phase::kChecking, watch);
}

void SurfaceIdentification::abort(const std::string& why) {
  if (!running()) return;
  // What has been said already stays said: a mixing found is in use whatever comes after it.
  const std::string text = phase_ == Phase::kChecking ? text_ + ", but was not seen to hold: " + why
                                                      : "identify_surfaces is given up: " + why;
  finish(text, false);
}

void SurfaceIdentification::enter(Phase phase, const core::FlightWatch& watch) {
  phase_ = phase;
  phase_since_ = watch.sim_time;
}

void SurfaceIdentification::finish(const std::string& text, bool success) {
  const bool signals = phase_ == Phase::kSignal;
  phase_ = Phase::kIdle;
  if (signals) excitation_->abort(text);
  surfaces_->cancelIdentification();
  report_(number_, text, who_, success);
}

}  // namespace xplane_bridge
