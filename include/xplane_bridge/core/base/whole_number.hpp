#pragma once

#include <cstdint>
#include <limits>
#include <stdexcept>

namespace xplane_bridge::core {

/// A whole number of a JSON text. (nlohmann/json turns any number into any integer; that is undefined for a large one
/// with a fraction or an exponent, and cuts one that is too large for its type.)
/// @param value nlohmann::json, which this header does without
/// @throws std::out_of_range it is no whole number, or one that the type does not hold
template <class Integer, class Json>
[[nodiscard]] Integer wholeNumber(const Json& value) {
  using Limits = std::numeric_limits<Integer>;
  if (value.is_number_unsigned()) {
    const auto number = value.template get<std::uint64_t>();
    if (number <= static_cast<std::uint64_t>(Limits::max())) return static_cast<Integer>(number);
  } else if (value.is_number_integer()) {
    const auto number = value.template get<std::int64_t>();
    if (number < 0 && Limits::is_signed && number >= static_cast<std::int64_t>(Limits::min())) {
      return static_cast<Integer>(number);
    }
  }
  throw std::out_of_range(value.dump() + " is no whole number, or one too large");
}

}  // namespace xplane_bridge::core
