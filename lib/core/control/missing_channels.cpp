#include "xplane_bridge/core/control/missing_channels.hpp"

#include <algorithm>

#include "xplane_bridge/core/base/text.hpp"

namespace xplane_bridge::core {
namespace {

const std::string kFolder = "sim/aircraft/controls/";

struct Trim {
  Channel channel;
  const char* name;
  /// Any of them other than 0: there is one. An elevator trim may move the whole stabiliser.
  std::vector<std::string> leaves;
};

const std::vector<Trim>& trims() {
  static const std::vector<Trim> kTrims = {
      {Channel::kTrimRoll, "aileron trim", {"acf_max_trim_ailn", "acf_min_trim_ailn"}},
      {Channel::kTrimPitch,
       "elevator trim",
       {"acf_max_trim_elev", "acf_min_trim_elev", "acf_hstb_trim_up", "acf_hstb_trim_dn"}},
      {Channel::kTrimYaw, "rudder trim", {"acf_max_trim_rudd", "acf_min_trim_rudd"}},
  };
  return kTrims;
}

}  // namespace

std::vector<std::string> trimDatarefs() {
  std::vector<std::string> out;
  for (const Trim& trim : trims()) {
    for (const std::string& leaf : trim.leaves) out.push_back(kFolder + leaf);
  }
  return out;
}

std::vector<MissingChannel> missingTrims(const std::vector<DatarefValue>& values) {
  std::vector<MissingChannel> out;
  auto value = values.begin();
  for (const Trim& trim : trims()) {
    const auto end = value + static_cast<std::ptrdiff_t>(trim.leaves.size());
    const bool missing = std::all_of(value, end, [](const DatarefValue& each) { return each == 0.0F; });
    value = end;
    if (!missing) continue;
    out.push_back({trim.channel, "this aircraft has no " + std::string(trim.name) + " (" + join(trim.leaves) +
                                     " of sim/aircraft/controls are 0)"});
  }
  return out;
}

}  // namespace xplane_bridge::core
