#include "xplane_bridge/core/link/sim_link.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>

#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/core/wire/udp_hub.hpp"
#include "xplane_bridge/core/wire/udp_socket.hpp"

namespace xplane_bridge::core {
namespace {

constexpr std::int64_t kMaintenanceNs = 20 * kNanosecondsPerMillisecond;
constexpr int kThreadStepMs = 20;
constexpr int kRequestStepMs = 5;           // while requests wait for their turn
constexpr double kDestructorTimeout = 1.0;  // [s]
constexpr std::size_t kMaxCalls = 1024;     // waiting: hundreds come at once when a node subscribes

Endpoint unpack(std::uint64_t packed) {
  return {static_cast<std::uint32_t>(packed >> 16), static_cast<std::uint16_t>(packed & 0xFFFFU)};
}

// In the order of kVersionIndex, kPausedIndex, kSimTimeIndex, kFramePeriodIndex.
RrefGroup statusGroup(std::int32_t rate_hz) {
  return {"link status",
          {"sim/version/xplane_internal_version", "sim/time/paused", "sim/time/total_running_time_sec",
           "sim/operation/misc/frame_rate_period"},
          rate_hz,
          kUrgentPriority};
}

}  // namespace

SimLink::SimLink(SimLinkOptions options, SimLinkCallbacks callbacks, Clock clock, LogFunction log,
                 JournalFactory journals, std::unique_ptr<DatagramHub> hub)
    : options_(checked(std::move(options), journals != nullptr)),
      callbacks_(std::move(callbacks)),
      clock_(std::move(clock)),
      log_(log ? std::move(log) : [](LogLevel, const std::string&) {}),
      journals_(std::move(journals)),
      hub_(hub ? std::move(hub) : std::make_unique<UdpHub>()),
      buffer_(1U << 16),
      control_source_(open("control")),
      monitor_({options_.stale_after_s, options_.lost_after_s, options_.beacon_timeout_s}),
      beacons_(options_.beacon_timeout_s, options_.beacon_settle_s, isOwnAddress),
      jitter_(options_.jitter_seed),
      pacer_(options_.batch_size, options_.batch_spacing_s),
      status_subscription_(statusGroup(options_.status_rate_hz)),
      reader_(kFirstReadIndex),
      data_output_(options_.data_output, options_.request_timeout_s,
                   {[this](ByteView message) { send(message); },
                    [this](std::vector<std::string> paths, double timeout_s, DatarefReader::Accept accept,
                           DatarefReader::Done done) {
                      reader_.start(std::move(paths), now_ns_ + toNanoseconds(timeout_s), std::move(done),
                                    std::move(accept));
                    },
                    log_}),
      leftovers_([this](std::uint16_t port) { return open("leftover", port); }, log_),
      rpos_rate_hz_(options_.rpos_rate_hz) {
  if (!clock_.steady_ns || !clock_.system_ns) {
    throw std::invalid_argument("SimLink needs both clocks");
  }
  if (options_.data_output.enabled) {
    data_source_ = open("data", options_.data_output.port);
  }
  if (rpos_rate_hz_ > 0) {
    rpos_source_ = open("rpos");
  }
  if (options_.xpc_port != 0) {
    xpc_source_ = open("xpc");
  }
  listenForBeacon();
  started_ns_ = clock_.steady_ns();
  now_ns_ = started_ns_;
  self_->link = this;
}

SimLink::~SimLink() {
  try {
    stop(kDestructorTimeout);
  } catch (const std::exception& error) {  // of the journal's disk, or of who handles what the link reports
    log_(LogLevel::kError, std::string("the link did not end in order: ") + error.what());
  }
  const std::lock_guard<std::mutex> lock(self_->mutex);
  self_->link = nullptr;
}

SimLink::SourcePtr SimLink::open(const std::string& name, std::uint16_t port) {
  UdpSocketOptions options;
  options.bind_port = port;
  return hub_->open(name, options);
}

void SimLink::listenForBeacon() {
  if (!options_.listen_for_beacon) {
    return;
  }
  try {
    UdpSocketOptions options;
    options.bind_port = options_.beacon_port;
    options.share_port = true;
    beacon_source_ = hub_->open("beacon", options);
    if (options_.host.empty()) {
      log_(LogLevel::kInfo, "looking for X-Plane by its beacon on " + options_.beacon_group + ":" +
                                std::to_string(options_.beacon_port));
    }
  } catch (const SocketError& error) {
    beacon_failure_ = std::string("X-Plane's beacon cannot be heard: ") + error.what();
    log_(options_.host.empty() ? LogLevel::kError : LogLevel::kWarn, beacon_failure_);
  }
}

// --- life cycle ---

void SimLink::startDriven() {
  if (running_.exchange(true)) {
    throw std::logic_error("SimLink::start() was called twice");
  }
}

void SimLink::start() {
  startDriven();
  thread_ = std::thread([this] {
    while (!quit_) {
      step(kThreadStepMs);
    }
  });
}

bool SimLink::stop(double timeout_s) {
  if (!thread_.joinable() && stop_phase_ == StopPhase::kDone) {
    return released_;
  }
  const auto begin_stop = [this, timeout_s] {
    if (stop_phase_ != StopPhase::kRunning) {
      return;
    }
    stop_phase_ = StopPhase::kReleasing;
    stop_deadline_ns_ = now_ns_ + toNanoseconds(timeout_s);
    released_ = false;
    reader_.cancelAll();
    // A silent X-Plane cannot confirm: send once and rely on the journal.
    data_output_.release(monitor_.alive() ? timeout_s : 0.0, [this](bool undone) {
      released_ = undone;
      stop_phase_ = StopPhase::kUnsubscribing;
      stop_deadline_ns_ = now_ns_ + toNanoseconds(kUnsubscribeTime);
      stopSubscriptions();
    });
  };
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    calls_.emplace_back(begin_stop);  // however many wait
  }
  hub_->wake();
  if (thread_.joinable()) {
    thread_.join();
  } else {
    // Driven by the caller: the injected clock may stand still, so the number of steps is bounded, too.
    const int max_steps = static_cast<int>((timeout_s + kUnsubscribeTime) * 1000.0) + 100;
    for (int i = 0; i < max_steps && stop_phase_ != StopPhase::kDone; ++i) {
      step(1);
    }
    stop_phase_ = StopPhase::kDone;
  }
  running_ = false;
  wakeWaiting();
  return released_;
}

