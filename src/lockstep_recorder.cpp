#include <cstdio>
#include <string>
#include <vector>

#include <ros/ros.h>

#include "xplane_bridge/nodes/base/ros_time.hpp"
#include "xplane_bridge/nodes/network/immediate_queue.hpp"
#include "xplane_bridge/nodes/recorder/lockstep_recorder.hpp"

int main(int argc, char** argv) {
  using xplane_bridge::LockstepRecorder;
  using xplane_bridge::LockstepRecording;
  try {
    xplane_bridge::initWithOwnTime(&argc, argv, "record");
    const LockstepRecording recording = LockstepRecording::parse({argv + 1, argv + argc});
    ros::NodeHandle handle;
    xplane_bridge::ImmediateQueue at_once;
    at_once.open();
    const ros::Subscriber clock =
        xplane_bridge::movesRosTime() ? xplane_bridge::followClock(&at_once) : ros::Subscriber();
    if (!ros::Time::isValid()) ROS_WARN("no time on /clock yet: nothing can be recorded before rx_node gives it");
    ros::Time::waitForValid();
    if (!ros::ok()) return 0;
    LockstepRecorder recorder(recording, handle);
    ROS_INFO("recording %zu topics to %s", recording.topics.size(), recording.bag.c_str());
    ros::spin();
    recorder.finish();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "lockstep_recorder: %s\n", error.what());
    return 1;
  }
}
