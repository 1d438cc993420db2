#include "xplane_bridge/guardian.hpp"

int main(int argc, char** argv) { return xplane_bridge::runGuardian(argc, argv); }
