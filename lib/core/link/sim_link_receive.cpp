#include "sim_link_impl.hpp"

#include <sys/epoll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <string>

namespace xplane_bridge::core {
namespace {

constexpr int kMaxDatagramsAtOnce = 64;  // of one socket, before the others have their turn
constexpr std::int64_t kRposSilenceNs = 500 * kNanosecondsPerMillisecond;

}  // namespace

void SimLink::Impl::watch(int fd) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = fd;
  if (epoll_ctl(epoll_fd_, EPOLL_CTL_ADD, fd, &event) != 0) {
    log_(LogLevel::kError, std::string("a socket cannot be waited for: ") + std::strerror(errno));
  }
}

// A removed group's socket may live on for requests that are still to be sent; nobody reads it any more.
void SimLink::Impl::unwatch(int fd) { epoll_ctl(epoll_fd_, EPOLL_CTL_DEL, fd, nullptr); }

void SimLink::Impl::waitForInput(int timeout_ms) {
  constexpr std::size_t kMostAtOnce = 64;
  ready_.resize(kMostAtOnce);
  const int count = epoll_wait(epoll_fd_, ready_.data(), static_cast<int>(ready_.size()), timeout_ms);
  ready_.resize(static_cast<std::size_t>(std::max(0, count)));  // interrupted: nothing
  if (hasInput(wake_fd_)) {
    std::uint64_t woken = 0;
    [[maybe_unused]] const ssize_t size = ::read(wake_fd_, &woken, sizeof(woken));
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

bool SimLink::Impl::hasInput(int fd) const {
  return std::any_of(ready_.begin(), ready_.end(), [fd](const epoll_event& event) { return event.data.fd == fd; });
}

template <typename Handler>
void SimLink::Impl::drain(UdpSocket* socket, const Handler& handle) {
  // Asking every socket in vain would cost a flight state more time than all its computing.
  if (socket == nullptr || !hasInput(socket->fd())) {
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
        version_.number = static_cast<std::int32_t>(std::lround(pair.value));
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
    group->delivery->deliver(group->list, *rref, infoOf(received));
    // The books are kept once the state is on its way.
    for (std::size_t i = 0; i < rref->size(); ++i) {
      live_counters_.non_finite_values += std::isfinite((*rref)[i].value) ? 0U : 1U;
    }
    live_counters_.unknown_indices += group->subscription.answered(*rref, now_ns_);
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
      ReceiveInfo info = infoOf(received);
      std::copy_n(bytes.data(), info.label.size(), info.label.begin());  // as long as every DATA message, at least
      callbacks_.on_data(*data, info);
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

void SimLink::Impl::receiveXpc() {
  drain(xpc_socket_.get(), [this](ByteView bytes, const Received& received) {
    if (!isFromPeer(received)) {
      return;
    }
    const DecodeResult<XpcPosition> position = decodePosi(bytes);
    if (!position.ok()) {
      countDecodeError(classify(bytes) == MessageKind::kUnknown ? DecodeError::kUnknownLabel : position.error());
      return;
    }
    // Not heardPeer(): the plugin answers also while X-Plane's own sender is silent.
    ++live_counters_.xpc_datagrams;
    if (callbacks_.on_xpc) {
      callbacks_.on_xpc(*position, infoOf(received));
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

}  // namespace xplane_bridge::core
