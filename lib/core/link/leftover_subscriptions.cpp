#include "xplane_bridge/core/link/leftover_subscriptions.hpp"

#include <utility>

#include "xplane_bridge/core/base/clock.hpp"

namespace xplane_bridge::core {
namespace {

/// What X-Plane sent before it read the requests has arrived by then, and the slowest groups come once a second.
constexpr std::int64_t kQuietNs = 1500 * kNanosecondsPerMillisecond;
constexpr int kMaxAttempts = 3;  // a request may be lost

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
        ports_.push_back({subscription, 0, 1, false});
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

std::size_t LeftoverSubscriptions::requestsOf(const Port& port) const {
  return port.subscription.datarefs.size() + (port.subscription.rpos ? 1U : 0U);
}

std::optional<LeftoverSubscriptions::Request> LeftoverSubscriptions::next(std::int64_t now_ns) {
  for (std::size_t i = 0; i < ports_.size(); ++i) {
    Port& port = ports_[i];
    if (port.sent < requestsOf(port)) {
      const std::size_t index = port.sent++;
      last_sent_ns_ = now_ns;
      const std::vector<std::string>& datarefs = port.subscription.datarefs;
      return Request{sources_[i], index < datarefs.size() ? datarefs[index] : "", static_cast<std::int32_t>(index)};
    }
  }
  return std::nullopt;
}

void LeftoverSubscriptions::heard(std::size_t position, std::int64_t now_ns) {
  // Before that, X-Plane may have sent it without having read the requests.
  constexpr std::int64_t kUnderWayNs = 300 * kNanosecondsPerMillisecond;
  if (now_ns - last_sent_ns_ > kUnderWayNs) {
    ports_[position].heard = true;
  }
}

void LeftoverSubscriptions::update(std::int64_t now_ns) {
  if (ports_.empty() || now_ns - last_sent_ns_ < kQuietNs) {
    return;
  }
  bool again = false;
  bool undone = true;
  for (Port& port : ports_) {
    if (port.heard) {
      undone = false;
      if (port.attempts < kMaxAttempts) {
        ++port.attempts;
        port.sent = 0;
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
