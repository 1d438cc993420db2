#include "xplane_bridge/core/link/sim_link.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/core/wire/udp_socket.hpp"

namespace xplane_bridge::core {
namespace {

constexpr std::int64_t kResolveNs = 5 * kNanosecondsPerSecond;
constexpr std::int64_t kJoinNs = 5 * kNanosecondsPerSecond;
constexpr std::int64_t kMoveNs = kNanosecondsPerSecond / 5;
constexpr std::int64_t kRposRetryNs = kNanosecondsPerSecond;

/// Of this process: what an earlier one has left under the same name is kept until it is ended.
std::string subscriptionsId(const Journal& journal) {
  return std::string(kSubscriptionsPurpose) + ":" + journal.self().node + ":" + std::to_string(journal.self().pid);
}

}  // namespace

void SimLink::maintain(std::int64_t now_ns) {
  if (beacon_source_ != nullptr && now_ns >= next_join_ns_) {
    next_join_ns_ = now_ns + kJoinNs;
    try {
      beacon_source_->joinOnAllInterfaces(resolveHost(options_.beacon_group));
    } catch (const SocketError& error) {
      beacon_failure_ = std::string("X-Plane's beacon cannot be heard: ") + error.what();
    }
  }
  // Before another peer is found: it has not refused anything.
  if (const std::uint64_t refused = control_source_->counters().refused; std::exchange(refused_, refused) != refused) {
    refused_ns_ = now_ns;
  }
  if (stop_phase_ == StopPhase::kRunning) {
    findPeer(now_ns);
  }
  refreshLink(now_ns);
  if (left_journal_ != nullptr && now_ns >= next_move_ns_) {
    moveEntries();
  }
  if (peer_.valid() && !monitor_.alive() && now_ns >= next_probe_ns_) {
    next_probe_ns_ = now_ns + jitter_.around(toNanoseconds(options_.probe_period_s));
    status_subscription_.restart(now_ns);
  }
  data_output_.update(monitor_.state() == LinkState::kConnected, now_ns);
  updateRpos(now_ns);
  if (monitor_.alive()) {
    leftovers_.update(now_ns);
  }
  publish(now_ns);
}

void SimLink::findPeer(std::int64_t now_ns) {
  if (!options_.host.empty()) {
    // Not at every hitch: a name server that does not answer holds this thread up for seconds.
    const bool away = monitor_.state() == LinkState::kSearching || monitor_.state() == LinkState::kLost;
    if (away && now_ns >= next_resolve_ns_) {
      resolve(now_ns);
    }
    return;
  }
  if (monitor_.alive()) {
    return;
  }
  const bool answered_once = last_heard_ns_ >= 0;
  if (!peer_.valid() || !answered_once) {
    // A peer that has been chosen but never answered gives way as soon as another is the only one.
    const std::optional<BeaconSighting> only = beacons_.onlyOne(now_ns);
    if (only.has_value() && only->endpoint != peer_) {
      setPeer(only->endpoint, "found by its beacon: " + toString(*only));
    }
    return;
  }
  // The X-Plane we knew is silent. It is where its beacon comes from now, or it is one of its computer that has begun
  // to announce itself since: never jump to another computer's, which another user may fly.
  if (now_ns - beacons_.lastHeard(peer_) < toNanoseconds(options_.beacon_settle_s)) {
    return;
  }
  const std::optional<BeaconSighting> known = beacons_.at(peer_, now_ns);
  if (known.has_value() && known->endpoint != peer_ &&
      now_ns - last_heard_ns_ > toNanoseconds(options_.beacon_timeout_s)) {
    setPeer(known->endpoint, "no longer heard from " + peer_.addressString() + ": " + toString(*known));
    return;
  }
  const std::optional<BeaconSighting> restarted =
      beacons_.onlyNewSince(last_heard_ns_, now_ns, peer_.address, peer_name_);
  if (restarted.has_value() && restarted->endpoint != peer_) {
    setPeer(restarted->endpoint, "come back as " + toString(*restarted));
  }
}

void SimLink::resolve(std::int64_t now_ns) {
  next_resolve_ns_ = now_ns + kResolveNs;
  try {
    const Endpoint found{resolveHost(options_.host), options_.port};
    resolve_failure_.clear();
    if (found != peer_) {
      setPeer(found, "host '" + options_.host + "'");
    }
  } catch (const SocketError& error) {
    if (resolve_failure_ != error.what()) {
      resolve_failure_ = error.what();
      log_(LogLevel::kError, resolve_failure_);
    }
  }
}

void SimLink::setPeer(const Endpoint& peer, const std::string& why) {
  log_(LogLevel::kInfo, "looking for X-Plane at " + peer.toString() + ", " + why);
  peer_ = peer;
  packed_peer_ = (std::uint64_t{peer.address} << 16) | peer.port;
  peer_name_.clear();
  if (const std::optional<BeaconSighting> sighting = beacons_.at(peer, now_ns_)) {
    peer_name_ = sighting->computer_name;
  }
  ports_.fill(0);
  intruder_.reset();
  other_address_.reset();
  answered_ns_.reset();
  ended_in_silence_.clear();
  answered_version_ = 0;
  answered_epoch_ = 0;
  version_ = {};
  paused_.reset();
  sim_time_s_.reset();
  monitor_.newPeer();
  if (beacons_.lastHeard(peer) > 0) {
    monitor_.beaconHeard(beacons_.lastHeard(peer));
  }
  next_probe_ns_ = now_ns_;
  refused_ns_.reset();
  openJournals();
}

/// X-Plane has another address, or was restarted at another port: what this process has noted goes along, as if that
/// were the old one. What belongs to the run before is dropped by what noted it, as after a restart at the old port.
void SimLink::openJournals() {
  left_journal_ = journal();
  left_subscriptions_journal_ = subscriptions_journal_;
  std::shared_ptr<Journal> opened = journals_ ? journals_(peer_) : nullptr;
  subscriptions_journal_ = opened && options_.journal_subscriptions ? opened->ofSubscriptions(peer_) : nullptr;
  data_output_.setJournal(opened);
  // In the new one before another thread looks there, and out of the old one afterwards.
  copyEntries(left_journal_.get(), opened.get(), false);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    journal_ = opened;
  }
  moveEntries();
}

