#include "xplane_bridge/nodes/capture/image_pairing.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/core/base/unknown.hpp"
#include "xplane_bridge/nodes/messages/conversions.hpp"
#include "xplane_bridge/nodes/messages/flight_state_interpolation.hpp"

namespace xplane_bridge {
namespace {

constexpr double kOffsetSmoothing = 0.05;
constexpr std::int64_t kLongestHalfFrame = 50'000'000;  // [ns]
constexpr std::size_t kEras = 8;

/// Whether what the clock said until then holds for earlier moments only, and does so from that frame on.
bool endsEra(core::ClockEvent event) {
  switch (event) {
    case core::ClockEvent::kPaused:
    case core::ClockEvent::kResumed:
    case core::ClockEvent::kReset:
    case core::ClockEvent::kReplayStarted:
    case core::ClockEvent::kReplayEnded:
      return true;
    default:
      return false;
  }
}

/// A state that nothing is known of: valid = 0 and NaN, never zero for unknown.
FlightState unknownState() {
  FlightState message;
  toMessage(core::FlightState(), "", &message);
  return message;
}

core::ClockFilter::Options clockOptions(bool exact) {
  core::ClockFilter::Options options;
  options.exact = exact;
  return options;
}

/// Frames and states are kept for longer than a picture waits, in which time may run somewhat faster than usual: those
/// behind it are paired when its wait is over.
core::ImageAssociatorOptions associatorOptions(double max_wait) {
  core::ImageAssociatorOptions options;
  options.history += max_wait;
  return options;
}

}  // namespace

ImagePairing::ImagePairing(double display_delay, double max_wait, Publish publish, Stamps stamps)
    : display_delay_(display_delay),
      delay_measured_(display_delay != 0.0),
      max_wait_ns_(core::toNanoseconds(max_wait)),
      publish_(std::move(publish)),
      stamps_(stamps),
      clock_(clockOptions(stamps == Stamps::kFrames)),
      associator_(associatorOptions(max_wait)) {}

void ImagePairing::addFrame(const core::SimStatus& status, float frame_period, std::int64_t receive_ns) {
  const std::lock_guard<std::mutex> lock(mutex_);
  status_ = status;
  frame_period_ = frame_period;
  core::ClockSample sample;
  sample.receive_ns = receive_ns;
  sample.sim_time = static_cast<float>(status.sim_time);
  sample.frame_period = frame_period;
  sample.acceleration = core::timeAcceleration(status.time_ratio_requested);
  sample.paused = status.paused;
  sample.replay = status.replay;
  const core::ClockFilter before = clock_;
  const core::ClockEstimate estimate = clock_.update(sample);
  if (!estimate.usable) return;
  if (estimate.event == core::ClockEvent::kHostClockStep) eras_.clear();  // host times mean other moments now
  if (endsEra(estimate.event)) {
    endEra(before, estimate.event == core::ClockEvent::kPaused ? sample.sim_time : newest_raw_, receive_ns);
  }
  newest_ns_ = receive_ns;
  newest_raw_ = sample.sim_time;
  newest_sim_time_ = estimate.sim_time;
  core::SimFrame frame;
  frame.sim_time = estimate.sim_time;
  frame.sim_time_raw = sample.sim_time;
  frame.frame_period = static_cast<double>(frame_period);
  frame.paused = status.paused || status.replay;
  frame.epoch = estimate.epoch;
  associator_.addFrame(frame);
  flushLocked(receive_ns);
}

void ImagePairing::addCamera(std::int64_t receive_ns, double sim_time, const core::FrameCamera& camera) {
  const std::lock_guard<std::mutex> lock(mutex_);
  cameras_.add(receive_ns, sim_time, camera);
}

std::optional<core::FrameCamera> ImagePairing::cameraOf(std::int64_t shown_ns, std::optional<float> frame_key,
                                                        double own_delay) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!frame_key.has_value()) return cameras_.at(shown_ns - core::toNanoseconds(display_delay_));
  const std::int64_t frame_ns = shown_ns - core::toNanoseconds(own_delay);
  std::optional<core::FrameCamera> camera = cameras_.ofFrame(static_cast<double>(*frame_key), frame_ns);
  if (camera) return camera;
  camera = cameras_.at(frame_ns);
  if (camera) camera->frustum.known = false;  // of another frame
  return camera;
}

