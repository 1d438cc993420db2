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

std::int64_t BeaconTracker::Known::lastNs() const {
  return std::max_element(addresses.begin(), addresses.end(),
                          [](const Address& a, const Address& b) { return a.last_ns < b.last_ns; })
      ->last_ns;
}

bool BeaconTracker::isSame(std::uint32_t a, std::uint32_t b) const {
  return isSameHost(a, b) || (is_own_ && is_own_(a) && is_own_(b));
}

bool BeaconTracker::isAt(const Known& known, const Endpoint& endpoint) const {
  return known.port == endpoint.port &&
         (isSame(known.addresses.front().address, endpoint.address) ||
          std::any_of(known.addresses.begin(), known.addresses.end(),
                      [&](const Address& each) { return each.address == endpoint.address; }));
}

BeaconSighting BeaconTracker::sightingOf(const Known& known, std::int64_t now_ns) const {
  const std::uint32_t first = known.addresses.front().address;
  BeaconSighting sighting{{first, known.port}, {}, known.version, known.computer_name};
  for (const Address& each : known.addresses) {
    if (isFresh(each.last_ns, now_ns) && !isSame(each.address, first)) {
      sighting.other_addresses.push_back(each.address);
    }
  }
  return sighting;
}

bool BeaconTracker::heard(const Beacon& beacon, std::uint32_t from_address, std::int64_t now_ns) {
  if (beacon.host != Beacon::Host::kXPlane || beacon.role != Beacon::Role::kMaster) {
    return false;
  }
  const Endpoint endpoint{from_address, beacon.port};
  auto known = std::find_if(known_.begin(), known_.end(), [&](const Known& each) { return isAt(each, endpoint); });
  if (known == known_.end()) {
    known = std::find_if(known_.begin(), known_.end(), [&](const Known& each) {
      return isFresh(each, now_ns) && !beacon.computer_name.empty() && each.port == beacon.port &&
             each.computer_name == beacon.computer_name && each.version == beacon.version;
    });
  }
  if (known == known_.end()) {
    known = known_.insert(known_.end(), Known{beacon.port, 0, {}, now_ns, {}});
  } else if (!isFresh(*known, now_ns)) {
    // Come back after an absence: as new, also under the address it is heard from now.
    known->addresses.clear();
    known->first_ns = now_ns;
  }
  std::vector<Address>& addresses = known->addresses;
  auto address = std::find_if(addresses.begin(), addresses.end(),
                              [&](const Address& each) { return each.address == from_address; });
  if (address == addresses.end()) {
    address = addresses.insert(addresses.end(), Address{from_address, now_ns});
  }
  address->last_ns = now_ns;
  if (!isFresh(addresses.front().last_ns, now_ns)) {
    std::iter_swap(addresses.begin(), address);
  }
  known->version = beacon.version;
  known->computer_name = std::string(beacon.computer_name);
  return true;
}

std::vector<BeaconSighting> BeaconTracker::sightings(std::int64_t now_ns) const {
  std::vector<BeaconSighting> result;
  for (const Known& known : known_) {
    if (isFresh(known, now_ns)) {
      result.push_back(sightingOf(known, now_ns));
    }
  }
  return result;
}

std::optional<BeaconSighting> BeaconTracker::at(const Endpoint& endpoint, std::int64_t now_ns) const {
  for (const Known& known : known_) {
    if (isFresh(known, now_ns) && isAt(known, endpoint)) {
      return sightingOf(known, now_ns);
    }
  }
  return std::nullopt;
}

std::int64_t BeaconTracker::lastHeard(const Endpoint& endpoint) const {
  for (const Known& known : known_) {
    if (isAt(known, endpoint)) {
      const auto address = std::find_if(known.addresses.begin(), known.addresses.end(),
                                        [&](const Address& each) { return each.address == endpoint.address; });
      return address == known.addresses.end() ? known.lastNs() : address->last_ns;
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
  return sightingOf(*found, now_ns);
}

bool BeaconTracker::isOfComputer(const BeaconSighting& sighting, std::uint32_t address,
                                 const std::string& computer_name) const {
  if (!computer_name.empty() && sighting.computer_name == computer_name) return true;
  const auto is_its = [&](std::uint32_t each) { return isSame(each, address); };
  return is_its(sighting.endpoint.address) ||
         std::any_of(sighting.other_addresses.begin(), sighting.other_addresses.end(), is_its);
}

std::optional<BeaconSighting> BeaconTracker::onlyNewSince(std::int64_t since_ns, std::int64_t now_ns,
                                                          std::uint32_t address,
                                                          const std::string& computer_name) const {
  std::optional<BeaconSighting> found;
  for (const Known& known : known_) {
    if (!isFresh(known, now_ns) || known.first_ns <= since_ns) {
      continue;
    }
    const BeaconSighting sighting = sightingOf(known, now_ns);
    if (!isOfComputer(sighting, address, computer_name)) {
      continue;
    }
    if (found.has_value()) {
      return std::nullopt;
    }
    found = sighting;
  }
  return found;
}

}  // namespace xplane_bridge::core