/// Again until X-Plane answers: another process may have had a journal locked, and another thread of this one may have
/// noted something in the old one while the new one was opened.
void SimLink::moveEntries() {
  next_move_ns_ = now_ns_ + kMoveNs;
  const bool moved = copyEntries(left_journal_.get(), journal().get(), true);
  const bool subscriptions_moved = copyEntries(left_subscriptions_journal_.get(), subscriptions_journal_.get(), true);
  if (moved && subscriptions_moved) {
    move_failure_.clear();
    if (monitor_.alive()) {
      left_journal_.reset();
      left_subscriptions_journal_.reset();
    }
  }
}

/// @return whether nothing is left to be copied
bool SimLink::copyEntries(const Journal* from, const Journal* to, bool remove) {
  if (from == nullptr || to == nullptr || from->path() == to->path()) {
    return true;
  }
  try {
    const std::vector<JournalEntry> own = from->own();
    if (own.empty()) {
      return true;
    }
    // The link must not stand still for a process that was stopped while it had a journal locked.
    const std::vector<JournalEntry> adopted = to->withoutWaiting().adopt(own);
    if (remove) {
      from->withoutWaiting().removeUndone(adopted);
    }
    return adopted.size() == own.size();
  } catch (const JournalError& error) {
    if (std::exchange(move_failure_, error.what()) != error.what()) {
      log_(LogLevel::kError, move_failure_);
    }
    return false;
  }
}

void SimLink::refreshLink(std::int64_t now_ns) {
  monitor_.update(now_ns);
  const bool alive = monitor_.alive();
  const bool came_up = alive && monitor_.epoch() != seen_epoch_;
  if (alive && (!was_alive_ || came_up)) {
    restartSubscriptions(now_ns);
    ends_.insert(ends_.end(), ended_in_silence_.begin(), ended_in_silence_.end());
    ended_in_silence_.clear();
  } else if (!alive && was_alive_) {
    for (Group& group : groups_) {
      group.subscription.suspend();
    }
    next_probe_ns_ = now_ns;
    ports_.fill(0);  // what comes back may be another run of X-Plane
  }
  const bool changed = alive != was_alive_ || came_up;
  was_alive_ = alive;
  if (came_up) {
    seen_epoch_ = monitor_.epoch();
    came_up_ns_ = now_ns;
    answered_ns_.reset();
    resolve_failure_.clear();  // it is where it was found last
    moveEntries();
    if (stop_phase_ == StopPhase::kRunning) {
      leftovers_.linkUp(subscriptions_journal_, now_ns);
      subscriptions_changed_ = true;
      updateDataOutput(now_ns);
    }
  }
  if (changed) {
    publish(now_ns);
  }
}

void SimLink::restartSubscriptions(std::int64_t now_ns) {
  for (Group& group : groups_) {
    group.subscription.restart(now_ns);
    ++live_counters_.resubscriptions;
  }
  status_subscription_.restart(now_ns);
  next_rpos_request_ns_ = now_ns;
}

