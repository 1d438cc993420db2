#pragma once

#include <functional>

#include <ros/publisher.h>
#include <ros/time.h>

#include "xplane_bridge/actuation/actuation.hpp"
#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/nodes/base/advertiser.hpp"
#include "xplane_bridge/nodes/base/event_log.hpp"

namespace xplane_bridge {

/// What an Actuation has to say, on tx_node's topics and in its log.
class TxPublishers {
 public:
  /// @param clock of the stamps
  /// @param held whether nothing is to be said yet, because a flight in lock-step has not begun
  void advertise(const Advertiser& topics, const core::Clock& clock, std::function<bool()> held);
  /// All but `stopping`. They must not outlive this.
  ActuationHooks hooks();
  EventLog& events() { return events_; }

 private:
  /// The message of these values, by toMessage().
  template <class Message, class... Values>
  void publishAs(const ros::Publisher& publisher, const Values&... values) const;
  void onEvent(const ActuationEvent& event);

  core::Clock clock_;
  std::function<bool()> held_;
  EventLog events_;
  ros::Publisher mode_, applied_, failures_, excitation_, disturbance_;
};

}  // namespace xplane_bridge
