#include "xplane_bridge/nodes/joystick/joystick_mapper_node.hpp"

#include "xplane_bridge/ControlCommand.h"
#include "xplane_bridge/LinkState.h"
#include "xplane_bridge/ModeRequest.h"
#include "xplane_bridge/SurfaceCommand.h"
#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/nodes/messages/control_conversions.hpp"

namespace xplane_bridge {
void JoystickMapperNode::loadParameters(const ParamLoader& own) {
  period_ = 1.0 / own.number("rate", {1.0, 1000.0}, 50.0);
  repeat_ = core::CommandRepeat(period_);
  mapper_ = std::make_unique<core::JoystickMapper>(loadJoystickOptions(own));
  source_ = std::make_unique<JoySource>(mapper_->options().joy_timeout, lockstep() ? common().lockstep.stick : "");
  if (!lockstep() && !mapper_->options().actions.empty()) {
    functions_ = std::make_unique<JoyFunctions>(loadJoyFunctions(own), [](const std::string& text, bool success) {
      if (success) {
        ROS_INFO("%s", text.c_str());
      } else {
        ROS_WARN("%s", text.c_str());
      }
    });
  }
  // Counting from the seconds of the clock, a restarted mapper is not mistaken for an old message.
  request_sequence_ =
      static_cast<std::uint32_t>((lockstep() ? clock() : wallClock()).system_ns() / core::kNanosecondsPerSecond);
}

void JoystickMapperNode::advertise() {
  // In lock-step none may be lost before tx_node listens.
  command_publisher_ = advertiseTopic<ControlCommand>("control/manual", lockstep() ? kLockstepQueue : 1, lockstep());
  request_publisher_ = advertiseTopic<ModeRequest>("control/mode_request", 10);
  if (!lockstep() && !mapper_->options().surfaces.empty()) {
    surface_publisher_ = advertiseTopic<SurfaceCommand>("control/surfaces", 1);
  }
  addDiagnostics("joystick", [this](diagnostic_updater::DiagnosticStatusWrapper& status) { fillDiagnostics(&status); });
  setHardwareId(mapper_->options().device);
}

void JoystickMapperNode::subscribe() {
  if (lockstep()) {
    subscribeInLockstep();
    return;
  }
  subscribeEvents<sensor_msgs::Joy>(
      "joy", 1, [this](const JoyEvent& event) { onJoy(event); }, Served::kWhereRead);
  subscribeTopic<ControlMode>("control/mode", 1, [this](const ControlModeConstPtr& mode) {
    if (mode->mode != ControlMode::MANUAL && mode->mode != ControlMode::AUTO) return;
    std::lock_guard<std::mutex> lock(mutex_);
    mapper_->setMode(static_cast<core::FlightMode>(mode->mode));
  });
  if (functions_) {
    subscribeTopic<LinkState>("link_state", 1, [this](const LinkStateConstPtr& link) {
      if (link->state == LinkState::CONNECTED) functions_->setPaused(false);
      if (link->state == LinkState::PAUSED) functions_->setPaused(true);
    });
  }
  addTimer(period_, [this] { onTimer(); });
}

void JoystickMapperNode::joinThreads() {
  if (functions_) functions_->stop();
}

bool JoystickMapperNode::ofTheStick(const JoyEvent& event) {
  if (source_->accept(event.getPublisherName(), clock().steadySeconds())) return true;
  if (source_->problem() != reported_source_) {
    reported_source_ = source_->problem();
    ROS_ERROR("%s", reported_source_.c_str());
  }
  return false;
}

void JoystickMapperNode::onJoy(const JoyEvent& event) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (!ofTheStick(event)) return;
  const sensor_msgs::Joy& joy = *event.getConstMessage();
  const double time = clock().steadySeconds();
  ++joy_count_;
  if (mapper_->onJoy(joy.axes, joy.buttons, time)) {
    last_joy_ = time;
    repeat_.heard(time);
    publish(time);
  }
  reportProblems();
}

