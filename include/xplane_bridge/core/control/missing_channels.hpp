#pragma once

/// Channels that the loaded aircraft has nothing for. X-Plane takes and shows such a command all the same.

#include <string>
#include <vector>

#include "xplane_bridge/core/control/control_command.hpp"
#include "xplane_bridge/core/wire/dataref_reader.hpp"

namespace xplane_bridge::core {

struct MissingChannel {
  Channel channel;
  std::string why;  ///< "this aircraft has no rudder trim (acf_max_trim_rudd and acf_min_trim_rudd are 0)"
};

/// What shows it, of the loaded aircraft: how far trims move their surfaces. Names after Laminar's lists of 11.40 to
/// 12.10, which have all of them.
std::vector<std::string> trimDatarefs();

/// Trims that move nothing.
/// @param values of trimDatarefs(); one that did not answer shows nothing
std::vector<MissingChannel> missingTrims(const std::vector<DatarefValue>& values);

}  // namespace xplane_bridge::core
