// The floor of ways into X-Plane: nodes that turn sensor_msgs/Joy, or a datagram by way of FlightState, into
// ControlCommand, or ControlCommand into a datagram, and do nothing else.
//
//   bench_bare_hops reader PORT STATE_TOPIC
//   bench_bare_hops law STATE_TOPIC COMMAND_TOPIC
//   bench_bare_hops mapper JOY_TOPIC COMMAND_TOPIC AXIS
//   bench_bare_hops sender COMMAND_TOPIC PORT

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <string>

#include <ros/ros.h>
#include <sensor_msgs/Joy.h>

#include "xplane_bridge/ControlCommand.h"
#include "xplane_bridge/FlightState.h"

namespace {

const ros::TransportHints kHints = ros::TransportHints().tcpNoDelay();

void map(char** words) {
  ros::NodeHandle handle;
  const auto axis = static_cast<std::size_t>(std::stoul(words[2]));
  ros::Publisher publisher = handle.advertise<xplane_bridge::ControlCommand>(words[1], 1);
  const auto on_joy = [&](const sensor_msgs::JoyConstPtr& joy) {
    xplane_bridge::ControlCommand command;
    command.roll = joy->axes.at(axis);
    publisher.publish(command);
  };
  const ros::Subscriber subscriber = handle.subscribe<sensor_msgs::Joy>(words[0], 1, on_joy, nullptr, kHints);
  ros::spin();
}

void send(char** words) {
  ros::NodeHandle handle;
  const int out = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  to.sin_port = htons(static_cast<std::uint16_t>(std::stoul(words[1])));
  const auto on_command = [&](const xplane_bridge::ControlCommandConstPtr& command) {
    sendto(out, &command->roll, sizeof command->roll, 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  };
  const ros::Subscriber subscriber =
      handle.subscribe<xplane_bridge::ControlCommand>(words[0], 1, on_command, nullptr, kHints);
  ros::spin();
}

void read(char** words) {
  ros::NodeHandle handle;
  ros::Publisher publisher = handle.advertise<xplane_bridge::FlightState>(words[1], 1);
  const int in = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  at.sin_port = htons(static_cast<std::uint16_t>(std::stoul(words[0])));
  bind(in, reinterpret_cast<const sockaddr*>(&at), sizeof at);
  float number = 0.0F;
  while (ros::ok() && recv(in, &number, sizeof number, 0) == sizeof number) {
    xplane_bridge::FlightState state;
    state.sim_time = number;
    publisher.publish(state);
  }
}

void command(char** words) {
  ros::NodeHandle handle;
  ros::Publisher publisher = handle.advertise<xplane_bridge::ControlCommand>(words[1], 1);
  const auto on_state = [&](const xplane_bridge::FlightStateConstPtr& state) {
    xplane_bridge::ControlCommand message;
    message.roll = state->sim_time;
    publisher.publish(message);
  };
  const ros::Subscriber subscriber =
      handle.subscribe<xplane_bridge::FlightState>(words[0], 1, on_state, nullptr, kHints);
  ros::spin();
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "bench_bare_hops", ros::init_options::AnonymousName);
  const std::string role = argc > 1 ? argv[1] : "";
  if (role == "mapper" && argc == 5) {
    map(argv + 2);
  } else if (role == "sender" && argc == 4) {
    send(argv + 2);
  } else if (role == "reader" && argc == 4) {
    read(argv + 2);
  } else if (role == "law" && argc == 4) {
    command(argv + 2);
  } else {
    ROS_ERROR(
        "usage: bench_bare_hops mapper JOY_TOPIC COMMAND_TOPIC AXIS | sender COMMAND_TOPIC PORT | reader PORT "
        "STATE_TOPIC | "
        "law STATE_TOPIC COMMAND_TOPIC");
    return 2;
  }
  return 0;
}
