#pragma once

#include <cstdint>
#include <string>

namespace xplane_bridge {

/// How a request ended. Numbers of ServiceResult.msg.
enum class ResultCode : std::uint8_t {
  kOk = 0,        ///< done, and seen in X-Plane
  kAccepted,      ///< begun; the outcome follows as an event
  kRefused,       ///< wrong, or not safe now
  kNotSupported,  ///< this version of X-Plane, or this aircraft, cannot
  kNoLink,        ///< X-Plane is not connected
  kTimeout,       ///< sent, but X-Plane has not shown it in time
};

struct RequestResult {
  ResultCode code = ResultCode::kOk;
  std::string text;  ///< one sentence

  bool success() const { return code == ResultCode::kOk || code == ResultCode::kAccepted; }
};

}  // namespace xplane_bridge
