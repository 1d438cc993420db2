#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <ros/publisher.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <std_msgs/Header.h>
#include <std_srvs/Trigger.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_broadcaster.h>
#include <opencv2/core/mat.hpp>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/base/rate_limiter.hpp"
#include "xplane_bridge/core/camera/camera_frustum.hpp"
#include "xplane_bridge/core/camera/camera_history.hpp"
#include "xplane_bridge/core/camera/camera_view.hpp"
#include "xplane_bridge/core/camera/delay_calibration.hpp"
#include "xplane_bridge/core/camera/pose_check.hpp"
#include "xplane_bridge/core/camera/view_stream.hpp"
#include "xplane_bridge/nodes/base/base_node.hpp"
#include "xplane_bridge/nodes/base/latest_worker.hpp"
#include "xplane_bridge/nodes/capture/capture_options.hpp"
#include "xplane_bridge/nodes/capture/image_pairing.hpp"
#include "xplane_bridge/nodes/capture/picture_clock.hpp"
#include "xplane_bridge/vision/picture_checks.hpp"

namespace xplane_bridge {

/// Publishes the cockpit view, and for each picture the state of the frame it shows.
///
/// Publishes camera/image_raw (bgr8), camera/image_raw/compressed (JPEG, ours: there is no other advertiser of it),
/// camera/camera_info, camera/frame_state, the measured camera frame and the three static, nominal ones; subscribes
/// flight_state.
///
/// Threads besides BaseNode's: one reads pictures and does nothing else; one scales, checks and publishes; one encodes
/// JPEG. Each drops, and counts, what it has no time for. Nothing is scaled or encoded without a subscriber.
///
/// In lock-step it is a participant: the simulator draws a frame's picture before it ends the frame, one thread reads,
/// scales and publishes it, and then the frame is answered. Nothing is dropped, and no time of the host's counts.
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
  bool frameReady(const core::LockstepFrame& frame) override;
  void endFrame(const core::LockstepFrame& frame) override;

 private:
  static constexpr const char* kFieldOfViewPurpose = "field_of_view";  ///< of the journal's entry, and its id
  /// [ns] Within so long an xplane_eye reports why it has no pictures, twice a second.
  static constexpr std::int64_t kEyeReportsNs = 1'500'000'000;

  /// A picture on its way from the source to the topics.
  struct Grabbed {
    cv::Mat pixels;                                         // empty where the source has JPEG
    std::shared_ptr<const std::vector<std::uint8_t>> jpeg;  // empty where it has pixels
    cv::Size size;                                          // [px]
    std::optional<vision::ShownFrame> frame;
    std::int64_t display_ns = 0;  // both in the time of pairingNow()
    std::int64_t grab_ns = 0;
    bool display_known = false;
    bool frozen = false;
    std::uint32_t dropped = 0;
  };
  /// What is done for a frame of lock-step.
  enum class FrameStage {
    kReading,     ///< its flight_state has not come
    kDue,         ///< its picture is to be taken
    kNoRenderer,  ///< the simulator draws no pictures
    kSkipped,     ///< it has no flight_state: tx_node waits for no answer
    kDone,        ///< it may be answered
  };

  void captureLoop();
  /// Remembers what a source says of itself; logs a new problem. @param described asking for that costs a round trip
  void noteSource(const vision::FrameSource& source, bool described);
  // Lock-step.
  void requireLockstep(const ParamLoader& own) const;
  void subscribeInLockstep();
  void captureInLockstep();
  /// @return whether the picture that is due was taken and published
  bool takeFramePicture(vision::FrameSource* source, cv::Mat* pixels);
  /// Reads off what has come whether the frame has a state, and a picture.
  FrameStage beginPicture(const core::LockstepFrame& frame);
  void sayWhatIsMissing(const std::string& what);
  void takePicture(vision::FrameSource* source, const vision::Change& change);
  void repeatFrozen(std::int64_t now_ns);
  void publishPicture(Grabbed* grabbed);
  /// [ns] by the clock that pictures are paired by: the host's, also where stamps are the simulator's
  /// (`publish_clock`); in lock-step the frames'.
  std::int64_t pairingNow() const { return lockstep() ? clock().system_ns() : picture_clock_.now(); }
  /// [ns] a time of that clock as it is published.
  std::int64_t published(std::int64_t time_ns) const;
  std::int64_t stampOfPicture(std::int64_t shown_ns);
  bool decode(Grabbed* grabbed, bool whole);
  sensor_msgs::ImagePtr takeMessage();
  void encodeJpeg(const sensor_msgs::Image& image);
  void publishJpeg(const std_msgs::Header& header, const std::vector<std::uint8_t>& jpeg);
  bool hasSubscribers() const;
  /// The camera of the frame that a picture shows, as far as X-Plane says. @param shown_ns [ns] by pairingNow()'s clock
  core::FrameCamera cameraOf(std::int64_t shown_ns, const std::optional<vision::ShownFrame>& frame) const;
  core::Frustum frustumOf(const core::FrustumSample& sample) const;
  sensor_msgs::CameraInfo cameraInfo(const std_msgs::Header& header, cv::Size source,
                                     const vision::FieldOfView& shown) const;
  void describeCamera(const core::FrameCamera& camera, FrameState* state) const;
  void broadcastFrames();
  void publishFrameState(const FrameState& state);
  void subscribeFrustumShift(core::SimulatorVersion version);
  void onView(const core::RrefView& datagram, const core::ReceiveInfo& info);
  void onLinkState(const core::LinkStatus& status);
  void onState(const FlightState::ConstPtr& state);
  void changeFieldOfView();
  /// Writes the user's own field of view into the journal. @param shown [deg] by X-Plane, that where no entry has it
  void recordFieldOfView(float shown);
  /// Gives back what this node has noted, but what another node still holds, and takes it out of the journal.
  void giveNotedBack(double timeout_s);

