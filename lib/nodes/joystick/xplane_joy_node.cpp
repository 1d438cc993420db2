#include "xplane_bridge/nodes/joystick/xplane_joy_node.hpp"

#include <mutex>

#include <sensor_msgs/Joy.h>

namespace xplane_bridge {
namespace {

constexpr std::uint32_t kQueueSize = 10;
constexpr const char* kDevice = "X-Plane's joystick";

}  // namespace

void XplaneJoyNode::loadParameters(const ParamLoader& own) {
  if (lockstep()) {
    throw ParamError(
        "a hand does not wait for frames: expected no lockstep/enabled with xplane_joy_node; start "
        "joystick.launch with driver:=virtual");
  }
  options_.rate = own.integer("rate", {10, 200}, options_.rate);
  options_.axes = own.integer("axes", {1, core::kMaxStickAxes}, options_.axes);
  options_.buttons = own.integer("buttons", {0, 256}, options_.buttons);
  options_.first_button =
      own.integer("first_button", {0, core::kMaxStickButtons - options_.buttons}, options_.first_button);
  stick_ = std::make_unique<core::SimulatorStick>(options_);
}

void XplaneJoyNode::advertise() {
  publisher_ = advertiseTopic<sensor_msgs::Joy>("joy", kQueueSize);
  addDiagnostics("device", [this](diagnostic_updater::DiagnosticStatusWrapper& status) { fillDiagnostics(&status); });
}

void XplaneJoyNode::start() {
  settings_ = link().subscribe(
      {"joystick settings", stick_->settingRequests(), core::SimulatorStick::kSettingsRateHz, 0},
      [this](const core::RrefView& datagram, const core::ReceiveInfo& info) { onSettings(datagram, info); }, mutex_);
  values_ = link().subscribe(
      valueGroup(), [this](const core::RrefView& datagram, const core::ReceiveInfo& info) { onValues(datagram, info); },
      mutex_);
}

void XplaneJoyNode::undo(const Deadline& /*deadline*/) {
  settings_.reset();
  values_.reset();
}

core::RrefGroup XplaneJoyNode::valueGroup() const { return {"joystick", stick_->valueRequests(), options_.rate, 0}; }

void XplaneJoyNode::onSettings(const core::RrefView& datagram, const core::ReceiveInfo& info) {
  if (stick_->addSettings(datagram, info.stamp_ns)) values_.replace(valueGroup());
}

void XplaneJoyNode::onValues(const core::RrefView& datagram, const core::ReceiveInfo& info) {
  const bool whole = stick_->addValues(datagram, info.stamp_ns);
  report();
  if (!whole) return;
  sensor_msgs::Joy joy;
  joy.header.stamp = stampNow();
  joy.header.frame_id = kDevice;
  joy.axes = stick_->axes();
  joy.buttons = stick_->buttons();
  publisher_.publish(joy);
  ++count_;
  heard_ = clock().steadySeconds();
}

void XplaneJoyNode::report() {
  const std::string problem = stick_->problem();
  const std::string text = problem.empty() ? "reading X-Plane's axes: " + stick_->describe() : problem;
  if (text == reported_) return;
  reported_ = text;
  if (problem.empty()) {
    ROS_INFO("%s", text.c_str());
  } else {
    ROS_WARN("%s", text.c_str());
  }
}

void XplaneJoyNode::fillDiagnostics(diagnostic_updater::DiagnosticStatusWrapper* status) {
  using Level = diagnostic_msgs::DiagnosticStatus;
  const std::lock_guard<core::HandlerMutex> lock(*mutex_);
  const std::string problem = stick_->problem();
  const double silence = clock().steadySeconds() - heard_;
  if (!problem.empty()) {
    status->summary(Level::WARN, problem);
  } else if (count_ > 0 && silence > common().stale_after) {
    status->summaryf(Level::WARN, "nothing heard for %.1f s: does X-Plane run, and does its computer answer?", silence);
  } else {
    status->summary(Level::OK, "reading X-Plane's axes: " + stick_->describe());
  }
  status->add("Messages (-)", count_);
  if (count_ > 0) status->addf("Silence (s)", "%.1f", silence);
}

}  // namespace xplane_bridge
