#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <ros/node_handle.h>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/state/state_assembler.hpp"
#include "xplane_bridge/nodes/base/advertiser.hpp"
#include "xplane_bridge/nodes/base/common_options.hpp"

namespace xplane_bridge {

/// One group of mission state: what is asked of X-Plane for it, its samples, its topic `mission/<group>`. One thread
/// calls, or the caller locks.
class MissionPublisher {
 public:
  /// What the diagnostics show of a group.
  struct Report {
    std::uint64_t published = 0;
    std::uint32_t missing = 0;  ///< valid bits that the last message lacked
    std::int64_t stamp_ns = 0;  ///< of the last message [ns]; 0 before the first
  };

  virtual ~MissionPublisher() = default;
  MissionPublisher() = default;
  MissionPublisher(const MissionPublisher&) = delete;
  MissionPublisher& operator=(const MissionPublisher&) = delete;

  virtual core::FieldGroup group() const = 0;
  virtual int rate() const = 0;
  virtual void advertise(const Advertiser& topics) = 0;

  /// X-Plane's version is known, or another: requests() and rows() change.
  virtual void configure(core::SimulatorVersion version) = 0;
  /// Datarefs to ask for, the position is the index; may be empty with DATA rows.
  virtual std::vector<std::string> requests() const = 0;
  virtual const std::vector<std::int32_t>& rows() const = 0;

  /// An answer to requests(). Publishes when it completes a sample and rows play no part.
  /// @return true when the aircraft turned out to have another number of engines, by which requests() has changed
  virtual bool onRref(const core::RrefView& datagram, std::int64_t receive_ns, const core::ClockFilter& clock) = 0;
  /// New DATA rows. Publishes at the group's rate.
  virtual void onRows(const core::RowStore& rows, std::int64_t receive_ns, const core::ClockFilter& clock) = 0;
  /// The link came up anew.
  virtual void reset() = 0;
  /// Nothing is published while muted.
  void mute(bool muted) { muted_ = muted; }

  const Report& report() const { return report_; }

 protected:
  Report report_;
  bool muted_ = false;
};

/// Stamps of simulator time: this clock's, which is that of the newest frame, and the time of simulator time 0.
struct SimulatorStamps {
  core::Clock clock;
  std::int64_t start_ns = 0;  ///< [ns]
};

/// The publishers of all groups whose rate is not 0. `publish_unheard`: also without a subscriber. `stamps`: empty:
/// of the host.
std::vector<std::unique_ptr<MissionPublisher>> makeMissionPublishers(
    const std::array<int, core::kFieldGroupCount>& rates, core::Transport transport, const FrameNames& frames,
    bool publish_unheard, const std::optional<SimulatorStamps>& stamps);

}  // namespace xplane_bridge
