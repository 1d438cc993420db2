#include "xplane_bridge/core/state/xplane_settings.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

namespace xplane_bridge::core {

bool sameValues(const std::vector<float>& a, const std::vector<float>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](float one, float other) {
    return std::isnan(one) ? std::isnan(other) : std::equal_to<>()(one, other);
  });
}

XPlaneSettings::XPlaneSettings() : frames_(datarefs().size(), 0, RrefFrameAssembler::Options::atRate(kRateHz)) {}

const std::vector<std::string>& XPlaneSettings::datarefs() {
  static const std::vector<std::string> kDatarefs = {
      "sim/time/sim_speed",
      "sim/time/use_system_time",
      "sim/joystick/joystick_roll_sensitivity",
      "sim/joystick/joystick_pitch_sensitivity",
      "sim/joystick/joystick_heading_sensitivity",
      "sim/joystick/joystick_roll_nullzone",
      "sim/joystick/joystick_pitch_nullzone",
      "sim/joystick/joystick_heading_nullzone",
      "sim/network/dataout/network_data_rate",
      "sim/graphics/settings/rendering_res",
  };
  return kDatarefs;
}

bool XPlaneSettings::add(const RrefView& datagram, std::int64_t receive_ns) {
  if (!frames_.add(datagram, receive_ns)) return false;
  const std::vector<float>& now = frames_.values();
  if (sameValues(now, values_)) return false;
  values_ = now;
  return true;
}

}  // namespace xplane_bridge::core
