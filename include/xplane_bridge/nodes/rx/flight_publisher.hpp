#pragma once

#include <cstdint>
#include <optional>

#include <ros/publisher.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_broadcaster.h>

#include "xplane_bridge/core/base/rate_limiter.hpp"
#include "xplane_bridge/core/state/state_assembler.hpp"
#include "xplane_bridge/nodes/base/advertiser.hpp"
#include "xplane_bridge/nodes/messages/conversions.hpp"
#include "xplane_bridge/nodes/rx/rx_options.hpp"

namespace xplane_bridge {

/// Publishes a FlightState and everything that is made of it: odom, imu/data, global_position/global, wind, /tf and the
/// latched origin. One thread calls publish(), or the caller locks.
///
/// Publishing starts once attitude, position and rates are valid; up to a second later when other groups are still
/// missing then, so that a recording does not begin with states that lack what the next ones have.
class FlightPublisher {
 public:
  FlightPublisher(const RxOptions& options, const FrameNames& frames);

  /// Advertises the topics and sends the static frames.
  void advertise(const Advertiser& topics);

  /// @param map the frame state.position_* refers to
  /// @param receive_ns host receive time of the state [ns]
  void publish(const core::FlightState& state, const core::TangentFrame& map, std::int64_t receive_ns);

  /// Whether X-Plane sends rates at all, so that publishing waits for them.
  void expectRates(bool expected) { rates_expected_ = expected; }
  /// The link came up anew: waits for the first complete state again.
  void restart();
  /// A new origin was set before the next state: says so at once.
  void publishOrigin(const core::TangentFrame& map, std::uint32_t position_epoch, std::int64_t stamp_ns);

  std::uint64_t published() const { return published_; }
  bool started() const { return started_; }

 private:
  bool mayStart(const core::FlightState& state, std::int64_t receive_ns);

  RxOptions options_;
  FrameNames frames_;
  core::RateLimiter state_limiter_;
  core::RateLimiter wind_limiter_;
  bool started_ = false;
  bool rates_expected_ = true;
  std::optional<std::int64_t> startable_since_ns_;
  std::optional<std::uint32_t> published_position_epoch_;
  std::uint64_t published_ = 0;

  ros::Publisher state_publisher_;
  ros::Publisher odometry_publisher_;
  ros::Publisher imu_publisher_;
  ros::Publisher fix_publisher_;
  ros::Publisher wind_publisher_;
  ros::Publisher origin_publisher_;
  std::optional<tf2_ros::TransformBroadcaster> tf_broadcaster_;
  std::optional<tf2_ros::StaticTransformBroadcaster> static_broadcaster_;

  // Kept, so that strings and arrays are not allocated for every state.
  FlightState state_message_;
  nav_msgs::Odometry odometry_message_;
  sensor_msgs::Imu imu_message_;
  sensor_msgs::NavSatFix fix_message_;
  geometry_msgs::TwistWithCovarianceStamped wind_message_;
  geometry_msgs::TransformStamped transform_message_;
};

}  // namespace xplane_bridge
