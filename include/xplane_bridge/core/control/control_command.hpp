/// What a pilot or controller can command, and what makes a command acceptable.
///
/// Signs: roll right +, pitch nose up +, yaw nose right +; trims likewise. Bits and ranges are ControlCommand.msg's.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "xplane_bridge/core/base/limits.hpp"

namespace xplane_bridge::core {

/// Bits of ControlCommand.msg's `fields`.
enum Field : std::uint32_t {
  kFieldRoll = 1u << 0,
  kFieldPitch = 1u << 1,
  kFieldYaw = 1u << 2,
  kFieldThrottle = 1u << 3,         ///< one lever for all engines
  kFieldEngineThrottles = 1u << 4,  ///< one lever each
  kFieldMotors = 1u << 5,           ///< motors directly, past the levers
  kFieldTrimRoll = 1u << 6,
  kFieldTrimPitch = 1u << 7,
  kFieldTrimYaw = 1u << 8,
  kFieldFlaps = 1u << 9,
  kFieldSpeedbrake = 1u << 10,
  kFieldGear = 1u << 11,
  kFieldParkingBrake = 1u << 12,
  kFieldToeBrakes = 1u << 13,
  kFieldThrustVector = 1u << 14,
};
constexpr std::uint32_t kAllFields = (1u << 15) - 1u;
constexpr std::uint32_t kThrottleFields = kFieldThrottle | kFieldEngineThrottles | kFieldMotors;

/// One number that is sent to X-Plane. Levers and motors follow each other by engine: see leverChannel().
enum class Channel : std::uint8_t {
  kRoll,
  kPitch,
  kYaw,
  kLever0,
  kMotor0 = kLever0 + kMaxEngines,
  kTrimRoll = kMotor0 + kMaxEngines,
  kTrimPitch,
  kTrimYaw,
  kFlaps,
  kSpeedbrake,
  kGear,
  kParkingBrake,
  kLeftBrake,
  kRightBrake,
  kThrustVector,
  kCount,
};
constexpr std::size_t kChannelCount = static_cast<std::size_t>(Channel::kCount);

constexpr std::size_t index(Channel channel) { return static_cast<std::size_t>(channel); }
constexpr Channel leverChannel(int engine) { return static_cast<Channel>(static_cast<int>(Channel::kLever0) + engine); }
constexpr Channel motorChannel(int engine) { return static_cast<Channel>(static_cast<int>(Channel::kMotor0) + engine); }
constexpr bool isLever(Channel c) { return c >= Channel::kLever0 && c < Channel::kMotor0; }
constexpr bool isMotor(Channel c) { return c >= Channel::kMotor0 && c < Channel::kTrimRoll; }

using ChannelSet = std::bitset<kChannelCount>;
using ChannelValues = std::array<double, kChannelCount>;

struct ChannelRange {
  double low, high;
};

/// Range a command must keep (ControlCommand.msg).
ChannelRange commandRange(Channel channel);

/// The field of a channel; levers belong to kFieldEngineThrottles.
std::uint32_t fieldOf(Channel channel);

/// Name as in ControlCommand.msg and the YAML files, e.g. "trim_pitch", "engine_throttles[2]".
std::string channelName(Channel channel);

/// A command as it arrives; same fields, units and ranges as ControlCommand.msg.
struct ControlCommand {
  std::uint32_t sequence = 0;
  std::uint32_t fields = 0;  ///< Field bits: which values below count
  double roll = 0.0, pitch = 0.0, yaw = 0.0;
  double throttle = 0.0;
  int engine_count = 0;  ///< entries used of the two arrays
  std::array<double, kMaxEngines> engine_throttles{};
  std::array<double, kMaxEngines> motors{};
  double trim_roll = 0.0, trim_pitch = 0.0, trim_yaw = 0.0;
  double flaps = 0.0, speedbrake = 0.0, gear = 0.0;
  double parking_brake = 0.0, left_brake = 0.0, right_brake = 0.0;
  double thrust_vector = 0.0;
};

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
