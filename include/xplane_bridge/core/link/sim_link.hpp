#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/base/log.hpp"
#include "xplane_bridge/core/link/data_output.hpp"
#include "xplane_bridge/core/link/journal.hpp"
#include "xplane_bridge/core/link/leftover_subscriptions.hpp"
#include "xplane_bridge/core/link/link_monitor.hpp"
#include "xplane_bridge/core/link/sim_link_options.hpp"
#include "xplane_bridge/core/link/simulator_port.hpp"
#include "xplane_bridge/core/wire/beacon_tracker.hpp"
#include "xplane_bridge/core/wire/datagram_source.hpp"
#include "xplane_bridge/core/wire/dataref_reader.hpp"
#include "xplane_bridge/core/wire/packets.hpp"
#include "xplane_bridge/core/wire/rref_subscription.hpp"

namespace xplane_bridge::core {

struct LinkCounters {
  UdpCounters udp;              ///< sum over all sockets
  std::uint64_t strangers = 0;  ///< datagrams from another computer than X-Plane's, or another program there: dropped
  std::array<std::uint64_t, kDecodeErrorCount> decode_errors{};  ///< by DecodeError
  std::uint64_t unknown_rows = 0;                                ///< DATA rows with an index outside 0..199: skipped
  std::uint64_t non_finite_values = 0;  ///< NaN or infinite values in DATA and RREF: passed on, to be judged
  std::uint64_t unknown_indices = 0;    ///< RREF values that were not requested
  std::uint64_t data_datagrams = 0;
  std::uint64_t rref_datagrams = 0;
  std::uint64_t rpos_datagrams = 0;
  std::uint64_t xpc_datagrams = 0;
  std::uint64_t beacons = 0;
  std::uint64_t requests = 0;           ///< subscription requests sent
  std::uint64_t resubscriptions = 0;    ///< groups asked for anew because the link came up or X-Plane was silent
  std::uint64_t repeated_requests = 0;  ///< datarefs asked for again because they did not answer
  std::uint64_t refused_calls = 0;      ///< calls of other threads dropped because the link did not take them up
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
/// One thread (start()), or one of the caller's at a time (receive(), step()), does all receiving and calls all
/// handlers and callbacks. Every other public function may be called from any thread; those that wait say so and must
/// not be called from a callback. Subscriptions may outlive the link; then they do nothing. Members that are not said
/// to be shared belong to the thread that receives.
class SimLink : public SimulatorPort {
 public:
  /// `journals` may be empty when neither Data Output is configured nor leftovers are to be restored.
  /// Throws std::invalid_argument (an option out of range) and SocketError (a port is taken).
  /// `hub`: where datagrams come from and go to; null: the computer's UDP sockets.
  SimLink(SimLinkOptions options, SimLinkCallbacks callbacks, Clock clock, LogFunction log,
          JournalFactory journals = {}, std::unique_ptr<DatagramHub> hub = nullptr);
  /// stop(), if it has not been called.
  ~SimLink() override;
  SimLink(const SimLink&) = delete;
  SimLink& operator=(const SimLink&) = delete;

  /// Runs the link in a thread of its own.
  void start();
  /// Instead: the caller's threads call, one at a time, receive() when fd() is readable, and stepThrough() patienceMs()
  /// after the last one at the latest; in lock-step that also when fd() is readable. They have ended before stop().
  void startDriven();
  /// Handles the datagrams that have come, and no more. @return whether step() is due at once
  bool receive();
  /// -1: it has to be start().
  int fd() const { return hub_->fd(); }
  int patienceMs() const;
  /// step(0), again and again while that leads to more that is to be done at once.
  void stepThrough();
  /// Undoes what was changed in X-Plane (read back, at most `timeout_s`), stops subscriptions (at the pace at which
  /// X-Plane reads requests, at most kUnsubscribeTime), joins the thread.
  /// Waits. Returns whether everything was undone; what was not, and subscriptions that are left, stay in the journal.
  bool stop(double timeout_s = 1.5);
  static constexpr double kUnsubscribeTime = 2.5;  ///< [s] for 950 datarefs at 20 frames a second
  /// Instead of start(): waits up to `timeout_ms` for datagrams, handles them and everything that is due.
  void step(int timeout_ms);

  Subscription subscribe(RrefGroup group, RrefHandler handler, std::shared_ptr<HandlerMutex> mutex) override;
  using SimulatorPort::subscribe;
  /// RPOS stream at `rate_hz`; 0 stops it.
  void setRposRate(std::int32_t rate_hz);
  /// Rows wanted from Data Output (transport DATA).
  void setDataRows(std::vector<std::int32_t> rows);

