#include "xplane_bridge/core/wire/replay_hub.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <thread>
#include <utility>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

constexpr std::chrono::milliseconds kPause{1};  // of the host, while time goes on after the last record

bool sameBytes(ByteView a, ByteView b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size()) == 0);
}

}  // namespace

class ReplayHub::Source : public DatagramSource {
 public:
  Source(ReplayHub* hub, std::uint16_t number_in, std::uint16_t port) : number(number_in), hub_(hub), port_(port) {}

  ReceiveStatus receive(ByteSpan buffer, Received* received) override {
    if (!hub_->takeReceived(number, buffer, received, &counters_.dropped)) return ReceiveStatus::kNothing;
    ++counters_.received;
    counters_.received_bytes += received->size;
    return ReceiveStatus::kReceived;
  }
  bool sendTo(ByteView bytes, const Endpoint& to, int* error_number) override {
    return hub_->takeSent(number, bytes, to, error_number);
  }
  std::vector<std::string> joinOnAllInterfaces(std::uint32_t /*group*/) override { return {}; }
  std::uint16_t localPort() const override { return port_; }
  int receiveBuffer() const override { return UdpSocketOptions().receive_buffer; }
  UdpCounters counters() const override {
    hub_->takeRefused(number, &counters_.refused);
    return counters_;
  }

  const std::uint16_t number;

 private:
  ReplayHub* hub_;
  const std::uint16_t port_;
  mutable UdpCounters counters_;  // of the thread that receives
};

ReplayHub::ReplayHub(const std::string& file, WireClock clock, WireTurn* turn, std::shared_ptr<ReplayProgress> progress,
                     LogFunction log)
    : clock_(std::move(clock)), turn_(turn), progress_(std::move(progress)), log_(std::move(log)) {
  std::ifstream in(file, std::ios::binary);
  bytes_.assign(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  const std::string magic = kReplayMagic;
  if (bytes_.size() < magic.size() || !std::equal(magic.begin(), magic.end(), bytes_.begin())) {
    throw std::runtime_error("'" + file + "' (wire_replay) " + (in ? "holds" : "cannot be read, or holds") +
                             " no records; scripts/wire_replay makes them of a wire log and starts the node with them");
  }
  next_ = magic.size();
  WireRecord record;
  for (std::size_t offset = next_; readRecord(bytes_, &offset, &record);) {
    if (record.kind == WireKind::kOpened) {
      opened_.push_back({std::string(record.payload.begin(), record.payload.end()), record.peer.port, false, false});
    }
  }
  for (std::size_t offset = next_; readRecord(bytes_, &offset, &record);) {
    if (record.kind == WireKind::kWaited) {
      clock_.move(record.steady_ns, record.wall_ns);
      next_ = offset;
      break;
    }
  }
}

ReplayHub::~ReplayHub() = default;

std::shared_ptr<DatagramSource> ReplayHub::open(const std::string& name, const UdpSocketOptions& options) {
  const std::lock_guard<std::mutex> lock(mutex_);
  auto found = std::find_if(opened_.begin(), opened_.end(),
                            [&name](const Opened& each) { return !each.claimed && each.name == name; });
  if (found == opened_.end()) {
    // One more than recorded, as a new list of datarefs where the log's first part is gone: it hears what the newest
    // does.
    const auto newest =
        std::find_if(opened_.rbegin(), opened_.rend(), [&name](const Opened& each) { return each.name == name; });
    found = newest != opened_.rend() ? std::prev(newest.base())
                                     : opened_.insert(opened_.end(), {name, options.bind_port, false, false});
  }
  found->claimed = true;
  return std::make_shared<Source>(this, static_cast<std::uint16_t>(found - opened_.begin()), found->port);
}

void ReplayHub::ignore(const DatagramSource& source) {
  const std::lock_guard<std::mutex> lock(mutex_);
  opened_[static_cast<const Source&>(source).number].ready = false;
}

bool ReplayHub::hasInput(const DatagramSource& source) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return opened_[static_cast<const Source&>(source).number].ready;
}

/// readRecord(), without datagrams for sources that the node has not opened: they would hold up all behind them.
bool ReplayHub::read(std::size_t* offset, WireRecord* record) const {
  while (readRecord(bytes_, offset, record)) {
    const bool taken = record->source < opened_.size() && opened_[record->source].claimed;
    if (record->kind != WireKind::kReceived || taken) return true;
  }
  return false;
}

bool ReplayHub::peek(WireRecord* record, std::size_t* after) const {
  *after = next_;
  return read(after, record) && record->kind != WireKind::kLost;
}

