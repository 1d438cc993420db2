#include "xplane_bridge/nodes/capture/capture_node.hpp"

int main(int argc, char** argv) {
  return xplane_bridge::runNode<xplane_bridge::CaptureNode>(argc, argv, "capture_node");
}
