#include "xplane_bridge/core/wire/dataref_path.hpp"

#include <algorithm>
#include <regex>
#include <stdexcept>

#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {
namespace {

[[noreturn]] void refuse(const std::string& name, const std::string& why) {
  throw std::invalid_argument("dataref \"" + name + "\": " + why);
}

}  // namespace

std::vector<std::string> datarefElements(const std::string& name) {
  static const std::regex kSingle(R"([^\[\]\s]+(\[\d{1,6}\])?)");
  static const std::regex kRange(R"(([^\[\]\s]+)\[(\d{1,6}):(\d{1,6})\])");

  const bool ascii = std::all_of(name.begin(), name.end(), [](char c) { return c > ' ' && c <= '~'; });
  if (!ascii || name.find('/') == std::string::npos) {
    refuse(name, "a path such as sim/cockpit2/controls/flap_ratio is expected, ASCII without blanks");
  }
  std::vector<std::string> elements;
  std::smatch match;
  if (std::regex_match(name, kSingle)) {
    elements.push_back(name);
  } else if (std::regex_match(name, match, kRange)) {
    const int first = std::stoi(match[2]);
    const int end = std::stoi(match[3]);
    if (end <= first || end - first > kMaxDatarefRange) {
      refuse(name, "[i:j] means elements i to j - 1, at most " + std::to_string(kMaxDatarefRange) + " of them");
    }
    for (int i = first; i < end; ++i) {
      elements.push_back(match[1].str() + "[" + std::to_string(i) + "]");
    }
  } else {
    refuse(name, "an index is written [3], a range [0:8]");
  }
  if (std::max(elements.front().size(), elements.back().size()) >= kRrefPathSize) {
    refuse(name, "longer than the " + std::to_string(kRrefPathSize - 1) + " characters X-Plane takes");
  }
  return elements;
}

}  // namespace xplane_bridge::core
