#pragma once

/// @file
/// One field of a core struct into the field of that name of a ROS message.

#include <algorithm>
#include <array>
#include <cstddef>
#include <type_traits>

#include <geometry_msgs/Quaternion.h>
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <boost/array.hpp>

namespace xplane_bridge {

/// Numbers, flags (uint8 in messages) and enumerations.
template <class From, class To>
std::enable_if_t<std::is_arithmetic_v<To>> putField(const From& from, To* to) {
  *to = static_cast<To>(from);
}

template <class T, std::size_t N>
void putField(const std::array<T, N>& from, boost::array<T, N>* to) {
  std::copy(from.begin(), from.end(), to->begin());
}

/// A geometry_msgs Vector3 or Point.
template <class Vector>
std::enable_if_t<!std::is_arithmetic_v<Vector>> putField(const Eigen::Vector3d& from, Vector* to) {
  to->x = from.x();
  to->y = from.y();
  to->z = from.z();
}

inline void putField(const Eigen::Quaterniond& from, geometry_msgs::Quaternion* to) {
  to->x = from.x();
  to->y = from.y();
  to->z = from.z();
  to->w = from.w();
}

}  // namespace xplane_bridge
