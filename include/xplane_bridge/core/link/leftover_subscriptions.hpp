#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "xplane_bridge/core/base/log.hpp"
#include "xplane_bridge/core/link/journal.hpp"
#include "xplane_bridge/core/wire/datagram_source.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {

constexpr const char* kSubscriptionsPurpose = "subscriptions";

/// Ends what a node that was killed has left subscribed in X-Plane, which otherwise sends to the dead port until it is
/// quit: opens each port that the journal names, asks for nothing any more from there, and listens whether that helps.
/// What was being read when it was killed is in no journal: that ends by the indices that still come.
/// No I/O of its own except the journal's. Times are the steady clock's [ns].
class LeftoverSubscriptions {
 public:
  /// One request to X-Plane that ends a subscription.
  struct Request {
    std::shared_ptr<DatagramSource> source;
    std::string dataref;  ///< empty: the position stream
    std::int32_t index = 0;
  };
  /// Opens a port; throws SocketError.
  using Open = std::function<std::shared_ptr<DatagramSource>(std::uint16_t port)>;

  LeftoverSubscriptions(Open open, LogFunction log) : open_(std::move(open)), log_(std::move(log)) {}

  /// The link came up anew: takes up what earlier processes of this node have left in its journal.
  void linkUp(std::shared_ptr<Journal> journal, std::int64_t now_ns);
  /// The next request to send; empty: none at the moment. What is taken is sent.
  std::optional<Request> next(std::int64_t now_ns);
  /// All sources, to be emptied; heard() with the position of its source for each datagram.
  const std::vector<std::shared_ptr<DatagramSource>>& sources() const { return sources_; }
  void heard(std::size_t position, ByteView datagram, std::int64_t now_ns);
  /// Call regularly while X-Plane answers: gives the ports back once nothing comes any more.
  void update(std::int64_t now_ns);

 private:
  struct Port {
    JournalSubscription subscription;
    std::deque<Request> requests;    // of this attempt, still to be sent
    std::set<std::int32_t> unnamed;  // indices that came and that the journal does not have
    int attempts = 1;
    bool heard = false;  // since it was asked to stop
  };

  void ask(std::size_t position);
  void finish(bool undone);

  Open open_;
  LogFunction log_;
  std::shared_ptr<Journal> journal_;
  std::vector<JournalEntry> entries_;
  std::vector<Port> ports_;
  std::vector<std::shared_ptr<DatagramSource>> sources_;  // of ports_
  std::int64_t last_sent_ns_ = 0;
};

}  // namespace xplane_bridge::core
