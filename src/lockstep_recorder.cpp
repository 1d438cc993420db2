#include <cstdio>
#include <string>
#include <vector>

#include <ros/ros.h>

#include "xplane_bridge/nodes/recorder/lockstep_recorder.hpp"

int main(int argc, char** argv) {
  using xplane_bridge::LockstepRecorder;
  using xplane_bridge::LockstepRecording;
  try {
    ros::init(argc, argv, "record");  // takes its own arguments away
    const LockstepRecording recording = LockstepRecording::parse({argv + 1, argv + argc});
    ros::NodeHandle handle;
    ros::Time::waitForValid();  // no message can be recorded at time 0
    if (!ros::ok()) return 0;
    LockstepRecorder recorder(recording, handle);
    ros::spin();
    recorder.finish();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "lockstep_recorder: %s\n", error.what());
    return 1;
  }
}
