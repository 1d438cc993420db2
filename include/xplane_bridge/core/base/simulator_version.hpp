#pragma once

#include <cstdint>
#include <limits>

namespace xplane_bridge::core {

/// X-Plane's version: it decides about names of datarefs and failures, DATA rows and messages.
///
/// An unknown version is neither 11 nor 12. What is read is then only what both have under one name; what is written
/// goes by X-Plane 11's names, most of which 12 has as well.
struct SimulatorVersion {
  std::int32_t number = 0;  ///< `sim/version/xplane_internal_version` or the beacon's, e.g. 115501; 0 or less: unknown

  constexpr bool known() const { return number > 0; }
  /// Also 9 and 10, whose rows 11 shares except as docs/fields.md says.
  constexpr bool is11() const { return known() && number < kFirstOf12; }
  constexpr bool is12() const { return number >= kFirstOf12; }

  static constexpr std::int32_t kFirstOf12 = 120000;
};

constexpr bool operator==(SimulatorVersion a, SimulatorVersion b) {
  return a.number == b.number || (!a.known() && !b.known());
}
constexpr bool operator!=(SimulatorVersion a, SimulatorVersion b) { return !(a == b); }

/// Where X-Plane's names change within a major version: the first number that the list of 12.08, of 12.10 holds for.
inline constexpr std::int32_t kFirstOf1208 = 120800;
inline constexpr std::int32_t kFirstOf1210 = 121000;

/// The versions that have something: from `first` on, before `end`.
struct VersionRange {
  std::int32_t first = 0;
  std::int32_t end = std::numeric_limits<std::int32_t>::max();

  constexpr bool isAll() const { return *this == VersionRange{}; }
  /// An unknown version has what all have.
  constexpr bool has(SimulatorVersion version) const {
    return version.known() ? first <= version.number && version.number < end : isAll();
  }
  constexpr bool operator==(const VersionRange& other) const { return first == other.first && end == other.end; }
};

/// The oldest versions of 11 and 12 with all that the package uses.
inline constexpr SimulatorVersion kXPlane11{114000};
inline constexpr SimulatorVersion kXPlane12{kFirstOf1208};

}  // namespace xplane_bridge::core
