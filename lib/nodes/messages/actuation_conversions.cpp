#include "xplane_bridge/nodes/messages/actuation_conversions.hpp"

#include "xplane_bridge/nodes/base/ros_time.hpp"
#include "xplane_bridge/nodes/messages/control_conversions.hpp"
#include "xplane_bridge/nodes/messages/field_copy.hpp"

namespace xplane_bridge {
core::FailureRequest toCore(const SetFailure::Request& request) {
  core::FailureRequest out;
  out.name = request.name;
  out.kind = request.kind;
  if (request.has_value) out.value = static_cast<double>(request.value);
  out.trigger = request.trigger;
  out.trigger_value = static_cast<double>(request.trigger_value);
  return out;
}

ExcitationRequest toCore(const InjectExcitation::Request& request) {
  ExcitationRequest out;
  out.kind = request.kind;
  out.target = request.target;
  out.amplitude = static_cast<double>(request.amplitude);
  out.duration = static_cast<double>(request.duration);
  out.frequency_min = static_cast<double>(request.frequency_min);
  out.frequency_max = static_cast<double>(request.frequency_max);
  out.seed = request.seed;
  out.max_roll_deg = static_cast<double>(request.max_roll_deg);
  out.max_pitch_deg = static_cast<double>(request.max_pitch_deg);
  return out;
}

IdentificationRequest toCore(const IdentifySurfaces::Request& request) {
  IdentificationRequest out;
  out.save = request.do_not_save == 0;
  out.max_roll_deg = static_cast<double>(request.max_roll_deg);
  out.max_pitch_deg = static_cast<double>(request.max_pitch_deg);
  out.max_rate_deg_s = static_cast<double>(request.max_rate_deg_s);
  out.max_airspeed_change = static_cast<double>(request.max_airspeed_change);
  out.min_height = static_cast<double>(request.min_height);
  return out;
}

ServiceResult toMessage(const RequestResult& result) {
  ServiceResult out;
  out.code = static_cast<std::uint8_t>(result.code);
  out.message = result.text;
  return out;
}

void toMessage(const AppliedControls& applied, const std::vector<core::SurfaceDeflection>& surfaces,
               AppliedCommand* message) {
  message->header.stamp = toRosTime(applied.sent_ns);
  toMessage(applied.controls, message);
  fillSurfaces(surfaces, message);
  message->read_back = applied.read_back;
  message->read_back_sim_time = static_cast<float>(applied.read_back_sim_time);
  message->read_back_frames = static_cast<float>(applied.read_back_frames);
}

void toMessage(const SurfaceControl::Echo& echo, core::FlightMode mode,
               const std::vector<core::SurfaceDeflection>& surfaces, AppliedCommand* message) {
  message->mode = static_cast<std::uint8_t>(mode);
  message->source = AppliedCommand::SOURCE_NONE;
  message->sequence = echo.sequence;
  fillSurfaces(surfaces, message);
  message->read_back = echo.read_back;
  message->read_back_sim_time = static_cast<float>(echo.sim_time);
  message->read_back_frames = static_cast<float>(echo.frames);
}

void toMessage(const FailureSnapshot& snapshot, FailureState* message) {
  const std_msgs::Header header = message->header;
  *message = FailureState();
  message->header = header;
  message->sim_time = static_cast<float>(snapshot.sim_time);
  for (const core::FailureLabel& label : snapshot.labels) {
    message->names.push_back(label.name);
    message->kinds.push_back(label.kind);
    message->values.push_back(static_cast<float>(label.value));
    message->set_by.emplace_back(label.by_bridge ? "bridge" : "simulator");
    message->active.push_back(label.active);
    message->confirmed.push_back(label.confirmed);
    message->since_sim_time.push_back(static_cast<float>(label.since_sim_time));
  }
  message->surrogate_mixing = snapshot.surrogate_mixing;
  message->surrogate_lag_frames = static_cast<float>(snapshot.surrogate_lag_frames);
}

void toMessage(const ExcitationLabel& label, ExcitationState* message) {
  message->sim_time = static_cast<float>(label.sim_time);
  message->active = label.active;
  message->id = label.id;
  message->kind = label.kind;
  message->target = label.target;
  message->amplitude = static_cast<float>(label.amplitude);
  message->duration = static_cast<float>(label.duration);
  message->frequency_min = static_cast<float>(label.frequency_min);
  message->frequency_max = static_cast<float>(label.frequency_max);
  message->seed = label.seed;
  message->start_sim_time = static_cast<float>(label.start_sim_time);
  message->end_sim_time = static_cast<float>(label.end_sim_time);
  message->result = label.result;
}

core::DisturbanceSpec toCore(const SetDisturbance::Request& request) {
  core::DisturbanceSpec out;
  out.horizontal_only = request.horizontal_only != 0;
  out.duration = static_cast<double>(request.duration);
  out.from_deg = static_cast<double>(request.from_deg);
  out.speed = static_cast<double>(request.speed);
  out.vertical_speed = static_cast<double>(request.vertical_speed);
  out.length = static_cast<double>(request.length);
  out.gradient = static_cast<double>(request.gradient);
  out.roughness = static_cast<double>(request.roughness);
  out.seed = request.seed;
  out.latitude_deg = request.latitude;
  out.longitude_deg = request.longitude;
  out.radius = static_cast<double>(request.radius);
  out.height = static_cast<double>(request.height);
  return out;
}

void toMessage(const DisturbanceLabel& label, DisturbanceState* message) {
  message->sim_time = static_cast<float>(label.sim_time);
  message->active = label.active;
  message->id = label.id;
  putField(label.steady, &message->steady_ned);
  putField(label.model, &message->model_ned);
  putField(label.commanded, &message->commanded_ned);
  message->wind_speed = static_cast<float>(label.wind_speed);
  message->wind_from_deg = static_cast<float>(label.wind_from_deg);
  message->start_sim_time = static_cast<float>(label.start_sim_time);
  message->end_sim_time = static_cast<float>(label.end_sim_time);
  message->result = label.result;
  if (!label.spec) return;
  const core::DisturbanceSpec& spec = *label.spec;
  message->kind = core::toString(spec.kind);
  message->horizontal_only = spec.horizontal_only;
  message->duration = static_cast<float>(spec.duration);
  message->from_deg = static_cast<float>(spec.from_deg);
  message->speed = static_cast<float>(spec.speed);
  message->vertical_speed = static_cast<float>(spec.vertical_speed);
  message->length = static_cast<float>(spec.length);
  message->gradient = static_cast<float>(spec.gradient);
  message->roughness = static_cast<float>(spec.roughness);
  message->seed = spec.seed;
  message->latitude = spec.latitude_deg;
  message->longitude = spec.longitude_deg;
  message->radius = static_cast<float>(spec.radius);
  message->height = static_cast<float>(spec.height);
}

}  // namespace xplane_bridge
