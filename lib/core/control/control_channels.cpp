#include "xplane_bridge/core/control/control_channels.hpp"

#include <algorithm>
#include <cmath>

#include "xplane_bridge/core/control/control_rows.hpp"

namespace xplane_bridge::core {
namespace {

// override_joystick would take pedals and auto-coordination from who commands roll only.
constexpr const char* kJoystickRoll = "sim/operation/override/override_joystick_roll";
constexpr const char* kJoystickPitch = "sim/operation/override/override_joystick_pitch";
constexpr const char* kJoystickHeading = "sim/operation/override/override_joystick_heading";
constexpr const char* kThrottles = "sim/operation/override/override_throttles";
constexpr const char* kToeBrakes = "sim/operation/override/override_toe_brakes";
constexpr const char* kOverridePrefix = "sim/operation/override/override_";

// X-Plane keeps these as float32, so what was sent comes back but for one rounding.
constexpr double kExact = 1e-6;
// A handle may be rounded to a detent of the aircraft.
constexpr double kHandle = 0.02;

struct Row {
  Channel first, last;  // inclusive
  ChannelWire wire;
};

// docs/protocol.md 5.1.
constexpr Row kRows[] = {
    {Channel::kRoll,
     Channel::kRoll,
     {"sim/joystick/yoke_roll_ratio", "sim/joystick/yoke_roll_ratio", kJoystickRoll, Refresh::kContinuous, kExact}},
    {Channel::kPitch,
     Channel::kPitch,
     {"sim/joystick/yoke_pitch_ratio", "sim/joystick/yoke_pitch_ratio", kJoystickPitch, Refresh::kContinuous, kExact}},
    {Channel::kYaw,
     Channel::kYaw,
     {"sim/joystick/yoke_heading_ratio", "sim/joystick/yoke_heading_ratio", kJoystickHeading, Refresh::kContinuous,
      kExact}},
    {Channel::kLever0,
     leverChannel(kMaxEngines - 1),
     {"sim/cockpit2/engine/actuators/throttle_ratio", "sim/cockpit2/engine/actuators/throttle_ratio", nullptr,
      Refresh::kContinuous, kExact}},
    {Channel::kMotor0,
     motorChannel(kMaxEngines - 1),
     {"sim/flightmodel/engine/ENGN_thro_use", "sim/flightmodel/engine/ENGN_thro_use", kThrottles, Refresh::kContinuous,
      kExact}},
    {Channel::kTrimRoll,
     Channel::kTrimRoll,
     {"sim/cockpit2/controls/aileron_trim", "sim/cockpit2/controls/aileron_trim", nullptr, Refresh::kOnChange, kExact}},
    {Channel::kTrimPitch,
     Channel::kTrimPitch,
     {"sim/cockpit2/controls/elevator_trim", "sim/cockpit2/controls/elevator_trim", nullptr, Refresh::kOnChange,
      kExact}},
    {Channel::kTrimYaw,
     Channel::kTrimYaw,
     {"sim/cockpit2/controls/rudder_trim", "sim/cockpit2/controls/rudder_trim", nullptr, Refresh::kOnChange, kExact}},
    {Channel::kFlaps,
     Channel::kFlaps,
     {"sim/cockpit2/controls/flap_ratio", "sim/cockpit2/controls/flap_ratio", nullptr, Refresh::kOnChange, kHandle}},
    {Channel::kSpeedbrake,
     Channel::kSpeedbrake,
     {"sim/cockpit2/controls/speedbrake_ratio", "sim/cockpit2/controls/speedbrake_ratio", nullptr, Refresh::kOnChange,
      kHandle}},
    {Channel::kGear,
     Channel::kGear,
     {"sim/cockpit2/controls/gear_handle_down", "sim/cockpit2/controls/gear_handle_down", nullptr, Refresh::kOnChange,
      kExact}},
    {Channel::kParkingBrake,
     Channel::kParkingBrake,
     {"sim/cockpit2/controls/parking_brake_ratio", "sim/cockpit2/controls/parking_brake_ratio", nullptr,
      Refresh::kOnChange, kHandle}},
    {Channel::kLeftBrake,
     Channel::kLeftBrake,
     {"sim/cockpit2/controls/left_brake_ratio", "sim/cockpit2/controls/left_brake_ratio", kToeBrakes,
      Refresh::kContinuous, kExact}},
    {Channel::kRightBrake,
     Channel::kRightBrake,
     {"sim/cockpit2/controls/right_brake_ratio", "sim/cockpit2/controls/right_brake_ratio", kToeBrakes,
      Refresh::kContinuous, kExact}},
    {Channel::kThrustVector,
     Channel::kThrustVector,
     {"sim/cockpit2/controls/thrust_vector_ratio", "sim/cockpit2/controls/thrust_vector_ratio", nullptr,
      Refresh::kOnChange, kHandle}},
};

constexpr bool hasWire(Channel channel) {
  for (const Row& row : kRows) {
    if (channel >= row.first && channel <= row.last) return true;
  }
  return false;
}
constexpr bool everyChannelHasWire() {
  for (std::size_t i = 0; i < kChannelCount; ++i) {
    if (!hasWire(static_cast<Channel>(i))) return false;
  }
  return true;
}
static_assert(everyChannelHasWire(), "a channel of ControlCommand.msg has no line here");

// X-Plane 12 marks flap_ratio as replaced.
constexpr ChannelWire kFlaps12 = {"sim/cockpit2/controls/flap_handle_request_ratio",
                                  "sim/cockpit2/controls/flap_handle_request_ratio", nullptr, Refresh::kOnChange,
                                  kHandle};
// [? reverse-lever] -1 full reverse .. 1 full throttle, from the description in X-Plane's list.
constexpr ChannelWire kReverseLever = {"sim/cockpit2/engine/actuators/throttle_jet_rev_ratio",
                                       "sim/cockpit2/engine/actuators/throttle_jet_rev_ratio", nullptr,
                                       Refresh::kContinuous, kExact};

std::string elementName(const char* dataref, Channel channel) {
  if (isLever(channel))
    return std::string(dataref) + "[" + std::to_string(index(channel) - index(Channel::kLever0)) + "]";
  if (isMotor(channel))
    return std::string(dataref) + "[" + std::to_string(index(channel) - index(Channel::kMotor0)) + "]";
  return dataref;
}

}  // namespace

const char* const kThrottleOverride = "sim/flightmodel/engine/ENGN_thro_override";
const char* const kSurfaceOverride = "sim/operation/override/override_control_surfaces";

const ChannelWire& channelWire(Channel channel, const EncoderOptions& options) {
  if (channel == Channel::kFlaps && options.version.is12()) return kFlaps12;
  if (isLever(channel) && options.reverse_thrust) return kReverseLever;
  return std::find_if(std::begin(kRows), std::end(kRows),
                      [channel](const Row& row) { return channel >= row.first && channel <= row.last; })
      ->wire;
}

std::string writeDataref(Channel channel, const EncoderOptions& options) {
  return elementName(channelWire(channel, options).write, channel);
}

std::string readBackDataref(Channel channel, const EncoderOptions& options) {
  return elementName(channelWire(channel, options).read_back, channel);
}

std::vector<std::string> requiredOverrides(const ChannelSet& channels, const EncoderOptions& options) {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < kChannelCount; ++i) {
    if (!channels.test(i)) continue;
    const char* name = channelWire(static_cast<Channel>(i), options).override_name;
    if (name && std::find(out.begin(), out.end(), name) == out.end()) out.emplace_back(name);
  }
  for (const DataRow& row : controlRows({}, channels, {}, options)) out.push_back(rowName(row.index));
  return out;
}

