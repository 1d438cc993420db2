#pragma once

/// @file
/// Members of two FlightStates into those of a third between them; for the interpolation that cmake/message_code makes.

#include <Eigen/Geometry>

#include "xplane_bridge/FlightState.h"
#include "xplane_bridge/core/camera/image_association.hpp"
#include "xplane_bridge/nodes/messages/field_copy.hpp"

namespace xplane_bridge {

class Blend {
 public:
  Blend(const FlightState& from, const FlightState& to, double fraction, FlightState* result)
      : from_(from), to_(to), fraction_(fraction), result_(result) {}

  void stamp() const {
    const double apart = (to_.header.stamp - from_.header.stamp).toSec();
    result_->header.stamp = from_.header.stamp + ros::Duration(apart * fraction_);
  }

  template <class T>
  void linear(T FlightState::*member) const {
    const auto from = static_cast<double>(from_.*member);
    result_->*member = static_cast<T>(from + fraction_ * (static_cast<double>(to_.*member) - from));
  }

  void linear(geometry_msgs::Vector3 FlightState::*member) const {
    const geometry_msgs::Vector3& from = from_.*member;
    const geometry_msgs::Vector3& to = to_.*member;
    geometry_msgs::Vector3& result = result_->*member;
    result.x = from.x + fraction_ * (to.x - from.x);
    result.y = from.y + fraction_ * (to.y - from.y);
    result.z = from.z + fraction_ * (to.z - from.z);
  }

  /// @param lower [deg] end of the angle's range: 0 (compass) or -180
  template <class T>
  void angle(T FlightState::*member, double lower) const {
    result_->*member = static_cast<T>(core::interpolateAngleDeg(static_cast<double>(from_.*member),
                                                                static_cast<double>(to_.*member), fraction_, lower));
  }

  void attitude(geometry_msgs::Quaternion FlightState::*member) const {
    const auto eigen = [](const geometry_msgs::Quaternion& q) { return Eigen::Quaterniond(q.w, q.x, q.y, q.z); };
    putField(core::interpolateAttitude(eigen(from_.*member), eigen(to_.*member), fraction_), &(result_->*member));
  }

 private:
  const FlightState& from_;
  const FlightState& to_;
  double fraction_;
  FlightState* result_;
};

}  // namespace xplane_bridge
