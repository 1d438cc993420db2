#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

namespace xplane_bridge::vision {

/// Host time, [ns]; the clock every stamp of a source is taken from. Best one that is never set: a source compares it
/// over seconds with the clock of a server, a sender or a stream.
using Clock = std::function<std::int64_t()>;

/// A picture appeared at the source.
struct Change {
  std::int64_t time_ns = 0;  ///< [ns] host time of the change; when it is not known, the time it was noticed
  bool time_known = false;   ///< false: `time_ns` may be late by any amount
};

/// The simulator frame that a picture shows, where its source knows it.
struct ShownFrame {
  float sim_time = 0.0F;      ///< [s] the frame's, as X-Plane sent it: the key by which its state is found
  double delay = 0.0;         ///< [s] from the frame to its display, as applied
  bool borderline = false;    ///< it may be the neighbouring frame's picture
  bool delay_assumed = true;  ///< the delay was not measured, or is not true any more
};

/// One picture: pixels, valid until the source's next grab(), or JPEG.
struct Picture {
  cv::Mat bgr;  ///< CV_8UC3, or CV_8UC4 whose fourth channel means nothing; empty with `jpeg`
  std::shared_ptr<const std::vector<std::uint8_t>> jpeg;  ///< as the source has it; empty with `bgr`
  cv::Size jpeg_size;                                     ///< [px]
  std::optional<ShownFrame> frame;
  std::int64_t display_time_ns = 0;  ///< [ns] host time at which the picture appeared (Change.time_ns)
  std::int64_t grab_time_ns = 0;     ///< [ns] host time at which the pixels were read
  bool display_time_known = false;
};

enum class WaitResult {
  kChange,   ///< a picture appeared: grab() it, or leave it
  kTimeout,  ///< nothing new
  kLost,     ///< no picture to be had now (window closed, stream broken): problem() says why; keep calling
  kEnded,    ///< the file is over
};

enum class GrabResult {
  kNew,   ///< differs from the picture grabbed before
  kSame,  ///< the same pixels as before: what changed was not the picture
  kLost,  ///< could not be read: problem() says why
};

/// Where pictures come from. One thread uses a source; nothing here throws or ends the process once constructed.
class FrameSource {
 public:
  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;
  FrameSource(FrameSource&&) = delete;
  FrameSource& operator=(FrameSource&&) = delete;
  virtual ~FrameSource() = default;

  /// Waits until a picture appears, at most `timeout`; also what finds a lost window or stream again.
  [[nodiscard]] virtual WaitResult waitChange(std::chrono::milliseconds timeout, Change& change) = 0;

  /// Reads the picture that is there now, right after a change.
  [[nodiscard]] virtual GrabResult grab(const Change& change, Picture& picture) = 0;

  /// What can be read at any time counts as changed, and as new, once more. Nothing for sources that only receive.
  virtual void lookAnew() {}

  /// One line for people: what is captured, and how.
  [[nodiscard]] virtual std::string describe() const = 0;

  /// Why there is no picture; empty while there is one.
  [[nodiscard]] virtual std::string problem() const = 0;
};

}  // namespace xplane_bridge::vision
