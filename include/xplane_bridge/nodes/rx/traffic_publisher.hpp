#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <ros/node_handle.h>

#include "xplane_bridge/TrafficState.h"
#include "xplane_bridge/core/state/clock_filter.hpp"
#include "xplane_bridge/core/state/traffic.hpp"
#include "xplane_bridge/nodes/base/advertiser.hpp"
#include "xplane_bridge/nodes/rx/mission_publisher.hpp"

namespace xplane_bridge {

/// The other aircraft on `traffic/state`, asked for only while the topic has subscribers: that is some hundred
/// datarefs. One thread calls, or the caller locks.
class TrafficPublisher {
 public:
  /// @param rate [1/s]
  /// @param stamps of simulator time; empty: of the host
  TrafficPublisher(int rate, const std::optional<SimulatorStamps>& stamps);

  void advertise(const Advertiser& topics);
  void configure(core::SimulatorVersion version) { traffic_.configure(version); }
  /// Datarefs to ask for, the position is the index; empty while they are not wanted.
  std::vector<std::string> requests() const;
  /// Whether the topic has subscribers.
  bool demanded() const;
  bool wanted() const { return wanted_; }
  /// Returns whether that is new: requests() have changed.
  bool want(bool wanted);
  /// An answer to requests().
  void onRref(const core::RrefView& datagram, std::int64_t receive_ns, const core::ClockFilter& clock);
  /// The link came up anew.
  void reset() { traffic_.reset(); }
  /// Nothing is asked for or published while muted, as before a flight in lock-step begins.
  void mute(bool muted) { muted_ = muted; }

 private:
  core::TrafficAssembler traffic_;
  std::optional<SimulatorStamps> stamps_;
  bool wanted_ = false;
  bool muted_ = false;
  ros::Publisher publisher_;
  TrafficState message_;  // kept, so that arrays are not allocated each time
};

}  // namespace xplane_bridge
