#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "xplane_bridge/core/wire/rref_frame_assembler.hpp"

namespace xplane_bridge::core {

/// Whether both have the same values at the same places; a NaN is the same as another.
bool sameValues(const std::vector<float>& a, const std::vector<float>& b);

/// What a user has set in X-Plane and what a flight depends on, of what every version shows: speed of time, whether the
/// date is the computer's, how the joystick is read, how fast Data Output comes, and the resolution of textures.
class XPlaneSettings {
 public:
  XPlaneSettings();

  /// What to subscribe; the position is the index. Once a second is enough (kRateHz).
  static const std::vector<std::string>& datarefs();
  static constexpr std::int32_t kRateHz = 1;

  /// @return true when the datagram completed values that differ from the last ones
  bool add(const RrefView& datagram, std::int64_t receive_ns);
  /// By position; NaN where X-Plane has not answered. Empty before the first.
  const std::vector<float>& values() const { return values_; }
  /// The subscription starts anew; the values are kept until others come.
  void reset() { frames_.reset(); }

 private:
  RrefFrameAssembler frames_;
  std::vector<float> values_;
};

}  // namespace xplane_bridge::core
