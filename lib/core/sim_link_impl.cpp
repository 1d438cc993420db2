#include "sim_link_impl.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <future>
#include <limits>
#include <stdexcept>
#include <utility>

namespace xplane_bridge::core {
namespace {

// The link's own subscription; index is the position.
constexpr const char* kStatusDatarefs[] = {"sim/version/xplane_internal_version", "sim/time/paused",
                                           "sim/time/total_running_time_sec"};
constexpr std::int32_t kVersionIndex = 0;
constexpr std::int32_t kPausedIndex = 1;
constexpr std::int32_t kSimTimeIndex = 2;
constexpr std::int32_t kFirstReadIndex = 1000;

constexpr std::int64_t kHousekeepingNs = 20 * kNanosecondsPerMillisecond;
constexpr int kThreadStepMs = 20;
constexpr int kMaxDatagramsAtOnce = 64;  // of one socket, before the others have their turn
constexpr std::int64_t kResolveNs = 5 * kNanosecondsPerSecond;
constexpr std::int64_t kJoinNs = 5 * kNanosecondsPerSecond;
constexpr std::int64_t kRposSilenceNs = 500 * kNanosecondsPerMillisecond;
constexpr double kPatienceS = 3.0;  // before a fruitless search is called a problem

std::int64_t nanoseconds(double seconds) {
  return static_cast<std::int64_t>(seconds * static_cast<double>(kNanosecondsPerSecond));
}

std::uint64_t pack(const Endpoint& endpoint) { return (std::uint64_t{endpoint.address} << 16) | endpoint.port; }

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

void add(const UdpCounters& more, UdpCounters* sum) {
  sum->received += more.received;
  sum->received_bytes += more.received_bytes;
  sum->truncated += more.truncated;
  sum->dropped += more.dropped;
  sum->sent += more.sent;
  sum->sent_bytes += more.sent_bytes;
  sum->send_failures += more.send_failures;
  sum->refused += more.refused;
}

std::string namesOf(const std::vector<BeaconSighting>& sightings) {
  std::string text;
  for (const BeaconSighting& sighting : sightings) {
    text += (text.empty() ? "" : ", ") + toString(sighting);
  }
  return text;
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
                      reader_.start(std::move(paths), now_ns_, now_ns_ + nanoseconds(timeout_s), std::move(done),
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
  listenForBeacon();
  wake_fd_ = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (wake_fd_ < 0) {
    throw SocketError(std::string("cannot make an eventfd: ") + std::strerror(errno), errno);
  }
  started_ns_ = clock_.steady_ns();
  now_ns_ = started_ns_;
}

SimLink::Impl::~Impl() {
  if (wake_fd_ >= 0) {
    close(wake_fd_);
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

// ------------------------------------------------------------------------------------------------------ any thread

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
  if (stop_phase_ == StopPhase::kDone && !thread_.joinable()) {
    return released_;
  }
  post([this, timeout_s] {
    if (stop_phase_ != StopPhase::kRunning) {
      return;
    }
    stop_phase_ = StopPhase::kReleasing;
    stop_deadline_ns_ = now_ns_ + nanoseconds(timeout_s);
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
  [[maybe_unused]] const ssize_t written = write(wake_fd_, &one, sizeof(one));
}

GroupId SimLink::Impl::addGroup(RrefGroup group) {
  const GroupId id = next_group_id_++;
  replaceGroup(id, std::move(group));
  return id;
}

void SimLink::Impl::replaceGroup(GroupId id, RrefGroup group) {
  auto added = std::make_shared<Group>(Group{id, RrefSubscription(std::move(group)), openSocket()});
  post([this, added] {
    const auto old =
        std::find_if(groups_.begin(), groups_.end(), [&](const Group& each) { return each.id == added->id; });
    if (old != groups_.end()) {
      stopGroup(*old);
      groups_.erase(old);
    }
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

void SimLink::Impl::removeGroup(GroupId id) {
  post([this, id] {
    const auto old = std::find_if(groups_.begin(), groups_.end(), [id](const Group& each) { return each.id == id; });
    if (old != groups_.end()) {
      stopGroup(*old);
      groups_.erase(old);
    }
  });
}

void SimLink::Impl::setRposRate(std::int32_t rate_hz) {
  requireRange("RPOS rate", rate_hz, 0, kEveryFrameRateHz);
  SocketPtr socket = openSocket();
  post([this, rate_hz, socket] {
    if (rpos_socket_ == nullptr) {
      rpos_socket_ = socket;
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
  status.silence_s =
      last < 0 ? std::numeric_limits<double>::quiet_NaN() : static_cast<double>(clock_.steady_ns() - last) / 1e9;
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
    reader_.start(paths, now_ns_, now_ns_ + nanoseconds(timeout_s), done, accept);
  });
}

std::vector<DatarefValue> SimLink::Impl::readAndWait(std::vector<std::string> paths, double timeout_s,
                                                     const DatarefReader::Accept& accept) {
  if (onLinkThread() || !running_) {
    throw std::logic_error("reading datarefs and waiting needs the link's thread to run, and another one to wait");
  }
  const std::size_t count = paths.size();
  auto promise = std::make_shared<std::promise<std::vector<DatarefValue>>>();
  std::future<std::vector<DatarefValue>> future = promise->get_future();
  read(std::move(paths), timeout_s, accept,
       [promise](const std::vector<DatarefValue>& values) { promise->set_value(values); });
  // The link ends the read in time; this deadline is for a link that is stopped before it sees the read.
  const auto patience = std::chrono::duration<double>(timeout_s + 1.0);
  if (future.wait_for(patience) != std::future_status::ready) {
    return std::vector<DatarefValue>(count);
  }
  return future.get();
}

// ------------------------------------------------------------------------------------------------------ the loop

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
}

void SimLink::Impl::waitForInput(int timeout_ms) {
  poll_.clear();
  poll_.push_back({wake_fd_, POLLIN, 0});
  poll_.push_back({control_socket_->fd(), POLLIN, 0});
  for (const SocketPtr& socket : {beacon_socket_, data_socket_, rpos_socket_}) {
    if (socket != nullptr) {
      poll_.push_back({socket->fd(), POLLIN, 0});
    }
  }
  for (const Group& group : groups_) {
    poll_.push_back({group.socket->fd(), POLLIN, 0});
  }
  poll(poll_.data(), poll_.size(), timeout_ms);
  if ((poll_[0].revents & POLLIN) != 0) {
    std::uint64_t count = 0;
    [[maybe_unused]] const ssize_t size = ::read(wake_fd_, &count, sizeof(count));
  }
}

void SimLink::Impl::runCommands() {
  std::vector<std::function<void()>> commands;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    commands.swap(commands_);
  }
  for (const std::function<void()>& command : commands) {
    command();
  }
}

template <typename Handler>
void SimLink::Impl::drain(UdpSocket* socket, const Handler& handle) {
  if (socket == nullptr) {
    return;
  }
  Received received;
  for (int i = 0; i < kMaxDatagramsAtOnce; ++i) {
    if (socket->receive(buffer_, &received) != ReceiveStatus::kReceived) {
      return;
    }
    handle(ByteView(buffer_.data(), received.size), received);
  }
}

bool SimLink::Impl::isFromPeer(const Received& received) {
  // By address only: X-Plane may answer from another port than the one it listens on.
  if (peer_.valid() && isSameHost(received.from.address, peer_.address)) {
    return true;
  }
  ++live_counters_.strangers;
  return false;
}

void SimLink::Impl::heardPeer() {
  monitor_.heard(now_ns_);
  last_heard_ns_ = now_ns_;
}

ReceiveInfo SimLink::Impl::infoOf(const Received& received) {
  ReceiveInfo info;
  info.kernel_stamp = received.kernel_stamp_ns != 0;
  info.stamp_ns = info.kernel_stamp ? received.kernel_stamp_ns : clock_.system_ns();
  info.steady_ns = now_ns_;
  info.link_epoch = monitor_.epoch();
  info.from = received.from;
  return info;
}

void SimLink::Impl::countDecodeError(DecodeError error) {
  ++live_counters_.decode_errors[static_cast<std::size_t>(error)];
}

void SimLink::Impl::receiveControl() {
  drain(control_socket_.get(), [this](ByteView bytes, const Received& received) {
    if (!isFromPeer(received)) {
      return;
    }
    const DecodeResult<RrefView> rref = decodeRref(bytes);
    if (!rref.ok()) {
      countDecodeError(classify(bytes) == MessageKind::kUnknown ? DecodeError::kUnknownLabel : rref.error());
      return;
    }
    ++live_counters_.rref_datagrams;
    heardPeer();
    for (std::size_t i = 0; i < rref->size(); ++i) {
      const RrefPair pair = (*rref)[i];
      if (pair.index >= 0 && pair.index < kFirstReadIndex) {
        takeStatus(pair);
      } else if (!reader_.answered(pair, now_ns_)) {
        ++live_counters_.unknown_indices;
      }
    }
    status_subscription_.answered(*rref, now_ns_);
  });
}

void SimLink::Impl::takeStatus(const RrefPair& pair) {
  if (!std::isfinite(pair.value)) {
    ++live_counters_.non_finite_values;
    return;
  }
  switch (pair.index) {
    case kVersionIndex:
      if (pair.value > 0.0F) {  // zero before a flight is loaded
        version_ = static_cast<std::int32_t>(std::lround(pair.value));
      }
      break;
    case kPausedIndex:
      paused_ = pair.value != 0.0F;
      monitor_.setPaused(*paused_);
      break;
    case kSimTimeIndex:
      sim_time_s_ = pair.value;
      monitor_.setSimTime(pair.value);
      break;
    default:
      ++live_counters_.unknown_indices;
      break;
  }
}

void SimLink::Impl::receiveGroup(Group* group) {
  drain(group->socket.get(), [this, group](ByteView bytes, const Received& received) {
    if (!isFromPeer(received)) {
      return;
    }
    const DecodeResult<RrefView> rref = decodeRref(bytes);
    if (!rref.ok()) {
      countDecodeError(classify(bytes) == MessageKind::kUnknown ? DecodeError::kUnknownLabel : rref.error());
      return;
    }
    ++live_counters_.rref_datagrams;
    heardPeer();
    for (std::size_t i = 0; i < rref->size(); ++i) {
      live_counters_.non_finite_values += std::isfinite((*rref)[i].value) ? 0U : 1U;
    }
    live_counters_.unknown_indices += group->subscription.answered(*rref, now_ns_);
    if (callbacks_.on_rref) {
      callbacks_.on_rref(group->id, *rref, infoOf(received));
    }
  });
}

void SimLink::Impl::receiveData() {
  drain(data_socket_.get(), [this](ByteView bytes, const Received& received) {
    if (!isFromPeer(received)) {
      return;
    }
    const DecodeResult<DataView> data = decodeData(bytes);
    if (!data.ok()) {
      countDecodeError(classify(bytes) == MessageKind::kUnknown ? DecodeError::kUnknownLabel : data.error());
      return;
    }
    ++live_counters_.data_datagrams;
    heardPeer();
    const DataAnomalies anomalies = inspect(*data);
    live_counters_.unknown_rows += anomalies.unknown_rows;
    live_counters_.non_finite_values += anomalies.non_finite_values;
    data_output_.heard(*data, now_ns_);
    if (callbacks_.on_data) {
      callbacks_.on_data(*data, infoOf(received));
    }
  });
}

void SimLink::Impl::receiveRpos() {
  drain(rpos_socket_.get(), [this](ByteView bytes, const Received& received) {
    if (!isFromPeer(received)) {
      return;
    }
    const DecodeResult<Rpos> rpos = decodeRpos(bytes);
    if (!rpos.ok()) {
      countDecodeError(classify(bytes) == MessageKind::kUnknown ? DecodeError::kUnknownLabel : rpos.error());
      return;
    }
    ++live_counters_.rpos_datagrams;
    heardPeer();
    next_rpos_request_ns_ = now_ns_ + jitter_.around(kRposSilenceNs);
    if (callbacks_.on_rpos && rpos_rate_hz_ > 0) {
      callbacks_.on_rpos(*rpos, infoOf(received));
    }
  });
}

void SimLink::Impl::receiveBeacons() {
  drain(beacon_socket_.get(), [this](ByteView bytes, const Received& received) {
    const DecodeResult<Beacon> beacon = decodeBeacon(bytes);
    if (!beacon.ok()) {
      countDecodeError(beacon.error());
      return;
    }
    ++live_counters_.beacons;
    const bool peer_was_away = peer_.valid() && !beacons_.at(peer_, now_ns_).has_value();
    if (!beacons_.heard(*beacon, received.from.address, now_ns_)) {
      return;
    }
    if (const std::optional<BeaconSighting> sighting = beacons_.at(peer_, now_ns_)) {
      monitor_.beaconHeard(now_ns_);
      peer_name_ = sighting->computer_name;
      if (peer_was_away && !monitor_.alive()) {
        next_probe_ns_ = now_ns_;  // it is back: ask at once
      }
    }
  });
}

// ------------------------------------------------------------------------------------------------------ what is due

void SimLink::Impl::housekeeping(std::int64_t now_ns) {
  if (beacon_socket_ != nullptr && now_ns >= next_join_ns_) {
    next_join_ns_ = now_ns + kJoinNs;
    try {
      beacon_socket_->joinOnAllInterfaces(resolveHost(options_.beacon_group));
    } catch (const SocketError& error) {
      beacon_failure_ = std::string("X-Plane's beacon cannot be heard: ") + error.what();
    }
  }
  if (stop_phase_ == StopPhase::kRunning) {
    findPeer(now_ns);
  }
  refreshLink(now_ns);
  if (peer_.valid() && !monitor_.alive() && now_ns >= next_probe_ns_) {
    next_probe_ns_ = now_ns + jitter_.around(nanoseconds(options_.probe_period_s));
    status_subscription_.restart(now_ns);
  }
  data_output_.update(monitor_.state() == LinkState::kConnected, now_ns);
  updateRpos(now_ns);
  publish(now_ns);
}

void SimLink::Impl::findPeer(std::int64_t now_ns) {
  if (!options_.host.empty()) {
    if (!monitor_.alive() && now_ns >= next_resolve_ns_) {
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
  // The X-Plane we knew is silent. Only one that has begun to announce itself since may be it: never jump to another
  // computer's that has been there all along.
  if (now_ns - beacons_.lastHeard(peer_) < nanoseconds(options_.beacon_settle_s)) {
    return;
  }
  const std::optional<BeaconSighting> restarted = beacons_.onlyNewSince(last_heard_ns_, now_ns);
  if (restarted.has_value() && restarted->endpoint != peer_) {
    setPeer(restarted->endpoint, "come back as " + toString(*restarted));
  }
}

void SimLink::Impl::resolve(std::int64_t now_ns) {
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

void SimLink::Impl::setPeer(const Endpoint& peer, const std::string& why) {
  log_(LogLevel::kInfo, "talking to X-Plane at " + peer.toString() + ", " + why);
  peer_ = peer;
  packed_peer_ = pack(peer);
  peer_name_.clear();
  if (const std::optional<BeaconSighting> sighting = beacons_.at(peer, now_ns_)) {
    peer_name_ = sighting->computer_name;
  }
  version_.reset();
  paused_.reset();
  sim_time_s_.reset();
  monitor_.newPeer();
  if (beacons_.lastHeard(peer) > 0) {
    monitor_.beaconHeard(beacons_.lastHeard(peer));
  }
  next_probe_ns_ = now_ns_;
  std::shared_ptr<Journal> journal = journals_ ? journals_(peer) : nullptr;
  const std::lock_guard<std::mutex> lock(mutex_);
  journal_ = std::move(journal);
}

void SimLink::Impl::refreshLink(std::int64_t now_ns) {
  monitor_.update(now_ns);
  const bool alive = monitor_.alive();
  const bool came_up = alive && monitor_.epoch() != seen_epoch_;
  if (alive && (!was_alive_ || came_up)) {
    restartSubscriptions(now_ns);
  } else if (!alive && was_alive_) {
    for (Group& group : groups_) {
      group.subscription.suspend();
    }
    next_probe_ns_ = now_ns;
  }
  const bool changed = alive != was_alive_ || came_up;
  was_alive_ = alive;
  if (came_up) {
    seen_epoch_ = monitor_.epoch();
    if (stop_phase_ == StopPhase::kRunning) {
      updateDataOutput(now_ns);
    }
  }
  if (changed) {
    publish(now_ns);
  }
}

void SimLink::Impl::restartSubscriptions(std::int64_t now_ns) {
  for (Group& group : groups_) {
    group.subscription.restart(now_ns);
    ++live_counters_.resubscriptions;
  }
  status_subscription_.restart(now_ns);
  next_rpos_request_ns_ = now_ns;
}

void SimLink::Impl::updateDataOutput(std::int64_t now_ns) {
  Endpoint target{0, dataPort()};
  try {
    target.address =
        options_.data_output.address.empty() ? localAddressTowards(peer_) : resolveHost(options_.data_output.address);
  } catch (const SocketError& error) {
    log_(LogLevel::kError, std::string("Data Output has no target: ") + error.what());
    return;
  }
  data_output_.linkUp(journal(), target, now_ns);
}

void SimLink::Impl::updateRpos(std::int64_t now_ns) {
  if (rpos_socket_ == nullptr || rpos_rate_hz_ == 0 || !monitor_.alive() || now_ns < next_rpos_request_ns_ ||
      stop_phase_ != StopPhase::kRunning) {
    return;
  }
  std::array<std::uint8_t, kRposRequestSize> buffer;
  if (const EncodeResult size = encodeRpos(buffer, rpos_rate_hz_)) {
    rpos_socket_->sendTo({buffer.data(), *size}, peer_);
    ++live_counters_.requests;
  }
  next_rpos_request_ns_ = now_ns + jitter_.around(2 * kRposSilenceNs);
}

void SimLink::Impl::flushRequests(std::int64_t now_ns) {
  if (!peer_.valid()) {
    return;
  }
  std::size_t allowance = pacer_.allowance(now_ns, &jitter_);
  const std::size_t before = allowance;
  const auto flush = [&](RrefSubscription* subscription, UdpSocket* socket) {
    while (allowance > 0) {
      const std::optional<std::size_t> index = subscription->nextRequest(now_ns, &jitter_);
      if (!index.has_value()) {
        return;
      }
      sendRequest(socket, subscription->group().datarefs[*index], subscription->group().rate_hz,
                  static_cast<std::int32_t>(*index));
      --allowance;
    }
  };
  const bool subscribing = stop_phase_ == StopPhase::kRunning || stop_phase_ == StopPhase::kReleasing;
  if (subscribing) {
    flush(&status_subscription_, control_socket_.get());
  }
  for (; allowance > 0 && !requests_.empty(); --allowance) {
    const Request& request = requests_.front();
    sendRequest(request.socket.get(), request.path, request.rate_hz, request.index);
    requests_.pop_front();
  }
  if (subscribing) {
    for (Group& group : groups_) {
      flush(&group.subscription, group.socket.get());
    }
  }
  pacer_.spend(before - allowance);
}

void SimLink::Impl::sendRequest(UdpSocket* socket, const std::string& path, std::int32_t rate_hz, std::int32_t index) {
  std::array<std::uint8_t, kRrefRequestSize> buffer;
  if (const EncodeResult size = encodeRref(buffer, path, rate_hz, index)) {
    socket->sendTo({buffer.data(), *size}, peer_);
    ++live_counters_.requests;
  }
}

void SimLink::Impl::stopGroup(const Group& group) {
  add(group.socket->counters(), &retired_udp_);
  if (!monitor_.alive()) {
    return;  // X-Plane has forgotten us, or will find nobody on that port
  }
  const RrefGroup& stopped = group.subscription.group();
  for (std::size_t i = 0; i < stopped.datarefs.size(); ++i) {
    requests_.push_back({group.socket, stopped.datarefs[i], 0, static_cast<std::int32_t>(i)});
  }
}

void SimLink::Impl::stopSubscriptions() {
  if (!monitor_.alive()) {
    return;
  }
  for (const Group& group : groups_) {
    stopGroup(group);
  }
  groups_.clear();
  for (std::int32_t i = 0; i <= kSimTimeIndex; ++i) {
    requests_.push_back({control_socket_, kStatusDatarefs[i], 0, i});
  }
  if (rpos_socket_ != nullptr && rpos_rate_hz_ > 0) {
    std::array<std::uint8_t, kRposRequestSize> buffer;
    if (const EncodeResult size = encodeRpos(buffer, 0)) {
      rpos_socket_->sendTo({buffer.data(), *size}, peer_);
    }
  }
}

void SimLink::Impl::updateStop(std::int64_t now_ns) {
  const bool late = now_ns >= stop_deadline_ns_;
  if (stop_phase_ == StopPhase::kReleasing && late) {
    reader_.cancelAll();
    stop_phase_ = StopPhase::kUnsubscribing;
  }
  if (stop_phase_ == StopPhase::kUnsubscribing && (requests_.empty() || late)) {
    stop_phase_ = StopPhase::kDone;
  }
  if (stop_phase_ == StopPhase::kDone) {
    reader_.cancelAll();
    quit_ = true;
  }
}

// ------------------------------------------------------------------------------------------------------ publishing

std::vector<std::string> SimLink::Impl::findProblems(std::int64_t now_ns) const {
  std::vector<std::string> problems;
  if (!resolve_failure_.empty()) {
    problems.push_back(resolve_failure_);
  }
  if (!beacon_failure_.empty() && options_.host.empty()) {
    problems.push_back(beacon_failure_);
  }
  const std::vector<BeaconSighting> sightings = beacons_.sightings(now_ns);
  const double searched_s = static_cast<double>(now_ns - started_ns_) / 1e9;
  if (!monitor_.alive() && options_.host.empty()) {
    if (sightings.size() > 1) {
      problems.push_back("several X-Planes announce themselves: " + namesOf(sightings) +
                         "; set the parameter host (and port) to the one that is meant");
    } else if (!peer_.valid() && sightings.empty() && searched_s > kPatienceS) {
      problems.push_back("no X-Plane announces itself on " + options_.beacon_group + ":" +
                         std::to_string(options_.beacon_port) +
                         ": start X-Plane, or set the parameter host if its beacon cannot get here (other network, "
                         "firewall, container)");
    }
  }
  if (!monitor_.alive() && !options_.host.empty() && peer_.valid()) {
    for (const BeaconSighting& sighting : sightings) {
      if (isSameHost(sighting.endpoint.address, peer_.address) && sighting.endpoint.port != peer_.port) {
        problems.push_back("X-Plane at " + sighting.endpoint.addressString() + " listens on port " +
                           std::to_string(sighting.endpoint.port) + ", but port " + std::to_string(peer_.port) +
                           " is configured: set the parameter port");
      }
    }
  }
  if (peer_.valid() && monitor_.state() == LinkState::kSearching && searched_s > kPatienceS) {
    problems.push_back("no answer from " + peer_.toString() +
                       (control_socket_->counters().refused > 0
                            ? ": that computer is there, but nothing listens on the port: start X-Plane, or set port"
                            : ": start X-Plane; check the address, firewalls and, in X-Plane 12, Settings > Network > "
                              "Accept incoming connections"));
  }
  if (!data_output_.problem().empty()) {
    problems.push_back(data_output_.problem());
  }
  return problems;
}

std::string SimLink::Impl::reasonOf(LinkState state) const {
  switch (state) {
    case LinkState::kSearching:
      return peer_.valid() ? "waiting for the first answer of " + peer_.toString() : "waiting for X-Plane's beacon";
    case LinkState::kConnected:
      return "X-Plane answers";
    case LinkState::kPaused:
      return "X-Plane answers, the simulation is paused";
    case LinkState::kStale:
      return "X-Plane has been silent for more than " + std::to_string(options_.stale_after_s).substr(0, 4) +
             " s: loading, in a menu, or gone";
    case LinkState::kLost:
      return monitor_.beaconGone(now_ns_) ? "X-Plane is silent and its beacon is gone" : "X-Plane is silent for long";
  }
  return {};
}

void SimLink::Impl::publish(std::int64_t now_ns) {
  LinkCounters counters = live_counters_;
  counters.udp = retired_udp_;
  counters.receive_buffer = control_socket_->receiveBuffer();
  std::vector<std::string> unanswered = status_subscription_.unanswered();
  const auto count = [&counters](const SocketPtr& socket) {
    if (socket != nullptr) {
      add(socket->counters(), &counters.udp);
      counters.receive_buffer = std::min(counters.receive_buffer, socket->receiveBuffer());
    }
  };
  for (const SocketPtr& socket : {control_socket_, beacon_socket_, data_socket_, rpos_socket_}) {
    count(socket);
  }
  for (const Group& group : groups_) {
    count(group.socket);
    counters.repeated_requests += group.subscription.repeats();
    for (std::string& path : group.subscription.unanswered()) {
      unanswered.push_back(std::move(path));
    }
  }
  LinkStatus status;
  status.state = monitor_.state();
  status.epoch = monitor_.epoch();
  status.reason = reasonOf(status.state);
  status.peer = peer_;
  status.computer_name = peer_name_;
  status.version = version_;
  status.paused = paused_;
  status.sim_time_s = sim_time_s_;
  status.silence_s = monitor_.silence(now_ns);
  status.beacons = beacons_.sightings(now_ns);
  status.problems = findProblems(now_ns);
  bool changed = false;
  bool state_changed = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    state_changed = status.state != status_.state || status.epoch != status_.epoch;
    changed = state_changed || status.peer != status_.peer || status.version != status_.version ||
              status.problems != status_.problems || status.computer_name != status_.computer_name;
    status.since_steady_ns = status.state != status_.state ? now_ns : status_.since_steady_ns;
    status_ = status;
    counters_ = counters;
    unanswered_ = std::move(unanswered);
  }
  if (state_changed) {
    const bool bad = status.state == LinkState::kLost || status.state == LinkState::kStale;
    log_(bad ? LogLevel::kWarn : LogLevel::kInfo, std::string("link ") + toString(status.state) + ": " + status.reason);
  }
  if (changed && callbacks_.on_state) {
    callbacks_.on_state(status);
  }
}

}  // namespace xplane_bridge::core
