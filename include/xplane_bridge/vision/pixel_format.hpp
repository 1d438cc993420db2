#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>

namespace xplane_bridge::vision {

/// How an X11 visual lays out a pixel in a ZPixmap.
struct PixelFormat {
  int depth = 0;           ///< [bit] significant bits of a pixel
  int bits_per_pixel = 0;  ///< [bit] stored bits of a pixel
  int scanline_pad = 32;   ///< [bit] rows are padded to a multiple of this
  bool msb_first = false;  ///< byte order of a pixel
  std::uint32_t red_mask = 0;
  std::uint32_t green_mask = 0;
  std::uint32_t blue_mask = 0;
};

/// Empty when the format can be converted, else why not and what to do.
[[nodiscard]] std::string unsupportedReason(const PixelFormat& format);

/// Bytes of one row of `width` pixels.
[[nodiscard]] std::size_t rowBytes(const PixelFormat& format, int width);

/// Makes an 8-bit picture of ZPixmap data. Where the data already is blue, green, red(, unused) in memory, the result
/// is a view of `data` without a copy; else it is converted into `scratch`.
/// @param data height rows of rowBytes(format, width); must outlive the result
/// @return CV_8UC3 (blue, green, red) or CV_8UC4 (and one that means nothing)
/// @throws std::invalid_argument with unsupportedReason().
[[nodiscard]] cv::Mat toBgr(const PixelFormat& format, std::uint8_t* data, int width, int height, cv::Mat& scratch);

}  // namespace xplane_bridge::vision
