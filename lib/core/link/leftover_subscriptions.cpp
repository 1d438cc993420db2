#include "xplane_bridge/core/link/leftover_subscriptions.hpp"

#include <utility>

#include "xplane_bridge/core/base/clock.hpp"

namespace xplane_bridge::core {
namespace {

/// What X-Plane sent before it read the requests has arrived by then, and the slowest groups come once a second.
constexpr std::int64_t kQuietNs = 1500 * kNanosecondsPerMillisecond;
constexpr int kMaxAttempts = 3;  // a request may be lost
/// For an index of which the name is not known. X-Plane goes by the index, whatever the name [? same-index].
constexpr const char* kAnyDataref = "sim/time/paused";

}  // namespace

void LeftoverSubscriptions::linkUp(std::shared_ptr<Journal> journal, std::int64_t now_ns) {
  journal_ = std::move(journal);
  entries_.clear();
  ports_.clear();
  sources_.clear();
  last_sent_ns_ = now_ns;
  if (journal_ == nullptr) {
    return;
  }
  try {
    for (JournalEntry& entry : journal_->orphans(kSubscriptionsPurpose)) {
      if (entry.owner.node == journal_->self().node) {
        entries_.push_back(std::move(entry));
      }
    }
  } catch (const JournalError& error) {
    log_(LogLevel::kError, error.what());
    return;
  }
  for (const JournalEntry& entry : entries_) {
    for (const JournalSubscription& subscription : entry.subscriptions) {
      try {
        sources_.push_back(open_(subscription.port));
        ports_.emplace_back().subscription = subscription;
        ask(ports_.size() - 1);
      } catch (const SocketError& error) {
        // The process that has the port now gets what X-Plane still sends there.
        log_(LogLevel::kWarn,
             std::string("a group of subscriptions that an earlier run of this node has left in X-Plane "
                         "cannot be ended: ") +
                 error.what());
      }
    }
  }
  if (!ports_.empty()) {
    log_(LogLevel::kInfo, "ending " + std::to_string(ports_.size()) +
                              " groups of subscriptions in X-Plane that an "
                              "earlier run of this node has left there");
  } else if (!entries_.empty()) {
    finish(true);
  }
}

void LeftoverSubscriptions::ask(std::size_t position) {
  Port& port = ports_[position];
  const std::vector<std::string>& datarefs = port.subscription.datarefs;
  for (std::size_t i = 0; i < datarefs.size(); ++i) {
    port.requests.push_back({sources_[position], datarefs[i], static_cast<std::int32_t>(i)});
  }
  for (const std::int32_t index : port.unnamed) {
    port.requests.push_back({sources_[position], kAnyDataref, index});
  }
  if (port.subscription.rpos) {
    port.requests.push_back({sources_[position], ""});
  }
}

std::optional<LeftoverSubscriptions::Request> LeftoverSubscriptions::next(std::int64_t now_ns) {
  for (Port& port : ports_) {
    if (!port.requests.empty()) {
      last_sent_ns_ = now_ns;
      Request request = std::move(port.requests.front());
      port.requests.pop_front();
      return request;
    }
  }
  return std::nullopt;
}

void LeftoverSubscriptions::heard(std::size_t position, ByteView datagram, std::int64_t now_ns) {
  // Before that, X-Plane may have sent it without having read the requests.
  constexpr std::int64_t kUnderWayNs = 300 * kNanosecondsPerMillisecond;
  if (now_ns - last_sent_ns_ <= kUnderWayNs) {
    return;
  }
  Port& port = ports_[position];
  port.heard = true;
  const DecodeResult<RrefView> values = decodeRref(datagram);
  for (std::size_t i = 0; values.ok() && i < values->size(); ++i) {
    const std::int32_t index = (*values)[i].index;
    if (index < 0 || static_cast<std::size_t>(index) >= port.subscription.datarefs.size()) {
      port.unnamed.insert(index);
    }
  }
}

void LeftoverSubscriptions::update(std::int64_t now_ns) {
  if (ports_.empty() || now_ns - last_sent_ns_ < kQuietNs) {
    return;
  }
  bool again = false;
  bool undone = true;
  for (std::size_t i = 0; i < ports_.size(); ++i) {
    Port& port = ports_[i];
    if (port.heard) {
      undone = false;
      if (port.attempts < kMaxAttempts) {
        ++port.attempts;
        ask(i);
        again = true;
      }
    }
    port.heard = false;
  }
  if (again) {
    last_sent_ns_ = now_ns;
  } else {
    finish(undone);
  }
}

void LeftoverSubscriptions::finish(bool undone) {
  ports_.clear();
  sources_.clear();
  if (!undone) {
    log_(LogLevel::kWarn,
         "X-Plane goes on sending what an earlier run has asked for; the journal keeps it for the "
         "next start");
    return;
  }
  try {
    journal_->removeUndone(entries_);
  } catch (const JournalError& error) {
    log_(LogLevel::kError, error.what());
  }
  entries_.clear();
}

}  // namespace xplane_bridge::core
