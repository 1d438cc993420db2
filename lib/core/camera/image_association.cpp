#include "xplane_bridge/core/camera/image_association.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

// Spacings and offsets are judged by the median of the last ones: one late datagram or swap must not move them.
constexpr std::size_t kSpacingWindow = 30;
constexpr std::size_t kOffsetWindow = 31;
constexpr std::size_t kMinimumOffsets = 5;
// A state belongs to a frame when it is nearer than this share of a frame period.
constexpr double kSameFrame = 0.25;
// States this much sparser than frames are "below the frame rate"; one lost datagram in the window does not do it.
constexpr double kSparseRatio = 1.5;
// Share of a period within which the border between two frames is too near to trust.
constexpr double kBorder = 0.1;
// Share of a period up to which the running offset is followed. At half a period or more it could hold itself: pictures
// that were late for a while would leave all later ones one frame off.
constexpr double kLargestOffset = 0.3;

// The upper of the two in the middle where there are two.
double upperMedian(std::vector<double>& values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

void requirePositive(double value, const char* name) {
  if (!(value > 0.0) || !std::isfinite(value)) {
    throw std::invalid_argument(std::string("ImageAssociatorOptions.") + name + " = " + std::to_string(value) +
                                ": expected a positive number of seconds");
  }
}

// Spacing of two neighbouring float32 values at `value`, [s].
double resolution(double value) {
  const auto raw = static_cast<float>(value);
  return static_cast<double>(std::nextafter(raw, std::numeric_limits<float>::infinity())) - static_cast<double>(raw);
}

}  // namespace

ImageAssociator::ImageAssociator(const ImageAssociatorOptions& options) : options_(options) {
  requirePositive(options.history, "history");
  requirePositive(options.max_gap, "max_gap");
  requirePositive(options.max_interpolation, "max_interpolation");
  requirePositive(options.max_state_offset, "max_state_offset");
}

void ImageAssociator::addFrame(const SimFrame& frame) {
  if (!std::isfinite(frame.sim_time) || !std::isfinite(frame.sim_time_raw)) return;
  if (frames_.empty() || frames_.back().frame.epoch != frame.epoch) {
    frames_.push_back({frame, ++frame_segment_});
    offsets_.clear();
  } else {
    auto place = frames_.end();
    while (place != frames_.begin() && std::prev(place)->frame.epoch == frame.epoch &&
           std::prev(place)->frame.sim_time >= frame.sim_time) {
      --place;
    }
    if (place != frames_.end() && place->frame.sim_time <= frame.sim_time) return;  // known already
    if (place == frames_.end()) {
      const SimFrame& last = frames_.back().frame;
      if (last.paused != frame.paused || frame.sim_time - last.sim_time > options_.max_gap) ++frame_segment_;
      frames_.push_back({frame, frame_segment_});
    } else {
      frames_.insert(place, {frame, place->segment});
    }
  }
  while (frames_.size() > 2 && (frames_.front().frame.epoch == frames_.back().frame.epoch
                                    ? frames_.back().frame.sim_time - frames_.front().frame.sim_time > options_.history
                                    : frames_.size() > kSpacingWindow)) {
    frames_.pop_front();
  }
}

void ImageAssociator::addState(const StateKey& state) {
  if (!std::isfinite(state.sim_time_raw)) return;
  std::int64_t age_axis_ns = 0;
  if (!states_.empty()) {
    const StateKey& last = states_.back().key;
    age_axis_ns = states_.back().age_axis_ns +
                  std::clamp<std::int64_t>(state.stamp_ns - last.stamp_ns, 0, toNanoseconds(options_.max_gap));
    const double step = static_cast<double>(state.sim_time_raw) - static_cast<double>(last.sim_time_raw);
    if (step < 0.0) {
      states_.clear();
      ++state_segment_;
    } else if (step > options_.max_gap || last.epoch != state.epoch || last.paused != state.paused ||
               last.position_epoch != state.position_epoch) {
      ++state_segment_;
    }
  }
  states_.push_back({state, state_segment_, age_axis_ns});
  const std::int64_t history_ns = toNanoseconds(options_.history);
  while (states_.size() > 2 &&
         (static_cast<double>(state.sim_time_raw) - static_cast<double>(states_.front().key.sim_time_raw) >
              options_.history ||
          age_axis_ns - states_.front().age_axis_ns > history_ns)) {
    states_.pop_front();
  }
}