void ImagePairing::setDisplayDelay(double delay) {
  const std::lock_guard<std::mutex> lock(mutex_);
  display_delay_ = delay;
  delay_measured_ = true;
}

void ImagePairing::forgetClock() {
  const std::lock_guard<std::mutex> lock(mutex_);
  cameras_.clear();
  clock_.reset();
  eras_.clear();
  status_ = core::SimStatus();
  frame_period_ = 0.0F;
  newest_sim_time_.reset();
}

void ImagePairing::addState(const FlightState::ConstPtr& state, std::int64_t arrival_ns,
                            std::optional<std::int64_t> stamp_ns) {
  const std::lock_guard<std::mutex> lock(mutex_);
  core::StateKey key;
  key.id = next_state_id_++;
  key.sim_time_raw = state->sim_time;
  key.stamp_ns = stamps_ == Stamps::kSimulator
                     ? arrival_ns
                     : stamp_ns.value_or(static_cast<std::int64_t>(state->header.stamp.toNSec()));
  key.epoch = state->epoch;
  key.paused = state->paused || state->replay;
  key.position_epoch = state->position_epoch;
  associator_.addState(key);
  states_[key.id] = {state, arrival_ns};
  state_seen_ = true;
  flushLocked(arrival_ns);
  forgetOldStates();
}

void ImagePairing::forgetOldStates() {
  const auto oldest = associator_.oldestStateId();
  states_.erase(states_.begin(), oldest.has_value() ? states_.lower_bound(*oldest) : states_.end());
}

void ImagePairing::endEra(const core::ClockFilter& before, float sim_time_raw, std::int64_t receive_ns) {
  // Between its last frame and the first of the next one, as between any two frames.
  const std::int64_t half_frame = std::min((receive_ns - newest_ns_) / 2, kLongestHalfFrame);
  eras_.push_back({receive_ns - half_frame, before, sim_time_raw});
  if (eras_.size() > kEras) eras_.pop_front();
  ++eras_ended_;
}

void ImagePairing::map(Waiting* picture) const {
  core::ImageMoment& moment = picture->moment;
  const auto era = std::find_if(eras_.begin(), eras_.end(),
                                [&moment](const Era& ended) { return moment.host_time_ns < ended.end_ns; });
  picture->slips = clock_.slips();
  picture->eras = eras_ended_;
  picture->present = era == eras_.end();
  const core::ClockFilter& clock = picture->present ? clock_ : era->clock;
  const float last_raw = picture->present ? newest_raw_ : era->sim_time_raw;
  moment.paused_at.reset();
  if (clock.paused()) moment.paused_at = last_raw;
  moment.sim_time = clock.simTime(moment.host_time_ns);
  // No frame of it came later, however late the next era was heard.
  if (!picture->present && moment.sim_time) moment.sim_time = std::min(*moment.sim_time, clock.unwrap(last_raw));
  moment.uncertainty = moment.frame_key.has_value() ? 0.0 : clock.uncertainty();
  moment.epoch = clock.epoch();
}

void ImagePairing::mapAnew(Waiting* picture) const {
  const core::ImageMoment& moment = picture->moment;
  const bool slipped = picture->slips != clock_.slips() && moment.epoch == clock_.epoch() && !clock_.paused();
  if (moment.sim_time.has_value() && !slipped && picture->eras == eras_ended_) return;
  map(picture);
}

void ImagePairing::addPicture(const FrameState& picture, std::int64_t shown_ns, std::int64_t now_ns,
                              std::optional<float> frame_key) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Waiting waiting;
  waiting.answer = picture;
  waiting.moment.frame_key = frame_key;
  if (!frame_key.has_value()) {
    waiting.answer.display_delay = display_delay_;
    if (!delay_measured_) waiting.answer.quality |= FrameState::QUALITY_DELAY_ASSUMED;
  }
  waiting.answer.clock_uncertainty = clock_.fitted() || stamps_ == Stamps::kFrames ? clock_.uncertainty() : core::kNaN;
  waiting.answer.frame_period = frame_period_ > 0.0F ? frame_period_ : core::kNaNf;
  waiting.moment.host_time_ns = shown_ns - core::toNanoseconds(waiting.answer.display_delay);
  waiting.deadline_ns = now_ns + max_wait_ns_;
  if (grace_until_ns_ == 0) grace_until_ns_ = now_ns + core::toNanoseconds(kFirstPictures);
  const bool starting = !state_seen_ || (!frame_key.has_value() && !clock_.fitted());
  if (max_wait_ns_ > 0 && starting) waiting.deadline_ns = std::max(waiting.deadline_ns, grace_until_ns_);
  map(&waiting);
  waiting_.push_back(std::move(waiting));
  flushLocked(now_ns);
}

