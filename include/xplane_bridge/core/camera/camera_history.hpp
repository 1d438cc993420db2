#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "xplane_bridge/core/base/message_constants.hpp"
#include "xplane_bridge/core/camera/camera_frustum.hpp"
#include "xplane_bridge/core/camera/pose_check.hpp"

namespace xplane_bridge::core {

/// What X-Plane says of its camera in one frame.
struct FrameCamera {
  CameraView view = CameraView::kUnknown;
  bool external = false;  ///< the camera is outside the aircraft
  Frustum frustum;
  std::optional<CheckedPose> pose;
};

/// The camera of the latest frames: a picture is seen long after its frame, and the camera may have changed since.
///
/// One thread calls.
class CameraHistory {
 public:
  /// Takes a frame, in order.
  /// @param receive_ns [ns] host time at which the frame was heard
  /// @param sim_time [s] raw simulator time of the frame
  void add(std::int64_t receive_ns, double sim_time, const FrameCamera& camera);
  /// Forgets everything, as when X-Plane is not heard any more.
  void clear() { frames_.clear(); }

  /// The camera of the frame with this raw simulator time [s]; nothing where that was not heard. All frames of a pause
  /// have the same: of several, the one heard nearest to a host time [ns], and what changes about then is not sure.
  [[nodiscard]] std::optional<FrameCamera> ofFrame(double sim_time, std::int64_t moment_ns) const;
  /// The newest pose of the frame with this raw simulator time [s], which may have come with another frame.
  [[nodiscard]] std::optional<CheckedPose> poseOf(double sim_time) const;
  /// The camera of the frame heard nearest to a host time [ns], which may be its neighbour: where the frustums differ
  /// there, it is not known, and the camera is external if it is in one of them. Nothing before the first frame.
  [[nodiscard]] std::optional<FrameCamera> at(std::int64_t moment_ns) const;

 private:
  struct Heard {
    std::int64_t receive_ns;
    double sim_time;
    FrameCamera camera;
  };
  std::deque<Heard> frames_;
};

}  // namespace xplane_bridge::core