std::optional<std::uint64_t> ImageAssociator::oldestStateId() const {
  if (states_.empty()) return std::nullopt;
  return states_.front().key.id;
}

void ImageAssociator::clear() {
  frames_.clear();
  states_.clear();
  offsets_.clear();
}

double ImageAssociator::framePeriod() const {
  std::vector<double> reported;
  std::vector<double> spacings;
  const std::size_t first = frames_.size() > kSpacingWindow ? frames_.size() - kSpacingWindow : 0;
  for (std::size_t i = first; i < frames_.size(); ++i) {
    if (frames_[i].frame.frame_period > 0.0) reported.push_back(frames_[i].frame.frame_period);
    if (i > first && frames_[i].segment == frames_[i - 1].segment) {
      spacings.push_back(frames_[i].frame.sim_time - frames_[i - 1].frame.sim_time);
    }
  }
  return reported.empty() ? upperMedian(spacings) : upperMedian(reported);
}

double ImageAssociator::statePeriod() const {
  std::vector<double> spacings;
  const std::size_t first = states_.size() > kSpacingWindow ? states_.size() - kSpacingWindow : 0;
  for (std::size_t i = first + 1; i < states_.size(); ++i) {
    if (states_[i].segment != states_[i - 1].segment) continue;
    spacings.push_back(static_cast<double>(states_[i].key.sim_time_raw) -
                       static_cast<double>(states_[i - 1].key.sim_time_raw));
  }
  return upperMedian(spacings);
}

double ImageAssociator::stateToFrameRatio() const {
  const double period = framePeriod();
  return period > 0.0 ? statePeriod() / period : 0.0;
}

double ImageAssociator::runningOffset() const {
  if (offsets_.size() < kMinimumOffsets) return 0.0;
  std::vector<double> values(offsets_.begin(), offsets_.end());
  const double largest = kLargestOffset * framePeriod();
  return std::clamp(upperMedian(values), -largest, largest);
}

std::optional<ImageAssociator::FrameChoice> ImageAssociator::chooseFrame(const ImageMoment& moment) const {
  const double wanted = *moment.sim_time - runningOffset();
  const Frame* before = nullptr;
  const Frame* after = nullptr;
  for (const Frame& candidate : frames_) {
    if (candidate.frame.epoch != moment.epoch) continue;
    if (candidate.frame.sim_time <= wanted) {
      before = &candidate;
    } else {
      after = &candidate;
      break;
    }
  }
  if (before == nullptr && after == nullptr) return std::nullopt;

  double period = framePeriod();
  const auto choose = [&](const Frame& base, double delta, bool inferred, bool settled) {
    FrameChoice choice{};
    choice.raw = static_cast<double>(base.frame.sim_time_raw) + delta;
    choice.offset = *moment.sim_time - (base.frame.sim_time + delta);
    choice.period = period;
    choice.inferred = inferred;
    const double to_border = 0.5 * period - std::abs(wanted - (base.frame.sim_time + delta));
    choice.ambiguous =
        to_border < std::max(moment.uncertainty, kBorder * period) || resolution(choice.raw) > (0.5 - kBorder) * period;
    choice.settled = settled;
    choice.at_edge = before != nullptr && after != nullptr && before->segment != after->segment;
    return choice;
  };

  if (before != nullptr && after != nullptr) {
    const double gap = after->frame.sim_time - before->frame.sim_time;
    const double way = wanted - before->frame.sim_time;
    if (before->segment != after->segment) {
      const Frame& nearest = way < gap - way ? *before : *after;
      if (std::abs(wanted - nearest.frame.sim_time) > period) return std::nullopt;
      return choose(nearest, 0.0, false, true);
    }
    // The later frame knows how long it lasted: a long one is no sign of a lost one before it.
    const double one = after->frame.frame_period > 0.0 ? after->frame.frame_period : period;
    const double steps = one > 0.0 ? std::max(1.0, std::round(gap / one)) : 1.0;
    const double step = gap / steps;
    const double index = std::round(way / step);
    if (period <= 0.0 || steps < 2.0) period = gap;
    if (index <= 0.0) return choose(*before, 0.0, false, true);
    if (index >= steps) return choose(*after, 0.0, false, true);
    return choose(*before, index * step, true, true);
  }
  if (period <= 0.0) return std::nullopt;
  if (before == nullptr) {
    if (after->frame.sim_time - wanted > 0.5 * period) return std::nullopt;
    return choose(*after, 0.0, false, true);
  }
  const double ahead = wanted - before->frame.sim_time;
  if (ahead < 0.5 * period) return choose(*before, 0.0, false, true);
  if (ahead > options_.max_gap) return std::nullopt;
  return choose(*before, std::round(ahead / period) * period, true, false);
}

