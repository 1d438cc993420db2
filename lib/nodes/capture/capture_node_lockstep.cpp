/// CaptureNode in lock-step: the picture of each frame that the simulator's window shows, and the answer to the frame.

#include <sys/prctl.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "xplane_bridge/core/base/node_name.hpp"
#include "xplane_bridge/nodes/capture/capture_node.hpp"

namespace xplane_bridge {
namespace {

using FrameLock = std::unique_lock<std::mutex>;

constexpr double kLookPeriod = 0.05;  // [s] between looks at the window while no picture is due
constexpr std::chrono::milliseconds kWindowWait{50};

/// Leaves out what belongs to frames before that of this stamp.
template <class Messages, class Stamp>
void dropBefore(const ros::Time& stamp, const Stamp& stamp_of, Messages* messages) {
  while (!messages->empty() && stamp_of(*messages->front()) < stamp) messages->pop_front();
}

}  // namespace

void CaptureNode::requireLockstep(const ParamLoader& own) const {
  const auto& named = common().lockstep.participants;
  if (std::none_of(named.begin(), named.end(), [this](const auto& each) { return core::isNamed(name(), each); })) {
    throw ParamError("parameter lockstep/participants does not name " + name() +
                     ": expected it there, because a frame waits for its picture; or start the bridge with "
                     "capture:=false");
  }
  if (options_.source != CaptureOptions::Source::kX11) {
    own.refuse("source", "x11 with lockstep/enabled: frames do not wait for pictures of a sender or a video");
  }
  if (options_.set_field_of_view) {
    own.refuse("set_field_of_view", "false with lockstep/enabled: it would be set by the host's time");
  }
}

void CaptureNode::subscribeInLockstep() {
  done_publisher_ = advertiseTopic<std_msgs::Header>(kLockstepDoneTopic, 1, true);
  subscribeTopic<FlightState>("flight_state", kLockstepQueue, [this](const FlightState::ConstPtr& state) {
    {
      const FrameLock lock(frame_mutex_);
      states_.push_back(state);
    }
    askFrameReady();
  });
  subscribeEvents<std_msgs::Header>(kLockstepDoneTopic, kLockstepQueue,
                                    [this](const ros::MessageEvent<const std_msgs::Header>& event) {
                                      const auto& done = event.getConstMessage();
                                      if (!core::isNamed(event.getPublisherName(), kLockstepReader)) return;
                                      if (done->frame_id == kLockstepFrame0) return;
                                      {
                                        const FrameLock lock(frame_mutex_);
                                        reader_.push_back(done);
                                      }
                                      askFrameReady();
                                    });
}

bool CaptureNode::frameReady(const core::LockstepFrame& frame) {
  if (frame.number == 0) return true;
  FrameStage before{}, now{};
  {
    const FrameLock lock(frame_mutex_);
    if (frame_ != frame.number) {
      frame_ = frame.number;
      frame_stage_ = FrameStage::kReading;
    }
    before = frame_stage_;
    if (before == FrameStage::kReading) frame_stage_ = beginPicture(frame);
    now = frame_stage_;
  }
  if (now != before && now == FrameStage::kDue) frame_changed_.notifyAll();
  if (now != before && now == FrameStage::kNoRenderer) sayWhatIsMissing("the emulator's renderer (option --window)");
  return now == FrameStage::kSkipped || now == FrameStage::kDone;
}

CaptureNode::FrameStage CaptureNode::beginPicture(const core::LockstepFrame& frame) {
  const ros::Time stamp = stampNow();
  dropBefore(
      stamp, [](const std_msgs::Header& done) { return done.stamp; }, &reader_);
  dropBefore(
      stamp, [](const FlightState& state) { return state.header.stamp; }, &states_);
  if (reader_.empty()) return FrameStage::kReading;
  const bool has_state = reader_.front()->frame_id != kLockstepNoState;
  if (has_state && states_.empty()) return FrameStage::kReading;
  reader_.pop_front();
  if (!has_state) return FrameStage::kSkipped;
  const FlightState::ConstPtr state = states_.front();
  states_.pop_front();
  pairing_->addState(state, clock().system_ns());
  frame_key_ = state->sim_time;
  if (frame.picture == 0) return FrameStage::kNoRenderer;
  return frame.picture == frame.number ? FrameStage::kDue : FrameStage::kDone;
}

void CaptureNode::endFrame(const core::LockstepFrame& frame) {
  std_msgs::Header done;
  if (frame.number == 0) {
    if (std::exchange(listens_, true)) return;
    done.frame_id = kLockstepFrame0;
  } else {
    const FrameLock lock(frame_mutex_);
    if (frame_ != frame.number || frame_stage_ != FrameStage::kDone) return;
  }
  done.stamp = stampNow();
  done_publisher_.publish(done);
}

void CaptureNode::sayWhatIsMissing(const std::string& what) {
  ROS_WARN_STREAM("no frame goes on: capture_node waits for " << what);
  std_msgs::Header waits;
  waits.stamp = stampNow();
  waits.frame_id = kLockstepWaits + what;
  done_publisher_.publish(waits);
}

void CaptureNode::captureInLockstep() {
  prctl(PR_SET_NAME, "capture");
  const std::unique_ptr<vision::FrameSource> source = makeSource(options_, wallClock().system_ns);
  cv::Mat pixels;
  std::string missing;
  while (!stop_) {
    bool due = false;
    {
      FrameLock lock(frame_mutex_);
      const auto is_due = [this] { return stop_ || frame_stage_ == FrameStage::kDue; };
      due = frame_changed_.waitUntil(&lock, Deadline(wallClock(), kLookPeriod), is_due) && !stop_;
    }
    // What is drawn was drawn before the frame ended: there is no change to wait for, but perhaps a window.
    vision::Change change;
    vision::WaitResult found = source->waitChange(std::chrono::milliseconds(0), change);
    if (found == vision::WaitResult::kLost && due) found = source->waitChange(kWindowWait, change);
    noteSource(*source, !due);
    if (!due) continue;
    const bool taken = found != vision::WaitResult::kLost && takeFramePicture(source.get(), &pixels);
    if (!taken) {
      const std::string problem = source->problem();
      if (problem != missing && !problem.empty()) sayWhatIsMissing("a picture: " + problem);
      missing = problem;
      continue;
    }
    missing.clear();
    {
      const FrameLock lock(frame_mutex_);
      frame_stage_ = FrameStage::kDone;
    }
    askFrameReady();
  }
}

bool CaptureNode::takeFramePicture(vision::FrameSource* source, cv::Mat* pixels) {
  const std::int64_t frame_ns = clock().system_ns();
  const std::int64_t began_ns = wallClock().steady_ns();
  vision::Picture picture;
  const vision::GrabResult result = source->grab({frame_ns, true}, picture);
  if (result == vision::GrabResult::kLost) return false;
  if (result == vision::GrabResult::kNew) picture.bgr.copyTo(*pixels);  // otherwise it looks as the one before
  if (pixels->empty()) return false;
  Grabbed grabbed;
  grabbed.pixels = *pixels;
  grabbed.size = pixels->size();
  grabbed.display_ns = grabbed.grab_ns = frame_ns;
  grabbed.display_known = true;
  {
    const FrameLock lock(frame_mutex_);
    grabbed.frame = vision::ShownFrame{frame_key_, 0.0, false, false};
  }
  {
    const std::lock_guard<std::mutex> lock(capture_mutex_);
    ++changes_;
    ++grabbed_;
    reads_.push_back(core::toSeconds(wallClock().steady_ns() - began_ns));
  }
  publishPicture(&grabbed);
  return true;
}

}  // namespace xplane_bridge
