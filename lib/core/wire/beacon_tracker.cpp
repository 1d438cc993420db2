#include "xplane_bridge/core/wire/beacon_tracker.hpp"

#include <algorithm>
#include <utility>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {

std::string toString(const BeaconSighting& sighting) {
  std::string text = (sighting.computer_name.empty() ? std::string("X-Plane") : sighting.computer_name) + " (" +
                     sighting.endpoint.toString() + ", version " + std::to_string(sighting.version);
  for (const std::uint32_t address : sighting.other_addresses) {
    text += ", also heard from " + Endpoint{address, 0}.addressString();
  }
  return text + ")";
}

BeaconTracker::BeaconTracker(double timeout_s, double settle_s, std::function<bool(std::uint32_t)> is_own)
    : timeout_ns_(toNanoseconds(timeout_s)), settle_ns_(toNanoseconds(settle_s)), is_own_(std::move(is_own)) {}

bool BeaconTracker::isSame(const Endpoint& a, const Endpoint& b) const {
  return a.port == b.port &&
         (isSameHost(a.address, b.address) || (is_own_ && is_own_(a.address) && is_own_(b.address)));
}

bool BeaconTracker::isAt(const BeaconSighting& sighting, const Endpoint& endpoint) const {
  if (isSame(sighting.endpoint, endpoint)) {
    return true;
  }
  const std::vector<std::uint32_t>& others = sighting.other_addresses;
  return sighting.endpoint.port == endpoint.port &&
         std::find(others.begin(), others.end(), endpoint.address) != others.end();
}

bool BeaconTracker::heard(const Beacon& beacon, std::uint32_t from_address, std::int64_t now_ns) {
  if (beacon.host != Beacon::Host::kXPlane || beacon.role != Beacon::Role::kMaster) {
    return false;
  }
  const Endpoint endpoint{from_address, beacon.port};
  auto known =
      std::find_if(known_.begin(), known_.end(), [&](const Known& each) { return isAt(each.sighting, endpoint); });
  if (known == known_.end()) {
    known = std::find_if(known_.begin(), known_.end(), [&](const Known& each) {
      return isFresh(each, now_ns) && !beacon.computer_name.empty() && each.sighting.endpoint.port == beacon.port &&
             each.sighting.computer_name == beacon.computer_name && each.sighting.version == beacon.version;
    });
    if (known != known_.end()) {
      known->sighting.other_addresses.push_back(from_address);
    }
  }
  if (known == known_.end()) {
    known = known_.insert(known_.end(), Known{{endpoint, {}, 0, {}}, now_ns, now_ns});
  } else if (!isFresh(*known, now_ns)) {
    // Come back after an absence: as new, also under the address it is heard from now.
    known->sighting.endpoint = endpoint;
    known->sighting.other_addresses.clear();
    known->first_ns = now_ns;
  }
  known->sighting.version = beacon.version;
  known->sighting.computer_name = std::string(beacon.computer_name);
  known->last_ns = now_ns;
  return true;
}

std::vector<BeaconSighting> BeaconTracker::sightings(std::int64_t now_ns) const {
  std::vector<BeaconSighting> result;
  for (const Known& known : known_) {
    if (isFresh(known, now_ns)) {
      result.push_back(known.sighting);
    }
  }
  return result;
}

std::optional<BeaconSighting> BeaconTracker::at(const Endpoint& endpoint, std::int64_t now_ns) const {
  for (const Known& known : known_) {
    if (isFresh(known, now_ns) && isAt(known.sighting, endpoint)) {
      return known.sighting;
    }
  }
  return std::nullopt;
}

std::int64_t BeaconTracker::lastHeard(const Endpoint& endpoint) const {
  for (const Known& known : known_) {
    if (isAt(known.sighting, endpoint)) {
      return known.last_ns;
    }
  }
  return 0;
}

std::optional<BeaconSighting> BeaconTracker::onlyOne(std::int64_t now_ns) const {
  const Known* found = nullptr;
  for (const Known& known : known_) {
    if (!isFresh(known, now_ns)) {
      continue;
    }
    if (found != nullptr) {
      return std::nullopt;
    }
    found = &known;
  }
  if (found == nullptr || now_ns - found->first_ns < settle_ns_) {
    return std::nullopt;
  }
  return found->sighting;
}

std::optional<BeaconSighting> BeaconTracker::onlyNewSince(std::int64_t since_ns, std::int64_t now_ns) const {
  const Known* found = nullptr;
  for (const Known& known : known_) {
    if (!isFresh(known, now_ns) || known.first_ns <= since_ns) {
      continue;
    }
    if (found != nullptr) {
      return std::nullopt;
    }
    found = &known;
  }
  return found == nullptr ? std::nullopt : std::optional<BeaconSighting>(found->sighting);
}

}  // namespace xplane_bridge::core