ImageAssociator::FrameChoice ImageAssociator::keyedFrame(float key) const {
  FrameChoice choice{};
  choice.raw = static_cast<double>(key);
  choice.period = framePeriod();
  choice.settled = true;
  // After a day neighbouring frames may share a key.
  choice.ambiguous = choice.period > 0.0 && resolution(choice.raw) > (0.5 - kBorder) * choice.period;
  return choice;
}

void ImageAssociator::pairWithFrame(const FrameChoice& frame, bool paused, bool final, Association& answer) const {
  const auto distance = [&frame](const State& state) {
    return static_cast<double>(state.key.sim_time_raw) - frame.raw;
  };
  const State* before = nullptr;
  const State* after = nullptr;
  bool placed = false;  // at the time of `before`
  for (const State& state : states_) {
    if (distance(state) <= 0.0) {
      // Those of a pause have the time of the last frame before it, and may be placed elsewhere.
      const bool same_time = before != nullptr && before->key.sim_time_raw == state.key.sim_time_raw;
      placed = same_time && (placed || before->key.position_epoch != state.key.position_epoch);
      if (!same_time || paused) before = &state;
    } else {
      after = &state;
      break;
    }
  }
  const State* nearest = before;
  if (before == nullptr || (after != nullptr && distance(*after) < -distance(*before))) nearest = after;

  const auto use = [&](PairingMethod method, const State& state) {
    answer.method = method;
    answer.id = answer.id_after = state.key.id;
    answer.state_offset = distance(state);
  };
  if (nearest != nullptr && std::abs(distance(*nearest)) <= kSameFrame * frame.period) {
    use(PairingMethod::kFrame, *nearest);
    answer.at_edge = answer.at_edge || (placed && !paused && nearest == before);
    if (frame.inferred) {  // put in evenly between its neighbours; its state knows its time, which other cameras heard
      answer.frame_sim_time = static_cast<double>(nearest->key.sim_time_raw);
      answer.frame_offset -= answer.state_offset;
      answer.state_offset = 0.0;
    }
    return;
  }
  if (after == nullptr && !final) {
    answer.pending = true;
    return;
  }
  if (nearest == nullptr) return;
  if (before != nullptr && after != nullptr) {
    if (before->segment != after->segment) {  // pause, reset, epoch or gap between: no state is this frame's
      answer.at_edge = true;
      return;
    }
    const double width = distance(*after) - distance(*before);
    if (stateToFrameRatio() > kSparseRatio && width <= options_.max_interpolation) {
      answer.method = PairingMethod::kInterpolated;
      answer.id = before->key.id;
      answer.id_after = after->key.id;
      answer.fraction = -distance(*before) / width;
      return;
    }
  }
  if (std::abs(distance(*nearest)) <= options_.max_state_offset) use(PairingMethod::kNearestFrame, *nearest);
}

void ImageAssociator::pairByStamp(const ImageMoment& moment, bool final, Association& answer) const {
  const State* nearest = nullptr;
  std::int64_t best = 0;
  for (const State& state : states_) {
    const std::int64_t distance = std::abs(state.key.stamp_ns - moment.host_time_ns);
    if (nearest != nullptr && distance > best) continue;
    nearest = &state;
    best = distance;
  }
  if (!final && (states_.empty() || states_.back().key.stamp_ns < moment.host_time_ns)) {
    answer.pending = true;
    return;
  }
  if (nearest == nullptr || toSeconds(best) > options_.max_state_offset) return;
  answer.method = PairingMethod::kStamp;
  answer.id = answer.id_after = nearest->key.id;
}

