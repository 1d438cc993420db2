#pragma once

#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <sensor_msgs/Joy.h>

#include "xplane_bridge/ControlMode.h"
#include "xplane_bridge/core/control/axis_map.hpp"
#include "xplane_bridge/core/control/command_repeat.hpp"
#include "xplane_bridge/nodes/base/base_node.hpp"
#include "xplane_bridge/nodes/joystick/joy_functions.hpp"
#include "xplane_bridge/nodes/joystick/joy_source.hpp"

namespace xplane_bridge {

/// Options of a joystick's file (config/joysticks/). @throws ParamError
core::JoystickOptions loadJoystickOptions(const ParamLoader& own);

/// `joy` into `control/manual`, `control/surfaces`, `control/mode_request` and calls of tx_node's services, by one of
/// config/joysticks/. Publishes on every joy message
/// and, on a timer of its own, in between; nothing while the device is silent for longer than `joy_timeout`. Where
/// several nodes publish `joy`, one of them counts (JoySource).
///
/// In lock-step it answers a frame when `lockstep/stick` has: by its joy, or by its lockstep/done. Surfaces and
/// functions of buttons are left out there.
class JoystickMapperNode : public BaseNode {
 protected:
  bool usesLink() const override { return false; }
  void loadParameters(const ParamLoader& own) override;
  void advertise() override;
  void subscribe() override;
  void joinThreads() override;

 private:
  /// What a frame waits for: the stick's answer to it.
  struct Frame {
    ros::Time stamp;
    sensor_msgs::JoyConstPtr joy;  // null: the stick has not moved
  };

  // Lock-step (joystick_mapper_lockstep.cpp).
  void subscribeInLockstep();
  void answerFrames();
  void answer(const Frame& frame);

  using JoyEvent = ros::MessageEvent<const sensor_msgs::Joy>;
  void onJoy(const JoyEvent& event);
  /// Whether the node that sent it is on the stick. `mutex_` is held.
  bool ofTheStick(const JoyEvent& event);
  void onTimer();
  /// Returns whether a command was published.
  bool publish(double now);
  void publishSurfaces(const core::JoystickCommand& command, const ros::Time& stamp);
  void reportProblems();
  void reportSelection();
  void fillDiagnostics(diagnostic_updater::DiagnosticStatusWrapper* status);

  double period_ = 0.02;  // [s]
  std::mutex mutex_;      // the mapper: sticks, timer and diagnostics are three threads
  std::unique_ptr<core::JoystickMapper> mapper_;
  std::unique_ptr<JoySource> source_;
  ros::Publisher command_publisher_;
  ros::Publisher request_publisher_;
  ros::Publisher surface_publisher_;  // where the file has surfaces
  bool surfaces_commanded_ = false;
  std::unique_ptr<JoyFunctions> functions_;  // where it has functions
  std::uint32_t command_sequence_ = 0;
  std::uint32_t request_sequence_ = 0;
  std::uint64_t joy_count_ = 0;
  core::CommandRepeat repeat_{period_};
  double last_joy_ = 0.0;  // [s] steady
  bool was_alive_ = false;
  std::string reported_problems_;
  std::string reported_source_;
  std::uint64_t diagnosed_refusals_ = 0;
  std::vector<std::string> reported_selection_;

  // In lock-step, of the subscriptions' thread.
  ros::Publisher done_publisher_;
  std::deque<Frame> frames_;
  std::deque<ControlModeConstPtr> modes_;
  ros::Time answered_;  // stamp of the last frame
};

}  // namespace xplane_bridge
