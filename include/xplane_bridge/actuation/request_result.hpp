#pragma once

#include <string>

#include "xplane_bridge/core/base/message_constants.hpp"

namespace xplane_bridge {

/// How a request ended: ServiceResult.msg.
struct RequestResult {
  core::ResultCode code = core::ResultCode::kOk;
  std::string text;  ///< one sentence

  bool success() const { return code == core::ResultCode::kOk || code == core::ResultCode::kAccepted; }
};

}  // namespace xplane_bridge
