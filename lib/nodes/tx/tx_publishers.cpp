#include "xplane_bridge/nodes/tx/tx_publishers.hpp"

#include <cstdint>
#include <string>
#include <utility>

#include <ros/console.h>

#include "xplane_bridge/AppliedCommand.h"
#include "xplane_bridge/ControlMode.h"
#include "xplane_bridge/DisturbanceState.h"
#include "xplane_bridge/ExcitationState.h"
#include "xplane_bridge/FailureState.h"
#include "xplane_bridge/nodes/base/ros_time.hpp"
#include "xplane_bridge/nodes/messages/actuation_conversions.hpp"
#include "xplane_bridge/nodes/messages/control_conversions.hpp"

namespace xplane_bridge {

void TxPublishers::advertise(const Advertiser& topics, const core::Clock& clock, std::function<bool()> held) {
  clock_ = clock;
  held_ = std::move(held);
  events_.start(topics.advertise<EventList>("events", 1, true), clock);
  mode_ = topics.advertise<ControlMode>("control/mode", 10, true);
  applied_ = topics.advertise<AppliedCommand>("control/applied", 100);
  failures_ = topics.advertise<FailureState>("failures/state", 10, true);
  excitation_ = topics.advertise<ExcitationState>("excitation/state", 10, true);
  disturbance_ = topics.advertise<DisturbanceState>("disturbance/state", 100, true);
}

template <class Message, class... Values>
void TxPublishers::publishAs(const ros::Publisher& publisher, const Values&... values) const {
  if (held_()) return;
  Message message;
  message.header.stamp = toRosTime(clock_.system_ns());
  toMessage(values..., &message);
  publisher.publish(message);
}

ActuationHooks TxPublishers::hooks() {
  ActuationHooks hooks;
  hooks.mode = [this](const auto&... mode) { publishAs<ControlMode>(mode_, mode...); };
  hooks.applied = [this](const auto&... applied) { publishAs<AppliedCommand>(applied_, applied...); };
  hooks.surfaces_applied = [this](const auto&... echo) { publishAs<AppliedCommand>(applied_, echo...); };
  hooks.failures = [this](const auto& snapshot) { publishAs<FailureState>(failures_, snapshot); };
  hooks.excitation = [this](const auto& label) { publishAs<ExcitationState>(excitation_, label); };
  hooks.disturbance = [this](const auto& label) { publishAs<DisturbanceState>(disturbance_, label); };
  hooks.event = [this](const ActuationEvent& event) { onEvent(event); };
  hooks.warn = [](const std::string& text) { ROS_WARN("%s", text.c_str()); };
  hooks.journal_problem = [](const std::string& text) { ROS_ERROR_THROTTLE(5.0, "%s", text.c_str()); };
  return hooks;
}

void TxPublishers::onEvent(const ActuationEvent& event) {
  if (!event.success) {
    ROS_ERROR("%s", event.text.c_str());
  } else if (event.warning) {
    ROS_WARN("%s", event.text.c_str());
  } else {
    ROS_INFO("%s", event.text.c_str());
  }
  events_.add(static_cast<std::uint8_t>(event.kind), event.text, event.sim_time, event.who, event.success,
              event.number);
}

}  // namespace xplane_bridge
