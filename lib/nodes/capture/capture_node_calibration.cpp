/// CaptureNode measures the delay of the display, on request: steps of X-Plane's field of view, seen in the pictures.

#include <cmath>
#include <cstdio>
#include <random>
#include <stdexcept>

#include <ros/master.h>
#include <ros/names.h>
#include <ros/this_node.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "xplane_bridge/nodes/capture/capture_node.hpp"
#include "xplane_bridge/nodes/capture/picture_recorders.hpp"

namespace xplane_bridge {
namespace {

// [s]
constexpr double kSettle = 0.7;
constexpr double kShortestStep = 0.15;
constexpr double kLongestStep = 0.3;
constexpr double kStands = 2.0 * kLongestStep;  // a field of view that is no step: the eye's steps are no longer
constexpr double kStandsWithin = 2.0 * kStands;
constexpr double kUndoTimeout = 2.0;
constexpr double kSenderAnswers = 30.0;  // with what it may have to wait for X-Plane to take its field of view back

/// Who records one of these topics, or of another camera's: a clause; empty: no node does.
std::string recordingOf(const std::vector<std::string>& topics) {
  XmlRpc::XmlRpcValue request, response, state;
  request[0] = ros::this_node::getName();
  if (!ros::master::execute("getSystemState", request, response, state, false)) {
    return "the roscore does not say who records the pictures";
  }
  // A further camera's states are those of its bridge, by a remapping.
  const std::string bridge = ros::names::parentNamespace(ros::names::resolve("flight_state"));
  XmlRpc::XmlRpcValue& subscribers = state[1];
  for (int i = 0; i < subscribers.size(); ++i) {
    const std::string topic = subscribers[i][0];
    if (!isOfBridge(topic, topics, bridge)) continue;
    XmlRpc::XmlRpcValue& nodes = subscribers[i][1];
    for (int k = 0; k < nodes.size(); ++k) {
      std::string node = nodes[k];
      if (isRecorder(node)) return node + " records the pictures";
    }
  }
  return "";
}

}  // namespace

std::string CaptureNode::recording() const {
  return recordingOf({image_publisher_.getTopic(), jpeg_publisher_.getTopic(), info_publisher_.getTopic(),
                      frame_state_publisher_.getTopic()});
}

void CaptureNode::serveCalibration(std_srvs::TriggerResponse* response) {
  try {
    if (options_.source == CaptureOptions::Source::kSender) {
      response->message = calibrateSender();
      response->success = 1;
      ROS_INFO("display delay measured by xplane_eye: %s", response->message.c_str());
      return;
    }
    const core::MeasuredDelay found = calibrate();
    pairing_->setDisplayDelay(found.delay);
    char text[160];
    std::snprintf(
        text, sizeof text,
        "%.4f s, from %d steps that lie %.1f ms from it; in use until the node ends, display_delay:=%.4f keeps "
        "it",
        found.delay, found.steps, 1e3 * found.spread, core::delayToKeep(found.delay));
    response->success = 1;
    response->message = text;
    ROS_INFO("display delay measured: %s", text);
  } catch (const std::exception& error) {
    response->success = 0;
    response->message = error.what();
    ROS_WARN("display delay not measured: %s", error.what());
  }
}

core::MeasuredDelay CaptureNode::calibrate() {
  if (lockstep()) throw std::runtime_error("there is no delay to measure in lock-step: a frame ends with its picture");
  if (options_.source != CaptureOptions::Source::kX11) {
    throw std::runtime_error(
        "the pictures come from a video: expected source x11 or sender (estimate_latency measures the "
        "delay of a video)");
  }
  if (options_.own_field_of_view) {
    throw std::runtime_error(
        "this window has a field of view of its own, which does not follow X-Plane's: measure the delay "
        "with estimate_latency --camera, or set own_field_of_view to false");
  }
  if (options_.x11.change_detection == vision::ChangeDetection::kNone) {
    throw std::runtime_error(
        "with window/change_detection none it is not known when the window changes: expected auto, damage or checksum");
  }
  refuseWhileRecorded();
  const double own = fieldOfViewToChange();
  {
    const std::lock_guard<std::mutex> lock(capture_mutex_);
    if (!source_problem_.empty()) throw std::runtime_error("no picture: " + source_problem_);
    calibration_ = core::DelayCalibration();
    step_before_.release();
    calibrating_ = true;
  }
  const bool higher = own + core::DelayCalibration::kStepDeg <= core::DelayCalibration::kWidestDeg;
  const double other = own + (higher ? 1.0 : -1.0) * core::DelayCalibration::kStepDeg;
  std::string why;
  try {
    const bool noted = noteFieldOfView(own);
    why = stepFieldOfView(own, other);
    giveFieldOfViewBack(own, noted);
  } catch (...) {
    calibrating_ = false;
    throw;
  }
  const std::lock_guard<std::mutex> lock(capture_mutex_);
  calibrating_ = false;
  if (!why.empty()) throw std::runtime_error(why);
  const auto found = calibration_.settle(&why);
  if (!found.has_value()) throw std::runtime_error(why);
  return *found;
}

std::string CaptureNode::calibrateSender() {
  refuseWhileRecorded();
  // Changed and given back by xplane_eye: in the journal, so that meanwhile no other node of this X-Plane takes a step
  // for the user's own value, or measures as well.
  const bool noted = noteFieldOfView(fieldOfViewToChange());
  calibrating_ = true;  // pictures of the steps are not published, and none for seconds is no frozen view
  const std::uint64_t number = sender_calibration_->ask();
  std::optional<vision::CalibrationAnswer> answer;
  const auto answered = [this, number, &answer] {
    answer = sender_calibration_->answer(number);
    return answer.has_value() || stopping();
  };
  link().waitUntil(answered, kSenderAnswers);
  {
    const std::lock_guard<std::mutex> lock(capture_mutex_);
    frozen_check_.beginAnew(pairingNow() + kEyeReportsNs);
    calibrating_ = false;
  }
  // Not what the eye has seen before its steps, where the node that changed it has ended meanwhile.
  if (noted) giveNotedBack(kUndoTimeout);
  if (!answer.has_value()) {
    if (stopping()) throw std::runtime_error("the node is stopping");
    const std::lock_guard<std::mutex> lock(capture_mutex_);
    throw std::runtime_error("xplane_eye has not answered in 30 s; " +
                             (source_problem_.empty() ? "it sends pictures: call again" : source_problem_));
  }
  if (!answer->measured) throw std::runtime_error(answer->text);
  return answer->text;
}

void CaptureNode::refuseWhileRecorded() const {
  const std::string who = recording();
  if (!who.empty()) {
    throw std::runtime_error(who + ", and the field of view would change in them: call it before or after a recording");
  }
}

double CaptureNode::fieldOfViewToChange() {
  double own = std::numeric_limits<double>::quiet_NaN();
  // An eye's measurement at its start is in no journal: a step of it is not the user's own.
  const auto stands = [this, &own] {
    const std::lock_guard<std::mutex> lock(camera_mutex_);
    own = camera_known_ ? field_of_view_deg_ : std::numeric_limits<double>::quiet_NaN();
    return stopping() || !std::isfinite(own) ||
           core::toSeconds(field_of_view_heard_ns_ - field_of_view_since_ns_) >= kStands;
  };
  const bool stood = link().waitUntil(stands, kStandsWithin);
  if (stopping()) throw std::runtime_error("the node is stopping");
  if (!std::isfinite(own)) {
    throw std::runtime_error("X-Plane does not say its field of view: is it heard (link_state)?");
  }
  if (!stood) {
    throw std::runtime_error(
        "X-Plane's field of view does not stand still: another camera or an xplane_eye measures its delay, or it is "
        "being changed: call again when it stands");
  }
  if (!options_.set_field_of_view && !link().journal()->orphans(kFieldOfViewPurpose).empty()) {
    throw std::runtime_error(
        "the field of view that a killed node has left changed is not given back yet: call again, or run "
        "release_overrides if that does not help");
  }
  return own;
}

std::string CaptureNode::stepFieldOfView(double own, double other) {
  const std::string& path = view_stream_.fieldOfViewDataref();
  std::mt19937 random{std::random_device{}()};
  std::uniform_real_distribution<double> pause(kShortestStep, kLongestStep);
  const auto wait = [this](double seconds) { return !link().waitUntil([this] { return stopping(); }, seconds); };
  if (!wait(kSettle)) return "the node is stopping";
  for (int step = 0; step < core::DelayCalibration::kSteps; ++step) {
    link().write(path, static_cast<float>(step % 2 == 0 ? other : own));
    if (!wait(pause(random))) return "the node is stopping";
  }
  return wait(kSettle) ? "" : "the node is stopping";
}

bool CaptureNode::noteFieldOfView(double shown) {
  if (core::ownEntry(*link().journal(), kFieldOfViewPurpose)) return false;  // the user's own is noted already
  try {
    recordFieldOfView(static_cast<float>(shown));
  } catch (const core::JournalTakenError& error) {
    throw std::runtime_error(std::string("another camera measures its delay, or has set_field_of_view: ") +
                             error.what() + ", or call again when it has measured");
  }
  return true;
}

void CaptureNode::giveFieldOfViewBack(double own, bool noted) {
  // What was seen before the steps is the user's own only where no other node had changed it, which may have ended.
  std::vector<core::UndoOperation> back;
  if (noted) back = link().journal()->handOver(kFieldOfViewPurpose);
  const bool is_noted = !back.empty();
  if (!is_noted) back.emplace_back(core::UndoDref{view_stream_.fieldOfViewDataref(), static_cast<float>(own)});
  if (!link().undo(back, kUndoTimeout)) {
    throw std::runtime_error(
        "X-Plane does not take its field of view back; it stays noted for the node's end and the next start");
  }
  if (is_noted) link().journal()->remove({kFieldOfViewPurpose});
}

void CaptureNode::lookForStep(vision::FrameSource* source, const vision::Change& change) {
  vision::Picture picture;
  if (source->grab(change, picture) != vision::GrabResult::kNew || picture.bgr.empty()) return;
  cv::Mat small, grey, difference;
  cv::resize(picture.bgr, small, {80, 56}, 0.0, 0.0, cv::INTER_AREA);
  cv::extractChannel(small, grey, 1);
  const std::lock_guard<std::mutex> lock(capture_mutex_);
  frozen_check_.pictureChanged();
  ++skipped_;
  if (!step_before_.empty() && picture.display_time_known) {
    cv::absdiff(grey, step_before_, difference);
    calibration_.addPicture(picture.display_time_ns, cv::mean(difference)[0]);
  }
  step_before_ = grey;
}

void CaptureNode::restoreFieldOfView() {
  if (!field_of_view_left_.exchange(false) || options_.set_field_of_view || !link().journal()) return;
  try {
    const std::vector<core::JournalEntry> left = link().journal()->orphans(kFieldOfViewPurpose);
    std::vector<core::JournalEntry> undone;
    for (const core::JournalEntry& entry : left) {
      if (link().undo(entry.undo, kUndoTimeout)) undone.push_back(entry);
    }
    if (!undone.empty()) ROS_INFO("X-Plane's field of view, which a killed node had left changed, is given back");
    link().journal()->removeUndone(undone);
  } catch (const core::JournalError& error) {
    ROS_ERROR("what a killed node has left of X-Plane's field of view is not known: %s", error.what());
  }
}

}  // namespace xplane_bridge
