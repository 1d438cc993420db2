#include "xplane_bridge/core/control/control_command.hpp"

#include <cmath>
#include <cstdio>

#include "xplane_bridge/core/control/field_bits.hpp"

namespace xplane_bridge::core {
namespace {

const ScalarChannel* scalarOf(Channel channel) {
  for (const auto& row : kScalarChannels) {
    if (row.channel == channel) return &row;
  }
  return nullptr;
}

std::optional<CommandRefusal> checkValue(double value, ChannelRange range, const std::string& name) {
  char text[160];
  if (!std::isfinite(value)) {
    std::snprintf(text, sizeof text, "%s is %g: expected a finite number", name.c_str(), value);
    return CommandRefusal{Refusal::kNotFinite, text};
  }
  if (value < range.low || value > range.high) {
    std::snprintf(text, sizeof text, "%s is %g: expected %g..%g", name.c_str(), value, range.low, range.high);
    return CommandRefusal{Refusal::kOutOfRange, text};
  }
  return std::nullopt;
}

std::optional<CommandRefusal> checkEngines(const ControlCommand& command) {
  const std::uint32_t kind = command.fields & kThrottleFields;
  if ((kind & (kind - 1u)) != 0u) {
    return CommandRefusal{Refusal::kThrottleConflict,
                          "fields has more than one of THROTTLE, ENGINE_THROTTLES and MOTORS: command one of them"};
  }
  if (kind == kFieldThrottle) return checkValue(command.throttle, kThrottleRange, "throttle");
  if (kind == 0u) return std::nullopt;
  if (command.engine_count < 1 || command.engine_count > kMaxEngines) {
    return CommandRefusal{Refusal::kEngineCount,
                          "engine_count is " + std::to_string(command.engine_count) + ": expected 1..8"};
  }
  const bool motors = kind == kFieldMotors;
  const auto& values = motors ? command.motors : command.engine_throttles;
  for (int engine = 0; engine < command.engine_count; ++engine) {
    const Channel channel = motors ? motorChannel(engine) : leverChannel(engine);
    auto wrong = checkValue(values[static_cast<std::size_t>(engine)], kThrottleRange, channelName(channel));
    if (wrong) return wrong;
  }
  return std::nullopt;
}

}  // namespace

ChannelRange commandRange(Channel channel) {
  const ScalarChannel* row = scalarOf(channel);
  return row ? row->range : kThrottleRange;
}

std::uint32_t fieldOf(Channel channel) {
  if (const ScalarChannel* row = scalarOf(channel)) return row->field;
  return isMotor(channel) ? kFieldMotors : kFieldEngineThrottles;
}

std::string channelName(Channel channel) {
  if (const ScalarChannel* row = scalarOf(channel)) return row->name;
  const Channel first = isMotor(channel) ? Channel::kMotor0 : Channel::kLever0;
  return (isMotor(channel) ? "motors[" : "engine_throttles[") + std::to_string(index(channel) - index(first)) + "]";
}

const char* toString(Refusal refusal) {
  switch (refusal) {
    case Refusal::kNone:
      return "none";
    case Refusal::kUnknownBits:
      return "unknown bits";
    case Refusal::kThrottleConflict:
      return "throttle conflict";
    case Refusal::kEngineCount:
      return "engine count";
    case Refusal::kNotFinite:
      return "not finite";
    case Refusal::kOutOfRange:
      return "out of range";
    case Refusal::kLengthMismatch:
      return "length mismatch";
    case Refusal::kUnknownSurface:
      return "unknown surface";
    case Refusal::kDuplicateSurface:
      return "duplicate surface";
    case Refusal::kCount:
      break;
  }
  return "unknown";
}

std::optional<CommandRefusal> checkCommand(const ControlCommand& command) {
  if (const auto wrong = unknownBits(command.fields, kAllFields)) return CommandRefusal{Refusal::kUnknownBits, *wrong};
  for (const auto& row : kScalarChannels) {
    if ((command.fields & row.field) == 0u) continue;
    if (auto wrong = checkValue(command.*row.value, row.range, row.name)) return wrong;
  }
  return checkEngines(command);
}

ExpandedCommand expand(const ControlCommand& command, int engines) {
  ExpandedCommand out;
  const auto set = [&out](Channel channel, double value) {
    out.values[index(channel)] = value;
    out.commanded.set(index(channel));
  };
  for (const auto& row : kScalarChannels) {
    if ((command.fields & row.field) != 0u) set(row.channel, command.*row.value);
  }
  if ((command.fields & kFieldThrottle) != 0u) {
    for (int engine = 0; engine < engines; ++engine) set(leverChannel(engine), command.throttle);
  }
  for (int engine = 0; engine < command.engine_count; ++engine) {
    const auto i = static_cast<std::size_t>(engine);
    if ((command.fields & kFieldEngineThrottles) != 0u) set(leverChannel(engine), command.engine_throttles[i]);
    if ((command.fields & kFieldMotors) != 0u) set(motorChannel(engine), command.motors[i]);
  }
  return out;
}

}  // namespace xplane_bridge::core
