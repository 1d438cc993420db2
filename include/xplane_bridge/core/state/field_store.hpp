#pragma once

/// @file
/// How received values get into the members of the state structs, whatever their types. Used by the headers that
/// cmake/message_code makes.

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <type_traits>

namespace xplane_bridge::core {

/// Writes a field's first `count` elements, SI values; NaN is unknown. `target` is the group's struct.
using FieldStore = void (*)(void* target, const double* values, int count);

/// FieldStore of one member. Unknown integers are 0, unknown flags false.
template <typename State, auto Member>
void storeMember(void* target, const double* values, [[maybe_unused]] int count) {
  auto& member = static_cast<State*>(target)->*Member;
  using Type = std::remove_reference_t<decltype(member)>;
  if constexpr (std::is_same_v<Type, bool>) {
    member = *values > 0.5;
  } else if constexpr (std::is_integral_v<Type>) {
    member = std::isfinite(*values) ? static_cast<Type>(*values) : Type{};
  } else if constexpr (std::is_floating_point_v<Type>) {
    member = static_cast<Type>(*values);
  } else if constexpr (std::is_same_v<Type, Eigen::Vector3d>) {
    for (int i = 0; i < count; ++i) member(i) = values[i];
  } else {
    for (int i = 0; i < count; ++i) member[static_cast<std::size_t>(i)] = static_cast<float>(values[i]);
  }
}

inline bool isKnown(double value) { return std::isfinite(value); }
inline bool isKnown(const Eigen::Vector3d& value) { return value.allFinite(); }

inline void takeField(double input, float& field) { field = static_cast<float>(input); }
inline void takeField(double input, double& field) { field = input; }
inline void takeField(double input, bool& field) { field = input > 0.5; }
inline void takeField(const Eigen::Vector3d& input, Eigen::Vector3d& field) { field = input; }

}  // namespace xplane_bridge::core
