// The floor of a flight state's way: subscribes to one dataref, the simulator's time if none is named, publishes a
// FlightState with its value as time for each datagram, and does nothing else.
//
//   bench_bare_publisher TOPIC PORT [DATAREF]

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cstring>
#include <string>

#include <ros/ros.h>

#include "xplane_bridge/FlightState.h"
#include "xplane_bridge/core/wire/packets.hpp"

namespace {

constexpr int kRateHz = 999;
constexpr timeval kPatience{0, 300'000};  // [s, us] without a datagram until it is asked for again

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "bench_bare_publisher", ros::init_options::AnonymousName);
  if (argc != 3 && argc != 4) {
    ROS_ERROR("usage: bench_bare_publisher TOPIC PORT [DATAREF]");
    return 2;
  }
  ros::NodeHandle handle;
  ros::Publisher publisher = handle.advertise<xplane_bridge::FlightState>(argv[1], 100);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  to.sin_port = htons(static_cast<std::uint16_t>(std::stoul(argv[2])));
  const int wire = socket(AF_INET, SOCK_DGRAM, 0);
  setsockopt(wire, SOL_SOCKET, SO_RCVTIMEO, &kPatience, sizeof kPatience);
  std::array<std::uint8_t, xplane_bridge::core::kRrefRequestSize> request;
  xplane_bridge::core::encodeRref(request, argc == 4 ? argv[3] : "sim/time/total_running_time_sec", kRateHz, 0);
  std::array<std::uint8_t, 2048> datagram;
  xplane_bridge::FlightState state;
  state.header.frame_id = "base_link_frd";
  while (ros::ok()) {
    const ssize_t size = recv(wire, datagram.data(), datagram.size(), 0);
    if (size < 0) {
      sendto(wire, request.data(), request.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
    } else if (static_cast<std::size_t>(size) >=
               xplane_bridge::core::kHeaderSize + xplane_bridge::core::kRrefPairSize) {
      std::memcpy(&state.sim_time, datagram.data() + xplane_bridge::core::kHeaderSize + 4, sizeof state.sim_time);
      publisher.publish(state);
    }
  }
  return 0;
}
