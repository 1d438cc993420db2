#include "xplane_bridge/nodes/joystick/xplane_joy_node.hpp"

int main(int argc, char** argv) {
  return xplane_bridge::runNode<xplane_bridge::XplaneJoyNode>(argc, argv, "xplane_joy_node");
}
