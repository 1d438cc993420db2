#include "xplane_bridge/nodes/messages/traffic_conversions.hpp"

#include <type_traits>

namespace xplane_bridge {

void toMessage(const core::TrafficState& state, TrafficState* message) {
  message->sim_time = state.sim_time;
  const auto list = [&state](auto of, auto* array) {
    array->clear();
    for (const core::OtherAircraft& each : state.aircraft) {
      array->push_back(static_cast<typename std::decay_t<decltype(*array)>::value_type>(of(each)));
    }
  };
  using Other = core::OtherAircraft;
  list([](const Other& a) { return a.number; }, &message->number);
  list([](const Other& a) { return a.place.latitude_deg; }, &message->latitude);
  list([](const Other& a) { return a.place.longitude_deg; }, &message->longitude);
  list([](const Other& a) { return a.place.height; }, &message->altitude_msl);
  list([](const Other& a) { return a.roll_deg; }, &message->roll_deg);
  list([](const Other& a) { return a.pitch_deg; }, &message->pitch_deg);
  list([](const Other& a) { return a.heading_deg; }, &message->heading_true_deg);
  list([](const Other& a) { return a.velocity_ned.x(); }, &message->velocity_north);
  list([](const Other& a) { return a.velocity_ned.y(); }, &message->velocity_east);
  list([](const Other& a) { return a.velocity_ned.z(); }, &message->velocity_down);
  list([](const Other& a) { return a.tcas_distance; }, &message->tcas_distance);
  list([](const Other& a) { return a.tcas_bearing_deg; }, &message->tcas_bearing_deg);
  list([](const Other& a) { return a.tcas_altitude_difference; }, &message->tcas_altitude_difference);
  list([](const Other& a) { return a.mode_s_id; }, &message->mode_s_id);
  list([](const Other& a) { return a.transponder_code; }, &message->transponder_code);
}

std::variant<std::vector<core::TrafficPose>, std::string> toCore(const TrafficCommand& message) {
  const std::size_t count = message.number.size();
  std::string wrong;
  const auto hold = [&wrong, count](const char* name, const auto& array, bool may_be_empty) {
    if (array.size() == count || (may_be_empty && array.empty()) || !wrong.empty()) return;
    wrong = std::string(name) + " has " + std::to_string(array.size()) + " elements: expected " +
            std::to_string(count) + ", as `number`";
  };
  hold("latitude", message.latitude, false);
  hold("longitude", message.longitude, false);
  hold("altitude_msl", message.altitude_msl, false);
  hold("roll_deg", message.roll_deg, false);
  hold("pitch_deg", message.pitch_deg, false);
  hold("heading_true_deg", message.heading_true_deg, false);
  hold("velocity_north", message.velocity_north, true);
  hold("velocity_east", message.velocity_east, true);
  hold("velocity_down", message.velocity_down, true);
  if (!wrong.empty()) return wrong;
  const auto velocity = [](const auto& array, std::size_t i) { return array.empty() ? 0.0 : double{array[i]}; };
  std::vector<core::TrafficPose> poses(count);
  for (std::size_t i = 0; i < count; ++i) {
    core::TrafficPose& pose = poses[i];
    pose.number = message.number[i];
    pose.place = {message.latitude[i], message.longitude[i], message.altitude_msl[i]};
    pose.attitude = core::attitudeOf(double{message.roll_deg[i]}, double{message.pitch_deg[i]},
                                     double{message.heading_true_deg[i]});
    pose.velocity_ned = {velocity(message.velocity_north, i), velocity(message.velocity_east, i),
                         velocity(message.velocity_down, i)};
  }
  return poses;
}

}  // namespace xplane_bridge
