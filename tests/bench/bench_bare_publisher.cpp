// The floor of a flight state's way: publishes a FlightState and does nothing else, a third into each period of the
// machine's steady clock. The stamp is the wall time before publish().
//
//   bench_bare_publisher TOPIC RATE

#include <string>

#include <ros/ros.h>

#include "bench_settings.hpp"
#include "xplane_bridge/FlightState.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "bench_bare_publisher", ros::init_options::AnonymousName);
  if (argc != 3) {
    ROS_ERROR("usage: bench_bare_publisher TOPIC RATE");
    return 2;
  }
  ros::NodeHandle handle;
  ros::Publisher publisher = handle.advertise<xplane_bridge::FlightState>(argv[1], 100);
  const auto period_ns = static_cast<std::int64_t>(1e9 / std::stod(argv[2]));
  xplane_bridge::FlightState state;
  state.header.frame_id = "base_link_frd";
  while (ros::ok()) {
    const std::int64_t now_ns = xplane_bridge::bench::now_ns();
    const std::int64_t next = ((now_ns + 2 * period_ns / 3) / period_ns) * period_ns + period_ns / 3;
    xplane_bridge::bench::sleepUntil(next);
    const ros::WallTime stamp = ros::WallTime::now();
    state.header.stamp = ros::Time(stamp.sec, stamp.nsec);
    publisher.publish(state);
  }
  return 0;
}
