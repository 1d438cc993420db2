#include "xplane_bridge/core/link/link_monitor.hpp"

#include <limits>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

/// X-Plane's clock may seem to step back by a frame or two when datagrams overtake each other.
constexpr float kRestartStepS = 1.0F;

}  // namespace

void LinkMonitor::heard(std::int64_t now_ns) {
  update(now_ns);  // a silence that ends with this datagram may have been long enough for LOST
  if (!last_heard_ns_.has_value() || state_ == LinkState::kLost) {
    ++epoch_;
    sim_time_s_.reset();
  }
  last_heard_ns_ = now_ns;
  peer_changed_ = false;
  update(now_ns);
}

void LinkMonitor::newPeer() {
  last_beacon_ns_.reset();
  peer_changed_ = last_heard_ns_.has_value();
  paused_ = false;
}

void LinkMonitor::setSimTime(float sim_time_s) {
  if (sim_time_s_.has_value() && sim_time_s < *sim_time_s_ - kRestartStepS) {
    ++epoch_;
  }
  sim_time_s_ = sim_time_s;
}

LinkState LinkMonitor::update(std::int64_t now_ns) {
  if (!last_heard_ns_.has_value()) {
    state_ = LinkState::kSearching;
  } else if (peer_changed_) {
    state_ = LinkState::kLost;
  } else if (silence(now_ns) <= options_.stale_after_s) {
    state_ = paused_ ? LinkState::kPaused : LinkState::kConnected;
  } else if (silence(now_ns) > options_.lost_after_s || beaconGone(now_ns)) {
    state_ = LinkState::kLost;
  } else {
    // A beacon that comes back before X-Plane answers does not turn LOST into STALE.
    state_ = state_ == LinkState::kLost ? LinkState::kLost : LinkState::kStale;
  }
  return state_;
}

double LinkMonitor::silence(std::int64_t now_ns) const {
  return last_heard_ns_.has_value() ? toSeconds(now_ns - *last_heard_ns_) : std::numeric_limits<double>::quiet_NaN();
}

bool LinkMonitor::beaconGone(std::int64_t now_ns) const {
  return last_beacon_ns_.has_value() && toSeconds(now_ns - *last_beacon_ns_) > options_.beacon_timeout_s;
}

}  // namespace xplane_bridge::core
