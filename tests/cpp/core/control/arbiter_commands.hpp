#pragma once

/// Commands, requests and options that tests of the arbiter share.

#include <cstdint>
#include <string>

#include "xplane_bridge/core/control/control_arbiter.hpp"

namespace xplane_bridge::core {

constexpr auto kManual = FlightMode::kManual;
constexpr auto kAuto = FlightMode::kAuto;

inline ControlCommand stick(double roll, double pitch = 0.0, std::uint32_t sequence = 1) {
  ControlCommand command;
  command.sequence = sequence;
  command.fields = kFieldRoll | kFieldPitch;
  command.roll = roll;
  command.pitch = pitch;
  return command;
}

inline ControlCommand only(std::uint32_t field, double ControlCommand::*value, double number) {
  ControlCommand command;
  command.fields = field;
  command.*value = number;
  return command;
}

inline ModeRequest request(int mode, std::uint32_t sequence, const std::string& who = "joystick", double stamp = 0.0) {
  return {sequence, mode, who, stamp};
}

// Options in which changes are immediate, so that a test sees only what it is about.
inline ArbiterOptions direct() {
  ArbiterOptions options;
  options.transition_rate = std::numeric_limits<double>::infinity();
  return options;
}

inline double roll(const ArbitratedControls& out) { return out.values[index(Channel::kRoll)]; }

}  // namespace xplane_bridge::core
