#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/core/wire/packets.hpp"
#include "xplane_bridge/core/wire/udp_socket.hpp"

namespace xplane_bridge::core {

/// An X-Plane that announces itself.
struct BeaconSighting {
  Endpoint endpoint;                           ///< where it listens
  std::vector<std::uint32_t> other_addresses;  ///< of the same computer, from which its beacon comes as well now
  std::int32_t version = 0;
  std::string computer_name;
};

/// "lab-pc-3 (192.168.1.5:49000, version 122015)"
std::string toString(const BeaconSighting& sighting);

/// Remembers which X-Planes announce themselves and chooses among them. Times are the steady clock's [ns].
class BeaconTracker {
 public:
  /// `is_own`: whether an address is one of this computer's, whose X-Plane is heard under several.
  BeaconTracker(double timeout_s, double settle_s, std::function<bool(std::uint32_t)> is_own);

  /// Takes note of a beacon. One from another address but with the name, port and version of one that is heard at the
  /// moment is the same X-Plane: its computer has several addresses. It listens where it was heard first; where its
  /// beacon has not come from that address for the timeout, but comes from another, it listens there. Ignores what is
  /// not a master X-Plane (external visuals, instructor stations, Plane Maker); returns whether it was noted.
  bool heard(const Beacon& beacon, std::uint32_t from_address, std::int64_t now_ns);

  /// Those heard within the timeout.
  std::vector<BeaconSighting> sightings(std::int64_t now_ns) const;
  /// The X-Plane at this place, if it has been heard within the timeout.
  std::optional<BeaconSighting> at(const Endpoint& endpoint, std::int64_t now_ns) const;

  /// Since when [ns] the X-Plane at this place has not announced itself from this very address; 0 when it never has.
  /// Of an address of this computer from which no beacon comes: from any address.
  std::int64_t lastHeard(const Endpoint& endpoint) const;

  /// The only X-Plane there is, once no other has announced itself for the settling time. Empty while waiting, or
  /// when there are several.
  std::optional<BeaconSighting> onlyOne(std::int64_t now_ns) const;
  /// Whether it is on the computer that had this address, or has this name (empty: not known).
  bool isOfComputer(const BeaconSighting& sighting, std::uint32_t address, const std::string& computer_name) const;
  /// The one X-Plane of that computer that has begun to announce itself after `since_ns`: the old one after a restart,
  /// as long as there is no second new one.
  std::optional<BeaconSighting> onlyNewSince(std::int64_t since_ns, std::int64_t now_ns, std::uint32_t address,
                                             const std::string& computer_name) const;

 private:
  struct Address {
    std::uint32_t address = 0;
    std::int64_t last_ns = 0;
  };
  struct Known {
    std::uint16_t port = 0;
    std::int32_t version = 0;
    std::string computer_name;
    std::int64_t first_ns = 0;
    std::vector<Address> addresses;  // the first is where it listens; never empty

    std::int64_t lastNs() const;
  };
  bool isFresh(std::int64_t last_ns, std::int64_t now_ns) const { return now_ns - last_ns <= timeout_ns_; }
  bool isFresh(const Known& known, std::int64_t now_ns) const { return isFresh(known.lastNs(), now_ns); }
  bool isSame(std::uint32_t a, std::uint32_t b) const;
  bool isAt(const Known& known, const Endpoint& endpoint) const;
  BeaconSighting sightingOf(const Known& known, std::int64_t now_ns) const;

  std::int64_t timeout_ns_;
  std::int64_t settle_ns_;
  std::function<bool(std::uint32_t)> is_own_;
  std::vector<Known> known_;
};

}  // namespace xplane_bridge::core
