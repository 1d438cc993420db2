#include "xplane_bridge/vision/picture_checks.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <vector>

namespace xplane_bridge::vision {
namespace {

constexpr int kBlackBelow = 16;        // of 255
constexpr double kBlackShare = 0.995;  // a loading message or a cursor may be lit
constexpr int kSamples = 64;           // along each side

}  // namespace

bool isBlack(const cv::Mat& bgr) {
  const int step_x = std::max(1, bgr.cols / kSamples);
  const int step_y = std::max(1, bgr.rows / kSamples);
  const int channels = bgr.channels();
  int black = 0;
  int samples = 0;
  for (int y = 0; y < bgr.rows; y += step_y) {
    const std::uint8_t* row = bgr.ptr<std::uint8_t>(y);
    for (int x = 0; x < bgr.cols; x += step_x) {
      const std::uint8_t* pixel = row + static_cast<std::ptrdiff_t>(x) * channels;
      ++samples;
      black += std::max({pixel[0], pixel[1], pixel[2]}) < kBlackBelow ? 1 : 0;
    }
  }
  return samples > 0 && black >= kBlackShare * samples;
}

bool samePixels(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != b.type()) return false;
  const std::size_t bytes = static_cast<std::size_t>(a.cols) * a.elemSize();
  for (int y = 0; y < a.rows; ++y) {
    if (std::memcmp(a.ptr(y), b.ptr(y), bytes) != 0) return false;
  }
  return true;
}

void PeriodMeter::add(std::int64_t time_ns) {
  constexpr double kNanosecond = 1e-9;
  if (last_ns_ != 0 && time_ns > last_ns_) {
    periods_[count_ % kPeriods] = static_cast<float>(static_cast<double>(time_ns - last_ns_) * kNanosecond);
    ++count_;
  }
  last_ns_ = std::max(last_ns_, time_ns);
}

PeriodMeter::Summary PeriodMeter::summary() const {
  constexpr double kShare = 0.99;
  Summary out;
  out.count = std::min(count_, kPeriods);
  if (out.count == 0) return out;
  std::vector<float> sorted(periods_.begin(), periods_.begin() + static_cast<std::ptrdiff_t>(out.count));
  std::sort(sorted.begin(), sorted.end());
  const auto size = static_cast<double>(out.count);
  out.mean = std::accumulate(sorted.begin(), sorted.end(), 0.0) / size;
  out.p99 = static_cast<double>(sorted[static_cast<std::size_t>(std::ceil(kShare * size)) - 1]);
  out.worst = static_cast<double>(sorted.back());
  return out;
}

}  // namespace xplane_bridge::vision
