#pragma once

#include <cstdint>

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

/// The versions whose published lists the names in this package are checked against.
inline constexpr SimulatorVersion kXPlane11{114000};
inline constexpr SimulatorVersion kXPlane12{120800};

}  // namespace xplane_bridge::core
