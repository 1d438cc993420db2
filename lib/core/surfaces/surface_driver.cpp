#include "xplane_bridge/core/surfaces/surface_driver.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace xplane_bridge::core {
namespace {

double towards(double from, double to, double step) { return from + std::clamp(to - from, -step, step); }

}  // namespace

std::optional<std::string> validate(const SurfaceFailure& f) {
  const auto wrong = [&f](const char* expected) {
    char given[32] = "missing";
    if (f.value) std::snprintf(given, sizeof given, "%g", *f.value);
    return std::string(toString(f.fault)) + ": value is " + given + ", expected " + expected;
  };
  switch (f.fault) {
    case SurfaceFault::kStuck:
      if (f.value && !(std::abs(*f.value) <= kMaxDeflectionDeg)) return wrong("-90..90 deg");
      break;
    case SurfaceFault::kReduced:
      if (!f.value || !(*f.value >= 0.0 && *f.value <= 1.0)) return wrong("0..1 of the effectiveness");
      break;
    case SurfaceFault::kSlow:
      if (!f.value || !(*f.value > 0.0) || !std::isfinite(*f.value)) return wrong("a rate above 0 deg/s");
      break;
    case SurfaceFault::kHardOverUp:
    case SurfaceFault::kHardOverDown:
    case SurfaceFault::kCentred:
    case SurfaceFault::kFloating:
      break;
    case SurfaceFault::kGone:
      return "gone: no deflection expresses a lost surface";
  }
  return std::nullopt;
}

SurfaceDriver::SurfaceDriver(MixingModel model, DriverOptions options) : model_(std::move(model)), options_(options) {
  if (!(options.rate_deg_s > 0.0)) throw std::invalid_argument("surfaces.rate_deg_s: expected above 0 deg/s");
  if (!(options.floating_time > 0.0)) throw std::invalid_argument("surfaces.floating_time: expected above 0 s");
}

void SurfaceDriver::engage(const std::vector<double>& shown_deg, const std::vector<double>& bias_deg) {
  std::vector<Driven> driven;
  for (std::size_t i = 0; i < surfaceTable().size(); ++i) {
    const SurfaceLaw* law = model_.lawOf(i);
    const double shown = i < shown_deg.size() ? shown_deg[i] : std::nan("");
    if (law && !std::isfinite(shown)) {
      throw std::invalid_argument("the present deflection of " + surfaceTable()[i].name + " is not known");
    }
    if (!law && (!std::isfinite(shown) || shown == 0.0)) continue;
    Driven d;
    d.surface = i;
    d.law = law;
    d.held_deg = d.now_deg = shown;
    if (i < bias_deg.size()) d.bias_deg = bias_deg[i];
    driven.push_back(d);
  }
  driven_ = std::move(driven);
}

SurfaceDriver::Driven& SurfaceDriver::driven(std::size_t surface) {
  const auto it = std::lower_bound(driven_.begin(), driven_.end(), surface,
                                   [](const Driven& d, std::size_t number) { return d.surface < number; });
  if (it != driven_.end() && it->surface == surface) return *it;
  Driven d;
  d.surface = surface;
  d.law = model_.lawOf(surface);
  return *driven_.insert(it, d);
}

void SurfaceDriver::setFailures(const std::vector<SurfaceFailure>& failures) {
  for (Driven& d : driven_) {
    const bool still =
        std::any_of(failures.begin(), failures.end(), [&](const auto& f) { return f.surface == d.surface; });
    if (!still) d.failure.reset();
  }
  for (const SurfaceFailure& failure : failures) {
    Driven& d = driven(failure.surface);
    const bool already_stuck_here = d.failure && d.failure->fault == SurfaceFault::kStuck && !d.failure->value &&
                                    failure.fault == SurfaceFault::kStuck && !failure.value;
    if (!already_stuck_here) d.stuck_deg = failure.value.value_or(d.now_deg);
    d.failure = failure;
  }
}

