#include "xplane_bridge/core/link/sim_link.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "xplane_bridge/core/wire/udp_socket.hpp"

namespace xplane_bridge::core {
namespace {

constexpr int kMaxDatagramsAtOnce = 64;  // of one source, before the others have their turn
constexpr std::int64_t kRposSilenceNs = 500 * kNanosecondsPerMillisecond;

}  // namespace

template <typename Handler>
void SimLink::drain(DatagramSource* source, const Handler& handle) {
  // Asking every source in vain would cost a flight state more time than all its computing.
  if (source == nullptr || !hub_->hasInput(*source)) {
    return;
  }
  Received received;
  for (int i = 0; i < kMaxDatagramsAtOnce; ++i) {
    if (source->receive(buffer_, &received) != ReceiveStatus::kReceived) {
      return;
    }
    handle(ByteView(buffer_.data(), received.size), received);
  }
}

bool SimLink::isFromPeer(ByteView bytes, const Received& received, Stream stream) {
  const bool same_host = peer_.valid() && isSameHost(received.from.address, peer_.address);
  // X-Plane may answer from another port than the one it listens on, but while it runs it keeps to that: what comes
  // from another port is another program's.
  const std::uint16_t port = ports_[static_cast<std::size_t>(stream)];
  if (same_host && (port == 0 || port == received.from.port)) {
    return true;
  }
  ++live_counters_.strangers;
  if (classify(bytes) != MessageKind::kUnknown) {
    (same_host ? intruder_ : other_address_) = Sighting{received.from, now_ns_};
  }
  return false;
}

void SimLink::heardPeer(const Received& received, Stream stream) {
  ports_[static_cast<std::size_t>(stream)] = received.from.port;
  if (stream == Stream::kAnswers) {
    answered_ns_ = now_ns_;
  }
  if (stream == Stream::kPlugin) {
    return;  // it answers also while X-Plane's own sender is silent
  }
  monitor_.heard(now_ns_);
  last_heard_ns_ = now_ns_;
}

ReceiveInfo SimLink::infoOf(const Received& received) {
  ReceiveInfo info;
  info.kernel_stamp = received.kernel_stamp_ns != 0;
  info.stamp_ns = info.kernel_stamp ? received.kernel_stamp_ns : clock_.system_ns();
  info.steady_ns = now_ns_;
  info.link_epoch = monitor_.epoch();
  info.from = received.from;
  return info;
}

void SimLink::countDecodeError(DecodeError error) { ++live_counters_.decode_errors[static_cast<std::size_t>(error)]; }

void SimLink::receiveControl() {
  drain(control_source_.get(), [this](ByteView bytes, const Received& received) {
    if (!isFromPeer(bytes, received, Stream::kAnswers)) {
      return;
    }
    const DecodeResult<RrefView> rref = decodeRref(bytes);
    if (!rref.ok()) {
      countDecodeError(classify(bytes) == MessageKind::kUnknown ? DecodeError::kUnknownLabel : rref.error());
      return;
    }
    ++live_counters_.rref_datagrams;
    heardPeer(received, Stream::kAnswers);
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

void SimLink::takeStatus(const RrefPair& pair) {
  if (!std::isfinite(pair.value)) {
    ++live_counters_.non_finite_values;
    return;
  }
  switch (pair.index) {
    case kVersionIndex:
      if (pair.value > 0.0F) {  // zero before a flight is loaded
        answered_version_ = static_cast<std::int32_t>(std::lround(pair.value));
        answered_epoch_ = monitor_.epoch();
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
    case kFramePeriodIndex:
      if (pair.value > 0.0F) {
        constexpr double kLongestFrame = 0.1;  // [s] a hitch says nothing about the next frames
        pacer_.setSpacing(options_.batch_frames * std::min(static_cast<double>(pair.value), kLongestFrame));
      }
      break;
    default:
      ++live_counters_.unknown_indices;
      break;
  }
}

void SimLink::receiveGroup(Group* group) {
  drain(group->source.get(), [this, group](ByteView bytes, const Received& received) {
    if (!isFromPeer(bytes, received, Stream::kAnswers)) {
      return;
    }
    const DecodeResult<RrefView> rref = decodeRref(bytes);
    if (!rref.ok()) {
      countDecodeError(classify(bytes) == MessageKind::kUnknown ? DecodeError::kUnknownLabel : rref.error());
      return;
    }
    ++live_counters_.rref_datagrams;
    heardPeer(received, Stream::kAnswers);
    group->delivery->deliver(group->list, *rref, infoOf(received));
    // Statistics after delivery, to keep latency low.
    for (std::size_t i = 0; i < rref->size(); ++i) {
      live_counters_.non_finite_values += std::isfinite((*rref)[i].value) ? 0U : 1U;
    }
    live_counters_.unknown_indices += group->subscription.answered(*rref, now_ns_);
  });
}

void SimLink::receiveData() {
  drain(data_source_.get(), [this](ByteView bytes, const Received& received) {
    if (!isFromPeer(bytes, received, Stream::kData)) {
      return;
    }
    const DecodeResult<DataView> data = decodeData(bytes);
    if (!data.ok()) {
      countDecodeError(classify(bytes) == MessageKind::kUnknown ? DecodeError::kUnknownLabel : data.error());
      return;
    }
    ++live_counters_.data_datagrams;
    heardPeer(received, Stream::kData);
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

void SimLink::receiveRpos() {
  drain(rpos_source_.get(), [this](ByteView bytes, const Received& received) {
    if (!isFromPeer(bytes, received, Stream::kPosition)) {
      return;
    }
    const DecodeResult<Rpos> rpos = decodeRpos(bytes);
    if (!rpos.ok()) {
      countDecodeError(classify(bytes) == MessageKind::kUnknown ? DecodeError::kUnknownLabel : rpos.error());
      return;
    }
    ++live_counters_.rpos_datagrams;
    heardPeer(received, Stream::kPosition);
    if (rpos_rate_hz_ == 0) {
      if (now_ns_ >= next_rpos_request_ns_) {
        stopRpos();
      }
      return;
    }
    next_rpos_request_ns_ = now_ns_ + jitter_.around(kRposSilenceNs);
    if (callbacks_.on_rpos) {
      callbacks_.on_rpos(*rpos, infoOf(received));
    }
  });
}

void SimLink::receiveXpc() {
  drain(xpc_source_.get(), [this](ByteView bytes, const Received& received) {
    if (!isFromPeer(bytes, received, Stream::kPlugin)) {
      return;
    }
    const DecodeResult<XpcPosition> position = decodePosi(bytes);
    if (!position.ok()) {
      countDecodeError(classify(bytes) == MessageKind::kUnknown ? DecodeError::kUnknownLabel : position.error());
      return;
    }
    ++live_counters_.xpc_datagrams;
    heardPeer(received, Stream::kPlugin);
    if (callbacks_.on_xpc) {
      callbacks_.on_xpc(*position, infoOf(received));
    }
  });
}

void SimLink::receiveLeftovers() {
  for (std::size_t i = 0; i < leftovers_.sources().size(); ++i) {
    drain(leftovers_.sources()[i].get(),
          [this, i](ByteView bytes, const Received&) { leftovers_.heard(i, bytes, now_ns_); });
  }
}

void SimLink::receiveBeacons() {
  drain(beacon_source_.get(), [this](ByteView bytes, const Received& received) {
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