/// Goes to the next record of a kind; what lies before it does not come about any more. False: there is none before the
/// end of the turn.
bool ReplayHub::skipTo(WireKind wanted, WireRecord* record) {
  for (std::size_t after = 0; peek(record, &after); next_ = after) {
    if (record->kind == wanted) return true;
    if (record->kind == WireKind::kWaited) return false;
    if (record->kind == WireKind::kSent) ++progress_->sent_otherwise;
  }
  return false;
}

void ReplayHub::findReady() {
  for (Opened& each : opened_) each.ready = false;
  WireRecord record;
  for (std::size_t offset = next_; read(&offset, &record) && record.kind != WireKind::kWaited;) {
    if (record.kind == WireKind::kReceived) opened_[record.source].ready = true;
  }
}

/// The next input of this turn.
bool ReplayHub::nextInput(std::vector<std::uint8_t>* input) {
  const std::lock_guard<std::mutex> lock(mutex_);
  WireRecord record;
  for (std::size_t offset = next_; read(&offset, &record);) {
    if (record.kind == WireKind::kInput) {
      skipTo(WireKind::kInput, &record);
      next_ = offset;
      input->assign(record.payload.begin(), record.payload.end());
      return true;
    }
    if (record.kind != WireKind::kSent && record.kind != WireKind::kOpened) return false;
  }
  return false;
}

void ReplayHub::wait(int timeout_ms) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    WireRecord record;
    if (!progress_->ended && skipTo(WireKind::kWaited, &record)) {
      std::size_t after = 0;
      peek(&record, &after);
      next_ = after;
      clock_.move(record.steady_ns, record.wall_ns);
      findReady();
    } else {
      goOn(timeout_ms);
    }
  }
  if (!progress_->ended) {
    for (std::vector<std::uint8_t> input; nextInput(&input);) turn_->act(input);
  }
  turn_->runDue();
}

/// After the last record.
void ReplayHub::goOn(int timeout_ms) {
  if (!progress_->ended.exchange(true)) {
    for (Opened& each : opened_) each.ready = false;
    WireRecord record;
    if (std::size_t after = next_; read(&after, &record) && record.kind == WireKind::kLost) {
      log_(LogLevel::kWarn, "the recording has a gap of " + std::to_string(record.count) +
                                " records, which were not written in time: the replay ends there");
    }
    turn_->end();
  }
  const std::int64_t step_ns = std::max(1, timeout_ms) * kNanosecondsPerMillisecond;
  clock_.move(clock_.steady() + step_ns, clock_.wall() + step_ns);
  std::this_thread::sleep_for(kPause);
}

bool ReplayHub::takeReceived(std::uint16_t number, ByteSpan buffer, Received* received, std::uint64_t* dropped) {
  const std::lock_guard<std::mutex> lock(mutex_);
  WireRecord record;
  std::uint64_t passed = 0;
  std::size_t offset = next_;
  while (read(&offset, &record) && (record.kind == WireKind::kOpened || record.kind == WireKind::kSent)) {
    passed += record.kind == WireKind::kSent ? 1U : 0U;
  }
  // What is to be sent first may still be sent, where the next datagram is another source's.
  if (record.kind != WireKind::kReceived || record.source != number || progress_->ended) return false;
  next_ = offset;
  progress_->sent_otherwise += passed;
  received->size = std::min(buffer.size(), record.payload.size());
  std::memcpy(buffer.data(), record.payload.data(), received->size);
  received->from = record.peer;
  received->kernel_stamp_ns = record.kernel_ns;
  *dropped = record.count;
  clock_.move(record.steady_ns, record.wall_ns);
  ++progress_->datagrams;
  return true;
}

bool ReplayHub::takeSent(std::uint16_t number, ByteView bytes, const Endpoint& to, int* error_number) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++progress_->sent;
  WireRecord record;
  std::uint64_t passed = 0;
  for (std::size_t offset = next_; read(&offset, &record);) {
    if (record.kind == WireKind::kSent) {
      if (record.source == number && record.peer == to && sameBytes(record.payload, bytes)) {
        next_ = offset;
        progress_->sent_otherwise += passed;
        if (record.count != 0 && error_number != nullptr) *error_number = static_cast<int>(record.count);
        return record.count == 0;
      }
      ++passed;
    } else if (record.kind != WireKind::kOpened) {
      break;
    }
  }
  ++progress_->sent_otherwise;
  return true;
}

void ReplayHub::takeRefused(std::uint16_t number, std::uint64_t* refused) {
  const std::lock_guard<std::mutex> lock(mutex_);
  WireRecord record;
  std::size_t after = 0;
  if (peek(&record, &after) && record.kind == WireKind::kRefused && record.source == number) {
    *refused = record.count;
    next_ = after;
  }
}

}  // namespace xplane_bridge::core