void SimLink::updateDataOutput(std::int64_t now_ns) {
  Endpoint target{0, dataPort()};
  try {
    target.address =
        options_.data_output.address.empty() ? localAddressTowards(peer_) : resolveHost(options_.data_output.address);
  } catch (const SocketError& error) {
    log_(LogLevel::kError, std::string("Data Output has no target: ") + error.what());
    return;
  }
  data_output_.linkUp(target, now_ns);
}

void SimLink::updateRpos(std::int64_t now_ns) {
  if (rpos_source_ == nullptr || rpos_rate_hz_ == 0 || !monitor_.alive() || now_ns < next_rpos_request_ns_ ||
      stop_phase_ != StopPhase::kRunning) {
    return;
  }
  sendRposRequest(rpos_source_.get(), rpos_rate_hz_);
  rpos_asked_ = true;
  next_rpos_request_ns_ = now_ns + jitter_.around(kRposRetryNs);
}

/// Again when it goes on: that request may be lost.
void SimLink::stopRpos() {
  sendRposRequest(rpos_source_.get(), 0);
  next_rpos_request_ns_ = now_ns_ + kRposRetryNs;
}

void SimLink::askXpc(std::int64_t now_ns) {
  if (xpc_source_ == nullptr || !peer_.valid() || !monitor_.alive() || now_ns < next_xpc_request_ns_ ||
      stop_phase_ != StopPhase::kRunning) {
    return;
  }
  constexpr std::uint8_t kOwnAircraft = 0;
  std::array<std::uint8_t, kGetpSize> buffer;
  if (const EncodeResult size = encodeGetp(buffer, kOwnAircraft)) {
    xpc_source_->sendTo({buffer.data(), *size}, {peer_.address, options_.xpc_port});
  }
  next_xpc_request_ns_ = now_ns + toNanoseconds(1.0 / options_.xpc_rate_hz);
}

void SimLink::flushRequests(std::int64_t now_ns) {
  if (!peer_.valid()) {
    return;
  }
  const auto flush = [&](RrefSubscription* subscription, DatagramSource* source) {
    const auto allowed = [&] {
      return subscription->urgent() ? pacer_.urgentAllowance(now_ns, &jitter_) : pacer_.allowance(now_ns, &jitter_);
    };
    while (allowed() > 0) {
      const std::optional<std::size_t> index = subscription->nextRequest(now_ns, &jitter_);
      if (!index.has_value()) {
        return;
      }
      sendRequest(source, subscription->group().datarefs[*index], subscription->group().rate_hz,
                  static_cast<std::int32_t>(*index));
      pacer_.spend(1);
    }
  };
  const bool subscribing = stop_phase_ == StopPhase::kRunning || stop_phase_ == StopPhase::kReleasing;
  if (subscribing) {
    recordSubscriptions();
    flush(&status_subscription_, control_source_.get());
    for (Group& group : groups_) {
      if (group.subscription.urgent()) {
        flush(&group.subscription, group.source.get());
      }
    }
  }
  for (; pacer_.allowance(now_ns, &jitter_) > 0; pacer_.spend(1)) {
    const std::optional<DatarefReader::Request> request = reader_.nextRequest(now_ns);
    if (!request.has_value()) {
      break;
    }
    sendRequest(control_source_.get(), request->path, request->rate_hz, request->index);
  }
  const auto end = [&](std::deque<End>* ends, bool again) {
    for (; !ends->empty() && pacer_.allowance(now_ns, &jitter_) > 0; pacer_.spend(1)) {
      sendEnd(ends->front().source.get(), ends->front().path, ends->front().index);
      if (again) {
        ends_again_.push_back(std::move(ends->front()));
      }
      ends->pop_front();
    }
  };
  end(&ends_, stop_phase_ == StopPhase::kRunning);
  if (subscribing) {
    for (Group& group : groups_) {
      flush(&group.subscription, group.source.get());
    }
  }
  for (; monitor_.alive() && pacer_.allowance(now_ns, &jitter_) > 0; pacer_.spend(1)) {
    const std::optional<LeftoverSubscriptions::Request> leftover = leftovers_.next(now_ns);
    if (!leftover.has_value()) {
      break;
    }
    sendEnd(leftover->source.get(), leftover->dataref, leftover->index);
  }
  end(&ends_again_, false);
}

void SimLink::sendRequest(DatagramSource* source, const std::string& path, std::int32_t rate_hz, std::int32_t index) {
  std::array<std::uint8_t, kRrefRequestSize> buffer;
  if (const EncodeResult size = encodeRref(buffer, path, rate_hz, index)) {
    source->sendTo({buffer.data(), *size}, peer_);
    ++live_counters_.requests;
  }
}

void SimLink::sendRposRequest(DatagramSource* source, std::int32_t rate_hz) {
  std::array<std::uint8_t, kRposRequestSize> buffer;
  if (const EncodeResult size = encodeRpos(buffer, rate_hz)) {
    source->sendTo({buffer.data(), *size}, peer_);
    ++live_counters_.requests;
  }
}