void ImageAssociator::pairPaused(float paused_at, bool final, Association& answer) const {
  const auto stands = [paused_at](const State& state) { return state.key.sim_time_raw == paused_at; };
  const auto newest = std::find_if(states_.rbegin(), states_.rend(), stands);
  // The first of a pause may come with the newest time of the flight, or be placed elsewhere.
  const bool found = newest != states_.rend();
  answer.pending = !final && !(found && newest->key.paused);
  if (answer.pending || !found) return;
  answer.method = PairingMethod::kPaused;
  answer.id = answer.id_after = newest->key.id;
}

Association ImageAssociator::associate(const ImageMoment& moment, bool final) {
  Association answer;
  std::optional<FrameChoice> frame;
  if (moment.frame_key.has_value()) {
    frame = keyedFrame(*moment.frame_key);
  } else if (moment.paused_at.has_value()) {
    pairPaused(*moment.paused_at, final, answer);
  } else if (!moment.sim_time.has_value()) {
    pairByStamp(moment, final, answer);
  } else if (frame = chooseFrame(moment); !frame.has_value() || (!frame->settled && !final)) {
    answer.pending = !final;
  }
  if (frame.has_value() && !answer.pending) {
    answer.frame_known = true;
    answer.frame_sim_time = frame->raw;
    answer.frame_offset = frame->offset;
    answer.frame_inferred = frame->inferred;
    answer.ambiguous = frame->ambiguous;
    answer.at_edge = frame->at_edge;
    answer.frame_period = frame->period;
    pairWithFrame(*frame, moment.paused_at.has_value(), final, answer);
  }
  if (!answer.pending) settle(answer);
  return answer;
}

void ImageAssociator::settle(const Association& answer) {
  if (answer.frame_known) {
    offsets_.push_back(answer.frame_offset);
    if (offsets_.size() > kOffsetWindow) offsets_.pop_front();
  }
  ++counters_.images;
  counters_.ambiguous += answer.ambiguous ? 1 : 0;
  counters_.frames_inferred += answer.frame_inferred ? 1 : 0;
  switch (answer.method) {
    case PairingMethod::kNone:
      ++counters_.without_state;
      break;
    case PairingMethod::kFrame:
      ++counters_.by_frame;
      break;
    case PairingMethod::kNearestFrame:
      ++counters_.by_nearest;
      break;
    case PairingMethod::kInterpolated:
      ++counters_.interpolated;
      break;
    case PairingMethod::kStamp:
      ++counters_.by_stamp;
      break;
    case PairingMethod::kPaused:
      ++counters_.paused;
      break;
  }
}

std::uint32_t pairingQuality(const ImageMoment& moment, const Association& answer) {
  std::uint32_t quality = 0;
  if (answer.method == PairingMethod::kNone) quality |= kQualityStateMissing;
  if (answer.method == PairingMethod::kInterpolated) quality |= kQualityInterpolated;
  if (answer.method == PairingMethod::kNearestFrame) quality |= kQualityOffFrame;
  // Stamps alone do not show which frame it is.
  if (answer.method == PairingMethod::kStamp) quality |= kQualityOffFrame | kQualityClockUnsure;
  if (answer.frame_known && moment.uncertainty > 0.5 * answer.frame_period) quality |= kQualityClockUnsure;
  if (moment.paused_at.has_value() || answer.method == PairingMethod::kPaused) quality |= kQualityPaused;
  if (answer.at_edge) quality |= kQualityEpochEdge;
  if (answer.ambiguous) quality |= kQualityBorderline;
  return quality;
}

double interpolateAngleDeg(double from, double to, double fraction, double lower) {
  const double turn = std::remainder(to - from, 360.0);
  const double angle = std::fmod(from + fraction * turn - lower, 360.0);
  return lower + (angle < 0.0 ? angle + 360.0 : angle);
}

Eigen::Quaterniond interpolateAttitude(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to, double fraction) {
  return from.normalized().slerp(fraction, to.normalized()).normalized();
}

}  // namespace xplane_bridge::core
