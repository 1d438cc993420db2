#include "xplane_bridge/nodes/rx/traffic_publisher.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/nodes/base/ros_time.hpp"
#include "xplane_bridge/nodes/messages/traffic_conversions.hpp"

namespace xplane_bridge {
namespace {

constexpr std::uint32_t kQueueSize = 20;

core::TrafficAssembler::Options at(int rate) {
  core::TrafficAssembler::Options options;
  options.rate = rate;
  return options;
}

}  // namespace

TrafficPublisher::TrafficPublisher(int rate, const std::optional<SimulatorStamps>& stamps)
    : traffic_(at(rate)), stamps_(stamps) {}

void TrafficPublisher::advertise(const Advertiser& topics) {
  publisher_ = topics.advertise<TrafficState>("traffic/state", kQueueSize);
}

std::vector<std::string> TrafficPublisher::requests() const {
  return wanted_ ? traffic_.requests() : std::vector<std::string>();
}

bool TrafficPublisher::demanded() const {
  // In lock-step who wants it may come until the flight begins; from then on every run asks in the same frame.
  return !muted_ && publisher_.getNumSubscribers() > 0;
}

bool TrafficPublisher::want(bool wanted) {
  if (wanted && !wanted_) traffic_.reset();
  return std::exchange(wanted_, wanted) != wanted;
}

void TrafficPublisher::onRref(const core::RrefView& datagram, std::int64_t receive_ns, const core::ClockFilter& clock) {
  if (!traffic_.add(datagram, receive_ns) || muted_) return;
  const core::TrafficState state = traffic_.state();
  std::int64_t stamp_ns = traffic_.receiveTime();
  if (stamps_) {
    stamp_ns = std::isfinite(state.sim_time) ? stamps_->start_ns + core::toNanoseconds(clock.unwrap(state.sim_time))
                                             : stamps_->clock.system_ns();
  } else if (std::isfinite(state.sim_time)) {
    if (const auto host = clock.hostTime(clock.unwrap(state.sim_time))) stamp_ns = std::min(*host, receive_ns);
  }
  toMessage(state, &message_);
  message_.header.stamp = toRosTime(stamp_ns);
  message_.epoch = clock.epoch();
  publisher_.publish(message_);
}

}  // namespace xplane_bridge
