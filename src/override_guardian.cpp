#include "xplane_bridge/actuation/guardian.hpp"

int main(int argc, char** argv) { return xplane_bridge::runGuardian(argc, argv); }