void SurfaceDriver::setCommands(const std::vector<SurfaceDeflection>& commands) {
  for (Driven& d : driven_) d.command_deg.reset();
  for (const SurfaceDeflection& command : commands) driven(command.surface).command_deg = command.deflection_deg;
}

void SurfaceDriver::setOffset(std::size_t surface, double offset_deg) {
  for (Driven& d : driven_) d.offset_deg = 0.0;
  if (offset_deg != 0.0) driven(surface).offset_deg = offset_deg;
}

double SurfaceDriver::target(const Driven& d, const MixingVector& terms) const {
  const double healthy = d.command_deg ? *d.command_deg : d.law ? d.law->deflection(terms) + d.bias_deg : d.held_deg;
  const double bounded = d.command_deg || !d.law ? healthy : std::clamp(healthy, d.law->low_deg, d.law->high_deg);
  if (!d.failure) return bounded;
  const double neutral = d.law ? d.law->neutral() + d.bias_deg : 0.0;
  switch (d.failure->fault) {
    case SurfaceFault::kStuck:
      return d.stuck_deg;
    case SurfaceFault::kHardOverUp:
      return d.law ? d.law->fullyUp() : d.now_deg;
    case SurfaceFault::kHardOverDown:
      return d.law ? d.law->fullyDown() : d.now_deg;
    case SurfaceFault::kCentred:
      return neutral;
    case SurfaceFault::kReduced:
      return neutral + *d.failure->value * (bounded - neutral);
    case SurfaceFault::kFloating:
    case SurfaceFault::kSlow:
    case SurfaceFault::kGone:  // refused by validate()
      return bounded;
  }
  return bounded;
}

double SurfaceDriver::floating(const Driven& d, const FlowAngles& flow, double dt) const {
  // Flow from below lifts the trailing edge; flow from the right pushes a rudder's to the left.
  const bool rudder = surfaceTable()[d.surface].kind == SurfaceKind::kRudder;
  const double angle = rudder ? flow.beta_deg : flow.alpha_deg;
  const double trail = std::isfinite(angle) ? upSign(d.surface) * options_.floating_gain * angle : 0.0;
  const double bounded = d.law ? std::clamp(trail, d.law->low_deg, d.law->high_deg) : trail;
  return d.now_deg + (bounded - d.now_deg) * -std::expm1(-dt / options_.floating_time);
}

const std::vector<SurfaceDeflection>& SurfaceDriver::step(const MixingInputs& inputs, const FlowAngles& flow,
                                                          double dt) {
  const MixingVector terms = mixingTerms(inputs);
  out_.clear();
  off_target_deg_ = 0.0;
  for (Driven& d : driven_) {
    const bool broken = d.failure.has_value();
    const double rate = broken && d.failure->fault == SurfaceFault::kSlow
                            ? std::min(options_.rate_deg_s, *d.failure->value)
                            : options_.rate_deg_s;
    const double wanted =
        broken && d.failure->fault == SurfaceFault::kFloating ? floating(d, flow, dt) : target(d, terms);
    if (std::isfinite(wanted)) {
      d.now_deg = towards(d.now_deg, wanted, rate * dt);
      off_target_deg_ = std::max(off_target_deg_, std::abs(wanted - d.now_deg));
    }
    double sent = d.now_deg;
    // A broken surface does not answer to a test signal, and none leaves its travel by one.
    if (!broken && d.offset_deg != 0.0) {
      const double low = d.law ? d.law->low_deg : -kMaxDeflectionDeg,
                   high = d.law ? d.law->high_deg : kMaxDeflectionDeg;
      sent = std::clamp(sent + d.offset_deg, std::min(low, sent), std::max(high, sent));
    }
    out_.push_back({d.surface, std::clamp(sent, -kMaxDeflectionDeg, kMaxDeflectionDeg)});
  }
  return out_;
}

}  // namespace xplane_bridge::core
