#pragma once

/// What a pilot or controller can command, and what makes a command acceptable.
///
/// Signs: roll right +, pitch nose up +, yaw nose right +; trims likewise. Bits and ranges are ControlCommand.msg's.

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "xplane_bridge/core/base/limits.hpp"
#include "xplane_bridge/core/control/control_fields.hpp"

namespace xplane_bridge::core {

constexpr std::uint32_t kThrottleFields = kFieldThrottle | kFieldEngineThrottles | kFieldMotors;

constexpr std::size_t kChannelCount = static_cast<std::size_t>(Channel::kCount);

constexpr std::size_t index(Channel channel) { return static_cast<std::size_t>(channel); }
constexpr bool isLever(Channel c) { return c >= Channel::kLever0 && c < Channel::kMotor0; }
constexpr bool isMotor(Channel c) { return c >= Channel::kMotor0 && c < Channel::kTrimRoll; }

using ChannelSet = std::bitset<kChannelCount>;
using ChannelValues = std::array<double, kChannelCount>;

/// Range a command must keep (ControlCommand.msg).
ChannelRange commandRange(Channel channel);

/// The field of a channel; levers belong to kFieldEngineThrottles.
std::uint32_t fieldOf(Channel channel);

/// Name as in ControlCommand.msg and the YAML files, e.g. "trim_pitch", "engine_throttles[2]".
std::string channelName(Channel channel);

enum class Refusal : std::uint8_t {
  kNone,
  kUnknownBits,       ///< `fields` has bits beyond kAllFields
  kThrottleConflict,  ///< more than one of throttle, engine_throttles and motors
  kEngineCount,       ///< engine_throttles or motors with a count outside 1..kMaxEngines
  kNotFinite,         ///< NaN or infinity in a commanded value
  kOutOfRange,        ///< a commanded value outside its range
  kLengthMismatch,    ///< lists that must be as long as each other are not (surface commands)
  kUnknownSurface,    ///< a surface name the table does not have
  kDuplicateSurface,  ///< a surface named twice
  kCount,
};

const char* toString(Refusal refusal);

/// Why a command is refused as a whole, in words a user can act on.
struct CommandRefusal {
  Refusal reason = Refusal::kNone;
  std::string text;
};

std::optional<CommandRefusal> checkCommand(const ControlCommand& command);

/// Values and channels of a command that checkCommand() passed. One throttle becomes a lever for each of `engines`
/// (1..kMaxEngines) engines.
struct ExpandedCommand {
  ChannelValues values{};
  ChannelSet commanded;
};
ExpandedCommand expand(const ControlCommand& command, int engines);

}  // namespace xplane_bridge::core