// --- calls of any thread ---

void SimLink::post(std::function<void()> call) {
  bool first_refused = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (calls_.size() < kMaxCalls) {
      calls_.push_back(std::move(call));
    } else {
      first_refused = refused_calls_++ == 0;
    }
  }
  if (first_refused && running_) {
    log_(LogLevel::kError, "the link's thread does not keep up: calls are dropped");
  }
  hub_->wake();
}

/// @return whether there were any
bool SimLink::runCalls() {
  std::vector<std::function<void()>> calls;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    calls.swap(calls_);
    live_counters_.refused_calls = refused_calls_;
  }
  for (const std::function<void()>& call : calls) {
    call();
  }
  return !calls.empty();
}

Subscription SimLink::subscribe(RrefGroup group, RrefHandler handler, std::shared_ptr<HandlerMutex> mutex) {
  auto delivery = std::make_shared<RrefDelivery>(std::move(handler), std::move(mutex));
  const auto change = [self = self_, delivery](std::uint32_t list, std::optional<RrefGroup> group_now) {
    const std::lock_guard<std::mutex> lock(self->mutex);
    if (self->link != nullptr) {
      self->link->changeGroup(delivery, list, std::move(group_now));
    }
  };
  return {delivery, change, std::move(group)};
}

void SimLink::changeGroup(const std::shared_ptr<RrefDelivery>& delivery, std::uint32_t list,
                          std::optional<RrefGroup> group) {
  if (!group) {
    post([this, delivery] { removeGroup(delivery.get()); });
    return;
  }
  RrefSubscription subscription(std::move(*group));  // checks it
  SourcePtr source = open(subscription.group().name);
  auto added = std::make_shared<Group>(Group{delivery, list, std::move(subscription), std::move(source)});
  post([this, added] {
    removeGroup(added->delivery.get());
    if (monitor_.alive()) {
      added->subscription.restart(now_ns_);
    }
    const int priority = added->subscription.group().priority;
    const auto place = std::find_if(groups_.begin(), groups_.end(), [priority](const Group& each) {
      return each.subscription.group().priority < priority;
    });
    groups_.insert(place, std::move(*added));
    subscriptions_changed_ = true;
  });
}

void SimLink::setRposRate(std::int32_t rate_hz) {
  requireRange("RPOS rate", rate_hz, 0, kEveryFrameRateHz);
  SourcePtr source = open("rpos");
  post([this, rate_hz, source] {
    if (rpos_source_ == nullptr) {
      rpos_source_ = source;
    }
    subscriptions_changed_ = subscriptions_changed_ || (rate_hz > 0) != (rpos_rate_hz_ > 0);
    rpos_rate_hz_ = rate_hz;
    next_rpos_request_ns_ = now_ns_;
    if (rate_hz == 0 && peer_.valid()) {
      stopRpos();
    }
  });
}

void SimLink::setDataRows(std::vector<std::int32_t> rows) {
  requireRows(rows);
  post([this, rows = std::move(rows)] { data_output_.setRows(rows); });
}

LinkStatus SimLink::status() const {
  LinkStatus status;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    status = status_;
  }
  const std::int64_t last = last_heard_ns_;
  status.silence_s = last < 0 ? std::numeric_limits<double>::quiet_NaN() : toSeconds(clock_.steady_ns() - last);
  return status;
}

LinkCounters SimLink::counters() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return counters_;
}

std::vector<std::string> SimLink::unansweredDatarefs() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return unanswered_;
}

bool SimLink::settled() const {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!calls_.empty()) {
      return false;
    }
  }
  const auto answered = [](const Group& group) { return group.subscription.settled(); };
  return monitor_.state() == LinkState::kConnected && !requestsWait() && status_subscription_.settled() &&
         std::all_of(groups_.begin(), groups_.end(), answered);
}

