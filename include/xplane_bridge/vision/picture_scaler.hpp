#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

namespace xplane_bridge::vision {

/// How a source of one shape becomes a picture of another.
enum class FitMode {
  kCrop,       ///< centred part of the source with the output's shape; nothing distorted, edges lost
  kLetterbox,  ///< whole source, black borders; nothing distorted, nothing lost
  kStretch,    ///< whole source; pixels no longer square, which K shows (fx != fy)
};

/// @throws std::invalid_argument unless `name` is crop, letterbox or stretch.
[[nodiscard]] FitMode fitModeFromName(const std::string& name);

/// What a whole source shows.
struct FieldOfView {
  double horizontal_deg = 60.0;  ///< between the left and the right edge, before the shift; in (0, 180)
  double vertical_deg = 0.0;     ///< likewise, lower and upper edge; 0: pixels are square
  double shift_right = 0.0;      ///< [widths] that the source's middle lies right of the line of sight
  double shift_up = 0.0;         ///< [heights] that it lies above it
};

/// Pinhole camera of the output picture; pixel centres at integers, top left pixel (0, 0), no distortion.
struct Intrinsics {
  double fx = 0.0;                  ///< [px]
  double fy = 0.0;                  ///< [px]
  double cx = 0.0;                  ///< [px]
  double cy = 0.0;                  ///< [px]
  double horizontal_fov_deg = 0.0;  ///< [deg] of the published picture, borders of a letterbox included
};

/// Scales pictures to a fixed output size, and says which camera the result is of.
class PictureScaler {
 public:
  /// @throws std::invalid_argument unless 16 <= width, height <= 8192.
  PictureScaler(int width, int height, FitMode mode);

  /// @param source CV_8UC3 or CV_8UC4 (fourth channel ignored), not empty
  /// @param[out] bgr CV_8UC3 of the output size; its memory is reused when it fits
  void scale(const cv::Mat& source, cv::Mat& bgr);

  /// What of the output [px] shows the source, whose size [px] is given: all of it but for the bars of a letterbox.
  [[nodiscard]] cv::Rect shows(cv::Size source) const { return layout(source).to; }

  /// Camera of the output.
  /// @param source size of the source, [px]
  /// @throws std::invalid_argument when out of range.
  [[nodiscard]] Intrinsics intrinsics(cv::Size source, const FieldOfView& shown) const;

  [[nodiscard]] cv::Size size() const { return size_; }

 private:
  struct Layout {
    cv::Rect from;  // part of the source that is used
    cv::Rect to;    // part of the output it fills
  };
  [[nodiscard]] Layout layout(cv::Size source) const;

  cv::Size size_;
  FitMode mode_;
  cv::Mat scaled_;
};

}  // namespace xplane_bridge::vision