void JoystickMapperNode::onTimer() {
  std::lock_guard<std::mutex> lock(mutex_);
  const double time = clock().steadySeconds();
  const bool alive = mapper_->alive(time);
  if (was_alive_ && !alive) {
    ROS_WARN("%s is silent: control/manual stops. Is it plugged in, and does the joy driver repeat (autorepeat_rate)?",
             mapper_->options().device.c_str());
  }
  was_alive_ = alive;
  if (repeat_.due(time)) publish(time);
}

bool JoystickMapperNode::publish(double time) {
  core::JoystickCommand command = mapper_->update(time);
  const ros::Time stamp = stampNow();
  for (const core::FlightMode mode : mapper_->takeModeRequests()) {
    ModeRequest request;
    request.header.stamp = stamp;
    request.sequence = ++request_sequence_;
    request.mode = static_cast<std::uint8_t>(mode);
    request.requester = name();
    request_publisher_.publish(request);
  }
  for (const std::size_t action : mapper_->takeActions()) {
    if (functions_) functions_->press(action);
  }
  if (!command.alive) return false;
  publishSurfaces(command, stamp);
  command.command.sequence = ++command_sequence_;
  ControlCommand message;
  message.header.stamp = stamp;
  toMessage(command.command, &message);
  command_publisher_.publish(message);
  repeat_.sent(time);
  reportSelection();
  return true;
}

/// An empty list, once, gives all of them back.
void JoystickMapperNode::publishSurfaces(const core::JoystickCommand& command, const ros::Time& stamp) {
  if (!surface_publisher_ || (command.surfaces.empty() && !surfaces_commanded_)) return;
  SurfaceCommand message;
  message.header.stamp = stamp;
  message.sequence = command_sequence_ + 1;
  for (const core::SurfaceSetting& surface : command.surfaces) {
    message.names.push_back(surface.name);
    message.deflections_deg.push_back(static_cast<float>(surface.deflection_deg));
  }
  surface_publisher_.publish(message);
  surfaces_commanded_ = !command.surfaces.empty();
}

void JoystickMapperNode::reportProblems() {
  const std::string text =
      core::join(mapper_->problems(), "; ", [](const core::JoyProblem& problem) { return problem.text; });
  if (text == reported_problems_) return;
  reported_problems_ = text;
  if (!text.empty()) ROS_ERROR("%s", text.c_str());
}

void JoystickMapperNode::reportSelection() {
  auto selection = mapper_->selected();
  if (selection == reported_selection_) return;
  reported_selection_ = std::move(selection);
  ROS_INFO("selected: %s", core::join(reported_selection_).c_str());
}

void JoystickMapperNode::fillDiagnostics(diagnostic_updater::DiagnosticStatusWrapper* status) {
  using Level = diagnostic_msgs::DiagnosticStatus;
  std::lock_guard<std::mutex> lock(mutex_);
  const double time = clock().steadySeconds();
  if (!mapper_->problems().empty()) {
    status->summary(Level::ERROR, reported_problems_);
  } else if (mapper_->alive(time)) {
    status->summary(Level::OK, mapper_->options().device + " is alive");
  } else {
    status->summary(Level::WARN,
                    mapper_->options().device + (joy_count_ == 0 ? " has not been heard yet" : " is silent"));
  }
  if (source_->refused() > diagnosed_refusals_) status->mergeSummary(Level::ERROR, source_->problem());
  diagnosed_refusals_ = source_->refused();
  status->add("Messages (-)", joy_count_);
  status->add("Messages of other nodes dropped (-)", source_->refused());
  status->add("Messages dropped (-)", mapper_->dropped());
  if (last_joy_ > 0.0) status->add("Silence (s)", time - last_joy_);
  status->add("Commands published (-)", command_sequence_);
  status->add("Selected (-)", core::join(mapper_->selected()));
}

}  // namespace xplane_bridge
