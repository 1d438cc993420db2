#include "xplane_bridge/core/link/sim_link.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/core/wire/udp_socket.hpp"

namespace xplane_bridge::core {
namespace {

constexpr double kPatienceS = 5.0;        // before a fruitless search is called a problem
constexpr double kRecentS = 5.0;          // what was noticed within this is reported
constexpr double kAnswerPatienceS = 2.0;  // without an answer, while DATA comes

std::string namesOf(const std::vector<BeaconSighting>& sightings) {
  return join(sightings, ", ", [](const BeaconSighting& sighting) { return toString(sighting); });
}

bool isRecent(const std::optional<std::int64_t>& time_ns, std::int64_t now_ns) {
  return time_ns.has_value() && toSeconds(now_ns - *time_ns) <= kRecentS;
}

bool contains(const std::vector<std::string>& texts, const std::string& text) {
  return std::find(texts.begin(), texts.end(), text) != texts.end();
}

}  // namespace

void SimLink::findSearchProblems(std::int64_t now_ns, std::vector<std::string>* problems) const {
  const std::vector<BeaconSighting> sightings = beacons_.sightings(now_ns);
  const double searched_s = toSeconds(now_ns - started_ns_);
  if (options_.host.empty()) {
    if (sightings.size() > 1 && !beacons_.at(peer_, now_ns).has_value()) {
      problems->push_back("several X-Planes announce themselves: " + namesOf(sightings) +
                          "; set the parameter host (and port) to the one that is meant");
    } else if (last_heard_ns_ >= 0 && sightings.size() == 1 &&
               !beacons_.isOfComputer(sightings.front(), peer_.address, peer_name_)) {
      problems->push_back("the X-Plane at " + peer_.toString() + " is gone, and " + namesOf(sightings) +
                          " is on another computer: to go on with that one, set the parameter host to it");
    } else if (!peer_.valid() && sightings.empty() && searched_s > kPatienceS) {
      problems->push_back("no X-Plane announces itself on " + options_.beacon_group + ":" +
                          std::to_string(options_.beacon_port) +
                          ": start X-Plane, or set the parameter host if its beacon cannot get here (other network, "
                          "firewall, container)");
    }
  } else if (peer_.valid()) {
    for (const BeaconSighting& sighting : sightings) {
      if (isSameHost(sighting.endpoint.address, peer_.address) && sighting.endpoint.port != peer_.port) {
        problems->push_back("X-Plane at " + sighting.endpoint.addressString() + " listens on port " +
                            std::to_string(sighting.endpoint.port) + ", but port " + std::to_string(peer_.port) +
                            " is configured: set the parameter port");
      }
    }
  }
  if (other_address_.has_value() && isRecent(other_address_->time_ns, now_ns)) {
    const std::string from = other_address_->from.addressString();
    problems->push_back(
        "answers come from " + from +
        (peer_.valid()
             ? ", but " + peer_.addressString() + (options_.host.empty() ? " announced itself" : " is configured")
             : ", but no X-Plane has announced itself") +
        ": X-Plane's computer has several addresses, or it is another one; set the parameter host to " + from);
  } else if (peer_.valid() && monitor_.state() == LinkState::kSearching && searched_s > kPatienceS) {
    problems->push_back("no answer from " + peer_.toString() +
                        (isRecent(refused_ns_, now_ns)
                             ? ": that computer is there, but nothing listens on the port: start X-Plane, or set port"
                             : ": start X-Plane; check the address, firewalls and, in X-Plane 12, Settings > Network > "
                               "Accept incoming connections"));
  }
}

std::vector<std::string> SimLink::findProblems(std::int64_t now_ns) const {
  std::vector<std::string> problems;
  if (!resolve_failure_.empty()) {
    problems.push_back(resolve_failure_);
  }
  if (!beacon_failure_.empty() && options_.host.empty()) {
    problems.push_back(beacon_failure_);
  }
  if (!monitor_.alive()) {
    findSearchProblems(now_ns, &problems);
  } else if (isOneWay(now_ns)) {
    problems.push_back("X-Plane sends Data Output, but nothing answers on " + peer_.toString() +
                       ": only what its rows contain is known (a firewall there; in X-Plane 12, Settings > Network > " +
                       "Accept incoming connections)");
    if (!version_.known()) {
      problems.emplace_back(
          "X-Plane's version is not known, so rows that differ by version (rates, for example) are left "
          "out: set the parameter xplane_version");
    }
  }
  if (intruder_.has_value() && isRecent(intruder_->time_ns, now_ns)) {
    problems.push_back("another program at " + intruder_->from.toString() +
                       " sends X-Plane's messages as well: they are dropped");
  }
  if (monitor_.alive() && !data_output_.problem().empty()) {  // which is said of an X-Plane that answers
    problems.push_back(data_output_.problem());
  }
  return problems;
}

bool SimLink::isOneWay(std::int64_t now_ns) const {
  const std::int64_t answered_ns = answered_ns_.value_or(came_up_ns_);
  return monitor_.alive() && live_counters_.data_datagrams > 0 && toSeconds(now_ns - answered_ns) > kAnswerPatienceS;
}

void SimLink::updateVersion(std::int64_t now_ns) {
  const bool one_way = isOneWay(now_ns);
  if (one_way && answered_epoch_ != monitor_.epoch()) {
    answered_version_ = 0;  // one that never answers may be another than the one that did before it went away
  }
  std::int32_t number = answered_version_;
  if (number == 0 && one_way) {
    const std::optional<BeaconSighting> beacon = beacons_.at(peer_, now_ns);
    number = beacon.has_value() ? beacon->version : options_.unheard_version;
  } else if (number == 0) {
    number = version_.number;  // a silence says nothing of it
  }
  if (number == version_.number) {
    return;
  }
  version_ = {number};
  if (version_.known() && options_.otherwise) {
    version_.otherwise = options_.otherwise(peer_, number);
  }
}

std::string SimLink::reasonOf(LinkState state) const {
  switch (state) {
    case LinkState::kSearching:
      return peer_.valid() ? "waiting for the first answer of " + peer_.toString() : "waiting for X-Plane's beacon";
    case LinkState::kConnected:
      return isOneWay(now_ns_) ? "X-Plane sends, but does not answer" : "X-Plane answers";
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
  updateVersion(now_ns);
  LinkStatus status;
  status.state = monitor_.state();
  status.epoch = monitor_.epoch();
  status.reason = reasonOf(status.state);
  status.peer = peer_;
  status.computer_name = peer_name_;
  status.version = version_;
  status.one_way = isOneWay(now_ns);
  status.paused = paused_;
  status.sim_time_s = sim_time_s_;
  status.silence_s = monitor_.silence(now_ns);
  status.beacons = beacons_.sightings(now_ns);
  status.problems = findProblems(now_ns);
  if (status.state == LinkState::kSearching && !status.problems.empty()) {
    status.reason = join(status.problems, "; ");
  } else if (status.state == LinkState::kLost && !status.problems.empty()) {
    status.reason += ": " + join(status.problems, "; ");
  }
  bool changed = false;
  bool state_changed = false;
  std::vector<std::string> new_problems;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    state_changed = status.state != status_.state || status.epoch != status_.epoch;
    changed = state_changed || status.peer != status_.peer || status.version != status_.version ||
              status.problems != status_.problems || status.computer_name != status_.computer_name;
    std::copy_if(status.problems.begin(), status.problems.end(), std::back_inserter(new_problems),
                 [this](const std::string& problem) { return !contains(status_.problems, problem); });
    status.since_steady_ns = status.state != status_.state ? now_ns : status_.since_steady_ns;
    status_ = status;
    counters_ = counters;
    unanswered_ = status.one_way ? std::vector<std::string>() : std::move(unanswered);
  }
  if (state_changed) {
    const bool bad = status.state == LinkState::kLost || status.state == LinkState::kStale;
    log_(bad ? LogLevel::kWarn : LogLevel::kInfo, std::string("link ") + toString(status.state) + ": " + status.reason);
  }
  for (const std::string& problem : new_problems) {
    // These three were logged when they came about.
    if (problem != resolve_failure_ && problem != beacon_failure_ && problem != data_output_.problem()) {
      log_(LogLevel::kWarn, problem);
    }
  }
  if (changed && callbacks_.on_state) {
    callbacks_.on_state(status);
  }
}

}  // namespace xplane_bridge::core
