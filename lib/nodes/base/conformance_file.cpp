#include "xplane_bridge/nodes/base/conformance_file.hpp"

#include <fstream>
#include <sstream>
#include <system_error>

#include <ros/console.h>

#include "xplane_bridge/core/base/conformance.hpp"
#include "xplane_bridge/core/wire/udp_socket.hpp"
#include "xplane_bridge/nodes/base/user_folder.hpp"

namespace xplane_bridge {
namespace {

constexpr char kSuffix[] = "_conformance.yaml";

std::string pathOf(const core::Endpoint& named) {
  return userFolder() + "/" + named.addressString() + "_" + std::to_string(named.port) + kSuffix;
}

/// Whether the first has been written later; what is not there never has.
bool isNewer(const std::filesystem::path& one, const std::filesystem::path& other) {
  const auto written = [](const std::filesystem::path& path) {
    std::error_code problem;
    const auto time = std::filesystem::last_write_time(path, problem);
    return problem ? std::filesystem::file_time_type::min() : time;
  };
  return written(one) > written(other);
}

std::string fileOf(const core::Endpoint& peer, bool replays) {
  const bool is_here =
      core::isSameHost(peer.address, core::kLoopbackAddress) || (!replays && core::isOwnAddress(peer.address));
  const std::string here = pathOf({core::kLoopbackAddress, peer.port}), named = pathOf(peer);
  // Earlier versions of the doctor named the file by the address that was flown, also on this computer.
  return is_here && !isNewer(named, here) ? here : named;
}

}  // namespace

std::uint32_t readConformance(const std::string& file, const core::Endpoint& peer, std::int32_t version, bool replays) {
  const std::string path = file.empty() ? fileOf(peer, replays) : file;
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

void nameByEachAddress(std::map<std::string, std::filesystem::path>* files) {
  const std::string here = core::Endpoint{core::kLoopbackAddress, 0}.addressString();
  const std::map<std::string, std::filesystem::path> in_folder = *files;
  for (const auto& [name, path] : in_folder) {
    if (name.rfind(here + "_", 0) != 0 || name.find(kSuffix) == std::string::npos) continue;
    for (const std::uint32_t address : core::ownAddresses()) {
      const std::string other = core::Endpoint{address, 0}.addressString() + name.substr(here.size());
      const auto named = in_folder.find(other);
      if (named == in_folder.end() || !isNewer(named->second, path)) (*files)[other] = path;
    }
  }
}

}  // namespace xplane_bridge
