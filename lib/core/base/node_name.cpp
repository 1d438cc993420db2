#include "xplane_bridge/core/base/node_name.hpp"

#include <algorithm>

namespace xplane_bridge::core {

bool isNamed(const std::string& who, const std::string& name) {
  if (name.find('/') == 0) return who == name;
  const std::size_t tail = who.size() - std::min(who.size(), name.size());
  return who.compare(tail, std::string::npos, name) == 0 && (tail == 0 || who[tail - 1] == '/');
}

}  // namespace xplane_bridge::core
