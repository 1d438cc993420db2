#include "xplane_bridge/nodes/rx/flight_publisher.hpp"

#include <ros/node_handle.h>

#include "xplane_bridge/core/state/clock_filter.hpp"

namespace xplane_bridge {
namespace {

// A slow subscriber loses old states rather than delaying new ones.
constexpr std::uint32_t kQueueSize = 100;
constexpr std::int64_t kCompletionTime = 1'000'000'000;  // [ns]
// Before the clock filter has its fit (a quarter of a second), stamps are receive times with all their jitter: a
// velocity differenced from the first positions would be wrong.
const double kUnsettledClock = core::ClockFilter::Options{}.unfitted_uncertainty;
constexpr std::uint32_t kNeededToStart = core::FlightState::kValidAttitude | core::FlightState::kValidPosition;

/// Publishes what `fill` makes, unless it has no subscriber (`unheard`: all the same) or it makes nothing.
template <class Message, class Fill>
void publishIfHeard(const ros::Publisher& publisher, bool unheard, Message* message, const Fill& fill) {
  if ((unheard || publisher.getNumSubscribers() > 0) && fill(message)) {
    publisher.publish(*message);
  }
}

}  // namespace

FlightPublisher::FlightPublisher(const RxOptions& options, const FrameNames& frames)
    : options_(options), frames_(frames), state_limiter_(options.max_publish_rate), wind_limiter_(options.wind_rate) {}

void FlightPublisher::advertise(const Advertiser& topics) {
  state_publisher_ = topics.advertise<FlightState>("flight_state", kQueueSize, options_.latch_state);
  odometry_publisher_ = topics.advertise<nav_msgs::Odometry>("odom", kQueueSize);
  imu_publisher_ = topics.advertise<sensor_msgs::Imu>("imu/data", kQueueSize);
  fix_publisher_ = topics.advertise<sensor_msgs::NavSatFix>("global_position/global", kQueueSize);
  wind_publisher_ = topics.advertise<geometry_msgs::TwistWithCovarianceStamped>("wind", kQueueSize);
  origin_publisher_ = topics.advertise<sensor_msgs::NavSatFix>("origin", 1, true);
  if (options_.publish_tf) {
    tf_broadcaster_.emplace();
  }
  static_broadcaster_.emplace();
  // A static transform holds for all times; its stamp has no meaning.
  static_broadcaster_->sendTransform(
      {baseLinkFrdTransform(frames_, ros::Time()), mapNedTransform(frames_, ros::Time())});
}

void FlightPublisher::restart() {
  started_ = false;
  startable_since_ns_.reset();
}

bool FlightPublisher::mayStart(const core::FlightState& state, std::int64_t receive_ns) {
  if (!state.has(kNeededToStart | (rates_expected_ ? core::FlightState::kValidRates : 0U))) {
    startable_since_ns_.reset();
    return false;
  }
  if (!startable_since_ns_) {
    startable_since_ns_ = receive_ns;
  }
  const bool complete = state.has(core::FlightState::kValidAll);
  const bool clock_settled = state.stamp_uncertainty < kUnsettledClock;
  return (complete && clock_settled) || receive_ns - *startable_since_ns_ >= kCompletionTime;
}

void FlightPublisher::publish(const core::FlightState& state, const core::TangentFrame& map, std::int64_t receive_ns) {
  if (!started_) {
    started_ = mayStart(state, receive_ns);
    if (!started_) {
      return;
    }
  }
  if (state.has(core::FlightState::kValidPosition) && published_position_epoch_ != state.position_epoch) {
    publishOrigin(map, state.position_epoch, state.stamp_ns);
  }
  if (!state_limiter_.due(state.stamp_ns)) {
    return;
  }
  ++published_;
  const bool unheard = options_.publish_unheard;
  publishIfHeard(state_publisher_, unheard, &state_message_, [&](FlightState* message) {
    toMessage(state, frames_.base_link_frd, message);
    return true;
  });
  publishIfHeard(odometry_publisher_, unheard, &odometry_message_,
                 [&](nav_msgs::Odometry* message) { return toOdometry(state, map, frames_, message); });
  publishIfHeard(imu_publisher_, unheard, &imu_message_,
                 [&](sensor_msgs::Imu* message) { return toImu(state, frames_, message); });
  publishIfHeard(fix_publisher_, unheard, &fix_message_, [&](sensor_msgs::NavSatFix* message) {
    return toNavSatFix(state, options_.geoid.undulation(state.latitude, state.longitude), frames_, message);
  });
  if (wind_limiter_.due(state.stamp_ns)) {
    publishIfHeard(wind_publisher_, unheard, &wind_message_, [&](geometry_msgs::TwistWithCovarianceStamped* message) {
      return toWind(state, map, frames_, message);
    });
  }
  if (tf_broadcaster_ && toTransform(state, map, frames_, &transform_message_)) {
    tf_broadcaster_->sendTransform(transform_message_);
  }
}

void FlightPublisher::publishOrigin(const core::TangentFrame& map, std::uint32_t position_epoch,
                                    std::int64_t stamp_ns) {
  sensor_msgs::NavSatFix message;
  const core::GeoPoint& origin = map.origin();
  const double undulation = options_.geoid.undulation(origin.latitude_deg, origin.longitude_deg);
  toOrigin(origin, stamp_ns, undulation, frames_, &message);
  origin_publisher_.publish(message);
  published_position_epoch_ = position_epoch;
}

}  // namespace xplane_bridge
