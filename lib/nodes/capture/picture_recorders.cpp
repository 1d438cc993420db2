#include "xplane_bridge/nodes/capture/picture_recorders.hpp"

#include <algorithm>
#include <cctype>

namespace xplane_bridge {

bool isOfBridge(const std::string& topic, const std::vector<std::string>& topics, const std::string& bridge) {
  const std::string space = bridge + "/";
  return std::any_of(topics.begin(), topics.end(), [&](const std::string& own) {
    if (topic == own) return true;
    const std::size_t camera = own.rfind("/camera/");
    if (camera == std::string::npos || bridge == "/") return false;
    const std::string tail = own.substr(camera);
    return topic.compare(0, space.size(), space) == 0 && topic.size() >= tail.size() &&
           topic.compare(topic.size() - tail.size(), tail.size(), tail) == 0;
  });
}

bool isRecorder(const std::string& node) {
  std::string name = "_" + node.substr(node.rfind('/') + 1) + "_";
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const auto has = [&name](const char* part) { return name.find(part) != std::string::npos; };
  return (has("rosbag") || has("_bag_") || has("record")) && !has("record_watch");
}

}  // namespace xplane_bridge
