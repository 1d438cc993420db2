#pragma once

#include <sys/epoll.h>

#include <atomic>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/core/link/sim_link.hpp"

namespace xplane_bridge::core {

/// Datarefs of the link's own subscription; the index is the position.
constexpr const char* kStatusDatarefs[] = {"sim/version/xplane_internal_version", "sim/time/paused",
                                           "sim/time/total_running_time_sec"};
constexpr std::int32_t kVersionIndex = 0;
constexpr std::int32_t kPausedIndex = 1;
constexpr std::int32_t kSimTimeIndex = 2;
constexpr std::int32_t kFirstReadIndex = 1000;  ///< of one-shot reads, on the same socket

/// The loop of SimLink. Its parts: sim_link_impl.cpp (life cycle, calls of any thread), sim_link_receive.cpp (what
/// arrives), sim_link_upkeep.cpp (what is due), sim_link_status.cpp (what is said). Functions under "any thread" lock;
/// everything else belongs to the thread that calls step().
class SimLink::Impl {
 public:
  Impl(SimLinkOptions options, SimLinkCallbacks callbacks, Clock clock, LogFunction log, JournalFactory journals);
  ~Impl();
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  // Any thread.
  void start();
  bool stop(double timeout_s);
  void step(int timeout_ms);
  /// Subscribes `group` in the place of what `delivery` had before; nullopt: ends that.
  void changeGroup(const std::shared_ptr<RrefDelivery>& delivery, std::uint32_t list, std::optional<RrefGroup> group);
  void setRposRate(std::int32_t rate_hz);
  void setDataRows(std::vector<std::int32_t> rows);
  LinkStatus status() const;
  LinkCounters counters() const;
  std::vector<std::string> unansweredDatarefs() const;
  std::shared_ptr<Journal> journal() const;
  const Clock& clock() const { return clock_; }
  std::uint16_t dataPort() const { return data_socket_ ? data_socket_->localPort() : std::uint16_t{0}; }
  std::uint16_t beaconPort() const { return beacon_socket_ ? beacon_socket_->localPort() : std::uint16_t{0}; }
  SendStatus send(ByteView message);
  void read(std::vector<std::string> paths, double timeout_s, DatarefReader::Accept accept, DatarefReader::Done done);
  std::vector<DatarefValue> readAndWait(std::vector<std::string> paths, double timeout_s,
                                        const DatarefReader::Accept& accept);
  bool waitUntil(const std::function<bool()>& condition, double timeout_s);

 private:
  using SocketPtr = std::shared_ptr<UdpSocket>;

  struct Group {
    std::shared_ptr<RrefDelivery> delivery;
    std::uint32_t list = 0;  // of the delivery
    RrefSubscription subscription;
    SocketPtr socket;
  };
  /// An RREF request waiting for its turn. Holds the socket of a group that may be gone by then.
  struct Request {
    SocketPtr socket;
    std::string path;
    std::int32_t rate_hz = 0;
    std::int32_t index = 0;
  };

  // Receiving.
  void waitForInput(int timeout_ms);
  bool hasInput(int fd) const;  // as the last waitForInput() found it
  void watch(int fd);
  void unwatch(int fd);
  void runCommands();
  void post(std::function<void()> command);
  void wake();
  template <typename Handler>
  void drain(UdpSocket* socket, const Handler& handle);
  bool isFromPeer(const Received& received);
  void heardPeer();
  ReceiveInfo infoOf(const Received& received);
  void countDecodeError(DecodeError error);
  void receiveControl();
  void receiveGroup(Group* group);
  void receiveData();
  void receiveRpos();
  void receiveXpc();
  void receiveBeacons();
  void takeStatus(const RrefPair& pair);

