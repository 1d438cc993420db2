/// CaptureNode's camera: where it is, what it shows, and the field of view it is given.

#include <algorithm>
#include <limits>
#include <vector>

#include <geometry_msgs/TransformStamped.h>
#include <sensor_msgs/distortion_models.h>

#include "xplane_bridge/nodes/capture/capture_node.hpp"
#include "xplane_bridge/nodes/messages/conversions.hpp"

namespace xplane_bridge {
namespace {

constexpr double kFieldOfViewTimeout = 2.0;  // [s]

geometry_msgs::Transform nominalPose(core::CameraView view, const CaptureOptions& options) {
  const auto& offset = options.camera_offset;
  return toTransform(core::opticalOrientation(view), {offset[0], offset[1], offset[2]});
}

}  // namespace

// --- frames ----------------------------------------------------------------------------------------------------------

void CaptureNode::broadcastFrames() {
  std::vector<geometry_msgs::TransformStamped> frames;
  for (const core::CameraView view : {core::CameraView::kForward, core::CameraView::kRear, core::CameraView::kDown}) {
    geometry_msgs::TransformStamped frame;
    frame.header.stamp = stampNow();
    frame.header.frame_id = common().frames.base_link;
    frame.child_frame_id = options_.frame_ids[static_cast<std::size_t>(view)];
    frame.transform = nominalPose(view, options_);
    frames.push_back(frame);
  }
  static_frames_ = std::make_unique<tf2_ros::StaticTransformBroadcaster>();
  static_frames_->sendTransform(frames);
}

void CaptureNode::publishFrameState(const FrameState& state) {
  frame_state_publisher_.publish(state);
  if (state.camera_pose_source != FrameState::POSE_MEASURED) return;
  geometry_msgs::TransformStamped frame;
  frame.header.stamp = state.header.stamp;
  frame.header.frame_id = common().frames.base_link;
  frame.child_frame_id = options_.measured_frame;
  frame.transform = state.body_to_camera;
  measured_frame_->sendTransform(frame);
}

// --- X-Plane ---------------------------------------------------------------------------------------------------------

void CaptureNode::onView(const core::RrefView& datagram, const core::ReceiveInfo& info) {
  // One thread is in here, the link's: the stream needs no lock.
  if (held()) return;  // no flight yet, and sent by wall time
  const std::int64_t receive_ns = lockstep() ? pairingNow() : picture_clock_.received(info.stamp_ns);
  if (!view_stream_.add(datagram, receive_ns)) return;
  if (calibrating_) {
    const std::lock_guard<std::mutex> lock(capture_mutex_);
    calibration_.addFrame(view_stream_.receiveTime(), view_stream_.frustum().horizontal_deg);
  }
  auto pose = pose_check_.add(view_stream_.camera());
  if (pose) pose->pose.orientation = pose->pose.orientation * options_.mount;
  core::FrameCamera camera;
  camera.external = view_stream_.camera().external;
  camera.pose = pose;
  if (pose && !camera.external) {
    camera.view = core::classifyView(pose->pose.orientation, options_.view_tolerance_deg);
  }
  core::FrustumSample frustum = view_stream_.frustum();
  {
    const std::lock_guard<std::mutex> lock(camera_mutex_);
    if (!camera_known_ || frustum.horizontal_deg != field_of_view_deg_) field_of_view_since_ns_ = receive_ns;
    camera_known_ = true;
    field_of_view_deg_ = frustum.horizontal_deg;
    field_of_view_heard_ns_ = receive_ns;
    frustum.shift_up = frustum_shift_up_;
    camera.frustum = frustumOf(frustum);
    pose_report_ = pose ? pose_check_.report() : "X-Plane does not answer";
    lever_scatter_ = pose_check_.leverScatter();
  }
  pairing_->addCamera(view_stream_.receiveTime(), view_stream_.camera().sim_time, camera);
  pairing_->addFrame(view_stream_.status(), view_stream_.simulatedFramePeriod(), view_stream_.receiveTime());
}

void CaptureNode::onLinkState(const core::LinkStatus& status) {
  const bool known = status.state != core::LinkState::kSearching && status.state != core::LinkState::kLost;
  if (!known) {
    const std::lock_guard<std::mutex> lock(camera_mutex_);
    camera_known_ = false;
  }
  if (status.epoch == link_epoch_) return;
  link_epoch_ = status.epoch;
  view_stream_.reset();
  pose_check_.reset();
  pairing_->forgetClock();
  subscribeFrustumShift(status.version);
  if (known && options_.set_field_of_view) changeFieldOfView();
  if (known) field_of_view_left_ = true;
}

void CaptureNode::subscribeFrustumShift(core::SimulatorVersion version) {
  frustum_shift_subscription_ = {};
  {
    const std::lock_guard<std::mutex> lock(camera_mutex_);
    frustum_shift_up_ = std::numeric_limits<double>::quiet_NaN();
  }
  if (version.number < core::kFirstWithFrustumShiftUp) return;
  core::RrefGroup group;
  group.name = "frustum";
  group.datarefs = {core::kFrustumShiftUpDataref};
  frustum_shift_subscription_ =
      link().subscribe(group, [this](const core::RrefView& datagram, const core::ReceiveInfo&) {
        const std::lock_guard<std::mutex> lock(camera_mutex_);
        if (datagram.size() > 0) frustum_shift_up_ = static_cast<double>(datagram[0].value);
      });
}

void CaptureNode::changeFieldOfView() {
  const std::string path = view_stream_.fieldOfViewDataref();
  link().read({path}, kFieldOfViewTimeout, [this, path](const std::vector<core::DatarefValue>& values) {
    if (!values.front().has_value()) {
      ROS_ERROR("X-Plane did not say its field of view within %.1f s; it is left as it is", kFieldOfViewTimeout);
      return;
    }
    try {
      recordFieldOfView(*values.front());
      link().write(path, static_cast<float>(options_.field_of_view_deg));
    } catch (const core::JournalError& error) {
      ROS_ERROR("X-Plane's field of view is left as it is, because it could not be restored later: %s", error.what());
    }
  });
}

void CaptureNode::recordFieldOfView(float shown) {
  const std::shared_ptr<core::Journal> journal = link().journal();
  const std::string& path = view_stream_.fieldOfViewDataref();
  // What a crashed run has left, or tx_node's set_view has asked for, is not the user's own value.
  const float before = core::valueBefore(journal->entries(), path).value_or(shown);
  journal->record(kFieldOfViewPurpose, kFieldOfViewPurpose, {core::UndoDref{path, before}});
}

void CaptureNode::giveNotedBack(double timeout_s) {
  const std::shared_ptr<core::Journal> journal = link().journal();
  const auto entry = core::ownEntry(*journal, kFieldOfViewPurpose);
  if (!entry) return;
  if (link().undo(journal->handOver(entry->id), timeout_s)) journal->removeUndone({*entry});
}

void CaptureNode::undo(const Deadline& deadline) {
  if (!link().journal()) return;
  try {
    giveNotedBack(std::max(deadline.left(), 0.1));
  } catch (const core::JournalError& error) {
    ROS_ERROR("X-Plane's field of view may not be restored: %s", error.what());
  }
}

core::Frustum CaptureNode::frustumOf(const core::FrustumSample& sample) const {
  if (!options_.own_field_of_view) return core::frustumOf(sample, options_.field_of_view_deg);
  core::Frustum own = core::frustumOf(core::FrustumSample(), options_.field_of_view_deg);
  own.known = true;
  return own;
}

core::FrameCamera CaptureNode::cameraOf(std::int64_t shown_ns, const std::optional<vision::ShownFrame>& frame) const {
  bool known = false;
  {
    const std::lock_guard<std::mutex> lock(camera_mutex_);
    known = camera_known_;
  }
  core::FrameCamera unknown;
  unknown.frustum = frustumOf(core::FrustumSample());
  if (!known) return unknown;
  core::FrameCamera camera =
      (frame.has_value() ? pairing_->cameraOf(shown_ns, frame->sim_time, frame->delay) : pairing_->cameraOf(shown_ns))
          .value_or(unknown);
  // A field of view of the window's own is the same in all frames, heard or not.
  if (options_.own_field_of_view) camera.frustum = unknown.frustum;
  return camera;
}

void CaptureNode::describeCamera(const core::FrameCamera& camera, FrameState* state) const {
  const core::CameraView nominal = camera.view == core::CameraView::kUnknown ? options_.assumed_view : camera.view;
  const bool measured = camera.pose.has_value() && !options_.nominal_frames;
  state->header.frame_id = measured ? options_.measured_frame : options_.frame_ids[static_cast<std::size_t>(nominal)];
  state->view = static_cast<std::uint8_t>(camera.view);
  if (!measured && camera.view == core::CameraView::kUnknown) state->quality |= FrameState::QUALITY_VIEW_UNKNOWN;
  if (camera.external) state->quality |= FrameState::QUALITY_EXTERNAL_VIEW;
  if (!camera.frustum.known) state->quality |= FrameState::QUALITY_FOV_ASSUMED;
  if (camera.pose) {
    setPose(*camera.pose, state);
    return;
  }
  state->camera_pose_source = FrameState::POSE_NOMINAL;
  state->body_to_camera = nominalPose(nominal, options_);
  state->camera_pose_uncertainty = state->camera_pose_uncertainty_deg = std::numeric_limits<float>::quiet_NaN();
}

// --- what a picture carries ------------------------------------------------------------------------------------------

sensor_msgs::CameraInfo CaptureNode::cameraInfo(const std_msgs::Header& header, cv::Size source,
                                                const vision::FieldOfView& shown) const {
  const vision::Intrinsics camera = scaler_->intrinsics(source, shown);
  sensor_msgs::CameraInfo info;
  info.header = header;
  info.width = static_cast<std::uint32_t>(options_.width);
  info.height = static_cast<std::uint32_t>(options_.height);
  info.distortion_model = sensor_msgs::distortion_models::PLUMB_BOB;
  info.D.assign(5, 0.0);
  info.K = {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0};
  info.R = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  info.P = {camera.fx, 0.0, camera.cx, 0.0, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0};
  return info;
}

}  // namespace xplane_bridge
