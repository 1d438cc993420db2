#include "xplane_bridge/actuation/excitation_manager.hpp"

#include <cmath>
#include <limits>

#include "xplane_bridge/ServiceResult.h"
#include "xplane_bridge/core/surfaces/surfaces.hpp"

namespace xplane_bridge {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

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

}  // namespace

ExcitationManager::ExcitationManager(SurfaceControl* surfaces, double max_roll_deg, double max_pitch_deg,
                                     Publish publish, Report report)
    : surfaces_(surfaces),
      max_roll_deg_(max_roll_deg),
      max_pitch_deg_(max_pitch_deg),
      publish_(std::move(publish)),
      report_(std::move(report)) {
  state_.sim_time = state_.start_sim_time = state_.end_sim_time = kUnknown;
  publish_(&state_);
}

ExcitationManager::Plan ExcitationManager::plan(const InjectExcitation::Request& request) const {
  Plan out;
  if (request.kind == "stop") return out;
  const auto shape = core::excitationShapeFrom(request.kind);
  if (!shape) {
    out.wrong = "kind is \"" + request.kind + "\"; expected stop, " + core::kExcitationShapeWords;
    return out;
  }
  out.channels = channelsOf(request.target);
  out.surface = core::surfaceNumber(request.target);
  if (out.channels.none() && !out.surface) {
    out.wrong =
        "target is \"" + request.target + "\"; expected roll, pitch, yaw, throttle or a surface (docs/surfaces.md)";
    return out;
  }
  core::ExcitationSpec spec;
  spec.shape = *shape;
  spec.amplitude = static_cast<double>(request.amplitude);
  spec.duration = static_cast<double>(request.duration);
  if (hasBand(*shape)) {
    spec.frequency_min = static_cast<double>(request.frequency_min);
    spec.frequency_max = static_cast<double>(request.frequency_max);
  }
  spec.seed = request.seed;
  spec.roll_limit_deg = request.max_roll_deg == 0.0F ? max_roll_deg_ : static_cast<double>(request.max_roll_deg);
  spec.pitch_limit_deg = request.max_pitch_deg == 0.0F ? max_pitch_deg_ : static_cast<double>(request.max_pitch_deg);
  if (const auto problem = core::validate(spec)) {
    out.wrong = *problem;
  } else if (out.channels.any() && spec.amplitude > 1.0) {
    out.wrong = "amplitude of an axis must be at most 1 (full travel)";
  } else {
    out.signal.emplace(spec);
  }
  return out;
}

void ExcitationManager::inject(const InjectExcitation::Request& request, const Plan& plan, const std::string& who,
                               const core::FlightWatch& watch, const std::string& refusal,
                               const core::ChannelSet& commanded, InjectExcitation::Response* response) {
  const auto answer = [&](std::uint8_t code, const std::string& text) {
    response->result.code = code;
    response->result.message = text;
    response->id = state_.id;
    response->success = code == ServiceResult::ACCEPTED;
  };
  if (!plan.wrong.empty()) return answer(ServiceResult::REFUSED, plan.wrong);
  if (!plan.signal) {
    if (!running()) return answer(ServiceResult::REFUSED, "no excitation runs");
    abort("stopped by " + who);
    return answer(ServiceResult::ACCEPTED, "excitation " + std::to_string(state_.id) + " is stopped");
  }
  const core::ExcitationSpec& spec = plan.signal->spec();
  if (!refusal.empty()) return answer(ServiceResult::NO_LINK, refusal);
  if (running()) {
    return answer(ServiceResult::REFUSED, "excitation " + std::to_string(state_.id) + " runs on " + state_.target +
                                              "; one at a time: wait for it, or stop it");
  }
  if (plan.channels.any() && (plan.channels & commanded).none()) {
    return answer(ServiceResult::REFUSED, "nobody commands " + request.target +
                                              ": an excitation is added to a command (control/manual or auto)");
  }
  if (!std::isfinite(watch.sim_time) || !std::isfinite(watch.roll_deg) || !std::isfinite(watch.pitch_deg)) {
    return answer(ServiceResult::NO_LINK, "X-Plane has not told the attitude yet");
  }
  if (!(std::abs(watch.roll_deg) < spec.roll_limit_deg && std::abs(watch.pitch_deg) < spec.pitch_limit_deg)) {
    return answer(ServiceResult::REFUSED, "the attitude is beyond the limits of the excitation already");
  }
  if (plan.surface) {
    const std::string why = surfaces_->beginOffset(*plan.surface, spec.amplitude);
    if (!why.empty()) return answer(ServiceResult::REFUSED, why);
  }
  runner_.start(*plan.signal, watch.sim_time);
  channels_ = plan.channels;
  surface_ = plan.surface;
  who_ = who;
  state_.active = true;
  ++state_.id;
  state_.kind = request.kind;
  state_.target = request.target;
  state_.amplitude = request.amplitude;
  state_.duration = request.duration;
  const bool has_band = hasBand(spec.shape);
  state_.frequency_min = has_band ? request.frequency_min : 0.0F;
  state_.frequency_max = has_band ? request.frequency_max : 0.0F;
  state_.seed = request.seed;
  state_.start_sim_time = state_.sim_time = static_cast<float>(watch.sim_time);
  state_.end_sim_time = kUnknown;
  state_.result = "running";
  last_sim_time_ = watch.sim_time;
  publish();
  report_("excitation " + std::to_string(state_.id) + ": " + request.kind + " on " + request.target + " begins", who,
          true);
  answer(ServiceResult::ACCEPTED, "it runs; excitation/state tells its end");
}

bool ExcitationManager::onFrame(const core::FlightWatch& watch) {
  if (!running()) return false;
  const double value = runner_.step(watch.sim_time, watch.roll_deg, watch.pitch_deg);
  last_sim_time_ = watch.sim_time;
  if (!running()) {
    end();
    return channels_.any();
  }
  if (surface_) {
    const std::string ended = surfaces_->setOffset(value);
    if (!ended.empty()) abort(ended);
  }
  return channels_.any();
}

void ExcitationManager::abort(const std::string& reason) {
  if (!running()) return;
  runner_.abort(reason);
  end();
}

core::ChannelExcitation ExcitationManager::excitation() const {
  if (!running()) return {};
  return {channels_, runner_.value()};
}

void ExcitationManager::end() {
  if (surface_) surfaces_->clearOffset();
  const bool done = runner_.phase() == core::ExcitationPhase::kDone;
  state_.active = false;
  state_.sim_time = state_.end_sim_time = static_cast<float>(last_sim_time_);
  state_.result = done ? "done" : "aborted: " + runner_.reason();
  publish();
  report_("excitation " + std::to_string(state_.id) + " on " + state_.target + ": " + state_.result, who_, done);
}

void ExcitationManager::publish() { publish_(&state_); }

}  // namespace xplane_bridge