std::optional<DatarefWrite> releaseOf(const std::string& dataref) {
  if (dataref.compare(0, std::string(kOverridePrefix).size(), kOverridePrefix) == 0) return DatarefWrite{dataref, 0.0f};
  if (dataref.compare(0, std::string(kThrottleOverride).size(), kThrottleOverride) == 0) {
    return DatarefWrite{dataref, -2.0f};
  }
  return std::nullopt;
}

float wireValue(Channel channel, double value) {
  if (channel == Channel::kGear) return value < 0.5 ? 0.0f : 1.0f;
  return static_cast<float>(value);
}

ControlEncoder::ControlEncoder(const EncoderOptions& options) : options_(options) {
  for (std::size_t i = 0; i < kChannelCount; ++i) {
    names_[i] = writeDataref(static_cast<Channel>(i), options_);
    in_rows_.set(i, !rowSlotsOf(static_cast<Channel>(i), options_).empty());
  }
}

void ControlEncoder::encode(const ChannelValues& values, const ChannelSet& channels,
                            std::vector<DatarefWrite>& out) const {
  for (std::size_t i = 0; i < kChannelCount; ++i) {
    if (channels.test(i) && !in_rows_.test(i))
      out.push_back({names_[i], wireValue(static_cast<Channel>(i), values[i])});
  }
}

bool ControlEncoder::matches(Channel channel, double sent, double shown) const {
  const double wire = static_cast<double>(wireValue(channel, sent));
  return std::abs(shown - wire) <= channelWire(channel, options_).read_back_tolerance;
}

}  // namespace xplane_bridge::core