void SimLink::sendEnd(DatagramSource* source, const std::string& path, std::int32_t index) {
  if (path.empty()) {
    sendRposRequest(source, 0);
  } else {
    sendRequest(source, path, 0, index);
  }
}

void SimLink::recordSubscriptions() {
  if (!subscriptions_changed_ || subscriptions_journal_ == nullptr || !monitor_.alive()) {
    return;  // before X-Plane has answered, it is asked for the link's own status only
  }
  subscriptions_changed_ = false;
  std::vector<JournalSubscription> subscriptions;
  const auto add = [&subscriptions](const DatagramSource& source, const std::vector<std::string>& datarefs, bool rpos) {
    subscriptions.push_back({source.localPort(), datarefs, rpos});
  };
  add(*control_source_, status_subscription_.group().datarefs, false);
  for (const Group& group : groups_) {
    add(*group.source, group.subscription.group().datarefs, false);
  }
  if (rpos_source_ != nullptr && rpos_rate_hz_ > 0) {
    add(*rpos_source_, {}, true);
  }
  try {
    subscriptions_journal_->record(subscriptionsId(*subscriptions_journal_), kSubscriptionsPurpose, {},
                                   std::move(subscriptions));
  } catch (const JournalError& error) {
    log_(LogLevel::kWarn,
         std::string("subscriptions are not written down, and stay in X-Plane after a crash: ") + error.what());
  }
}

void SimLink::forgetSubscriptions() {
  if (subscriptions_journal_ == nullptr) {
    return;
  }
  try {
    subscriptions_journal_->remove({subscriptionsId(*subscriptions_journal_)});
  } catch (const JournalError& error) {
    log_(LogLevel::kError, error.what());
  }
}

void SimLink::removeGroup(const RrefDelivery* delivery) {
  const auto old = std::find_if(groups_.begin(), groups_.end(),
                                [delivery](const Group& each) { return each.delivery.get() == delivery; });
  if (old != groups_.end()) {
    stopGroup(*old);
    groups_.erase(old);
    subscriptions_changed_ = true;
  }
}

void SimLink::stopGroup(const Group& group) {
  retired_udp_ += group.source->counters();
  hub_->ignore(*group.source);  // it may live on for requests that are still to be sent
  if (!group.subscription.asked()) {
    return;
  }
  endSubscription(group.source, group.subscription.group().datarefs);
}

/// @param paths in the order of their indices; an empty one: the position stream
void SimLink::endSubscription(const SourcePtr& source, const std::vector<std::string>& paths) {
  // One that is silent may only be loading, and goes on sending afterwards.
  std::deque<End>& ends = monitor_.alive() ? ends_ : ended_in_silence_;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    ends.push_back({source, paths[i], static_cast<std::int32_t>(i)});
  }
}

void SimLink::stopSubscriptions() {
  if (!monitor_.alive()) {
    return;
  }
  if (rpos_asked_) {
    endSubscription(rpos_source_, {""});
  }
  for (const Group& group : groups_) {
    stopGroup(group);
  }
  groups_.clear();
  endSubscription(control_source_, status_subscription_.group().datarefs);
}

void SimLink::updateStop(std::int64_t now_ns) {
  const auto late = [&] { return now_ns >= stop_deadline_ns_; };
  if (stop_phase_ == StopPhase::kReleasing && late()) {
    reader_.cancelAll();  // which says that it is not undone, and gives the subscriptions their time
    stop_phase_ = StopPhase::kUnsubscribing;
  }
  if (stop_phase_ == StopPhase::kUnsubscribing && ends_.empty() && reader_.idle()) {
    stop_phase_ = StopPhase::kDone;
    // While it loads, X-Plane does not read that it is to stop, and may be silent for longer than LOST takes.
    if (monitor_.alive()) forgetSubscriptions();
  } else if (stop_phase_ == StopPhase::kUnsubscribing && late()) {
    stop_phase_ = StopPhase::kDone;
    log_(LogLevel::kWarn, "X-Plane's frames are so slow that " + std::to_string(ends_.size()) +
                              " subscriptions could not be ended; the next start of this node, or release_overrides, "
                              "ends them");
  }
  if (stop_phase_ == StopPhase::kDone) {
    reader_.cancelAll();
    // In lock-step each has its fence, which the simulator would send for ever.
    for (const Group& group : groups_) hub_->ignore(*group.source);  // those of one that is silent
    for (const SourcePtr& source : {control_source_, rpos_source_}) {
      if (source != nullptr) hub_->ignore(*source);
    }
    quit_ = true;
  }
}

}  // namespace xplane_bridge::core
