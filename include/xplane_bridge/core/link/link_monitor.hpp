#pragma once

#include <cstdint>
#include <optional>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/base/message_constants.hpp"

namespace xplane_bridge::core {

/// X-Plane answers: what is sent now acts, and can be read back.
constexpr bool answers(LinkState state) { return state == LinkState::kConnected || state == LinkState::kPaused; }

struct LinkMonitorOptions {
  double stale_after_s = 0.4;
  double lost_after_s = 10.0;
  double beacon_timeout_s = 2.5;
};

/// Decides in which state the link is, from what is heard and when. All times are the steady clock's, in nanoseconds.
class LinkMonitor {
 public:
  explicit LinkMonitor(const LinkMonitorOptions& options) : options_(options) {}

  /// A valid datagram of X-Plane; they come during a pause as well [? paused-output].
  void heard(std::int64_t now_ns);
  /// Its beacon.
  void beaconHeard(std::int64_t now_ns) { last_beacon_ns_ = now_ns; }
  void setPaused(bool paused) { paused_ = paused; }
  /// sim/time/total_running_time_sec: it starts at zero with X-Plane, so a step back is a restart that no silence
  /// showed.
  void setSimTime(float sim_time_s);
  /// Another X-Plane is talked to from now on: the link to the old one counts as lost.
  void newPeer();

  /// The state at `now_ns`. Call it again whenever time has passed.
  LinkState update(std::int64_t now_ns);

  LinkState state() const { return state_; }
  /// Raised each time the link came up anew: first answer, return after LOST, restart of X-Plane. 0 before.
  std::uint32_t epoch() const { return epoch_; }
  /// Whether X-Plane answers at the moment.
  bool alive() const { return answers(state_); }
  /// [s] since the last valid datagram; NaN before the first.
  double silence(std::int64_t now_ns) const;
  /// Whether the beacon was heard and has been gone for longer than its timeout.
  bool beaconGone(std::int64_t now_ns) const;

 private:
  LinkMonitorOptions options_;
  LinkState state_ = LinkState::kSearching;
  std::uint32_t epoch_ = 0;
  bool paused_ = false;
  bool peer_changed_ = false;
  std::optional<std::int64_t> last_heard_ns_;
  std::optional<std::int64_t> last_beacon_ns_;
  std::optional<float> sim_time_s_;
};

}  // namespace xplane_bridge::core
