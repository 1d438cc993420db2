#include "xplane_bridge/core/simulator/simulator_settings.hpp"

#include <stdexcept>

#include "xplane_bridge/core/wire/dataref_path.hpp"

namespace xplane_bridge::core {

const char* pauseCommand(bool pause, SimulatorVersion version) {
  if (version.number < kFirstOf1210) return "sim/operation/pause_toggle";
  return pause ? "sim/operation/pause_on" : "sim/operation/pause_off";
}

std::vector<std::string> consecutiveElements(const std::string& name, std::size_t count) {
  std::vector<std::string> first = datarefElements(name);
  if (first.size() != 1) throw std::invalid_argument("\"" + name + "\" is a range: expected path or path[i]");
  if (count == 1) return first;
  const std::size_t bracket = name.find('[');
  const int begin = bracket == std::string::npos ? 0 : std::stoi(name.substr(bracket + 1));
  return datarefElements(name.substr(0, bracket) + "[" + std::to_string(begin) + ":" +
                         std::to_string(begin + static_cast<int>(count)) + "]");
}

}  // namespace xplane_bridge::core
