#include "xplane_bridge/vision/pixel_format.hpp"

#include <cstring>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace xplane_bridge::vision {
namespace {

enum class Layout { kUnsupported, kBgrx, kRgbx, kBgr, kBgr565, kBgr555, kBgr101010 };

bool hasMasks(const PixelFormat& format, std::uint32_t red, std::uint32_t green, std::uint32_t blue) {
  return format.red_mask == red && format.green_mask == green && format.blue_mask == blue;
}

Layout layoutOf(const PixelFormat& format) {
  if (format.msb_first) return Layout::kUnsupported;
  switch (format.bits_per_pixel) {
    case 32:
      if (hasMasks(format, 0xff0000, 0xff00, 0xff)) return Layout::kBgrx;
      if (hasMasks(format, 0xff, 0xff00, 0xff0000)) return Layout::kRgbx;
      if (hasMasks(format, 0x3ff00000, 0xffc00, 0x3ff)) return Layout::kBgr101010;
      return Layout::kUnsupported;
    case 24:
      return hasMasks(format, 0xff0000, 0xff00, 0xff) ? Layout::kBgr : Layout::kUnsupported;
    case 16:
      if (hasMasks(format, 0xf800, 0x7e0, 0x1f)) return Layout::kBgr565;
      if (hasMasks(format, 0x7c00, 0x3e0, 0x1f)) return Layout::kBgr555;
      return Layout::kUnsupported;
    default:
      return Layout::kUnsupported;
  }
}

std::string hex(std::uint32_t value) {
  char text[16];
  std::snprintf(text, sizeof text, "0x%x", static_cast<unsigned>(value));
  return text;
}

}  // namespace

std::string unsupportedReason(const PixelFormat& format) {
  if (layoutOf(format) != Layout::kUnsupported) return {};
  if (format.msb_first)
    return "the X server stores pixels most significant byte first; expected a little-endian server";
  return "the window's visual has depth " + std::to_string(format.depth) + " at " +
         std::to_string(format.bits_per_pixel) + " bits per pixel with masks red " + hex(format.red_mask) + ", green " +
         hex(format.green_mask) + ", blue " + hex(format.blue_mask) +
         "; expected true colour of depth 15, 16, 24, 30 or 32: run the X server at depth 24";
}

std::size_t rowBytes(const PixelFormat& format, int width) {
  const auto bits = static_cast<std::size_t>(width) * static_cast<std::size_t>(format.bits_per_pixel);
  const auto pad = static_cast<std::size_t>(format.scanline_pad);
  return (bits + pad - 1) / pad * pad / 8;
}

cv::Mat toBgr(const PixelFormat& format, std::uint8_t* data, int width, int height, cv::Mat& scratch) {
  const std::size_t stride = rowBytes(format, width);
  switch (layoutOf(format)) {
    case Layout::kBgrx:
      return {height, width, CV_8UC4, data, stride};
    case Layout::kBgr:
      return {height, width, CV_8UC3, data, stride};
    case Layout::kRgbx:
      cv::cvtColor(cv::Mat(height, width, CV_8UC4, data, stride), scratch, cv::COLOR_RGBA2BGR);
      return scratch;
    case Layout::kBgr565:
      cv::cvtColor(cv::Mat(height, width, CV_8UC2, data, stride), scratch, cv::COLOR_BGR5652BGR);
      return scratch;
    case Layout::kBgr555:
      cv::cvtColor(cv::Mat(height, width, CV_8UC2, data, stride), scratch, cv::COLOR_BGR5552BGR);
      return scratch;
    case Layout::kBgr101010: {
      scratch.create(height, width, CV_8UC3);
      for (int y = 0; y < height; ++y) {
        const std::uint8_t* from = data + static_cast<std::size_t>(y) * stride;
        std::uint8_t* to = scratch.ptr<std::uint8_t>(y);
        for (int x = 0; x < width; ++x, from += 4, to += 3) {
          std::uint32_t pixel = 0;
          std::memcpy(&pixel, from, sizeof pixel);
          to[0] = static_cast<std::uint8_t>(pixel >> 2U);
          to[1] = static_cast<std::uint8_t>(pixel >> 12U);
          to[2] = static_cast<std::uint8_t>(pixel >> 22U);
        }
      }
      return scratch;
    }
    case Layout::kUnsupported:
      break;
  }
  throw std::invalid_argument(unsupportedReason(format));
}

}  // namespace xplane_bridge::vision
