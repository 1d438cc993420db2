// rx_node in lock-step: what it does of its own in each frame.

#include <algorithm>

#include <rosgraph_msgs/Clock.h>
#include <std_msgs/Header.h>

#include "xplane_bridge/nodes/rx/rx_node.hpp"

namespace xplane_bridge {

void RxNode::mute(bool muted) {
  for (const auto& mission : missions_) {
    mission->mute(muted);
  }
  datarefs_->mute(muted);
  if (traffic_) traffic_->mute(muted);
}

void RxNode::beginFlight() {
  const std::lock_guard<std::mutex> lock(mutex_);
  flight_->restart();
  flight_publisher_->restart();
  consistency_.reset();
  last_state_.reset();
  mute(false);
  publishLinkState(last_status_);
  publishExperiment();
}

void RxNode::beginFrame(const core::LockstepFrame&) {
  state_is_new_ = false;
  publishClock();
}

void RxNode::publishClock() {
  rosgraph_msgs::Clock message;
  message.clock = stampNow();
  clock_publisher_.publish(message);
}

bool RxNode::frameReady(const core::LockstepFrame& frame) {
  if (frame.number > 0) {
    return true;
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool known_place =
      last_state_ && last_state_->has(core::FlightState::kValidAttitude | core::FlightState::kValidPosition);
  if (last_state_ && !known_place) {
    // Taken when not all of its datarefs had been asked for. Time stands: whole frames since are repetitions of it.
    flight_->restart();
    last_state_.reset();
  }
  const bool current = std::all_of(streams_.begin(), streams_.end(), [](const auto& stream) { return stream.current; });
  const bool checked = flight_->positionCheck().verdict() != core::PositionCheck::Verdict::kUnknown &&
                       (rpos_rate_ == 0 || rpos_rate_ == core::kEveryFrameRateHz);
  const bool known = aircraft_.answers() > 0 && !settings_.values().empty();
  return adopted_version_ && known && current && (checked || !flight_->wantsRpos()) && known_place;
}

void RxNode::endFrame(const core::LockstepFrame& frame) {
  if (ended_frame_ == frame.number) {
    return;
  }
  ended_frame_ = frame.number;
  std_msgs::Header done;
  done.stamp = stampNow();
  // No participant can answer a state that has not come.
  done.frame_id = frame.number == 0 ? kLockstepFrame0 : state_is_new_ ? "" : kLockstepNoState;
  done_publisher_.publish(done);
}

}  // namespace xplane_bridge
