#pragma once

#include <memory>
#include <string>

#include "xplane_bridge/vision/frame_source.hpp"

namespace xplane_bridge::vision {

struct VideoSourceOptions {
  std::string address;        ///< "/dev/video0" or "0" (device), a file, or a stream's URL
  bool loop = false;          ///< files: start again at the end
  bool paced = true;          ///< files: play at the recorded rate; false: as fast as pictures are taken
  double retry_period = 1.0;  ///< [s] between two attempts to open, (0, 60]
};

/// Pictures of a capture device, a video file or a network stream, through OpenCV.
///
/// X-Plane on Windows, or on a machine without an X server, can stream its window here. Display times are the stream's
/// own time stamps, moved to the host clock by the least delay seen lately; they are then free of the network's jitter,
/// and what constant delay is left belongs to the display delay. A stream without usable stamps says so in every
/// Change (time_known false).
class VideoSource : public FrameSource {
 public:
  /// Opens on the first wait. @throws std::invalid_argument on an empty address or a period out of range.
  VideoSource(const VideoSourceOptions& options, Clock clock);
  ~VideoSource() override;

  /// Reading blocks inside OpenCV: a device delivers at its own rate, a silent stream until the backend gives up.
  [[nodiscard]] WaitResult waitChange(std::chrono::milliseconds timeout, Change& change) override;
  [[nodiscard]] GrabResult grab(const Change& change, Picture& picture) override;
  [[nodiscard]] std::string describe() const override;
  [[nodiscard]] std::string problem() const override;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace xplane_bridge::vision
