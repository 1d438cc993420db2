#pragma once

#include <cstdio>
#include <optional>
#include <string>

#include "xplane_bridge/core/base/simulator_version.hpp"

/// What the checks of settings share: how a value that cannot be is refused.
namespace xplane_bridge::core {

inline std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

/// Why `value` is refused; nothing where it lies within the bounds.
inline std::optional<std::string> outside(const std::string& name, double value, double low, double high,
                                          const char* unit) {
  if (value >= low && value <= high) return std::nullopt;
  return name + " is " + number(value) + ": expected " + number(low) + ".." + number(high) + " [" + unit + "]";
}

/// A request that leaves the place out has 0 in both, a place in the open sea.
inline std::optional<std::string> noPlace(double latitude_deg, double longitude_deg) {
  if (latitude_deg != 0.0 || longitude_deg != 0.0) return std::nullopt;
  return "no place is given: expected latitude and longitude, of which one is not 0";
}

/// Whether the weather is set by region, under names of its own.
inline bool hasRegions(SimulatorVersion version) { return version.number >= kFirstOf1208; }

}  // namespace xplane_bridge::core
