#include "xplane_bridge/core/camera/delay_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace xplane_bridge::core {
namespace {

// Steps that must fit the delay that is found, and how many more than fit any other.
constexpr std::size_t kEnough = 6;
constexpr std::size_t kMore = 2;
// [ns] The delay is looked for within these.
constexpr double kLeast = 1e9 * DelayCalibration::kLeastDelay;
constexpr double kMost = 500e6;
// So many more pictures than steps, those that differ most from the one before, may have zoomed; they differ by at
// least so many grey levels.
constexpr std::size_t kSpare = 2;
constexpr double kLeastDifference = 1.5;

double median(std::vector<double> values) {
  const std::size_t half = values.size() / 2;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(half), values.end());
  const double upper = values[half];
  if (values.size() % 2 != 0) return upper;
  return 0.5 * (upper + *std::max_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(half)));
}

// For each step that was asked for the picture nearest to the delay, where that is within half a frame of it.
std::vector<double> matches(const std::vector<std::int64_t>& asked, const std::vector<std::int64_t>& shown,
                            double delay_ns, double period_ns) {
  std::vector<double> found;
  for (const std::int64_t arrival_ns : asked) {
    std::optional<double> nearest;
    for (const std::int64_t change_ns : shown) {
      const auto delay = static_cast<double>(change_ns - arrival_ns);
      if (!nearest.has_value() || std::abs(delay - delay_ns) < std::abs(*nearest - delay_ns)) nearest = delay;
    }
    if (nearest.has_value() && std::abs(*nearest - delay_ns) <= 0.5 * period_ns) found.push_back(*nearest);
  }
  return found;
}

}  // namespace

double delayToKeep(double measured) {
  constexpr double kPrinted = 1e-4;  // the advice has four decimals
  return std::abs(measured) < 0.5 * kPrinted ? kPrinted : measured;
}

void DelayCalibration::addFrame(std::int64_t arrival_ns, double field_of_view_deg) {
  frames_.push_back({arrival_ns, field_of_view_deg});
}

void DelayCalibration::addPicture(std::int64_t change_ns, double difference) {
  pictures_.push_back({change_ns, difference});
}

std::vector<std::int64_t> DelayCalibration::stepFrames() const {
  std::vector<std::int64_t> steps;
  for (std::size_t i = 1; i < frames_.size(); ++i) {
    if (std::abs(frames_[i].field_of_view_deg - frames_[i - 1].field_of_view_deg) > 0.5 * kStepDeg) {
      steps.push_back(frames_[i].arrival_ns);
    }
  }
  return steps;
}

std::vector<std::int64_t> DelayCalibration::stepPictures(std::size_t steps) const {
  std::vector<Picture> seen;
  std::copy_if(pictures_.begin(), pictures_.end(), std::back_inserter(seen),
               [](const Picture& picture) { return picture.difference > kLeastDifference; });
  std::stable_sort(seen.begin(), seen.end(),
                   [](const Picture& a, const Picture& b) { return a.difference > b.difference; });
  if (seen.size() > steps + kSpare) seen.resize(steps + kSpare);
  std::vector<std::int64_t> times;
  times.reserve(seen.size());
  for (const Picture& picture : seen) times.push_back(picture.change_ns);
  return times;
}

double DelayCalibration::framePeriodNs() const {
  std::vector<double> periods;
  for (std::size_t i = 1; i < frames_.size(); ++i) {
    periods.push_back(static_cast<double>(frames_[i].arrival_ns - frames_[i - 1].arrival_ns));
  }
  return median(std::move(periods));
}

std::optional<MeasuredDelay> DelayCalibration::settle(std::string* why) const {
  const std::vector<std::int64_t> asked = stepFrames();
  if (asked.size() < kEnough) {
    *why = "X-Plane reports " + std::to_string(asked.size()) + " of " + std::to_string(kSteps) +
           " steps of its field of view, at least " + std::to_string(kEnough) +
           " are needed: is it held by an aircraft or a plugin?";
    return std::nullopt;
  }
  const std::vector<std::int64_t> shown = stepPictures(asked.size());
  const double period_ns = framePeriodNs();
  std::vector<double> candidates;
  for (const std::int64_t change_ns : shown) {
    for (const std::int64_t arrival_ns : asked) {
      const auto delay_ns = static_cast<double>(change_ns - arrival_ns);
      if (delay_ns >= kLeast && delay_ns <= kMost) candidates.push_back(delay_ns);
    }
  }
  std::vector<double> best;
  for (const double delay_ns : candidates) {
    std::vector<double> found = matches(asked, shown, delay_ns, period_ns);
    if (found.size() > best.size()) best = std::move(found);
  }
  if (best.size() < kEnough) {
    *why = "only " + std::to_string(best.size()) + " of " + std::to_string(asked.size()) +
           " steps of the field of view were seen in the pictures, at least " + std::to_string(kEnough) +
           " are needed: does the window show X-Plane's own view, and does it change with it?";
    return std::nullopt;
  }
  const double middle_ns = median(best);
  std::size_t rival = 0;
  for (const double delay_ns : candidates) {
    if (std::abs(delay_ns - middle_ns) <= 1.5 * period_ns) continue;
    rival = std::max(rival, matches(asked, shown, delay_ns, period_ns).size());
  }
  if (best.size() < rival + kMore) {
    *why = "the steps of the field of view in the pictures fit more than one delay (" + std::to_string(best.size()) +
           " and " + std::to_string(rival) + " of " + std::to_string(asked.size()) +
           "): the view moves too much, or X-Plane draws too few frames";
    return std::nullopt;
  }
  std::vector<double> away;
  away.reserve(best.size());
  for (const double delay_ns : best) away.push_back(std::abs(delay_ns - middle_ns));
  // Those that agree with a delay at the limit may lie half a frame beyond it.
  const double delay = std::max(1e-9 * middle_ns, kLeastDelay);
  return MeasuredDelay{delay, static_cast<int>(best.size()), 1e-9 * median(std::move(away))};
}

}  // namespace xplane_bridge::core
