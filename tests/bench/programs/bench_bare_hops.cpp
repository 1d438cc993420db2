// The floor of ways into X-Plane: nodes that turn sensor_msgs/Joy or FlightState into ControlCommand, or ControlCommand
// into a datagram or the answer to the fence of a simulator in lock-step, and do nothing else.
//
//   bench_bare_hops law STATE_TOPIC COMMAND_TOPIC
//   bench_bare_hops mapper JOY_TOPIC COMMAND_TOPIC AXIS
//   bench_bare_hops sender COMMAND_TOPIC PORT
//   bench_bare_hops answerer COMMAND_TOPIC XPLANE_PORT

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cstring>
#include <string>

#include <ros/ros.h>
#include <sensor_msgs/Joy.h>

#include "xplane_bridge/ControlCommand.h"
#include "xplane_bridge/FlightState.h"
#include "xplane_bridge/core/wire/lockstep_hub.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace {

namespace core = xplane_bridge::core;

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

sockaddr_in onThisHost(const char* port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(std::stoul(port)));
  return address;
}

/// Sends a datagram for each command. @param encode makes it of the command's roll; returns its size [bytes]
template <typename Encode>
void send(char** words, const Encode& encode) {
  ros::NodeHandle handle;
  const int out = socket(AF_INET, SOCK_DGRAM, 0);
  const sockaddr_in to = onThisHost(words[1]);
  const auto on_command = [&](const xplane_bridge::ControlCommandConstPtr& command) {
    std::array<std::uint8_t, core::kDrefSize> datagram;
    const std::size_t size = encode(command->roll, datagram);
    sendto(out, datagram.data(), size, 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  };
  const ros::Subscriber subscriber =
      handle.subscribe<xplane_bridge::ControlCommand>(words[0], 1, on_command, nullptr, kHints);
  ros::spin();
}

std::size_t encodeNumber(float number, core::ByteSpan datagram) {
  std::memcpy(datagram.data(), &number, sizeof number);
  return sizeof number;
}

std::size_t encodeAnswer(float number, core::ByteSpan datagram) {
  return *core::encodeDref(datagram, core::kFenceDataref, number);
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
    send(argv + 2, encodeNumber);
  } else if (role == "answerer" && argc == 4) {
    send(argv + 2, encodeAnswer);
  } else if (role == "law" && argc == 4) {
    command(argv + 2);
  } else {
    ROS_ERROR(
        "usage: bench_bare_hops mapper JOY_TOPIC COMMAND_TOPIC AXIS | sender COMMAND_TOPIC PORT | "
        "law STATE_TOPIC COMMAND_TOPIC | answerer COMMAND_TOPIC XPLANE_PORT");
    return 2;
  }
  return 0;
}
