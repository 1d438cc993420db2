#include "xplane_bridge/actuation/excitation_manager.hpp"

#include <cmath>
#include <utility>

#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/core/surfaces/surfaces.hpp"

namespace xplane_bridge {
namespace {

bool hasBand(core::ExcitationShape shape) {
  return shape == core::ExcitationShape::kMultisine || shape == core::ExcitationShape::kChirp;
}

core::ChannelSet channelsOf(const std::string& target) {
  core::ChannelSet out;
  if (target == "roll") out.set(core::index(core::Channel::kRoll));
  if (target == "pitch") out.set(core::index(core::Channel::kPitch));
  if (target == "yaw") out.set(core::index(core::Channel::kYaw));
  if (target == "throttle") {
    for (std::size_t i = 0; i < core::kChannelCount; ++i) {
      if (core::isLever(static_cast<core::Channel>(i))) out.set(i);
    }
  }
  return out;
}

/// The axes of "roll,pitch"; spaces do not count.
std::vector<std::string> axesOf(const std::string& target) {
  std::vector<std::string> out(1);
  for (const char c : target) {
    if (c == ',') {
      out.emplace_back();
    } else if (c != ' ') {
      out.back() += c;
    }
  }
  return out;
}

/// The channels of each axis of `target`; returns what is wrong with it, or nothing.
std::string planAxes(const std::string& target, std::vector<core::ChannelSet>* channels) {
  core::ChannelSet all;
  for (const std::string& axis : axesOf(target)) {
    const core::ChannelSet own = channelsOf(axis);
    if (own.none()) {
      return "target is \"" + target +
             "\"; expected roll, pitch, yaw, throttle or a surface (docs/control/surfaces.md), of a " +
             "multisine also several axes, for example \"roll,pitch\"";
    }
    if ((all & own).any()) return "target is \"" + target + "\"; expected each axis once";
    all |= own;
    channels->push_back(own);
  }
  return {};
}

}  // namespace

ExcitationManager::ExcitationManager(SurfaceControl* surfaces, double max_roll_deg, double max_pitch_deg,
                                     Publish publish, Report report)
    : surfaces_(surfaces),
      max_roll_deg_(max_roll_deg),
      max_pitch_deg_(max_pitch_deg),
      publish_(std::move(publish)),
      report_(std::move(report)) {
  this->publish();
}

ExcitationManager::Plan ExcitationManager::plan(const ExcitationRequest& request) const {
  Plan out;
  if (request.kind == "stop") return out;
  const auto shape = core::excitationShapeFrom(request.kind);
  if (!shape) {
    out.wrong = "kind is \"" + request.kind + "\"; expected " + core::kExcitationShapeWords + " or stop";
    return out;
  }
  out.surface = core::surfaceNumber(request.target);
  if (!out.surface) out.wrong = planAxes(request.target, &out.channels);
  if (!out.wrong.empty()) return out;
  const std::size_t targets = out.surface ? 1 : out.channels.size();
  if (targets > 1 && *shape != core::ExcitationShape::kMultisine) {
    out.wrong =
        "target is \"" + request.target + "\"; several axes at once take a multisine, " + request.kind + " takes one";
    return out;
  }
  core::ExcitationSpec spec;
  spec.shape = *shape;
  spec.amplitude = request.amplitude;
  spec.duration = request.duration;
  if (hasBand(*shape)) {
    spec.frequency_min = request.frequency_min;
    spec.frequency_max = request.frequency_max;
  }
  spec.seed = request.seed;
  spec.roll_limit_deg = request.max_roll_deg == 0.0 ? max_roll_deg_ : request.max_roll_deg;
  spec.pitch_limit_deg = request.max_pitch_deg == 0.0 ? max_pitch_deg_ : request.max_pitch_deg;
  spec.interleave = static_cast<int>(targets);
  if (!out.channels.empty() && spec.amplitude > 1.0) {
    out.wrong = "amplitude of an axis must be at most 1 (full travel)";
    return out;
  }
  for (std::size_t i = 0; i < targets; ++i) {
    spec.interleave_offset = static_cast<int>(i);
    if (const auto problem = core::validate(spec)) {
      out.wrong = *problem;
      out.signals.clear();
      return out;
    }
    out.signals.emplace_back(spec);
  }
  return out;
}

RequestResult ExcitationManager::inject(const ExcitationRequest& request, const Plan& plan, const std::string& who,
                                        const core::FlightWatch& watch, const std::optional<RequestResult>& blocked,
                                        const core::ChannelSet& commanded) {
  if (!plan.wrong.empty()) return {core::ResultCode::kRefused, plan.wrong};
  if (plan.signals.empty()) {
    if (!running()) return {core::ResultCode::kRefused, "no excitation runs"};
    abort("stopped by " + who);
    return {core::ResultCode::kAccepted, "excitation " + std::to_string(label_.id) + " is stopped"};
  }
  const core::ExcitationSpec& spec = plan.signals.front().spec();
  if (blocked) return *blocked;
  if (running()) {
    return {core::ResultCode::kRefused, "excitation " + std::to_string(label_.id) + " runs on " + label_.target +
                                            "; one at a time: wait for it, or stop it"};
  }
  for (std::size_t i = 0; i < plan.channels.size(); ++i) {
    if ((plan.channels[i] & commanded).any() || request.rest) continue;
    return {core::ResultCode::kRefused, "no source commands " + axesOf(request.target)[i] +
                                            ": an excitation is added to a command (control/manual or auto)"};
  }
  if (!std::isfinite(watch.sim_time) || !std::isfinite(watch.roll_deg) || !std::isfinite(watch.pitch_deg)) {
    return {core::ResultCode::kNoLink, "X-Plane has not shown the attitude yet"};
  }
  if (!(std::abs(watch.roll_deg) < spec.roll_limit_deg && std::abs(watch.pitch_deg) < spec.pitch_limit_deg)) {
    return {core::ResultCode::kRefused, "the attitude is beyond the limits of the excitation already"};
  }
  if (plan.surface) {
    const std::string why = surfaces_->beginOffset(*plan.surface, spec.amplitude);
    if (!why.empty()) return {core::ResultCode::kRefused, why};
  }
  runner_.start(plan.signals, watch.sim_time);
  channels_ = plan.channels;
  rest_ = request.rest;
  surface_ = plan.surface;
  who_ = who;
  begin(request, spec, watch.sim_time);
  return {core::ResultCode::kAccepted, "it runs; its end is published on excitation/state"};
}

void ExcitationManager::begin(const ExcitationRequest& request, const core::ExcitationSpec& spec, double sim_time) {
  const bool has_band = hasBand(spec.shape);
  label_.active = true;
  ++label_.id;
  label_.kind = request.kind;
  label_.target = request.target;
  label_.amplitude = request.amplitude;
  label_.duration = request.duration;
  label_.frequency_min = has_band ? request.frequency_min : 0.0;
  label_.frequency_max = has_band ? request.frequency_max : 0.0;
  label_.seed = request.seed;
  label_.start_sim_time = label_.sim_time = last_sim_time_ = sim_time;
  label_.end_sim_time = std::nan("");
  label_.result = "running";
  publish();
  report_("excitation " + std::to_string(label_.id) + ": " + request.kind + " on " + request.target + " begins", who_,
          true);
}

bool ExcitationManager::onFrame(const core::FlightWatch& watch) {
  if (!running()) return false;
  const double value = runner_.step(watch.sim_time, watch.roll_deg, watch.pitch_deg).front();
  last_sim_time_ = watch.sim_time;
  if (!running()) {
    end();
    return !channels_.empty();
  }
  if (surface_) {
    const std::string ended = surfaces_->setOffset(value);
    if (!ended.empty()) abort(ended);
  }
  return !channels_.empty();
}

void ExcitationManager::abort(const std::string& reason) {
  if (!running()) return;
  runner_.abort(reason);
  end();
}

core::ChannelSet ExcitationManager::channels() const {
  core::ChannelSet out;
  if (!running()) return out;
  for (const core::ChannelSet& axis : channels_) out |= axis;
  return out;
}

core::ChannelExcitation ExcitationManager::excitation() const {
  core::ChannelExcitation out;
  if (!running()) return out;
  out.channels = channels();
  out.rest = rest_;
  for (std::size_t axis = 0; axis < channels_.size(); ++axis) {
    for (std::size_t i = 0; i < core::kChannelCount; ++i) {
      if (channels_[axis].test(i)) out.values[i] = runner_.values()[axis];
    }
  }
  return out;
}

void ExcitationManager::end() {
  if (surface_) surfaces_->clearOffset();
  const bool done = runner_.phase() == core::ExcitationPhase::kDone;
  label_.active = false;
  label_.sim_time = label_.end_sim_time = last_sim_time_;
  label_.result = done ? "done" : "aborted: " + runner_.reason();
  publish();
  report_("excitation " + std::to_string(label_.id) + " on " + label_.target + ": " + label_.result, who_, done);
}

}  // namespace xplane_bridge
