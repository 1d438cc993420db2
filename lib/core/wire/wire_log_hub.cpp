#include "xplane_bridge/core/wire/wire_log_hub.hpp"

#include <algorithm>
#include <cerrno>
#include <utility>
#include <vector>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {

class WireLogHub::Source : public DatagramSource {
 public:
  Source(std::shared_ptr<DatagramSource> inner_in, std::uint16_t number, const WireLogHub& hub)
      : inner(std::move(inner_in)),
        number_(number),
        log_(hub.log_),
        clock_(hub.clock_),
        host_(hub.host_),
        leads_(hub.turn_ != nullptr) {}

  ReceiveStatus receive(ByteSpan buffer, Received* received) override {
    const ReceiveStatus status = inner->receive(buffer, received);
    if (status != ReceiveStatus::kReceived) return status;
    WireRecord record = now(WireKind::kReceived);
    record.kernel_ns = received->kernel_stamp_ns;
    record.peer = received->from;
    record.count = static_cast<std::uint32_t>(inner->counters().dropped);
    record.payload = {buffer.data(), std::min(received->size, buffer.size())};
    log_->add(record);
    if (leads_) clock_.move(record.steady_ns, record.wall_ns);
    return status;
  }
  bool sendTo(ByteView bytes, const Endpoint& to, int* error_number) override {
    int error = 0;
    const bool sent = inner->sendTo(bytes, to, &error);
    if (!sent && error_number != nullptr) *error_number = error;
    WireRecord record = now(WireKind::kSent);
    record.peer = to;
    record.count = sent ? 0U : static_cast<std::uint32_t>(error != 0 ? error : EIO);
    record.payload = bytes;
    log_->add(record);
    return sent;
  }
  std::vector<std::string> joinOnAllInterfaces(std::uint32_t group) override {
    return inner->joinOnAllInterfaces(group);
  }
  std::uint16_t localPort() const override { return inner->localPort(); }
  int receiveBuffer() const override { return inner->receiveBuffer(); }
  UdpCounters counters() const override {
    const UdpCounters counters = inner->counters();
    if (counters.refused != refused_) {
      refused_ = counters.refused;
      WireRecord record = now(WireKind::kRefused);
      record.count = static_cast<std::uint32_t>(refused_);
      log_->add(record);
    }
    return counters;
  }

  const std::shared_ptr<DatagramSource> inner;

 private:
  WireRecord now(WireKind kind) const {
    WireRecord record;
    record.kind = kind;
    record.source = number_;
    record.wall_ns = host_.system_ns();
    record.steady_ns = host_.steady_ns();
    return record;
  }

  const std::uint16_t number_;
  const std::shared_ptr<WireLog> log_;
  const WireClock clock_;
  const Clock host_;
  const bool leads_;
  mutable std::uint64_t refused_ = 0;  // of the thread that receives
};

WireLogHub::WireLogHub(std::unique_ptr<DatagramHub> inner, std::shared_ptr<WireLog> log, WireClock clock, Clock host,
                       WireTurn* turn)
    : inner_(std::move(inner)), log_(std::move(log)), clock_(std::move(clock)), host_(std::move(host)), turn_(turn) {
  if (turn_ == nullptr) return;
  WireRecord start;
  start.wall_ns = clock_.wall();
  start.steady_ns = clock_.steady();
  log_->add(start);
}

std::shared_ptr<DatagramSource> WireLogHub::open(const std::string& name, const UdpSocketOptions& options) {
  std::shared_ptr<DatagramSource> below = inner_->open(name, options);
  const std::lock_guard<std::mutex> lock(opening_);
  WireRecord record;
  record.kind = WireKind::kOpened;
  record.source = opened_;
  record.peer.port = below->localPort();
  record.payload = {reinterpret_cast<const std::uint8_t*>(name.data()), name.size()};
  log_->add(record);
  return std::make_shared<Source>(std::move(below), opened_++, *this);
}

void WireLogHub::wake() {
  if (turn_ != nullptr) turn_->woken();
  inner_->wake();
}

void WireLogHub::ignore(const DatagramSource& source) { inner_->ignore(*static_cast<const Source&>(source).inner); }

bool WireLogHub::hasInput(const DatagramSource& source) const {
  return inner_->hasInput(*static_cast<const Source&>(source).inner);
}

int WireLogHub::fdFor(const DatagramSource* source) {
  if (turn_ != nullptr) return -1;
  return inner_->fdFor(source == nullptr ? nullptr : static_cast<const Source*>(source)->inner.get());
}

void WireLogHub::wait(int timeout_ms) {
  if (turn_ == nullptr) {
    inner_->wait(timeout_ms);
    return;
  }
  if (turn_->hasInput()) {
    timeout_ms = 0;
  } else if (const std::int64_t due_ns = turn_->nextDue(); due_ns != 0) {
    const std::int64_t left_ms =
        (due_ns - host_.steady_ns() + kNanosecondsPerMillisecond - 1) / kNanosecondsPerMillisecond;
    timeout_ms = static_cast<int>(std::clamp<std::int64_t>(left_ms, 0, timeout_ms));
  }
  inner_->wait(timeout_ms);
  WireRecord record;
  record.wall_ns = host_.system_ns();
  record.steady_ns = host_.steady_ns();
  log_->add(record);
  clock_.move(record.steady_ns, record.wall_ns);
  for (std::vector<std::uint8_t> input; turn_->takeInput(&input);) {
    record.kind = WireKind::kInput;
    record.payload = input;
    log_->add(record);
    turn_->act(input);
  }
  turn_->runDue();
}

}  // namespace xplane_bridge::core
