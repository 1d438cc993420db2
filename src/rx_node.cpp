#include "xplane_bridge/nodes/rx/rx_node.hpp"

int main(int argc, char** argv) { return xplane_bridge::runNode<xplane_bridge::RxNode>(argc, argv, "rx_node"); }
