#include "xplane_bridge/nodes/joystick/joystick_mapper_node.hpp"

int main(int argc, char** argv) {
  return xplane_bridge::runNode<xplane_bridge::JoystickMapperNode>(argc, argv, "joystick_mapper_node");
}
