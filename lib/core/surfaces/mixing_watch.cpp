#include "xplane_bridge/core/surfaces/mixing_watch.hpp"

#include <algorithm>
#include <cstdio>

namespace xplane_bridge::core {
namespace {

constexpr double kSamplePeriod = 0.0999;  // [s] ten a second; float32 time rounds
constexpr double kFastest = 1.5;          // [1/s] of full stick: surfaces of a real rate follow that
constexpr double kSpeedWindow = 0.1;      // [s] over which that is measured: commands come in steps
constexpr double kSettling = 0.5;         // [s] after a faster movement
constexpr double kGap = 0.5;              // [s] between frames from which on they are no longer neighbours
constexpr double kSmoothing = 0.1;        // weight of a sample: one second
constexpr int kChecked = 5;               // samples until the check says anything
constexpr double kContradiction = 2.0;    // [-] times the allowed rms
constexpr double kSignalExcursion = 0.2;  // [-] of stick by test signals of one axis at a time
constexpr std::size_t kSignalSamples = 60;

double fastest(const MixingInputs& a, const MixingInputs& b) {
  return std::max({std::abs(a.roll - b.roll), std::abs(a.pitch - b.pitch), std::abs(a.yaw - b.yaw),
                   std::abs(a.trim_roll - b.trim_roll), std::abs(a.trim_pitch - b.trim_pitch),
                   std::abs(a.trim_yaw - b.trim_yaw)});
}

std::size_t knownTerms(const MixingModel& model) {
  return static_cast<std::size_t>(std::count(model.known.begin(), model.known.end(), true));
}

}  // namespace

MixingWatch::MixingWatch(const MixingRequirements& requirements)
    : requirements_(requirements), identifier_(requirements), off_(surfaceTable().size(), 0.0) {
  quality_ = identifier_.solve("").quality;
}

void MixingWatch::reset(const std::string& aircraft) {
  *this = MixingWatch(requirements_);
  aircraft_ = aircraft;
}

void MixingWatch::adopt(const MixingModel& model) {
  model_ = model;
  solved_samples_ = 0;
  recheck();
}

void MixingWatch::interrupt() { last_time_ = fast_time_ = used_time_ = std::nan(""); }

void MixingWatch::recheck() {
  interrupt();
  off_.assign(off_.size(), 0.0);
  off_count_ = 0;
}

void MixingWatch::add(const SurfaceSample& sample) {
  const double time = sample.sim_time;
  if (!std::isfinite(time)) return;
  const double dt = time - last_time_;
  if (dt == 0.0) return;  // paused
  if (dt < 0.0 || dt > kGap) interrupt();
  // The first frame after a gap does not show how fast the stick is.
  const bool first = !std::isfinite(last_time_);
  last_time_ = time;
  const double window = std::max(time - speed_time_, kSpeedWindow);
  if (first || fastest(sample.inputs, speed_inputs_) > kFastest * window) fast_time_ = time;
  if (first || time - speed_time_ >= kSpeedWindow) {
    speed_time_ = time;
    speed_inputs_ = sample.inputs;
  }
  if (time - fast_time_ < kSettling || time - used_time_ < kSamplePeriod) return;
  if (!identifier_.addSample(sample.inputs, sample.deflections_deg)) return;
  used_time_ = time;
  used_inputs_ = sample.inputs;
  if (!model_) return;
  const MixingVector terms = mixingTerms(sample.inputs);
  const double weight = off_count_ == 0 ? 1.0 : kSmoothing;
  for (const SurfaceLaw& law : model_->laws) {
    double& off = off_[law.surface];
    const double now = sample.deflections_deg[law.surface] - law.deflection(terms);
    off = std::isfinite(off) ? off + weight * (now - off) : now;
  }
  ++off_count_;
}

/// Or as much.
bool MixingWatch::knowsMore(const MixingModel& found) const {
  for (std::size_t j = 0; j < kMixingTerms; ++j) {
    if (model_->known[j] && !found.known[j]) return false;
  }
  return true;
}

bool MixingWatch::replaces(const MixingModel& found) const {
  if (!model_ || !contradiction().empty() || !notShown().empty()) return true;
  if (!knowsMore(found)) return false;
  return knownTerms(found) > knownTerms(*model_) || found.samples >= 2 * solved_samples_;
}

void MixingWatch::adoptFound(const MixingModel& found) {
  model_ = found;
  solved_samples_ = found.samples;
  recheck();
}

bool MixingWatch::solve() {
  const auto solution = identifier_.solve(aircraft_);
  quality_ = solution.quality;
  if (!quality_.good || !replaces(solution.model)) return false;
  adoptFound(solution.model);
  return true;
}

MixingRequirements MixingWatch::signalled(MixingRequirements requirements) {
  requirements.excursion = std::min(requirements.excursion, kSignalExcursion);
  requirements.samples = std::min(requirements.samples, kSignalSamples);
  return requirements;
}

void MixingWatch::beginIdentification() {
  const bool contradicts = model_ && !contradiction().empty();
  const bool inconsistent = identifier_.solve(aircraft_).quality.worst_residual_deg > requirements_.residual_deg;
  if (contradicts || inconsistent) identifier_.reset();
  identifier_.setRequirements(signalled(requirements_));
  interrupt();
}

MixingWatch::Found MixingWatch::concludeIdentification() {
  const auto solution = identifier_.solve(aircraft_);
  identifier_.setRequirements(requirements_);
  quality_ = solution.quality;
  Found out{solution.quality};
  const bool holds = model_ && contradiction().empty() && notShown().empty();
  if (!out.good() || (holds && !knowsMore(solution.model))) return out;
  adoptFound(solution.model);
  out.adopted = true;
  return out;
}

void MixingWatch::cancelIdentification() { identifier_.setRequirements(requirements_); }

bool MixingWatch::unknownMoved() const { return model_ && !model_->unknownMovement(used_inputs_).empty(); }

std::string MixingWatch::contradiction() const {
  if (!model_ || off_count_ < kChecked || unknownMoved()) return "";
  for (const SurfaceLaw& law : model_->laws) {
    const double off = off_[law.surface];
    if (!std::isfinite(off) || std::abs(off) <= kContradiction * requirements_.residual_deg) continue;
    char text[200];
    std::snprintf(text, sizeof text, "%s stands %.1f deg off what its mixing says",
                  surfaceTable()[law.surface].name.c_str(), off);
    return text;
  }
  return "";
}

std::string MixingWatch::notShown() const {
  for (const SurfaceLaw& law : model_->laws) {
    if (!std::isfinite(off_[law.surface])) {
      return "X-Plane does not show " + surfaceTable()[law.surface].name + ", which the mixing has";
    }
  }
  return "";
}

std::string MixingWatch::refusal() const {
  if (!model_) {
    return "how the surfaces are moved is not identified yet: call identify_surfaces, or move the stick: " +
           quality_.text();
  }
  if (off_count_ < kChecked) {
    return "the surfaces have not been seen to follow their mixing for half a second of steady stick yet";
  }
  const std::string wrong = contradiction();
  if (!wrong.empty()) return wrong + "; identify anew: call identify_surfaces, or move the stick: " + quality_.text();
  return notShown();
}

std::vector<double> MixingWatch::bias() const {
  if (!unknownMoved()) return std::vector<double>(off_.size(), 0.0);
  return off_;
}

}  // namespace xplane_bridge::core
