#include "xplane_bridge/core/base/node_name.hpp"

#include <algorithm>

namespace xplane_bridge::core {

bool isNamed(const std::string& who, const std::string& name) {
  if (name.find('/') == 0) return who == name;
  const std::size_t tail = who.size() - std::min(who.size(), name.size());
  return who.compare(tail, std::string::npos, name) == 0 && (tail == 0 || who[tail - 1] == '/');
}

std::string nameInFiles(const std::string& who, const std::string& usual) {
  const std::size_t last = who.rfind('/');
  if (who.substr(0, last) == usual) return who.substr(last + 1);
  std::string out = who.substr(who.find_first_not_of('/'));
  std::replace(out.begin(), out.end(), '/', '.');
  return out;
}

}  // namespace xplane_bridge::core
