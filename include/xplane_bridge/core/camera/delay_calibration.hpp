#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace xplane_bridge::core {

/// A delay from a frame to its picture, measured.
struct MeasuredDelay {
  double delay = 0.0;   ///< [s]
  int steps = 0;        ///< that agree with it
  double spread = 0.0;  ///< [s] how far these lie from it, median
};

/// [s] The value of the parameter `display_delay` that keeps a measured delay: 0 counts as not measured there.
[[nodiscard]] double delayToKeep(double measured);

/// Finds the delay from a frame to its picture by steps of the field of view at random times, seen in both: the frame
/// whose datagram first reports a step is the frame whose picture zooms, and the random times leave one delay only that
/// explains all steps. Frames that come regularly hide no whole periods. The same as `eye/calibrate.py`.
///
/// No clock, no thread: one thread calls, or the caller locks.
class DelayCalibration {
 public:
  static constexpr int kSteps = 10;          ///< to be made
  static constexpr double kStepDeg = 8.0;    ///< up from the user's field of view, and back
  static constexpr double kWidestDeg = 120;  ///< where that would be wider: down from it

  /// [s] A frame's datagram may come after its picture. `display_delay` takes no less, and no result is less.
  static constexpr double kLeastDelay = -0.02;

  /// A frame of X-Plane. @param arrival_ns [ns] host time @param field_of_view_deg as it reports it
  void addFrame(std::int64_t arrival_ns, double field_of_view_deg);
  /// A picture that appeared. @param change_ns [ns] host time @param difference mean, from the picture before [grey]
  void addPicture(std::int64_t change_ns, double difference);

  /// @param why in words, where there is no result: a sentence without its full stop
  [[nodiscard]] std::optional<MeasuredDelay> settle(std::string* why) const;

 private:
  struct Frame {
    std::int64_t arrival_ns;
    double field_of_view_deg;
  };
  struct Picture {
    std::int64_t change_ns;
    double difference;
  };
  [[nodiscard]] std::vector<std::int64_t> stepFrames() const;
  [[nodiscard]] std::vector<std::int64_t> stepPictures(std::size_t steps) const;
  [[nodiscard]] double framePeriodNs() const;

  std::vector<Frame> frames_;
  std::vector<Picture> pictures_;
};

}  // namespace xplane_bridge::core
