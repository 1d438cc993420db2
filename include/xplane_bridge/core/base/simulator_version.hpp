#pragma once

#include <cstdint>
#include <limits>

namespace xplane_bridge::core {

/// Where the doctor's card (docs/setups/doctor.md) found an X-Plane to be otherwise than is assumed; a bit each.
enum class Otherwise : std::uint32_t {
  kRow1Hours = 1U << 0U,    ///< zulu and local time of row 1 are no hours
  kRow16 = 1U << 1U,        ///< row 16 has another order or unit
  kRow17Axes = 1U << 2U,    ///< row 17's angles are against the axes at the scenery's origin
  kRow20 = 1U << 3U,        ///< row 20 has other slots
  kRow28Unit = 1U << 4U,    ///< row 28 is not rpm
  kRow115Bits = 1U << 5U,   ///< row 115 has no bit for each engine
  kRow116Modes = 1U << 6U,  ///< rows 116 and 117 code modes otherwise than the datarefs
  kBetaSign = 1U << 7U,     ///< beta is + with wind from the right
  kVehs = 1U << 8U,         ///< VEHS moves nothing
  kFconActs = 1U << 9U,     ///< rel_fcon_* do not act
};

/// X-Plane's version, and in what this X-Plane is otherwise than assumed of it: they decide about names of datarefs and
/// failures, DATA rows and messages.
///
/// An unknown version is neither 11 nor 12. What is read is then only what both have under one name; what is written
/// goes by X-Plane 11's names, most of which 12 has as well.
struct SimulatorVersion {
  std::int32_t number = 0;  ///< `sim/version/xplane_internal_version` or the beacon's, e.g. 115501; 0 or less: unknown
  std::uint32_t otherwise = 0;  ///< bits of Otherwise

  constexpr bool known() const { return number > 0; }
  /// Also 9 and 10, whose rows 11 shares except as docs/fields.md says.
  constexpr bool is11() const { return known() && number < kFirstOf12; }
  constexpr bool is12() const { return number >= kFirstOf12; }
  constexpr bool is(Otherwise what) const { return (otherwise & static_cast<std::uint32_t>(what)) != 0U; }

  static constexpr std::int32_t kFirstOf12 = 120000;
};

constexpr bool operator==(SimulatorVersion a, SimulatorVersion b) {
  return (a.number == b.number && a.otherwise == b.otherwise) || (!a.known() && !b.known());
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
