#include "sim_link_impl.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <utility>

namespace xplane_bridge::core {
namespace {

constexpr std::int64_t kHousekeepingNs = 20 * kNanosecondsPerMillisecond;
constexpr int kThreadStepMs = 20;

Endpoint unpack(std::uint64_t packed) {
  return {static_cast<std::uint32_t>(packed >> 16), static_cast<std::uint16_t>(packed & 0xFFFFU)};
}

void require(bool condition, const std::string& message) {
  if (!condition) {
    throw std::invalid_argument(message);
  }
}

void requireRange(const char* name, double value, double low, double high) {
  require(std::isfinite(value) && value >= low && value <= high, std::string(name) + " is " + std::to_string(value) +
                                                                     ", expected " + std::to_string(low) + " to " +
                                                                     std::to_string(high));
}

void requireRows(const std::vector<std::int32_t>& rows) {
  for (const std::int32_t row : rows) {
    require(row >= 0 && row < kDataRowLimit,
            "Data Output row " + std::to_string(row) + ", expected 0 to " + std::to_string(kDataRowLimit - 1));
  }
}

SimLinkOptions checked(SimLinkOptions options, const Clock& clock, const JournalFactory& journals) {
  constexpr double kHour = 3600.0;
  require(clock.steady_ns && clock.system_ns, "SimLink needs both clocks");
  require(options.port != 0, "port is 0, expected the port X-Plane listens on (49000)");
  require(!options.host.empty() || options.listen_for_beacon,
          "no host is given and the beacon is not listened to: X-Plane cannot be found; set host");
  requireRange("stale_after_s", options.stale_after_s, 0.01, kHour);
  requireRange("lost_after_s", options.lost_after_s, options.stale_after_s, kHour);
  requireRange("beacon_timeout_s", options.beacon_timeout_s, 0.01, kHour);
  requireRange("beacon_settle_s", options.beacon_settle_s, 0.0, kHour);
  requireRange("probe_period_s", options.probe_period_s, 0.01, kHour);
  requireRange("batch_size", static_cast<double>(options.batch_size), 1.0, 1e6);
  requireRange("batch_spacing_s", options.batch_spacing_s, 0.0, kHour);
  requireRange("request_timeout_s", options.request_timeout_s, 0.01, kHour);
  requireRange("rpos_rate_hz", options.rpos_rate_hz, 0, kEveryFrameRateHz);
  require(options.xpc_rate_hz > 0.0 && options.xpc_rate_hz <= 1000.0, "xpc_rate_hz must be above 0 and at most 1000");
  const DataOutputOptions& data = options.data_output;
  require(data.port != kXPlaneSendPort, "data_port 49001 is X-Plane's own sending port; choose another, such as 49003");
  requireRows(data.rows);
  if (data.enabled) {
    require(data.port != 0 || data.configure, "data_port 0 (any) needs X-Plane to be configured by the bridge");
    require(!data.configure || journals,
            "Data Output cannot be configured without a journal in which its previous settings are kept");
    require(!data.configure || !data.rows.empty(), "no Data Output rows are asked for");
    requireRange("data output rate", data.rate_hz, 1, 99);
  }
  return options;
}

RrefGroup statusGroup(std::int32_t rate_hz) {
  return {"link status", {std::begin(kStatusDatarefs), std::end(kStatusDatarefs)}, rate_hz, 0};
}

std::shared_ptr<UdpSocket> openSocket(std::uint16_t port = 0) {
  UdpSocketOptions options;
  options.bind_port = port;
  return std::make_shared<UdpSocket>(options);
}

}  // namespace

SimLink::Impl::Impl(SimLinkOptions options, SimLinkCallbacks callbacks, Clock clock, LogFunction log,
                    JournalFactory journals)
    : options_(checked(std::move(options), clock, journals)),
      callbacks_(std::move(callbacks)),
      clock_(std::move(clock)),
      log_(log ? std::move(log) : [](LogLevel, const std::string&) {}),
      journals_(std::move(journals)),
      buffer_(1U << 16),
      control_socket_(openSocket()),
      monitor_({options_.stale_after_s, options_.lost_after_s, options_.beacon_timeout_s}),
      beacons_(options_.beacon_timeout_s, options_.beacon_settle_s, isOwnAddress),
      jitter_(options_.jitter_seed),
      pacer_(options_.batch_size, options_.batch_spacing_s),
      status_subscription_(statusGroup(options_.status_rate_hz)),
      reader_(kFirstReadIndex,
              [this](const std::string& path, std::int32_t rate_hz, std::int32_t index) {
                requests_.push_back({control_socket_, path, rate_hz, index});
              }),
      data_output_(options_.data_output, options_.request_timeout_s,
                   {[this](ByteView message) { send(message); },
                    [this](std::vector<std::string> paths, double timeout_s, DatarefReader::Accept accept,
                           DatarefReader::Done done) {
                      reader_.start(std::move(paths), now_ns_, now_ns_ + toNanoseconds(timeout_s), std::move(done),
                                    std::move(accept));
                    },
                    log_}),
      rpos_rate_hz_(options_.rpos_rate_hz) {
  if (options_.data_output.enabled) {
    data_socket_ = openSocket(options_.data_output.port);
  }
  if (rpos_rate_hz_ > 0) {
    rpos_socket_ = openSocket();
  }
  if (options_.xpc_port != 0) {
    xpc_socket_ = openSocket();
  }
  listenForBeacon();
  wake_fd_ = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (wake_fd_ < 0) {
    throw SocketError(std::string("cannot make an eventfd: ") + std::strerror(errno), errno);
  }
  epoll_fd_ = epoll_create1(EPOLL_CLOEXEC);
  if (epoll_fd_ < 0) {
    const int error_number = errno;
    close(wake_fd_);
    throw SocketError(std::string("cannot make an epoll: ") + std::strerror(error_number), error_number);
  }
  watch(wake_fd_);
  for (const SocketPtr& socket : {control_socket_, beacon_socket_, data_socket_, rpos_socket_, xpc_socket_}) {
    if (socket != nullptr) {
      watch(socket->fd());
    }
  }
  started_ns_ = clock_.steady_ns();
  now_ns_ = started_ns_;
}

SimLink::Impl::~Impl() {
  if (wake_fd_ >= 0) {
    close(wake_fd_);
  }
  if (epoll_fd_ >= 0) {
    close(epoll_fd_);
  }
}

void SimLink::Impl::listenForBeacon() {
  if (!options_.listen_for_beacon) {
    return;
  }
  try {
    UdpSocketOptions options;
    options.bind_port = options_.beacon_port;
    options.share_port = true;
    beacon_socket_ = std::make_shared<UdpSocket>(options);
  } catch (const SocketError& error) {
    beacon_failure_ = std::string("X-Plane's beacon cannot be heard: ") + error.what();
    log_(options_.host.empty() ? LogLevel::kError : LogLevel::kWarn, beacon_failure_);
  }
}

void SimLink::Impl::start() {
  if (running_.exchange(true)) {
    throw std::logic_error("SimLink::start() was called twice");
  }
  thread_ = std::thread([this] {
    while (!quit_) {
      step(kThreadStepMs);
    }
  });
}

bool SimLink::Impl::stop(double timeout_s) {
  if (!thread_.joinable() && stop_phase_ == StopPhase::kDone) {
    return released_;
  }
  post([this, timeout_s] {
    if (stop_phase_ != StopPhase::kRunning) {
      return;
    }
    stop_phase_ = StopPhase::kReleasing;
    stop_deadline_ns_ = now_ns_ + toNanoseconds(timeout_s);
    released_ = false;
    reader_.cancelAll();
    // Who does not answer cannot confirm: say it once and leave the rest to the journal.
    data_output_.release(monitor_.alive() ? timeout_s : 0.0, [this](bool undone) {
      released_ = undone;
      stop_phase_ = StopPhase::kUnsubscribing;
      stopSubscriptions();
    });
  });
  if (thread_.joinable()) {
    thread_.join();
    running_ = false;
    wakeWaiting();
  } else {
    // Driven by the caller: the injected clock may stand still, so the number of steps is bounded, too.
    const int max_steps = static_cast<int>(timeout_s * 1000.0) + 100;
    for (int i = 0; i < max_steps && stop_phase_ != StopPhase::kDone; ++i) {
      step(1);
    }
    stop_phase_ = StopPhase::kDone;
  }
  return released_;
}

void SimLink::Impl::post(std::function<void()> command) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    commands_.push_back(std::move(command));
  }
  wake();
}

