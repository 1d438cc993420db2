#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <ros/node_handle.h>

#include "xplane_bridge/DatarefValues.h"
#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/wire/rref_frame_assembler.hpp"
#include "xplane_bridge/nodes/base/advertiser.hpp"
#include "xplane_bridge/nodes/rx/rx_options.hpp"

namespace xplane_bridge {

/// Publishes the datarefs a user has listed: all of them on `datarefs` whenever those of one rate have come, single
/// ones on scalar topics below `datarefs/`. One thread calls, or the caller locks.
class DatarefPublisher {
 public:
  /// @param publish_unheard also without a subscriber
  /// @param stamps clock of the stamps; empty: they are receive times
  DatarefPublisher(const std::vector<DatarefEntry>& entries, bool publish_unheard, std::optional<core::Clock> stamps);

  void advertise(const Advertiser& topics);

  /// Datarefs are asked for in batches of the same rate.
  std::size_t batches() const { return batches_.size(); }
  int rate(std::size_t batch) const { return batches_[batch].rate; }
  const std::vector<std::string>& requests(std::size_t batch) const { return batches_[batch].names; }

  /// An answer to requests(batch).
  /// @param sim_time raw simulator time of the nearest flight state [s], NaN when none is near
  void onRref(std::size_t batch, const core::RrefView& datagram, std::int64_t receive_ns, float sim_time,
              std::uint32_t epoch);
  /// The link came up anew: nothing of before is known any more.
  void reset();
  /// Nothing is published while muted.
  void mute(bool muted) { muted_ = muted; }

 private:
  struct Batch {
    int rate = 0;
    std::vector<std::string> names;
    std::vector<std::size_t> positions;  ///< of the names in the message
    core::RrefFrameAssembler frames{0};
    std::int64_t received_ns = 0;
  };
  struct Scalar {
    std::size_t position = 0;
    std::string topic;
    ros::Publisher publisher;
  };

  void publish(std::int64_t receive_ns, float sim_time, std::uint32_t epoch);

  bool goesOut(const ros::Publisher& publisher) const {
    return !muted_ && (publish_unheard_ || publisher.getNumSubscribers() > 0);
  }

  const bool publish_unheard_;
  const std::optional<core::Clock> stamps_;
  bool muted_ = false;
  std::vector<Batch> batches_;
  std::vector<Scalar> scalars_;
  DatarefValues message_;
  ros::Publisher publisher_;
};

}  // namespace xplane_bridge
