#pragma once

#include <cstdint>
#include <mutex>
#include <string>

#include <ros/publisher.h>

#include "xplane_bridge/EventList.h"
#include "xplane_bridge/core/base/clock.hpp"

namespace xplane_bridge {

/// The last hundred events on a latched topic, numbered without gaps. Thread-safe once started.
class EventLog {
 public:
  static constexpr std::size_t kKept = 100;

  /// @param publisher of the topic
  /// @param clock of the stamps
  void start(const ros::Publisher& publisher, const core::Clock& clock) {
    publisher_ = publisher;
    clock_ = clock;
  }

  /// Adds and publishes. `kind` is one of Event's. Returns the event's number: the next one, or `number`, which
  /// reserve() has given.
  std::uint32_t add(std::uint8_t kind, const std::string& text, double sim_time, const std::string& requested_by = "",
                    bool success = true, std::uint32_t number = 0);
  /// While muted, events are neither published nor kept. Ending it begins the numbers anew.
  void mute(bool muted);
  /// A number for an event that will happen later.
  std::uint32_t reserve();

 private:
  std::mutex mutex_;
  ros::Publisher publisher_;
  core::Clock clock_;
  EventList list_;
  std::uint32_t number_ = 0;
  bool muted_ = false;
};

}  // namespace xplane_bridge
