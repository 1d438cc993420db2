#include "xplane_bridge/core/failures/failure_names.hpp"

#include <algorithm>
#include <iterator>
#include <sstream>

#include "xplane_bridge/core/failures/failures.hpp"

namespace xplane_bridge::core {
namespace {

// Beginnings of those that keep surfaces from following.
constexpr const char* kOfSurfaces[] = {"rel_conlock", "rel_fc_",   "rel_fcon_",    "rel_ail_",  "rel_elv_",
                                       "rel_rud_",    "rel_trim_", "rel_flap_act", "rel_L_flp", "rel_R_flp"};

}  // namespace

bool touchesSurfaces(const std::string& dataref) {
  const std::string name = failureName(dataref);
  return std::any_of(std::begin(kOfSurfaces), std::end(kOfSurfaces),
                     [&name](const char* beginning) { return name.rfind(beginning, 0) == 0; });
}

std::vector<std::string> simulatorFailures(SimulatorVersion version) {
  std::vector<std::string> out;
  for (const FailureNames& row : failureNameTable()) {
    if (!row.versions.has(version)) continue;
    std::istringstream in(row.leaves);
    for (std::string leaf; in >> leaf;) out.push_back(failureDataref("rel_" + leaf));
  }
  return out;
}

bool hasFailure(SimulatorVersion version, const std::string& dataref) {
  const std::vector<std::string> names = simulatorFailures(version);
  return std::find(names.begin(), names.end(), dataref) != names.end();
}

}  // namespace xplane_bridge::core
