#include "xplane_bridge/nodes/messages/control_conversions.hpp"

#include "xplane_bridge/nodes/messages/control_scalars.hpp"

namespace xplane_bridge {
namespace {

using core::Channel;
using core::kMaxEngines;

template <class Message, class Command, class Copy>
void forEachValue(Message& message, Command& command, Copy copy) {
  forEachScalar(message, command, copy);
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
  forEachValue(message, command, [](float from, double& to) { to = static_cast<double>(from); });
  return command;
}

void toMessage(const core::ControlCommand& command, ControlCommand* message) {
  message->sequence = command.sequence;
  message->fields = command.fields;
  message->engine_count = static_cast<std::uint8_t>(command.engine_count);
  forEachValue(*message, command, [](float& to, double from) { to = static_cast<float>(from); });
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
  const bool motors = (controls.fields & core::kFieldMotors) != 0u;
  message->engine_count = 0;
  for (int engine = 0; engine < kMaxEngines; ++engine) {
    const Channel channel = motors ? core::motorChannel(engine) : core::leverChannel(engine);
    message->throttles[static_cast<std::size_t>(engine)] = value(channel);
    if (controls.active.test(core::index(channel))) message->engine_count = static_cast<std::uint8_t>(engine + 1);
  }
  forEachChannel(*message, [&value](float& to, Channel channel) { to = value(channel); });
}

void toMessage(const core::ModeStatus& status, double sim_time, ControlMode* message) {
  message->mode = static_cast<std::uint8_t>(status.mode);
  message->previous = status.previous ? static_cast<std::uint8_t>(*status.previous) : std::uint8_t{0};
  message->requested_by = status.requested_by;
  message->reason = status.reason;
  message->request_sequence = status.request_sequence;
  message->accepted = status.accepted;
  message->sim_time = static_cast<float>(sim_time);
  message->manual_alive = status.manual_alive;
  message->auto_alive = status.auto_alive;
  message->failsafe = status.failsafe;
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
