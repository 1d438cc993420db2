#include "xplane_bridge/core/link/sim_link.hpp"

#include <algorithm>
#include <utility>

#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/core/wire/udp_socket.hpp"

namespace xplane_bridge::core {
namespace {

constexpr double kPatienceS = 3.0;  // before a fruitless search is called a problem

std::string namesOf(const std::vector<BeaconSighting>& sightings) {
  return join(sightings, ", ", [](const BeaconSighting& sighting) { return toString(sighting); });
}

}  // namespace

std::vector<std::string> SimLink::findProblems(std::int64_t now_ns) const {
  std::vector<std::string> problems;
  if (!resolve_failure_.empty()) {
    problems.push_back(resolve_failure_);
  }
  if (!beacon_failure_.empty() && options_.host.empty()) {
    problems.push_back(beacon_failure_);
  }
  const std::vector<BeaconSighting> sightings = beacons_.sightings(now_ns);
  const double searched_s = toSeconds(now_ns - started_ns_);
  if (!monitor_.alive() && options_.host.empty()) {
    if (sightings.size() > 1 && !beacons_.at(peer_, now_ns).has_value()) {
      problems.push_back("several X-Planes announce themselves: " + namesOf(sightings) +
                         "; set the parameter host (and port) to the one that is meant");
    } else if (!peer_.valid() && sightings.empty() && searched_s > kPatienceS) {
      problems.push_back("no X-Plane announces itself on " + options_.beacon_group + ":" +
                         std::to_string(options_.beacon_port) +
                         ": start X-Plane, or set the parameter host if its beacon cannot get here (other network, "
                         "firewall, container)");
    }
  }
  if (!monitor_.alive() && !options_.host.empty() && peer_.valid()) {
    for (const BeaconSighting& sighting : sightings) {
      if (isSameHost(sighting.endpoint.address, peer_.address) && sighting.endpoint.port != peer_.port) {
        problems.push_back("X-Plane at " + sighting.endpoint.addressString() + " listens on port " +
                           std::to_string(sighting.endpoint.port) + ", but port " + std::to_string(peer_.port) +
                           " is configured: set the parameter port");
      }
    }
  }
  if (peer_.valid() && monitor_.state() == LinkState::kSearching && searched_s > kPatienceS) {
    problems.push_back("no answer from " + peer_.toString() +
                       (control_source_->counters().refused > 0
                            ? ": that computer is there, but nothing listens on the port: start X-Plane, or set port"
                            : ": start X-Plane; check the address, firewalls and, in X-Plane 12, Settings > Network > "
                              "Accept incoming connections"));
  }
  if (!data_output_.problem().empty()) {
    problems.push_back(data_output_.problem());
  }
  return problems;
}

std::string SimLink::reasonOf(LinkState state) const {
  switch (state) {
    case LinkState::kSearching:
      return peer_.valid() ? "waiting for the first answer of " + peer_.toString() : "waiting for X-Plane's beacon";
    case LinkState::kConnected:
      return "X-Plane answers";
    case LinkState::kPaused:
      return "X-Plane answers, the simulation is paused";
    case LinkState::kStale:
      return "X-Plane has been silent for more than " + std::to_string(options_.stale_after_s).substr(0, 4) +
             " s: loading, in a menu, or gone";
    case LinkState::kLost:
      if (monitor_.silence(now_ns_) > options_.lost_after_s) {
        return "X-Plane has been silent for long";
      }
      return monitor_.beaconGone(now_ns_) ? "X-Plane is silent and its beacon is gone"
                                          : "X-Plane has moved to " + peer_.toString();
  }
  return {};
}

void SimLink::publish(std::int64_t now_ns) {
  LinkCounters counters = live_counters_;
  counters.udp = retired_udp_;
  counters.receive_buffer = control_source_->receiveBuffer();
  std::vector<std::string> unanswered = status_subscription_.unanswered();
  const auto count = [&counters](const SourcePtr& source) {
    if (source != nullptr) {
      counters.udp += source->counters();
      counters.receive_buffer = std::min(counters.receive_buffer, source->receiveBuffer());
    }
  };
  for (const SourcePtr& source : {control_source_, beacon_source_, data_source_, rpos_source_, xpc_source_}) {
    count(source);
  }
  for (const Group& group : groups_) {
    count(group.source);
    counters.repeated_requests += group.subscription.repeats();
    for (std::string& path : group.subscription.unanswered()) {
      unanswered.push_back(std::move(path));
    }
  }
  LinkStatus status;
  status.state = monitor_.state();
  status.epoch = monitor_.epoch();
  status.reason = reasonOf(status.state);
  status.peer = peer_;
  status.computer_name = peer_name_;
  status.version = version_;
  status.paused = paused_;
  status.sim_time_s = sim_time_s_;
  status.silence_s = monitor_.silence(now_ns);
  status.beacons = beacons_.sightings(now_ns);
  status.problems = findProblems(now_ns);
  bool changed = false;
  bool state_changed = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    state_changed = status.state != status_.state || status.epoch != status_.epoch;
    changed = state_changed || status.peer != status_.peer || status.version != status_.version ||
              status.problems != status_.problems || status.computer_name != status_.computer_name;
    status.since_steady_ns = status.state != status_.state ? now_ns : status_.since_steady_ns;
    status_ = status;
    counters_ = counters;
    unanswered_ = std::move(unanswered);
  }
  if (state_changed) {
    const bool bad = status.state == LinkState::kLost || status.state == LinkState::kStale;
    log_(bad ? LogLevel::kWarn : LogLevel::kInfo, std::string("link ") + toString(status.state) + ": " + status.reason);
  }
  if (changed && callbacks_.on_state) {
    callbacks_.on_state(status);
  }
}

}  // namespace xplane_bridge::core
