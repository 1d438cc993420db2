// The part of BaseNode that owns the link to X-Plane.

#include <stdexcept>

#include "xplane_bridge/base_node.hpp"

namespace xplane_bridge {

void BaseNode::makeLink() {
  if (usesLink()) {
    throw std::logic_error("the link to X-Plane is not part of this build yet");
  }
}

void BaseNode::startLink() {}

void BaseNode::stopLink(Deadline) {}

}  // namespace xplane_bridge
