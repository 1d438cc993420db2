#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/base/log.hpp"
#include "xplane_bridge/core/link/data_output.hpp"
#include "xplane_bridge/core/link/journal.hpp"
#include "xplane_bridge/core/link/simulator_port.hpp"
#include "xplane_bridge/core/wire/packets.hpp"
#include "xplane_bridge/core/wire/udp_socket.hpp"

namespace xplane_bridge::core {

/// Where X-Plane is and how long to wait for it. Checked by SimLink's constructor.
struct SimLinkOptions {
  std::string host;                   ///< name or IPv4 address; empty: found by beacon
  std::uint16_t port = kDefaultPort;  ///< X-Plane's listening port; with an empty host the beacon says it
  bool listen_for_beacon = true;
  std::string beacon_group = kBeaconGroup;
  std::uint16_t beacon_port = kBeaconPort;
  double stale_after_s = 0.4;        ///< [s] silence until STALE
  double lost_after_s = 10.0;        ///< [s] silence until LOST whatever the beacon says
  double beacon_timeout_s = 2.5;     ///< [s] without a beacon until it counts as gone
  double beacon_settle_s = 1.2;      ///< [s] waited for a second beacon before the first is chosen
  double probe_period_s = 0.2;       ///< [s] between questions while X-Plane is silent
  std::int32_t status_rate_hz = 20;  ///< of the link's own subscription (version, paused, simulator time)
  std::size_t batch_size = 100;      ///< subscription requests sent at once; X-Plane loses some above about 140
  double batch_spacing_s = 0.1;      ///< [s] between batches
  double request_timeout_s = 2.0;    ///< [s] deadline of the link's own read-backs
  std::uint32_t jitter_seed = 1;     ///< retries are spread by up to 20 %
  std::int32_t rpos_rate_hz = 0;     ///< RPOS stream; 0: none
  std::uint16_t xpc_port = 0;        ///< where the X-Plane Connect plugin is asked for the position; 0: not at all
  double xpc_rate_hz = 60.0;         ///< of these questions (each has one answer), up to 1000
  DataOutputOptions data_output;
};

struct LinkCounters {
  UdpCounters udp;              ///< sum over all sockets
  std::uint64_t strangers = 0;  ///< datagrams from another computer than X-Plane's: dropped
  std::array<std::uint64_t, kDecodeErrorCount> decode_errors{};  ///< by DecodeError
  std::uint64_t unknown_rows = 0;                                ///< DATA rows with an index outside 0..199: skipped
  std::uint64_t non_finite_values = 0;  ///< NaN or infinite values in DATA and RREF: passed on, to be judged
  std::uint64_t unknown_indices = 0;    ///< RREF values nobody asked for
  std::uint64_t data_datagrams = 0;
  std::uint64_t rref_datagrams = 0;
  std::uint64_t rpos_datagrams = 0;
  std::uint64_t xpc_datagrams = 0;
  std::uint64_t beacons = 0;
  std::uint64_t requests = 0;           ///< subscription requests sent
  std::uint64_t resubscriptions = 0;    ///< groups asked for anew because the link came up or X-Plane was silent
  std::uint64_t repeated_requests = 0;  ///< datarefs asked for again because they did not answer
  int receive_buffer = 0;               ///< [bytes] smallest receive buffer the kernel granted
};

/// What concerns the whole link, not one subscription. Called from the link's thread; must return quickly. Views are
/// valid during the call only.
struct SimLinkCallbacks {
  std::function<void(const DataView&, const ReceiveInfo&)> on_data;
  std::function<void(const Rpos&, const ReceiveInfo&)> on_rpos;
  std::function<void(const XpcPosition&, const ReceiveInfo&)> on_xpc;
  std::function<void(const LinkStatus&)> on_state;  ///< state, epoch, peer, version or problems changed
};

/// The link to one X-Plane: finds it, keeps subscriptions alive whatever happens to it, says in which state it is,
/// reads and writes datarefs.
///
/// One thread (start()) or the caller (step()) does all receiving and calls all handlers and callbacks. Every other
/// public function may be called from any thread; those that wait say so and must not be called from a callback.
/// Subscriptions may outlive the link; then they do nothing.
class SimLink : public SimulatorPort {
 public:
  /// `journals` may be empty when neither Data Output is configured nor leftovers are to be restored.
  /// Throws std::invalid_argument (an option out of range) and SocketError (a port is taken).
  SimLink(SimLinkOptions options, SimLinkCallbacks callbacks, Clock clock, LogFunction log,
          JournalFactory journals = {});
  /// stop(), if it has not been called.
  ~SimLink() override;
  SimLink(const SimLink&) = delete;
  SimLink& operator=(const SimLink&) = delete;

  /// Runs the link in a thread of its own.
  void start();
  /// Undoes what was changed in X-Plane (read back, at most `timeout_s`), stops subscriptions, joins the thread.
  /// Waits. Returns whether everything was undone; what was not stays in the journal.
  bool stop(double timeout_s = 1.5);
  /// Instead of start(): waits up to `timeout_ms` for datagrams, handles them and everything that is due.
  void step(int timeout_ms);

  Subscription subscribe(RrefGroup group, RrefHandler handler, std::shared_ptr<HandlerMutex> mutex) override;
  using SimulatorPort::subscribe;
  /// RPOS stream at `rate_hz`; 0 stops it.
  void setRposRate(std::int32_t rate_hz);
  /// Rows wanted from Data Output (transport DATA).
  void setDataRows(std::vector<std::int32_t> rows);

  LinkStatus status() const override;
  LinkCounters counters() const;
  /// Datarefs that were asked for repeatedly and never answered while others were: unknown to this X-Plane.
  std::vector<std::string> unansweredDatarefs() const;
  std::shared_ptr<Journal> journal() const override;
  const Clock& clock() const override;
  /// Port on which DATA is received; 0 without DATA transport.
  std::uint16_t dataPort() const;
  /// Port on which beacons are received; 0 when not listening.
  std::uint16_t beaconPort() const;

  SendStatus send(ByteView message) override;
  void read(std::vector<std::string> paths, double timeout_s, DatarefReader::Done done) override;
  using SimulatorPort::read;
  std::vector<DatarefValue> readUntil(std::vector<std::string> paths, double timeout_s,
                                      DatarefReader::Accept accept) override;
  bool waitUntil(const std::function<bool()>& condition, double timeout_s) override;

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace xplane_bridge::core
