#pragma once

/// @file
/// For controllers of other packages: a node's part in lock-step (docs/experiments/lockstep.md). Needs roscpp and the
/// messages only.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include <ros/ros.h>
#include <std_msgs/Header.h>

#include "xplane_bridge/FlightState.h"

namespace xplane_bridge {

/// Answers every frame of lock-step on one topic, or that there is nothing to command in it; the node is to be named in
/// `lockstep/participants`.
///
///     xplane_bridge::LockstepParticipant<xplane_bridge::ControlCommand> participant(
///         "/xplane", "control/auto", [](const xplane_bridge::FlightState& state) { return law(state); });
///     ros::spin();
template <class Command>
class LockstepParticipant {
 public:
  using Answer = std::function<std::optional<Command>(const FlightState&)>;

  /// @param bridge namespace of the bridge
  /// @param topic of the commands, in that namespace
  /// @param answer called with each state; gives the command, whose stamp is set here, or nothing. What it does before
  /// it returns belongs to the frame: the simulator waits for it.
  LockstepParticipant(const std::string& bridge, const std::string& topic, Answer answer)
      : handle_(bridge),
        answer_(std::move(answer)),
        // Latched, so that no answer is lost before tx_node listens.
        commands_(handle_.advertise<Command>(topic, kQueue, true)),
        done_(handle_.advertise<std_msgs::Header>("lockstep/done", kQueue, true)),
        states_(handle_.subscribe<FlightState>(
            "flight_state", kQueue, [this](const FlightStateConstPtr& state) { onState(*state); }, ros::VoidConstPtr(),
            ros::TransportHints().tcpNoDelay())) {}
  LockstepParticipant(const LockstepParticipant&) = delete;
  LockstepParticipant& operator=(const LockstepParticipant&) = delete;

 private:
  static constexpr std::uint32_t kQueue = 100;

  void onState(const FlightState& state) {
    std::optional<Command> command = answer_(state);
    if (command) {
      command->header.stamp = state.header.stamp;
      commands_.publish(*command);
      return;
    }
    std_msgs::Header done;
    done.stamp = state.header.stamp;
    done_.publish(done);
  }

  ros::NodeHandle handle_;
  const Answer answer_;
  ros::Publisher commands_;
  ros::Publisher done_;
  ros::Subscriber states_;  // last: it uses all of the above
};

}  // namespace xplane_bridge
