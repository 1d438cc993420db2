// The floor of a stick's way into X-Plane: a node that turns sensor_msgs/Joy into ControlCommand, or one that turns
// ControlCommand into a datagram, and neither does anything else.
//
//   bench_bare_hops mapper JOY_TOPIC COMMAND_TOPIC AXIS
//   bench_bare_hops sender COMMAND_TOPIC PORT

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <string>

#include <ros/ros.h>
#include <sensor_msgs/Joy.h>

#include "xplane_bridge/ControlCommand.h"

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

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "bench_bare_hops", ros::init_options::AnonymousName);
  const std::string role = argc > 1 ? argv[1] : "";
  if (role == "mapper" && argc == 5) {
    map(argv + 2);
  } else if (role == "sender" && argc == 4) {
    send(argv + 2);
  } else {
    ROS_ERROR("usage: bench_bare_hops mapper JOY_TOPIC COMMAND_TOPIC AXIS | sender COMMAND_TOPIC PORT");
    return 2;
  }
  return 0;
}
