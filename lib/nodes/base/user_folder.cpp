#include "xplane_bridge/nodes/base/user_folder.hpp"

#include <cstdlib>
#include <stdexcept>

namespace xplane_bridge {

std::string userFolder() {
  const char* const ros_home = std::getenv("ROS_HOME");
  if (ros_home != nullptr && *ros_home != '\0') {
    return std::string(ros_home) + "/xplane_bridge";
  }
  const char* const home = std::getenv("HOME");
  if (home == nullptr || *home == '\0') {
    throw std::runtime_error(
        "neither ROS_HOME nor HOME is set, so there is no folder for the journal; set one of them");
  }
  return std::string(home) + "/.ros/xplane_bridge";
}

}  // namespace xplane_bridge
