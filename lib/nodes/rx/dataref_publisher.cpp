#include "xplane_bridge/nodes/rx/dataref_publisher.hpp"

#include <algorithm>
#include <limits>
#include <map>

#include <std_msgs/Float64.h>

#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/nodes/messages/conversions.hpp"

namespace xplane_bridge {
namespace {

constexpr std::uint32_t kQueueSize = 100;
// Values older than this many of their periods (but not younger than the shortest age) are unknown.
constexpr double kFreshPeriods = 2.5;
constexpr double kShortestAge = 0.5;  // [s]

}  // namespace

DatarefPublisher::DatarefPublisher(const std::vector<DatarefEntry>& entries, bool publish_unheard,
                                   std::optional<core::Clock> stamps)
    : publish_unheard_(publish_unheard), stamps_(std::move(stamps)) {
  std::map<int, Batch, std::greater<int>> by_rate;
  for (const DatarefEntry& entry : entries) {
    Batch& batch = by_rate[entry.rate];
    batch.rate = entry.rate;
    if (!entry.topic.empty()) {
      scalars_.push_back({message_.names.size(), entry.topic, ros::Publisher()});
    }
    for (const std::string& name : entry.elements) {
      batch.names.push_back(name);
      batch.positions.push_back(message_.names.size());
      message_.names.push_back(name);
    }
  }
  for (auto& [rate, batch] : by_rate) {
    batch.frames = core::RrefFrameAssembler(batch.names.size(), 0, core::RrefFrameAssembler::Options::atRate(rate));
    batches_.push_back(std::move(batch));
  }
  message_.values.assign(message_.names.size(), std::numeric_limits<float>::quiet_NaN());
}

void DatarefPublisher::advertise(const Advertiser& topics) {
  if (batches_.empty()) {
    return;
  }
  publisher_ = topics.advertise<DatarefValues>("datarefs", kQueueSize);
  for (Scalar& scalar : scalars_) {
    scalar.publisher = topics.advertise<std_msgs::Float64>("datarefs/" + scalar.topic, kQueueSize);
  }
}

void DatarefPublisher::onRref(std::size_t batch_index, const core::RrefView& datagram, std::int64_t receive_ns,
                              float sim_time, std::uint32_t epoch) {
  Batch& batch = batches_[batch_index];
  if (!batch.frames.add(datagram, receive_ns)) {
    return;
  }
  batch.received_ns = receive_ns;
  for (std::size_t i = 0; i < batch.positions.size(); ++i) {
    message_.values[batch.positions[i]] = batch.frames.values()[i];
  }
  publish(batch.frames.receiveTime(), sim_time, epoch);
  for (const Scalar& scalar : scalars_) {
    const bool arrived =
        std::find(batch.positions.begin(), batch.positions.end(), scalar.position) != batch.positions.end();
    if (arrived && goesOut(scalar.publisher)) {
      std_msgs::Float64 value;
      value.data = static_cast<double>(message_.values[scalar.position]);
      scalar.publisher.publish(value);
    }
  }
}

void DatarefPublisher::publish(std::int64_t receive_ns, float sim_time, std::uint32_t epoch) {
  for (const Batch& batch : batches_) {
    const double age = core::toSeconds(receive_ns - batch.received_ns);
    if (age > std::max(kFreshPeriods / batch.rate, kShortestAge)) {
      for (const std::size_t position : batch.positions) {
        message_.values[position] = std::numeric_limits<float>::quiet_NaN();
      }
    }
  }
  if (!goesOut(publisher_)) {
    return;
  }
  message_.header.stamp = toRosTime(stamps_ ? stamps_->system_ns() : receive_ns);
  message_.sim_time = sim_time;
  message_.epoch = epoch;
  publisher_.publish(message_);
}

void DatarefPublisher::reset() {
  for (Batch& batch : batches_) {
    batch.frames.reset();
  }
  message_.values.assign(message_.names.size(), std::numeric_limits<float>::quiet_NaN());
}

}  // namespace xplane_bridge
