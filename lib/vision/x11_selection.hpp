#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "xplane_bridge/vision/x11_window_source.hpp"

namespace xplane_bridge::vision {

/// As xwininfo prints window ids.
[[nodiscard]] std::string hex(std::uint32_t value);

/// The window or region that the options ask for, in words.
[[nodiscard]] std::string selection(const X11SourceOptions& options);

/// What there is instead of the window looked for, for the end of a sentence.
[[nodiscard]] std::string thereAre(std::vector<std::string> titles);

/// @throws std::invalid_argument when the options contradict each other
void validate(const X11SourceOptions& options);

}  // namespace xplane_bridge::vision