  // What is due.
  void housekeeping(std::int64_t now_ns);
  void listenForBeacon();
  void findPeer(std::int64_t now_ns);
  void resolve(std::int64_t now_ns);
  void setPeer(const Endpoint& peer, const std::string& why);
  void refreshLink(std::int64_t now_ns);
  void restartSubscriptions(std::int64_t now_ns);
  void updateDataOutput(std::int64_t now_ns);
  void updateRpos(std::int64_t now_ns);
  void askXpc(std::int64_t now_ns);
  void flushRequests(std::int64_t now_ns);
  void sendRequest(UdpSocket* socket, const std::string& path, std::int32_t rate_hz, std::int32_t index);
  void removeGroup(const RrefDelivery* delivery);
  void stopGroup(const Group& group);
  void stopSubscriptions();
  void updateStop(std::int64_t now_ns);

  // Publishing.
  std::vector<std::string> findProblems(std::int64_t now_ns) const;
  std::string reasonOf(LinkState state) const;
  void publish(std::int64_t now_ns);

  void requireWaiting() const;
  void wakeWaiting();
  bool onLinkThread() const { return std::this_thread::get_id() == link_thread_id_.load(); }

  const SimLinkOptions options_;
  const SimLinkCallbacks callbacks_;
  const Clock clock_;
  const LogFunction log_;
  const JournalFactory journals_;

  // Shared with any thread.
  std::atomic<std::uint64_t> packed_peer_{0};
  std::atomic<std::int64_t> last_heard_ns_{-1};
  std::atomic<std::thread::id> link_thread_id_{};
  std::atomic<bool> running_{false};
  std::atomic<bool> quit_{false};
  mutable std::mutex mutex_;  // guards the following
  std::vector<std::function<void()>> commands_;
  LinkStatus status_;
  LinkCounters counters_;
  std::vector<std::string> unanswered_;
  std::shared_ptr<Journal> journal_;

  // Of waitUntil().
  std::atomic<int> waiting_{0};
  std::mutex waiting_mutex_;
  ClockCondition stepped_;
  std::uint64_t steps_ = 0;

  int wake_fd_ = -1;
  std::thread thread_;
  std::vector<std::uint8_t> buffer_;
  int epoll_fd_ = -1;
  std::vector<epoll_event> ready_;  // as the last waitForInput() found them
  SocketPtr control_socket_;
  SocketPtr beacon_socket_;
  SocketPtr data_socket_;
  SocketPtr rpos_socket_;
  SocketPtr xpc_socket_;
  std::string beacon_failure_;

  Endpoint peer_;
  std::string peer_name_;
  std::string resolve_failure_;
  std::int64_t next_resolve_ns_ = 0;
  std::int64_t started_ns_ = 0;
  std::int64_t next_join_ns_ = 0;
  std::int64_t next_housekeeping_ns_ = 0;
  std::int64_t next_probe_ns_ = 0;
  std::int64_t now_ns_ = 0;

  LinkMonitor monitor_;
  BeaconTracker beacons_;
  Jitter jitter_;
  RequestPacer pacer_;
  RrefSubscription status_subscription_;
  DatarefReader reader_;
  DataOutput data_output_;
  std::vector<Group> groups_;  // by falling priority
  std::deque<Request> requests_;
  bool was_alive_ = false;
  std::uint32_t seen_epoch_ = 0;

  std::int32_t rpos_rate_hz_ = 0;
  std::int64_t next_rpos_request_ns_ = 0;
  std::int64_t next_xpc_request_ns_ = 0;

  SimulatorVersion version_;
  std::optional<bool> paused_;
  std::optional<float> sim_time_s_;
  LinkCounters live_counters_;  // of this thread; published in housekeeping
  UdpCounters retired_udp_;     // of sockets that are gone

  enum class StopPhase : std::uint8_t { kRunning, kReleasing, kUnsubscribing, kDone };
  StopPhase stop_phase_ = StopPhase::kRunning;
  std::int64_t stop_deadline_ns_ = 0;
  bool released_ = true;
};

}  // namespace xplane_bridge::core
