#pragma once

#include <optional>
#include <string>

#include "xplane_bridge/core/surfaces/surface_mixing.hpp"

namespace xplane_bridge {

/// The mixing kept for an aircraft (docs/control/mixing_file.md); nullopt where there is none.
/// @throws core::MixingFileError
std::optional<core::MixingModel> readMixingFile(const std::string& folder, const std::string& aircraft);

/// Keeps a mixing; makes the folder. Returns the file's path. @throws core::MixingFileError
std::string writeMixingFile(const std::string& folder, const core::MixingModel& model);

}  // namespace xplane_bridge
