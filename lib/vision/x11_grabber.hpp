#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core/types.hpp>
#include <optional>
#include <vector>

#include "x11_connection.hpp"

namespace xplane_bridge::vision {

/// Reads the pixels of one rectangle of one drawable: through shared memory, or through the socket where that fails.
/// Two buffers take turns, so that the picture before stays readable for the comparison.
class X11Grabber {
 public:
  /// @param area [px] rectangle inside the drawable
  X11Grabber(const X11Connection& connection, xcb_drawable_t drawable, const PixelFormat& format, cv::Rect area,
             bool use_shared_memory);
  ~X11Grabber();
  X11Grabber(const X11Grabber&) = delete;
  X11Grabber& operator=(const X11Grabber&) = delete;

  /// Reads the whole rectangle. @return its ZPixmap data, valid until the next call but one; nullptr: not readable
  [[nodiscard]] std::uint8_t* read();

  /// Whether the last two read() gave the same bytes.
  [[nodiscard]] bool sameAsBefore() const { return same_; }

  /// Whatever the next read() gives is not the same.
  void forget() { previous_ = nullptr; }

  /// Number of the last read()'s request: an event of a lower one was raised before the pixels were read.
  [[nodiscard]] std::uint32_t readSequence() const { return read_sequence_; }

  /// Sum over a few rows spread over the rectangle; empty: not readable. Cheap enough to be polled.
  [[nodiscard]] std::optional<std::uint64_t> checksum();
  /// The same of what read() gave.
  [[nodiscard]] std::uint64_t checksum(const std::uint8_t* data) const;

  [[nodiscard]] cv::Rect area() const { return area_; }
  [[nodiscard]] bool sharesMemory() const { return segment_.id != XCB_NONE; }

 private:
  struct Segment {
    std::uint32_t id = 0;  // XCB_NONE: none
    std::uint8_t* memory = nullptr;
  };
  void attach(std::size_t bytes);
  void detach();
  [[nodiscard]] int checksumRows() const;
  /// Row `i` of those the checksum looks at.
  [[nodiscard]] int checksumRow(int i) const;
  /// Rows [y, y + height) to `offset` of the segment or into `plain`.
  [[nodiscard]] const std::uint8_t* readRows(int y, int height, std::size_t offset, std::vector<std::uint8_t>& plain);

  const X11Connection& connection_;
  xcb_drawable_t drawable_;
  PixelFormat format_;
  cv::Rect area_;
  std::size_t stride_;
  std::size_t picture_bytes_;
  Segment segment_;
  std::array<std::vector<std::uint8_t>, 2> plain_;
  std::vector<std::uint8_t> plain_row_;
  std::size_t turn_ = 0;
  std::uint8_t* previous_ = nullptr;
  std::uint32_t read_sequence_ = 0;
  bool same_ = false;
};

}  // namespace xplane_bridge::vision
