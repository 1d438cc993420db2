// joystick_mapper_node in lock-step: one answer to each frame, when the stick has answered it.

#include <utility>

#include <std_msgs/Header.h>

#include "xplane_bridge/core/base/node_name.hpp"
#include "xplane_bridge/nodes/joystick/joystick_mapper_node.hpp"

namespace xplane_bridge {

void JoystickMapperNode::subscribeInLockstep() {
  const std::string stick = common().lockstep.stick;
  if (stick.empty()) {
    throw ParamError(
        "parameter lockstep/stick is empty: expected the name of the node that publishes joy, which is one "
        "of lockstep/participants, as joystick_mapper_node answers a frame when that one has");
  }
  done_publisher_ = advertiseTopic<std_msgs::Header>(kLockstepDoneTopic, 1, true);
  subscribeTopic<ControlMode>(kLockstepModeTopic, kLockstepQueue, [this](const ControlModeConstPtr& mode) {
    modes_.push_back(mode);
    answerFrames();
  });
  subscribeEvents<sensor_msgs::Joy>("joy", kLockstepQueue, [this](const JoyEvent& event) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!ofTheStick(event)) return;
    }
    const sensor_msgs::JoyConstPtr& joy = event.getConstMessage();
    frames_.push_back({joy->header.stamp, joy});
    answerFrames();
  });
  subscribeEvents<std_msgs::Header>(kLockstepDoneTopic, kLockstepQueue,
                                    [this, stick](const ros::MessageEvent<const std_msgs::Header>& event) {
                                      if (!core::isNamed(event.getPublisherName(), stick)) return;
                                      frames_.push_back({event.getConstMessage()->stamp, nullptr});
                                      answerFrames();
                                    });
}

/// Answers what can be answered: when the mode at the end of the frame before has come, so have all before it, and the
/// last of those counts in every run.
void JoystickMapperNode::answerFrames() {
  while (!frames_.empty()) {
    const bool known = answered_.isZero() || (!modes_.empty() && modes_.back()->header.stamp >= answered_);
    if (!known) return;
    while (!modes_.empty() && modes_.front()->header.stamp < answered_) {
      const std::lock_guard<std::mutex> lock(mutex_);
      mapper_->setMode(static_cast<core::FlightMode>(modes_.front()->mode));
      modes_.pop_front();
    }
    const Frame frame = std::move(frames_.front());
    frames_.pop_front();
    answer(frame);
    answered_ = frame.stamp;
  }
}

void JoystickMapperNode::answer(const Frame& frame) {
  moveClock(frame.stamp);
  const std::lock_guard<std::mutex> lock(mutex_);
  const double time = clock().steadySeconds();
  if (frame.joy) {
    ++joy_count_;
    if (mapper_->onJoy(frame.joy->axes, frame.joy->buttons, time)) last_joy_ = time;
    reportProblems();
  }
  if (publish(time)) return;
  std_msgs::Header done;
  done.stamp = frame.stamp;
  done_publisher_.publish(done);
}

}  // namespace xplane_bridge
