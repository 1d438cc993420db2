#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <ros/publisher.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <opencv2/core/mat.hpp>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/base/rate_limiter.hpp"
#include "xplane_bridge/core/camera/camera_view.hpp"
#include "xplane_bridge/core/state/clock_filter.hpp"
#include "xplane_bridge/nodes/base/base_node.hpp"
#include "xplane_bridge/nodes/base/latest_worker.hpp"
#include "xplane_bridge/nodes/capture/capture_options.hpp"
#include "xplane_bridge/nodes/capture/image_pairing.hpp"
#include "xplane_bridge/vision/picture_checks.hpp"

namespace xplane_bridge {

/// Publishes the cockpit view, and for each picture the state of the frame it shows.
///
/// Publishes camera/image_raw (bgr8), camera/image_raw/compressed (JPEG, ours: there is no other advertiser of it),
/// camera/camera_info, camera/frame_state, and the three static camera frames; subscribes flight_state.
///
/// Threads besides BaseNode's: one reads pictures and does nothing else; one scales, checks and publishes; one encodes
/// JPEG. Each drops, and counts, what it has no time for. Nothing is scaled or encoded while nobody listens.
class CaptureNode : public BaseNode {
 public:
  CaptureNode();
  ~CaptureNode() override;

 protected:
  void loadParameters(const ParamLoader& own) override;
  void advertise() override;
  void subscribe() override;
  core::SimLinkCallbacks linkCallbacks() override;
  void start() override;
  void stopInputs() override;
  void undo(const Deadline& deadline) override;
  void joinThreads() override;

 private:
  /// A picture on its way from the source to the topics.
  struct Grabbed {
    cv::Mat pixels;
    std::int64_t display_ns = 0;
    std::int64_t grab_ns = 0;
    bool display_known = false;
    bool frozen = false;
    std::uint32_t dropped = 0;
  };
  /// What the camera is, as far as X-Plane says.
  struct CameraFacts {
    core::CameraView view = core::CameraView::kUnknown;
    bool external = false;
    double field_of_view_deg = 0.0;
    bool field_of_view_read = false;
  };

  void captureLoop();
  void takePicture(vision::FrameSource* source, const vision::Change& change);
  void repeatFrozen(std::int64_t now_ns);
  void publishPicture(Grabbed* grabbed);
  sensor_msgs::ImagePtr takeMessage();
  void publishJpeg(const sensor_msgs::Image& image);
  bool anybodyListens() const;
  CameraFacts cameraFacts() const;
  sensor_msgs::CameraInfo cameraInfo(const std_msgs::Header& header, cv::Size source, double field_of_view_deg) const;
  void broadcastFrames();
  void onView(const core::RrefView& datagram, const core::ReceiveInfo& info);
  void onLinkState(const core::LinkStatus& status);
  void onState(const FlightState::ConstPtr& state);
  void changeFieldOfView();
  void diagnoseCapture(diagnostic_updater::DiagnosticStatusWrapper* status);
  void diagnosePairing(diagnostic_updater::DiagnosticStatusWrapper* status);
  cv::Mat takeBuffer();
  void giveBuffer(cv::Mat buffer);

  CaptureOptions options_;
  std::unique_ptr<vision::PictureScaler> scaler_;
  std::unique_ptr<ImagePairing> pairing_;
  std::unique_ptr<tf2_ros::StaticTransformBroadcaster> static_frames_;

  ros::Publisher image_publisher_;
  ros::Publisher jpeg_publisher_;
  ros::Publisher info_publisher_;
  ros::Publisher frame_state_publisher_;

  std::atomic<bool> stop_{false};
  std::thread capture_thread_;
  std::unique_ptr<LatestWorker<Grabbed>> publisher_;
  std::unique_ptr<LatestWorker<sensor_msgs::ImageConstPtr>> encoder_;

  // Link's thread.
  core::ViewStream view_stream_;
  core::ReceiveClock receive_clock_;
  std::uint32_t link_epoch_ = 0;

  mutable std::mutex camera_mutex_;
  bool camera_known_ = false;
  core::SimStatus camera_status_;

  // Capture thread, and who asks it.
  mutable std::mutex capture_mutex_;
  std::string source_description_;
  std::string source_problem_;
  vision::FrozenCheck frozen_check_;
  FlightState::ConstPtr moved_from_;
  bool frozen_ = false;
  bool black_ = false;
  std::uint64_t changes_ = 0;
  std::uint64_t grabbed_ = 0;
  std::uint32_t skipped_ = 0;
  double grab_age_sum_ = 0.0;  // [s] display to grab, since the last report
  double grab_age_max_ = 0.0;
  std::uint32_t grab_ages_ = 0;
  std::uint32_t dropped_ = 0;

  cv::Mat last_pixels_;  // capture thread only: for repeating a frozen picture
  std::int64_t frozen_sent_ns_ = 0;
  core::RateLimiter limiter_;

  std::mutex buffers_mutex_;
  std::vector<cv::Mat> buffers_;

  // Publisher thread only.
  std::vector<sensor_msgs::ImagePtr> messages_;  // used again once nobody else holds them: memory once touched is cheap
  std::uint32_t image_count_ = 0;
  std::uint32_t frozen_count_ = 0;

  core::AssociationCounters reported_;  // diagnostics only: as of the last report

  core::Subscription view_subscription_;  // last: it ends first
};

}  // namespace xplane_bridge
