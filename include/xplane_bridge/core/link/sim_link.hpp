#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/base/log.hpp"
#include "xplane_bridge/core/base/simulator_version.hpp"
#include "xplane_bridge/core/link/data_output.hpp"
#include "xplane_bridge/core/link/journal.hpp"
#include "xplane_bridge/core/link/link_monitor.hpp"
#include "xplane_bridge/core/wire/beacon_tracker.hpp"
#include "xplane_bridge/core/wire/dataref_reader.hpp"
#include "xplane_bridge/core/wire/packets.hpp"
#include "xplane_bridge/core/wire/rref_subscription.hpp"
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

using GroupId = std::int32_t;

/// What is known of a datagram besides its bytes.
struct ReceiveInfo {
  std::int64_t stamp_ns = 0;     ///< [ns] CLOCK_REALTIME when the kernel received it; else when it was read
  bool kernel_stamp = false;     ///< stamp_ns is the kernel's
  std::int64_t steady_ns = 0;    ///< [ns] the injected steady clock when it was read
  std::uint32_t link_epoch = 0;  ///< LinkStatus::epoch at that moment
  Endpoint from;
  std::array<std::uint8_t, kHeaderSize> label{};  ///< the datagram's first bytes; DATA only
};

struct LinkStatus {
  LinkState state = LinkState::kSearching;
  std::string reason;                ///< one sentence
  std::uint32_t epoch = 0;           ///< raised each time the link came up anew; 0 before the first time
  std::int64_t since_steady_ns = 0;  ///< [ns] when `state` began
  Endpoint peer;                     ///< X-Plane; not valid() while unknown
  std::string computer_name;         ///< from the beacon; empty without
  SimulatorVersion version;          ///< unknown until X-Plane has answered
  std::optional<bool> paused;
  std::optional<float> sim_time_s;      ///< sim/time/total_running_time_sec as received
  double silence_s = 0.0;               ///< [s] since the last valid datagram; NaN before the first
  std::vector<BeaconSighting> beacons;  ///< all that are heard at the moment
  std::vector<std::string> problems;    ///< what a user should know and do something about, one sentence each
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

/// Called from the link's thread; must return quickly. Views are valid during the call only.
struct SimLinkCallbacks {
  std::function<void(GroupId, const RrefView&, const ReceiveInfo&)> on_rref;
  std::function<void(const DataView&, const ReceiveInfo&)> on_data;
  std::function<void(const Rpos&, const ReceiveInfo&)> on_rpos;
  std::function<void(const XpcPosition&, const ReceiveInfo&)> on_xpc;
  std::function<void(const LinkStatus&)> on_state;  ///< state, epoch, peer, version or problems changed
};

enum class SendStatus : std::uint8_t {
  kSent = 0,
  kNoPeer,       ///< X-Plane has not been found
  kNotEncoded,   ///< empty, over-long or NUL-bearing path, non-finite value, bad row
  kSocketError,  ///< the kernel refused it
};
const char* toString(SendStatus status);

/// The link to one X-Plane: finds it, keeps subscriptions alive whatever happens to it, says in which state it is,
/// reads and writes datarefs.
///
/// One thread (start()) or the caller (step()) does all receiving and calls all callbacks. Every other public function
/// may be called from any thread; those that wait say so and must not be called from a callback.
class SimLink {
 public:
  /// `journals` may be empty when neither Data Output is configured nor leftovers are to be restored.
  /// Throws std::invalid_argument (an option out of range) and SocketError (a port is taken).
  SimLink(SimLinkOptions options, SimLinkCallbacks callbacks, Clock clock, LogFunction log,
          JournalFactory journals = {});
  /// stop(), if it has not been called.
  ~SimLink();
  SimLink(const SimLink&) = delete;
  SimLink& operator=(const SimLink&) = delete;

  /// Runs the link in a thread of its own.
  void start();
  /// Undoes what was changed in X-Plane (read back, at most `timeout_s`), stops subscriptions, joins the thread.
  /// Waits. Returns whether everything was undone; what was not stays in the journal.
  bool stop(double timeout_s = 1.5);
  /// Instead of start(): waits up to `timeout_ms` for datagrams, handles them and everything that is due.
  void step(int timeout_ms);

  /// Subscribes a group, from now on and after every loss. Throws std::invalid_argument for an empty or over-long path,
  /// a rate outside 1..kEveryFrameRateHz, or an empty group; SocketError when no socket can be had.
  GroupId addGroup(RrefGroup group);
  /// Replaces a group's datarefs and rate; datagrams of the old list are no longer delivered.
  void replaceGroup(GroupId id, RrefGroup group);
  void removeGroup(GroupId id);
  /// RPOS stream at `rate_hz`; 0 stops it.
  void setRposRate(std::int32_t rate_hz);
  /// Rows wanted from Data Output (transport DATA).
  void setDataRows(std::vector<std::int32_t> rows);

  LinkStatus status() const;
  LinkCounters counters() const;
  /// Datarefs that were asked for repeatedly and never answered while others were: unknown to this X-Plane.
  std::vector<std::string> unansweredDatarefs() const;
  /// The journal of the X-Plane found; null before, or without a factory.
  std::shared_ptr<Journal> journal() const;
  /// Port on which DATA is received; 0 without DATA transport.
  std::uint16_t dataPort() const;
  /// Port on which beacons are received; 0 when not listening.
  std::uint16_t beaconPort() const;

  /// All senders send at once, on the socket that reads datarefs too, so that X-Plane sees writes and reads in order.
  SendStatus sendDref(std::string_view path, float value);
  SendStatus sendCommand(std::string_view path);
  SendStatus sendData(const DataRow* rows, std::size_t count);
  SendStatus sendUndo(const UndoOperation& operation);
  /// Any message made with encode...().
  SendStatus send(ByteView message);

  /// Reads datarefs once: subscribes, takes the first value that arrives afterwards, unsubscribes. Calls `done` from
  /// the link's thread, with one value per path, at the latest after `timeout_s`.
  void readDatarefs(std::vector<std::string> paths, double timeout_s,
                    std::function<void(const std::vector<DatarefValue>&)> done);
  /// The same, waiting. Not from a callback.
  std::vector<DatarefValue> readDatarefs(std::vector<std::string> paths, double timeout_s);
  /// The same, waiting until `fits` likes the values; X-Plane sends them every frame. Not from a callback.
  std::vector<DatarefValue> readDatarefsUntil(std::vector<std::string> paths, double timeout_s,
                                              const DatarefReader::Accept& fits);
  /// Waits until a dataref reads `expected` within `tolerance`; returns the last value seen (empty: none) and whether
  /// it fits. Not from a callback.
  std::pair<bool, DatarefValue> waitForDataref(const std::string& path, float expected, float tolerance,
                                               double timeout_s);
  /// Carries out the operations and reads datarefs among them back. Waits. Returns whether all read back as written.
  bool undo(const std::vector<UndoOperation>& operations, double timeout_s);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace xplane_bridge::core
