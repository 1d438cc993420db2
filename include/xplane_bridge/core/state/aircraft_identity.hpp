#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "xplane_bridge/core/wire/dataref_reader.hpp"
#include "xplane_bridge/core/wire/rref_frame_assembler.hpp"

namespace xplane_bridge::core {

/// Which aircraft is loaded in X-Plane, by its own words.
struct AircraftIdentity {
  std::string icao;         ///< type designator, e.g. "BE58"; sim/aircraft/view/acf_ICAO
  std::string description;  ///< sim/aircraft/view/acf_descrip, the first 64 characters

  friend bool operator==(const AircraftIdentity& a, const AircraftIdentity& b) {
    return a.icao == b.icao && a.description == b.description;
  }
  friend bool operator!=(const AircraftIdentity& a, const AircraftIdentity& b) { return !(a == b); }
};

/// For people: "BE58 (Baron)".
std::string described(const AircraftIdentity& aircraft);

/// Whether one of these is its ICAO code or its description. Blanks at the ends do not count: an aircraft's file may
/// lack those with which the description begins.
bool isListed(const AircraftIdentity& aircraft, const std::vector<std::string>& identities);

/// Puts the identity together from RREF replies: X-Plane sends a byte[] dataref one character a value.
class AircraftIdentityReader {
 public:
  AircraftIdentityReader();

  /// What to subscribe; the position is the index. Once a second is enough (kRateHz).
  static const std::vector<std::string>& datarefs();
  static constexpr std::int32_t kRateHz = 1;

  /// @return true when the datagram completed an identity that differs from the last one
  bool add(const RrefView& datagram, std::int64_t receive_ns);
  /// Both strings empty before the first.
  const AircraftIdentity& identity() const { return identity_; }
  /// The same, from single values of datarefs(), in that order; false while one is missing.
  bool add(const std::vector<DatarefValue>& values);
  /// Answers that held an identity, the same or another.
  unsigned answers() const { return answers_; }
  /// An identity with at least one character has come.
  bool known() const { return !identity_.icao.empty() || !identity_.description.empty(); }
  /// The subscription starts anew; the identity is kept until another one comes.
  void reset() { frames_.reset(); }

 private:
  bool take(const std::vector<float>& characters);

  RrefFrameAssembler frames_;
  AircraftIdentity identity_;
  unsigned answers_ = 0;
};

}  // namespace xplane_bridge::core
