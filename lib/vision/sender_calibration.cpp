#include "xplane_bridge/vision/sender_calibration.hpp"

#include <utility>

namespace xplane_bridge::vision {

std::uint64_t SenderCalibration::ask() {
  const std::lock_guard<std::mutex> lock(mutex_);
  answer_.reset();
  waiting_ = true;
  return ++number_;
}

std::optional<CalibrationAnswer> SenderCalibration::answer(std::uint64_t number) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return number == number_ ? answer_ : std::nullopt;
}

std::uint64_t SenderCalibration::take() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(waiting_, false) ? number_ : 0;
}

void SenderCalibration::settle(std::uint64_t number, CalibrationAnswer answer) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (number == number_ && !answer_.has_value()) answer_ = std::move(answer);
}

}  // namespace xplane_bridge::vision
