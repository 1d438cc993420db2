#include "xplane_bridge/nodes/messages/control_conversions.hpp"

#include <algorithm>

#include "xplane_bridge/ControlMode.h"

namespace xplane_bridge {
namespace {

using core::Channel;
using core::kMaxEngines;

// The bits of the message are the core's: whoever changes one is told here.
constexpr bool same(std::uint32_t message, std::uint32_t core) { return message == core; }
static_assert(same(ControlCommand::ROLL, core::kFieldRoll) && same(ControlCommand::PITCH, core::kFieldPitch) &&
                  same(ControlCommand::YAW, core::kFieldYaw) && same(ControlCommand::THROTTLE, core::kFieldThrottle) &&
                  same(ControlCommand::ENGINE_THROTTLES, core::kFieldEngineThrottles) &&
                  same(ControlCommand::MOTORS, core::kFieldMotors) &&
                  same(ControlCommand::TRIM_ROLL, core::kFieldTrimRoll) &&
                  same(ControlCommand::TRIM_PITCH, core::kFieldTrimPitch) &&
                  same(ControlCommand::TRIM_YAW, core::kFieldTrimYaw) &&
                  same(ControlCommand::FLAPS, core::kFieldFlaps) &&
                  same(ControlCommand::SPEEDBRAKE, core::kFieldSpeedbrake) &&
                  same(ControlCommand::GEAR, core::kFieldGear) &&
                  same(ControlCommand::PARKING_BRAKE, core::kFieldParkingBrake) &&
                  same(ControlCommand::TOE_BRAKES, core::kFieldToeBrakes) &&
                  same(ControlCommand::THRUST_VECTOR, core::kFieldThrustVector) &&
                  same(ControlCommand::ALL_FIELDS, core::kAllFields),
              "ControlCommand.msg and core/control_command.hpp disagree");
static_assert(same(static_cast<std::uint32_t>(core::FlightMode::kManual), ControlMode::MANUAL) &&
                  same(static_cast<std::uint32_t>(core::FlightMode::kAuto), ControlMode::AUTO),
              "ControlMode.msg and core/control_arbiter.hpp disagree");
static_assert(same(static_cast<std::uint32_t>(core::CommandSource::kManual), AppliedCommand::SOURCE_MANUAL) &&
                  same(static_cast<std::uint32_t>(core::CommandSource::kAuto), AppliedCommand::SOURCE_AUTO) &&
                  same(static_cast<std::uint32_t>(core::CommandSource::kFailsafe), AppliedCommand::SOURCE_FAILSAFE),
              "AppliedCommand.msg and core/control_arbiter.hpp disagree");

// One list for both directions: message member, core member.
template <class Message, class Command, class Copy>
void copyScalars(Message& message, Command& command, Copy copy) {
  copy(message.roll, command.roll);
  copy(message.pitch, command.pitch);
  copy(message.yaw, command.yaw);
  copy(message.throttle, command.throttle);
  copy(message.trim_roll, command.trim_roll);
  copy(message.trim_pitch, command.trim_pitch);
  copy(message.trim_yaw, command.trim_yaw);
  copy(message.flaps, command.flaps);
  copy(message.speedbrake, command.speedbrake);
  copy(message.gear, command.gear);
  copy(message.parking_brake, command.parking_brake);
  copy(message.left_brake, command.left_brake);
  copy(message.right_brake, command.right_brake);
  copy(message.thrust_vector, command.thrust_vector);
  for (std::size_t i = 0; i < kMaxEngines; ++i) {
    copy(message.engine_throttles[i], command.engine_throttles[i]);
    copy(message.motors[i], command.motors[i]);
  }
}

}  // namespace

core::ControlCommand toCore(const ControlCommand& message) {
  core::ControlCommand command;
  command.sequence = message.sequence;
  command.fields = message.fields;
  command.engine_count = message.engine_count;
  copyScalars(message, command, [](float from, double& to) { to = static_cast<double>(from); });
  return command;
}

void toMessage(const core::ControlCommand& command, ControlCommand* message) {
  message->sequence = command.sequence;
  message->fields = command.fields;
  message->engine_count = static_cast<std::uint8_t>(command.engine_count);
  copyScalars(*message, command, [](float& to, double from) { to = static_cast<float>(from); });
}

void toMessage(const core::ArbitratedControls& controls, AppliedCommand* message) {
  const auto value = [&controls](Channel channel) { return static_cast<float>(controls.values[core::index(channel)]); };
  message->mode = static_cast<std::uint8_t>(controls.mode);
  message->source = static_cast<std::uint8_t>(controls.source);
  message->sequence = controls.sequence;
  message->source_age.fromSec(controls.source_age);
  message->fields = controls.fields;
  message->limited = controls.limited;
  message->excited = controls.excited;
  message->roll = value(Channel::kRoll);
  message->pitch = value(Channel::kPitch);
  message->yaw = value(Channel::kYaw);
  const bool motors = (controls.fields & core::kFieldMotors) != 0u;
  message->engine_count = 0;
  for (int engine = 0; engine < kMaxEngines; ++engine) {
    const Channel channel = motors ? core::motorChannel(engine) : core::leverChannel(engine);
    message->throttles[static_cast<std::size_t>(engine)] = value(channel);
    if (controls.active.test(core::index(channel))) message->engine_count = static_cast<std::uint8_t>(engine + 1);
  }
  message->trim_roll = value(Channel::kTrimRoll);
  message->trim_pitch = value(Channel::kTrimPitch);
  message->trim_yaw = value(Channel::kTrimYaw);
  message->flaps = value(Channel::kFlaps);
  message->speedbrake = value(Channel::kSpeedbrake);
  message->gear = value(Channel::kGear);
  message->parking_brake = value(Channel::kParkingBrake);
  message->left_brake = value(Channel::kLeftBrake);
  message->right_brake = value(Channel::kRightBrake);
  message->thrust_vector = value(Channel::kThrustVector);
}

void fillSurfaces(const std::vector<core::SurfaceDeflection>& surfaces, AppliedCommand* message) {
  message->surface_names.clear();
  message->surface_deflections_deg.clear();
  for (const core::SurfaceDeflection& surface : surfaces) {
    message->surface_names.push_back(core::surfaceTable()[surface.surface].name);
    message->surface_deflections_deg.push_back(static_cast<float>(surface.deflection_deg));
  }
}

}  // namespace xplane_bridge