  bool inLockstep() const override { return options_.lockstep; }
  LinkStatus status() const override;
  LinkCounters counters() const;
  /// Datarefs that were asked for repeatedly and never answered while others were: unknown to this X-Plane.
  std::vector<std::string> unansweredDatarefs() const;
  std::shared_ptr<Journal> journal() const override;
  /// X-Plane has answered for all datarefs that are asked for, or has been asked in vain, and nothing is under way. Of
  /// the link's thread.
  bool settled() const;
  const Clock& clock() const override { return clock_; }
  /// Port on which DATA is received; 0 without DATA transport.
  std::uint16_t dataPort() const { return data_source_ ? data_source_->localPort() : std::uint16_t{0}; }
  /// Port on which beacons are received; 0 when not listening.
  std::uint16_t beaconPort() const { return beacon_source_ ? beacon_source_->localPort() : std::uint16_t{0}; }

  SendStatus send(ByteView message) override;
  void read(std::vector<std::string> paths, double timeout_s, DatarefReader::Done done) override;
  using SimulatorPort::read;
  std::vector<DatarefValue> readUntil(std::vector<std::string> paths, double timeout_s,
                                      DatarefReader::Accept accept) override;
  bool waitUntil(const std::function<bool()>& condition, double timeout_s) override;

 private:
  using SourcePtr = std::shared_ptr<DatagramSource>;

  struct Group {
    std::shared_ptr<RrefDelivery> delivery;
    std::uint32_t list = 0;  // of the delivery
    RrefSubscription subscription;
    SourcePtr source;
  };
  /// The end of a subscription, waiting for its turn. Holds the source of a group that may be gone by then.
  struct End {
    SourcePtr source;
    std::string path;  // empty: the position stream
    std::int32_t index = 0;
  };

  /// What X-Plane sends from one socket of its own, as far as is known.
  enum class Stream : std::uint8_t { kAnswers, kData, kPosition, kPlugin };
  static constexpr std::size_t kStreamCount = 4;
  struct Sighting {
    Endpoint from;
    std::int64_t time_ns = 0;
  };

  /// For handles: null once the link is gone.
  struct Self {
    std::mutex mutex;
    SimLink* link = nullptr;
  };

  static constexpr std::int32_t kVersionIndex = 0;  // of the status subscription: sim_link.cpp
  static constexpr std::int32_t kPausedIndex = 1;
  static constexpr std::int32_t kSimTimeIndex = 2;
  static constexpr std::int32_t kFramePeriodIndex = 3;
  static constexpr std::int32_t kFirstReadIndex = 1000;  // of one-shot reads, on the same source

  // Calls of any thread, carried out on the link's (sim_link.cpp).
  void post(std::function<void()> call);
  bool runCalls();
  bool receive(int timeout_ms);
  void changeGroup(const std::shared_ptr<RrefDelivery>& delivery, std::uint32_t list, std::optional<RrefGroup> group);
  void startRead(std::vector<std::string> paths, double timeout_s, DatarefReader::Accept accept,
                 DatarefReader::Done done);
  void requireWaiting() const;
  void wakeWaiting();
  bool onLinkThread() const { return std::this_thread::get_id() == link_thread_id_.load(); }
  SourcePtr open(const std::string& name, std::uint16_t port = 0);
  void listenForBeacon();

  // What arrives (sim_link_receive.cpp).
  template <typename Handler>
  void drain(DatagramSource* source, const Handler& handle);
  bool isFromPeer(ByteView bytes, const Received& received, Stream stream);
  void heardPeer(const Received& received, Stream stream);
  ReceiveInfo infoOf(const Received& received);
  void countDecodeError(DecodeError error);
  void receiveControl();
  void receiveGroup(Group* group);
  void receiveData();
  void receiveRpos();
  void receiveXpc();
  void receiveLeftovers();
  void receiveBeacons();
  void takeStatus(const RrefPair& pair);

  // What is due (sim_link_maintenance.cpp).
  void maintain(std::int64_t now_ns);
  void findPeer(std::int64_t now_ns);
  void resolve(std::int64_t now_ns);
  void setPeer(const Endpoint& peer, const std::string& why);
  void openJournals();
  void moveEntries();
  bool copyEntries(const Journal* from, const Journal* to, bool remove);
  void refreshLink(std::int64_t now_ns);
  void restartSubscriptions(std::int64_t now_ns);
  void updateDataOutput(std::int64_t now_ns);
  void updateRpos(std::int64_t now_ns);
  void stopRpos();
  void askXpc(std::int64_t now_ns);
  void flushRequests(std::int64_t now_ns);
  void sendRequest(DatagramSource* source, const std::string& path, std::int32_t rate_hz, std::int32_t index);
  void sendRposRequest(DatagramSource* source, std::int32_t rate_hz);
  void sendEnd(DatagramSource* source, const std::string& path, std::int32_t index);
  void endSubscription(const SourcePtr& source, const std::vector<std::string>& paths);
  bool requestsWait() const { return !ends_.empty() || !ends_again_.empty() || !reader_.idle(); }
  void removeGroup(const RrefDelivery* delivery);
  void stopGroup(const Group& group);
  void stopSubscriptions();
  void recordSubscriptions();
  void forgetSubscriptions();
  void updateStop(std::int64_t now_ns);

