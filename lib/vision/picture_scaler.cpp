#include "xplane_bridge/vision/picture_scaler.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace xplane_bridge::vision {
namespace {

constexpr int kSmallest = 16;
constexpr int kLargest = 8192;
constexpr double kDegree = 3.14159265358979323846 / 180.0;

// Largest centred rectangle of the shape of `shape` that fits into `outer`.
cv::Rect centred(cv::Size outer, cv::Size shape) {
  cv::Size size = outer;
  const auto outer_wider = static_cast<std::int64_t>(outer.width) * shape.height;
  const auto shape_wider = static_cast<std::int64_t>(shape.width) * outer.height;
  if (outer_wider > shape_wider) {
    size.width = std::max(1, static_cast<int>(std::lround(static_cast<double>(shape_wider) / shape.height)));
  } else if (outer_wider < shape_wider) {
    size.height = std::max(1, static_cast<int>(std::lround(static_cast<double>(outer_wider) / shape.width)));
  }
  return {(outer.width - size.width) / 2, (outer.height - size.height) / 2, size.width, size.height};
}

void toThreeChannels(const cv::Mat& from, cv::Mat& to) {
  if (from.channels() == 4) {
    cv::cvtColor(from, to, cv::COLOR_BGRA2BGR);
  } else {
    from.copyTo(to);
  }
}

}  // namespace

FitMode fitModeFromName(const std::string& name) {
  if (name == "crop") return FitMode::kCrop;
  if (name == "letterbox") return FitMode::kLetterbox;
  if (name == "stretch") return FitMode::kStretch;
  throw std::invalid_argument("fit mode \"" + name + "\": expected crop, letterbox or stretch");
}

PictureScaler::PictureScaler(int width, int height, FitMode mode) : size_(width, height), mode_(mode) {
  if (std::min(width, height) < kSmallest || std::max(width, height) > kLargest) {
    throw std::invalid_argument("output size " + std::to_string(width) + "x" + std::to_string(height) +
                                ": expected width and height from " + std::to_string(kSmallest) + " to " +
                                std::to_string(kLargest));
  }
}

PictureScaler::Layout PictureScaler::layout(cv::Size source) const {
  const cv::Rect whole_source(cv::Point(), source);
  const cv::Rect whole_output(cv::Point(), size_);
  switch (mode_) {
    case FitMode::kCrop:
      return {centred(source, size_), whole_output};
    case FitMode::kLetterbox:
      return {whole_source, centred(size_, source)};
    case FitMode::kStretch:
      break;
  }
  return {whole_source, whole_output};
}

void PictureScaler::scale(const cv::Mat& source, cv::Mat& bgr) {
  if (source.size() == size_) {
    toThreeChannels(source, bgr);
    return;
  }
  const Layout part = layout(source.size());
  const cv::Mat used = source(part.from);
  bgr.create(size_, CV_8UC3);
  if (part.to.size() != size_) bgr.setTo(cv::Scalar::all(0));
  cv::Mat inside = bgr(part.to);
  if (used.size() == inside.size()) {
    toThreeChannels(used, inside);
    return;
  }
  const bool shrinks = part.to.width < part.from.width || part.to.height < part.from.height;
  cv::resize(used, scaled_, part.to.size(), 0.0, 0.0, shrinks ? cv::INTER_AREA : cv::INTER_LINEAR);
  toThreeChannels(scaled_, inside);
}

Intrinsics PictureScaler::intrinsics(cv::Size source, const FieldOfView& shown) const {
  const bool across = shown.horizontal_deg > 0.0 && shown.horizontal_deg < 180.0;
  const bool upwards = shown.vertical_deg >= 0.0 && shown.vertical_deg < 180.0;
  if (!across || !upwards || source.width < 1 || source.height < 1) {
    throw std::invalid_argument("field of view " + std::to_string(shown.horizontal_deg) + " x " +
                                std::to_string(shown.vertical_deg) + " deg of a source of " +
                                std::to_string(source.width) + "x" + std::to_string(source.height) +
                                ": expected an angle in (0, 180) and a source that is not empty");
  }
  const Layout part = layout(source);
  const auto focal = [](int side, double angle_deg) { return 0.5 * side / std::tan(0.5 * angle_deg * kDegree); };
  const double focal_x = focal(source.width, shown.horizontal_deg);
  const double focal_y = shown.vertical_deg > 0.0 ? focal(source.height, shown.vertical_deg) : focal_x;
  const double scale_x = static_cast<double>(part.to.width) / part.from.width;
  const double scale_y = static_cast<double>(part.to.height) / part.from.height;
  Intrinsics camera;
  camera.fx = focal_x * scale_x;
  camera.fy = focal_y * scale_y;
  // Unshifted, the optical axis is the middle of the source, half a pixel beyond the centre of the pixel before it.
  camera.cx = ((0.5 - shown.shift_right) * source.width - part.from.x) * scale_x + part.to.x - 0.5;
  camera.cy = ((0.5 + shown.shift_up) * source.height - part.from.y) * scale_y + part.to.y - 0.5;
  camera.horizontal_fov_deg =
      (std::atan((camera.cx + 0.5) / camera.fx) + std::atan((size_.width - camera.cx - 0.5) / camera.fx)) / kDegree;
  return camera;
}

}  // namespace xplane_bridge::vision
