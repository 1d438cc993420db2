#include "xplane_bridge/nodes/tx/tx_node.hpp"

int main(int argc, char** argv) { return xplane_bridge::runNode<xplane_bridge::TxNode>(argc, argv, "tx_node"); }