  // What is said (sim_link_status.cpp).
  std::vector<std::string> findProblems(std::int64_t now_ns) const;
  void findSearchProblems(std::int64_t now_ns, std::vector<std::string>* problems) const;
  bool isOneWay(std::int64_t now_ns) const;
  void updateVersion(std::int64_t now_ns);
  std::string reasonOf(LinkState state) const;
  void publish(std::int64_t now_ns);

  const SimLinkOptions options_;
  const SimLinkCallbacks callbacks_;
  const Clock clock_;
  const LogFunction log_;
  const JournalFactory journals_;
  const std::unique_ptr<DatagramHub> hub_;
  const std::shared_ptr<Self> self_ = std::make_shared<Self>();

  // Shared with any thread.
  std::atomic<std::uint64_t> packed_peer_{0};
  std::atomic<std::int64_t> last_heard_ns_{-1};
  std::atomic<std::thread::id> link_thread_id_{};
  std::atomic<bool> running_{false};
  std::atomic<bool> quit_{false};
  mutable std::mutex mutex_;  // guards the following
  std::vector<std::function<void()>> calls_;
  std::uint64_t refused_calls_ = 0;
  LinkStatus status_;
  LinkCounters counters_;
  std::vector<std::string> unanswered_;
  std::shared_ptr<Journal> journal_;

  // Of waitUntil().
  std::mutex waiting_mutex_;  // guards the following
  int waiting_ = 0;
  ClockCondition stepped_;
  std::uint64_t steps_ = 0;

  std::thread thread_;
  std::vector<std::uint8_t> buffer_;
  SourcePtr control_source_;
  SourcePtr beacon_source_;
  SourcePtr data_source_;
  SourcePtr rpos_source_;
  SourcePtr xpc_source_;
  std::string beacon_failure_;

  Endpoint peer_;
  std::string peer_name_;
  std::string resolve_failure_;
  std::int64_t next_resolve_ns_ = 0;
  std::int64_t started_ns_ = 0;
  std::int64_t next_join_ns_ = 0;
  std::int64_t next_maintenance_ns_ = 0;
  std::int64_t maintained_ns_ = -1;
  std::int64_t next_probe_ns_ = 0;
  std::int64_t now_ns_ = 0;

  /// Port of X-Plane's that a stream has come from since the link came up; 0: not yet.
  std::array<std::uint16_t, kStreamCount> ports_{};
  std::optional<Sighting> intruder_;         // another program of X-Plane's computer, see isFromPeer()
  std::optional<Sighting> other_address_;    // X-Plane's messages from another computer, or another address of its
  std::optional<std::int64_t> answered_ns_;  // RREF, the last one
  std::int64_t came_up_ns_ = 0;
  std::uint64_t refused_ = 0;               // control_source_'s counter of "port unreachable", as of refused_ns_
  std::optional<std::int64_t> refused_ns_;  // the last one of this peer

  LinkMonitor monitor_;
  BeaconTracker beacons_;
  Jitter jitter_;
  RequestPacer pacer_;
  RrefSubscription status_subscription_;
  DatarefReader reader_;
  DataOutput data_output_;
  LeftoverSubscriptions leftovers_;
  std::shared_ptr<Journal> subscriptions_journal_;  // null: they are not written down
  // Of the peer before, until this one has answered and all entries have been moved.
  std::shared_ptr<Journal> left_journal_, left_subscriptions_journal_;
  std::string move_failure_;
  std::int64_t next_move_ns_ = 0;
  bool subscriptions_changed_ = false;  // since recordSubscriptions()
  std::vector<Group> groups_;           // by falling priority
  std::deque<End> ends_;
  std::deque<End> ends_again_;  // as ends_, after all else, while the node runs: one may be lost, and none is confirmed
  std::deque<End> ended_in_silence_;  // for when X-Plane answers again
  bool was_alive_ = false;
  std::uint32_t seen_epoch_ = 0;

  std::int32_t rpos_rate_hz_ = 0;
  bool rpos_asked_ = false;
  std::int64_t next_rpos_request_ns_ = 0;
  std::int64_t next_xpc_request_ns_ = 0;

  std::int32_t answered_version_ = 0;  // X-Plane's own answer; 0: none yet
  std::uint32_t answered_epoch_ = 0;   // monitor_'s at that answer
  SimulatorVersion version_;           // the last known, and what options_.otherwise says of it
  std::optional<bool> paused_;
  std::optional<float> sim_time_s_;
  LinkCounters live_counters_;  // of this thread; published by maintain()
  UdpCounters retired_udp_;     // of sources that are gone

  enum class StopPhase : std::uint8_t { kRunning, kReleasing, kUnsubscribing, kDone };
  StopPhase stop_phase_ = StopPhase::kRunning;
  std::int64_t stop_deadline_ns_ = 0;
  bool released_ = true;
};

}  // namespace xplane_bridge::core
