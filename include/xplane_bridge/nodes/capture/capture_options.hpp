#pragma once

#include <array>
#include <memory>
#include <string>

#include <Eigen/Geometry>

#include "xplane_bridge/core/camera/camera_view.hpp"
#include "xplane_bridge/nodes/base/param_loader.hpp"
#include "xplane_bridge/vision/frame_source.hpp"
#include "xplane_bridge/vision/picture_scaler.hpp"
#include "xplane_bridge/vision/sender_source.hpp"
#include "xplane_bridge/vision/video_source.hpp"
#include "xplane_bridge/vision/x11_window_source.hpp"

namespace xplane_bridge {

/// Parameters of capture_node; config/capture.yaml explains them.
struct CaptureOptions {
  enum class Source {
    kX11,     ///< an X11 window or screen region
    kVideo,   ///< a device, file or stream
    kSender,  ///< what xplane_eye sends
  };
  Source source = Source::kX11;
  vision::X11SourceOptions x11;
  vision::VideoSourceOptions video;
  vision::SenderSourceOptions sender;

  int width = 640;   ///< [px]
  int height = 480;  ///< [px]
  vision::FitMode fit = vision::FitMode::kCrop;
  double max_rate = 30.0;  ///< [1/s], 0: every picture
  int jpeg_quality = 90;   ///< 1..100

  double field_of_view_deg = 60.0;  ///< horizontal, of the whole window; where X-Plane does not say
  bool set_field_of_view = false;   ///< also write it into X-Plane (and restore it)
  bool own_field_of_view = false;   ///< of this window alone: what X-Plane says is of its first one
  /// Rotation of this camera's optical vectors into those of X-Plane's main view.
  Eigen::Quaterniond mount = Eigen::Quaterniond::Identity();
  core::CameraView assumed_view = core::CameraView::kForward;  ///< where X-Plane does not say
  double view_tolerance_deg = 5.0;
  std::array<std::string, 4> frame_ids;   ///< by CameraView; [kUnknown] is not used
  std::string measured_frame;             ///< of the camera's measured pose
  bool nominal_frames = false;            ///< pictures carry `frame_ids` also where the pose is measured
  std::array<double, 3> camera_offset{};  ///< [m] of the camera from base_link, FLU

  double max_wait = 0.2;      ///< [s] longest wait for a picture's state
  double frozen_after = 1.0;  ///< [s] standing picture with a moving state

  /// Puts the shared `frame_prefix` before the cameras' frames.
  void prefixFrames(const std::string& prefix);
};

/// @throws ParamError
CaptureOptions loadCaptureOptions(const ParamLoader& own);

/// The source these options ask for. @throws std::invalid_argument
std::unique_ptr<vision::FrameSource> makeSource(const CaptureOptions& options, vision::Clock clock);

}  // namespace xplane_bridge
