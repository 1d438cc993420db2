#include "xplane_bridge/core/control/missing_channels.hpp"

#include <algorithm>

#include "xplane_bridge/core/base/text.hpp"

namespace xplane_bridge::core {
namespace {

struct Trim {
  Channel channel;
  const char* name;
  /// Any of them other than 0: there is one. An elevator trim may move the whole stabiliser.
  std::vector<std::string> datarefs;
};

const std::vector<Trim>& trims() {
  static const std::vector<Trim> kTrims = {
      {Channel::kTrimRoll,
       "aileron trim",
       {"sim/aircraft/controls/acf_max_trim_ailn", "sim/aircraft/controls/acf_min_trim_ailn"}},
      {Channel::kTrimPitch,
       "elevator trim",
       {"sim/aircraft/controls/acf_max_trim_elev", "sim/aircraft/controls/acf_min_trim_elev",
        "sim/aircraft/controls/acf_hstb_trim_up", "sim/aircraft/controls/acf_hstb_trim_dn"}},
      {Channel::kTrimYaw,
       "rudder trim",
       {"sim/aircraft/controls/acf_max_trim_rudd", "sim/aircraft/controls/acf_min_trim_rudd"}},
  };
  return kTrims;
}

}  // namespace

std::vector<std::string> trimDatarefs() {
  std::vector<std::string> out;
  for (const Trim& trim : trims()) {
    out.insert(out.end(), trim.datarefs.begin(), trim.datarefs.end());
  }
  return out;
}

std::vector<MissingChannel> missingTrims(const std::vector<DatarefValue>& values) {
  std::vector<MissingChannel> out;
  auto value = values.begin();
  for (const Trim& trim : trims()) {
    const auto end = value + static_cast<std::ptrdiff_t>(trim.datarefs.size());
    const bool missing = std::all_of(value, end, [](const DatarefValue& each) { return each == 0.0F; });
    value = end;
    if (!missing) continue;
    out.push_back(
        {trim.channel, "this aircraft has no " + std::string(trim.name) + " (" + join(trim.datarefs) + " are 0)"});
  }
  return out;
}

}  // namespace xplane_bridge::core
