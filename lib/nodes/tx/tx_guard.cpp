// What tx_node's guardian hears of it, and what tx_node does when that has acted.

#include "xplane_bridge/nodes/tx/tx_node.hpp"

namespace xplane_bridge {
namespace {

const ros::WallDuration kHeartbeat(0.1);

}  // namespace

void TxNode::startBeating() {
  if (lockstep()) return;  // a frame may take long: the guardian acts on death only
  if (wired()) {
    pollInput(
        "hang", [this] { return guardian_.beat(options_.hang_timeout); }, [this] { actuation_->onHang(); });
    return;
  }
  heartbeat_ = handle().createSteadyTimer(kHeartbeat, [this](const ros::SteadyTimerEvent&) { beat(); });
}

/// First of all that the control thread does: after a hang nothing may be sent as before.
void TxNode::beat() {
  if (!lockstep() && !wired() && guardian_.beat(options_.hang_timeout)) actuation_->onHang();
}

}  // namespace xplane_bridge
