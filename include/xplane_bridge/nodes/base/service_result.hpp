#pragma once

#include <cstdint>
#include <string>

#include "xplane_bridge/ServiceResult.h"

namespace xplane_bridge {

/// @param code one of ServiceResult's
/// @param message one sentence
inline ServiceResult result(std::uint8_t code, const std::string& message) {
  ServiceResult made;
  made.code = code;
  made.message = message;
  return made;
}

}  // namespace xplane_bridge