  // Calibration: service's thread, but for lookForStep() (capture) and restoreFieldOfView() (timer).
  /// Who records the pictures, a clause; empty: no node does.
  [[nodiscard]] std::string recording() const;
  void serveCalibration(std_srvs::TriggerResponse* response);
  /// @throws std::runtime_error with a sentence for people
  core::MeasuredDelay calibrate();
  /// The same by xplane_eye, which sends the delay with its pictures. @return what it says of it
  /// @throws std::runtime_error with a sentence for people
  std::string calibrateSender();
  /// @throws std::runtime_error with a sentence for people
  void refuseWhileRecorded() const;
  /// @return why it did not come to its end; empty: it did
  std::string stepFieldOfView(double own, double other);
  /// X-Plane's field of view as it shows it [deg], once it stands. @throws std::runtime_error where it may not be
  /// changed, with a sentence for people
  double fieldOfViewToChange();
  /// @return whether a new entry was made
  bool noteFieldOfView(double shown);
  void giveFieldOfViewBack(double own, bool noted);
  void lookForStep(vision::FrameSource* source, const vision::Change& change);
  /// What a killed node has left.
  void restoreFieldOfView();
  void diagnoseCapture(diagnostic_updater::DiagnosticStatusWrapper* status);
  void diagnosePairing(diagnostic_updater::DiagnosticStatusWrapper* status);
  cv::Mat takeBuffer();
  void giveBuffer(cv::Mat buffer);

  CaptureOptions options_;
  PictureClock picture_clock_{wallClock()};
  std::unique_ptr<vision::PictureScaler> scaler_;
  std::unique_ptr<ImagePairing> pairing_;
  std::unique_ptr<tf2_ros::StaticTransformBroadcaster> static_frames_;
  std::unique_ptr<tf2_ros::TransformBroadcaster> measured_frame_;

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
  core::PoseCheck pose_check_;
  std::uint32_t link_epoch_ = 0;

  mutable std::mutex camera_mutex_;
  bool camera_known_ = false;
  double field_of_view_deg_ = 0.0;           // horizontal, of the newest frame
  std::int64_t field_of_view_since_ns_ = 0;  // when a frame first had it
  std::int64_t field_of_view_heard_ns_ = 0;  // when the newest frame came
  std::string pose_report_;
  double lever_scatter_ = 0.0;  // [m]
  double frustum_shift_up_ = std::numeric_limits<double>::quiet_NaN();

  // Capture thread, and who asks it.
  mutable std::mutex capture_mutex_;
  std::string source_description_;
  std::string source_problem_;
  vision::FrozenCheck frozen_check_;
  vision::StandingCheck standing_check_{500'000'000};  // capture's thread
  vision::PeriodMeter periods_;
  FlightState::ConstPtr moved_from_;
  bool frozen_ = false;
  bool crashed_ = false;
  bool black_ = false;
  std::uint64_t changes_ = 0;
  std::uint64_t grabbed_ = 0;
  std::uint32_t skipped_ = 0;
  double grab_age_sum_ = 0.0;  // [s] display to grab, since the last report
  double grab_age_max_ = 0.0;
  std::uint32_t grab_ages_ = 0;
  std::uint32_t dropped_ = 0;
  std::vector<double> reads_;           // [s] how long reading took, since the last report
  core::DelayCalibration calibration_;  // while `calibrating_`
  cv::Mat step_before_;                 // the picture before, small and grey
  std::atomic<bool> calibrating_{false};
  std::shared_ptr<vision::SenderCalibration> sender_calibration_ = std::make_shared<vision::SenderCalibration>();
  std::atomic<bool> field_of_view_left_{false};  // a killed node's may have to be given back

  std::string logged_problem_;  // capture thread only
  Grabbed last_;                // capture thread only: for repeating a frozen picture
  std::int64_t frozen_sent_ns_ = 0;
  core::RateLimiter limiter_;

  std::mutex buffers_mutex_;
  std::vector<cv::Mat> buffers_;

  // Publisher thread only.
  std::vector<sensor_msgs::ImagePtr>
      messages_;  // used again once no publisher holds them: memory once touched is cheap
  std::uint32_t image_count_ = 0;
  std::int64_t last_stamp_ns_ = 0;  // with `publish_clock`
  std::uint32_t frozen_count_ = 0;

  // Lock-step.
  ros::Publisher done_publisher_;
  bool listens_ = false;    // frame 0 is answered; of the link's thread
  std::mutex frame_mutex_;  // guards the following
  core::ClockCondition frame_changed_;
  std::deque<FlightState::ConstPtr> states_;     // of frames that were not begun
  std::deque<std_msgs::HeaderConstPtr> reader_;  // rx_node's answers to them
  std::uint32_t frame_ = 0;
  FrameStage frame_stage_ = FrameStage::kDone;
  float frame_key_ = 0.0F;  // [s] the frame's raw simulator time

  core::AssociationCounters reported_;  // diagnostics only: as of the last report

  // Last: they end first.
  core::Subscription frustum_shift_subscription_;
  core::Subscription view_subscription_;
};

}  // namespace xplane_bridge