std::optional<double> ImagePairing::simTime(std::int64_t host_ns) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto known = clock_.simTime(host_ns);
  return known.has_value() ? known : newest_sim_time_;
}

void ImagePairing::flush(std::int64_t now_ns) {
  const std::lock_guard<std::mutex> lock(mutex_);
  flushLocked(now_ns);
}

void ImagePairing::flushLocked(std::int64_t now_ns) {
  while (!waiting_.empty()) {
    Waiting& picture = waiting_.front();
    const bool final = now_ns >= picture.deadline_ns;
    mapAnew(&picture);
    // Without the simulator's clock the pairing is a makeshift: not before the deadline, the clock may come.
    const bool clock_missing =
        !picture.moment.frame_key.has_value() && !picture.moment.sim_time.has_value() && !picture.moment.paused_at;
    if (clock_missing && picture.present && !final) return;
    const core::Association association = associator_.associate(picture.moment, final);
    if (association.pending) return;
    complete(association, now_ns, &picture);
    publish_(picture.answer);
    waiting_.pop_front();
  }
}

void ImagePairing::complete(const core::Association& association, std::int64_t now_ns, Waiting* picture) {
  FrameState& answer = picture->answer;
  answer.quality |= core::pairingQuality(picture->moment, association);
  answer.frame_sim_time = association.frame_known ? association.frame_sim_time : core::kNaN;
  answer.sim_time_error = core::kNaN;
  answer.state_age = core::kNaN;
  const auto state = states_.find(association.id);
  const auto after = states_.find(association.id_after);
  if (association.method == core::PairingMethod::kNone || state == states_.end() || after == states_.end()) {
    answer.quality |= FrameState::QUALITY_STATE_MISSING;
    answer.state = unknownState();
    if (status_.replay) answer.quality |= FrameState::QUALITY_REPLAY;
    ++unpaired_;
  } else {
    answer.state = association.method == core::PairingMethod::kInterpolated
                       ? interpolate(*state->second.message, *after->second.message, association.fraction)
                       : *state->second.message;
    if (answer.state.replay) answer.quality |= FrameState::QUALITY_REPLAY;
    answer.state_age = core::toSeconds(now_ns - after->second.arrival_ns);
    if (association.frame_known) answer.sim_time_error = association.state_offset;
  }
  completePose(association, picture);
  answer.unpaired = unpaired_;
  if (association.frame_known) mean_offset_ += kOffsetSmoothing * (association.frame_offset - mean_offset_);
}

void ImagePairing::completePose(const core::Association& association, Waiting* picture) const {
  FrameState& answer = picture->answer;
  if (answer.camera_pose_source != FrameState::POSE_MEASURED || picture->moment.paused_at) return;
  const auto of_frame = association.frame_known ? cameras_.poseOf(association.frame_sim_time) : std::nullopt;
  if (of_frame) {
    setPose(*of_frame, &answer);
  } else {
    answer.quality |= FrameState::QUALITY_POSE_UNSURE;  // of another frame
  }
}

void setPose(const core::CheckedPose& checked, FrameState* answer) {
  const core::CameraPose& pose = checked.pose;
  answer->camera_pose_source = FrameState::POSE_MEASURED;
  answer->body_to_camera = toTransform(pose.orientation, pose.position);
  answer->camera_pose_uncertainty_deg = static_cast<float>(pose.angle_uncertainty_deg);
  answer->camera_pose_uncertainty = static_cast<float>(pose.position_uncertainty);
  answer->quality &= ~std::uint32_t{FrameState::QUALITY_POSE_UNSURE};
  if (!checked.sure) answer->quality |= FrameState::QUALITY_POSE_UNSURE;
}

ImagePairing::Report ImagePairing::report() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  Report report;
  report.counters = associator_.counters();
  report.display_delay = display_delay_;
  report.clock_fitted = clock_.fitted();
  report.clock_uncertainty = clock_.uncertainty();
  report.state_to_frame_ratio = associator_.stateToFrameRatio();
  report.mean_offset = mean_offset_;
  report.waiting = waiting_.size();
  return report;
}

}  // namespace xplane_bridge