std::shared_ptr<Journal> SimLink::journal() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return journal_;
}

SendStatus SimLink::send(ByteView message) {
  const Endpoint peer = unpack(packed_peer_);
  if (!peer.valid()) {
    return SendStatus::kNoPeer;
  }
  return control_source_->sendTo(message, peer) ? SendStatus::kSent : SendStatus::kSocketError;
}

void SimLink::read(std::vector<std::string> paths, double timeout_s, DatarefReader::Done done) {
  startRead(std::move(paths), timeout_s, {}, std::move(done));
}

void SimLink::startRead(std::vector<std::string> paths, double timeout_s, DatarefReader::Accept accept,
                        DatarefReader::Done done) {
  std::array<std::uint8_t, kRrefRequestSize> buffer;
  for (const std::string& path : paths) {
    const EncodeResult encoded = encodeRref(buffer, path, 0, 0);
    if (!encoded.ok()) {
      throw std::invalid_argument("'" + path + "' is no dataref (" + toString(encoded.error()) + ")");
    }
  }
  requireRange("timeout", timeout_s, 0.0, 3600.0);
  post([this, paths = std::move(paths), timeout_s, accept = std::move(accept), done = std::move(done)] {
    reader_.start(paths, now_ns_ + toNanoseconds(timeout_s), done, accept);
  });
}

std::vector<DatarefValue> SimLink::readUntil(std::vector<std::string> paths, double timeout_s,
                                             DatarefReader::Accept accept) {
  requireWaiting();
  const std::size_t count = paths.size();
  struct Answer {
    std::mutex mutex;
    ClockCondition changed;
    std::optional<std::vector<DatarefValue>> values;
  };
  const auto answer = std::make_shared<Answer>();
  startRead(std::move(paths), timeout_s, std::move(accept), [answer](const std::vector<DatarefValue>& values) {
    const std::lock_guard<std::mutex> lock(answer->mutex);
    answer->values = values;
    answer->changed.notifyAll();
  });
  // The link ends the read in time; this deadline is for a link that is stopped before it sees the read.
  const Deadline patience(clock_, timeout_s + 1.0);
  std::unique_lock<std::mutex> lock(answer->mutex);
  answer->changed.waitUntil(&lock, patience, [&answer] { return answer->values.has_value(); });
  return answer->values.value_or(std::vector<DatarefValue>(count));
}

void SimLink::requireWaiting() const {
  if (onLinkThread() || !running_) {
    throw std::logic_error("waiting for X-Plane needs the link's thread to run, and another one to wait");
  }
}

bool SimLink::waitUntil(const std::function<bool()>& condition, double timeout_s) {
  requireWaiting();
  const Deadline deadline(clock_, timeout_s);
  std::unique_lock<std::mutex> lock(waiting_mutex_);
  for (;;) {
    const std::uint64_t seen = steps_;
    lock.unlock();
    if (condition()) {
      return true;
    }
    if (deadline.over() || !running_) {
      return false;
    }
    lock.lock();
    ++waiting_;
    stepped_.waitUntil(&lock, deadline, [&] { return steps_ != seen || !running_; });
    --waiting_;
  }
}

void SimLink::wakeWaiting() {
  bool any = false;
  {
    const std::lock_guard<std::mutex> lock(waiting_mutex_);
    ++steps_;
    any = waiting_ > 0;
  }
  if (any) {
    stepped_.notifyAll();
  }
}

void SimLink::stepThrough() {
  do {
    step(0);
  } while (hub_->busy());
}

int SimLink::patienceMs() const { return requestsWait() ? kRequestStepMs : kThreadStepMs; }

bool SimLink::receive() {
  const bool called = receive(0);
  wakeWaiting();
  return called || monitor_.alive() != was_alive_ || monitor_.epoch() != seen_epoch_;
}

bool SimLink::receive(int timeout_ms) {
  link_thread_id_ = std::this_thread::get_id();
  now_ns_ = clock_.steady_ns();
  bool called = runCalls();
  hub_->wait(std::min(timeout_ms, patienceMs()));
  now_ns_ = clock_.steady_ns();
  called = runCalls() || called;
  receiveControl();
  for (Group& group : groups_) {
    receiveGroup(&group);
  }
  receiveData();
  receiveRpos();
  receiveXpc();
  receiveLeftovers();
  askXpc(now_ns_);
  receiveBeacons();
  return called;
}

void SimLink::step(int timeout_ms) {
  receive(timeout_ms);
  refreshLink(now_ns_);
  if (!reader_.idle()) {
    reader_.update(now_ns_);
  }
  // In lock-step by frames, whatever the phase of the time before the flight.
  const bool due = options_.lockstep ? now_ns_ != maintained_ns_ : now_ns_ >= next_maintenance_ns_;
  if (due) {
    next_maintenance_ns_ = now_ns_ + kMaintenanceNs;
    maintained_ns_ = now_ns_;
    maintain(now_ns_);
  }
  flushRequests(now_ns_);
  if (stop_phase_ != StopPhase::kRunning) {
    updateStop(now_ns_);
  }
  wakeWaiting();
}

}  // namespace xplane_bridge::core