void SimLink::Impl::wake() {
  const std::uint64_t one = 1;
  // Fails only when the counter is full, and then the thread is awake anyway.
  [[maybe_unused]] const ssize_t written = ::write(wake_fd_, &one, sizeof(one));
}

void SimLink::Impl::changeGroup(const std::shared_ptr<RrefDelivery>& delivery, std::uint32_t list,
                                std::optional<RrefGroup> group) {
  if (!group) {
    post([this, delivery] { removeGroup(delivery.get()); });
    return;
  }
  auto added = std::make_shared<Group>(Group{delivery, list, RrefSubscription(std::move(*group)), openSocket()});
  post([this, added] {
    removeGroup(added->delivery.get());
    watch(added->socket->fd());
    if (monitor_.alive()) {
      added->subscription.restart(now_ns_);
    }
    const int priority = added->subscription.group().priority;
    const auto place = std::find_if(groups_.begin(), groups_.end(), [priority](const Group& each) {
      return each.subscription.group().priority < priority;
    });
    groups_.insert(place, std::move(*added));
  });
}

void SimLink::Impl::removeGroup(const RrefDelivery* delivery) {
  const auto old = std::find_if(groups_.begin(), groups_.end(),
                                [delivery](const Group& each) { return each.delivery.get() == delivery; });
  if (old != groups_.end()) {
    stopGroup(*old);
    unwatch(old->socket->fd());
    groups_.erase(old);
  }
}

