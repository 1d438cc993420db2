#include <algorithm>

#include <ros/ros.h>
#include <xplane_bridge/ControlCommand.h>
#include <xplane_bridge/nodes/client/lockstep_participant.hpp>

using xplane_bridge::ControlCommand;
using xplane_bridge::FlightState;

// The command that answers a state.
ControlCommand law(const FlightState& state) {
  ControlCommand command;
  command.fields = ControlCommand::ROLL | ControlCommand::PITCH | ControlCommand::YAW;
  command.roll = static_cast<float>(std::clamp(-0.03 * state.roll_deg, -1.0, 1.0));
  return command;
}

int main(int argc, char** argv) {
  ros::init(argc, argv, "controller");
  const xplane_bridge::LockstepParticipant<ControlCommand> participant("/xplane", "control/auto", law);
  ros::spin();
}
