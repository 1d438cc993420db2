#include "xplane_bridge/nodes/recorder/lockstep_recorder.hpp"

int main(int argc, char** argv) { return xplane_bridge::runLockstepRecorder(argc, argv); }
