#include "xplane_bridge/core/surfaces/surface_watch.hpp"

#include <algorithm>

namespace xplane_bridge::core {
namespace {

// In front of the inputs and surfaces.
constexpr std::size_t kSimTime = 0, kFramePeriod = 1, kOverride = 2, kAlpha = 3, kBeta = 4, kStick = 5, kFlap = 8,
                      kSpeedbrake = 9, kInputs = 10;
constexpr std::size_t kInputCount = std::tuple_size_v<std::decay_t<decltype(mixingInputDatarefs())>>;
constexpr std::size_t kSurfaces = kInputs + kInputCount;

constexpr double kStickMoved = 0.05;    // [-] from which on the total must have moved too
constexpr double kTotalFollows = 0.25;  // [-] of the stick's movement
constexpr int kFramesStanding = 10;     // until it is believed
constexpr double kHandleMoved = 0.01;   // [-]
constexpr double kDeployMoved = 1e-5;   // [-] in a frame; flaps that take a minute move by 8e-5 at 200 frames a second

std::array<double, 3> totals(const MixingInputs& in) { return {in.roll, in.pitch, in.yaw}; }

}  // namespace

std::vector<std::string> surfaceWatchDatarefs(SimulatorVersion version) {
  const EncoderOptions options{version, false};
  std::vector<std::string> out = {"sim/time/total_running_time_sec", "sim/operation/misc/frame_rate_period",
                                  kSurfaceOverride, "sim/flightmodel/position/alpha", "sim/flightmodel/position/beta"};
  for (const Channel channel :
       {Channel::kRoll, Channel::kPitch, Channel::kYaw, Channel::kFlaps, Channel::kSpeedbrake}) {
    out.push_back(readBackDataref(channel, options));
  }
  out.insert(out.end(), mixingInputDatarefs().begin(), mixingInputDatarefs().end());
  for (const SurfaceInfo& surface : surfaceTable()) out.push_back(surface.dataref);
  return out;
}

bool surfaceSampleFrom(const std::vector<float>& values, SurfaceSample* sample) {
  if (values.size() != kSurfaces + surfaceTable().size()) return false;
  const auto at = [&values](std::size_t i) { return static_cast<double>(values[i]); };
  sample->sim_time = at(kSimTime);
  sample->frame_period = at(kFramePeriod);
  sample->override_shown = at(kOverride);
  sample->alpha_deg = at(kAlpha);
  sample->beta_deg = at(kBeta);
  for (std::size_t i = 0; i < 3; ++i) sample->stick[i] = at(kStick + i);
  sample->flap_handle = at(kFlap);
  sample->speedbrake_handle = at(kSpeedbrake);
  std::array<double, kInputCount> inputs{};
  for (std::size_t i = 0; i < kInputCount; ++i) inputs[i] = at(kInputs + i);
  sample->inputs = mixingInputsFrom(inputs);
  sample->deflections_deg.assign(values.begin() + kSurfaces, values.end());
  return true;
}

void DrivenInputs::watch(const SurfaceSample& sample) {
  if (sample.sim_time == watched_time_) return;  // X-Plane stands
  const auto moved = [this](double now, double before) {
    return std::isfinite(watched_time_) && std::abs(now - before) > kDeployMoved;
  };
  flap_.moved = moved(sample.inputs.flap1, flap1_) || moved(sample.inputs.flap2, flap2_);
  speedbrake_.moved = moved(sample.inputs.speedbrake, brake_);
  watched_time_ = sample.sim_time;
  flap1_ = sample.inputs.flap1;
  flap2_ = sample.inputs.flap2;
  brake_ = sample.inputs.speedbrake;
}

void DrivenInputs::begin(const SurfaceSample& sample) {
  total_begin_ = totals(sample.inputs);
  stick_begin_ = sample.stick;
  standing_ = {};
  flap_.at_begin = sample.flap_handle;
  speedbrake_.at_begin = sample.speedbrake_handle;
  flap1_ = sample.inputs.flap1;
  flap2_ = sample.inputs.flap2;
  brake_ = sample.inputs.speedbrake;
}

double DrivenInputs::run(Handle* handle, double shown, double now, double rate, double dt) {
  if (!std::isfinite(shown)) return now;  // not received in this frame
  if (!std::isfinite(handle->at_begin)) handle->at_begin = shown;
  if (std::abs(shown - handle->at_begin) > kHandleMoved) handle->moved = true;
  if (!handle->moved) return now;
  return now + std::clamp(std::max(shown, 0.0) - now, -rate * dt, rate * dt);
}

MixingInputs DrivenInputs::step(const SurfaceSample& sample, const std::array<double, 3>& own, double dt) {
  MixingInputs out = sample.inputs;
  const std::array<double, 3> total = totals(sample.inputs);
  std::array<double, 3> axes{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double moved = sample.stick[i] - stick_begin_[i];
    const double followed = total[i] - total_begin_[i];
    if (std::abs(moved) > kStickMoved) {
      const bool stands = std::abs(followed) < kTotalFollows * std::abs(moved);
      standing_[i] = stands ? std::min(standing_[i] + 1, kFramesStanding) : 0;
    }
    const bool stands = standing_[i] == kFramesStanding;
    const double stick = std::isfinite(own[i]) ? own[i] : sample.stick[i];
    const double rest = stands ? total_begin_[i] - stick_begin_[i] : total[i] - sample.stick[i];
    axes[i] = std::clamp(stick + rest, -1.0, 1.0);
  }
  out.roll = axes[0];
  out.pitch = axes[1];
  out.yaw = axes[2];
  flap1_ = run(&flap_, sample.flap_handle, flap1_, flap_rate_, dt);
  flap2_ = run(&flap_, sample.flap_handle, flap2_, flap_rate_, dt);
  brake_ = run(&speedbrake_, sample.speedbrake_handle, brake_, speedbrake_rate_, dt);
  out.flap1 = flap1_;
  out.flap2 = flap2_;
  out.speedbrake = brake_;
  return out;
}

}  // namespace xplane_bridge::core