void SimLink::Impl::setRposRate(std::int32_t rate_hz) {
  requireRange("RPOS rate", rate_hz, 0, kEveryFrameRateHz);
  SocketPtr socket = openSocket();
  post([this, rate_hz, socket] {
    if (rpos_socket_ == nullptr) {
      rpos_socket_ = socket;
      watch(socket->fd());
    }
    rpos_rate_hz_ = rate_hz;
    next_rpos_request_ns_ = now_ns_;
    if (rate_hz == 0) {
      std::array<std::uint8_t, kRposRequestSize> buffer;
      if (const EncodeResult size = encodeRpos(buffer, 0); size.ok() && peer_.valid()) {
        rpos_socket_->sendTo({buffer.data(), *size}, peer_);
      }
    }
  });
}

void SimLink::Impl::setDataRows(std::vector<std::int32_t> rows) {
  requireRows(rows);
  post([this, rows = std::move(rows)] { data_output_.setRows(rows); });
}

LinkStatus SimLink::Impl::status() const {
  LinkStatus status;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    status = status_;
  }
  const std::int64_t last = last_heard_ns_;
  status.silence_s = last < 0 ? std::numeric_limits<double>::quiet_NaN() : toSeconds(clock_.steady_ns() - last);
  return status;
}

LinkCounters SimLink::Impl::counters() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return counters_;
}

std::vector<std::string> SimLink::Impl::unansweredDatarefs() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return unanswered_;
}

std::shared_ptr<Journal> SimLink::Impl::journal() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return journal_;
}

SendStatus SimLink::Impl::send(ByteView message) {
  const Endpoint peer = unpack(packed_peer_);
  if (!peer.valid()) {
    return SendStatus::kNoPeer;
  }
  return control_socket_->sendTo(message, peer) ? SendStatus::kSent : SendStatus::kSocketError;
}

void SimLink::Impl::read(std::vector<std::string> paths, double timeout_s, DatarefReader::Accept accept,
                         DatarefReader::Done done) {
  std::array<std::uint8_t, kRrefRequestSize> buffer;
  for (const std::string& path : paths) {
    const EncodeResult encoded = encodeRref(buffer, path, 0, 0);
    require(encoded.ok(), "'" + path + "' is no dataref (" + toString(encoded.error()) + ")");
  }
  requireRange("timeout", timeout_s, 0.0, 3600.0);
  post([this, paths = std::move(paths), timeout_s, accept = std::move(accept), done = std::move(done)] {
    reader_.start(paths, now_ns_, now_ns_ + toNanoseconds(timeout_s), done, accept);
  });
}

std::vector<DatarefValue> SimLink::Impl::readAndWait(std::vector<std::string> paths, double timeout_s,
                                                     const DatarefReader::Accept& accept) {
  requireWaiting();
  const std::size_t count = paths.size();
  struct Answer {
    std::mutex mutex;
    ClockCondition changed;
    std::optional<std::vector<DatarefValue>> values;
  };
  const auto answer = std::make_shared<Answer>();
  read(std::move(paths), timeout_s, accept, [answer](const std::vector<DatarefValue>& values) {
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

void SimLink::Impl::requireWaiting() const {
  if (onLinkThread() || !running_) {
    throw std::logic_error("waiting for X-Plane needs the link's thread to run, and another one to wait");
  }
}

bool SimLink::Impl::waitUntil(const std::function<bool()>& condition, double timeout_s) {
  requireWaiting();
  const Deadline deadline(clock_, timeout_s);
  ++waiting_;
  bool met = false;
  std::unique_lock<std::mutex> lock(waiting_mutex_);
  for (;;) {
    const std::uint64_t seen = steps_;
    lock.unlock();
    met = condition();
    if (met || deadline.over() || !running_) {
      break;
    }
    lock.lock();
    stepped_.waitUntil(&lock, deadline, [&] { return steps_ != seen || !running_; });
  }
  --waiting_;
  return met;
}

void SimLink::Impl::wakeWaiting() {
  if (waiting_ == 0) {
    return;
  }
  {
    const std::lock_guard<std::mutex> lock(waiting_mutex_);
    ++steps_;
  }
  stepped_.notifyAll();
}

void SimLink::Impl::step(int timeout_ms) {
  link_thread_id_ = std::this_thread::get_id();
  now_ns_ = clock_.steady_ns();
  runCommands();
  waitForInput(requests_.empty() ? timeout_ms : std::min(timeout_ms, 5));
  now_ns_ = clock_.steady_ns();
  runCommands();
  receiveControl();
  for (Group& group : groups_) {
    receiveGroup(&group);
  }
  receiveData();
  receiveRpos();
  receiveXpc();
  askXpc(now_ns_);
  receiveBeacons();
  refreshLink(now_ns_);
  if (!reader_.idle()) {
    reader_.update(now_ns_);
  }
  if (now_ns_ >= next_housekeeping_ns_) {
    next_housekeeping_ns_ = now_ns_ + kHousekeepingNs;
    housekeeping(now_ns_);
  }
  flushRequests(now_ns_);
  if (stop_phase_ != StopPhase::kRunning) {
    updateStop(now_ns_);
  }
  wakeWaiting();
}

}  // namespace xplane_bridge::core
