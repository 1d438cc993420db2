#include "xplane_bridge/nodes/base/conformance_file.hpp"

#include <fstream>
#include <sstream>

#include <ros/console.h>

#include "xplane_bridge/core/base/conformance.hpp"
#include "xplane_bridge/core/wire/udp_socket.hpp"
#include "xplane_bridge/nodes/base/user_folder.hpp"

namespace xplane_bridge {
namespace {

std::string fileOf(const core::Endpoint& peer) {
  const core::Endpoint named{
      core::isSameHost(peer.address, core::kLoopbackAddress) ? core::kLoopbackAddress : peer.address, peer.port};
  return userFolder() + "/" + named.addressString() + "_" + std::to_string(named.port) + "_conformance.yaml";
}

}  // namespace

std::uint32_t readConformance(const std::string& file, const core::Endpoint& peer, std::int32_t version) {
  const std::string path = file.empty() ? fileOf(peer) : file;
  std::ifstream stream(path, std::ios::binary);
  if (!stream) {
    if (!file.empty()) {
      ROS_WARN("conformance_file %s cannot be read; X-Plane is taken to be as assumed", path.c_str());
    }
    return 0;
  }
  std::ostringstream text;
  text << stream.rdbuf();
  try {
    const core::Conformance found = core::conformanceFromText(text.str());
    if (found.xplane_version != version) {
      ROS_WARN("%s is for X-Plane %d, this is %d: ignored; fly scripts/xplane_doctor --conformance again", path.c_str(),
               found.xplane_version, version);
      return 0;
    }
    for (const std::string& id : found.refuted) {
      const std::string consequence = core::consequenceOf(id);
      ROS_INFO("%s: %s is refuted: %s", path.c_str(), id.c_str(),
               consequence.empty() ? "see docs/setups/doctor.md" : consequence.c_str());
    }
    return found.otherwise();
  } catch (const core::ConformanceError& error) {
    ROS_WARN("%s is ignored: %s", path.c_str(), error.what());
    return 0;
  }
}

}  // namespace xplane_bridge
