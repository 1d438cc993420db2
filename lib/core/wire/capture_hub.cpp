#include "xplane_bridge/core/wire/capture_hub.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <deque>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <thread>
#include <utility>

#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {
namespace {

constexpr std::int64_t kEarlyNs = 4 * kNanosecondsPerSecond;  // for the node, before the first datagram
constexpr std::int64_t kEarlyAnswerNs = 50 * kNanosecondsPerMillisecond;
constexpr std::size_t kLabelSize = 5;
constexpr std::size_t kPathAt = kLabelSize + 2 * sizeof(std::int32_t);  // of a request
constexpr std::size_t kPairSize = 2 * sizeof(std::int32_t);             // number or index, and value
constexpr const char* kAnswering = "control";  // the source whose answers say that X-Plane is there
constexpr const char* kPaused = "sim/time/paused";
constexpr std::chrono::milliseconds kPause{1};

void append(std::vector<std::uint8_t>* out, std::int32_t index, const std::uint8_t* value) {
  const std::size_t at = out->size();
  out->resize(at + kPairSize);
  storeLittleEndian(index, out->data() + at);
  std::memcpy(out->data() + at + sizeof(index), value, sizeof(float));
}

std::vector<std::uint8_t> emptyAnswer() { return {'R', 'R', 'E', 'F', ','}; }

}  // namespace

bool isCapture(const std::string& file) {
  const std::string magic = kCaptureMagic;
  std::string start(magic.size(), '\0');
  std::ifstream in(file, std::ios::binary);
  return in.read(start.data(), static_cast<std::streamsize>(start.size())) && start == magic;
}

class CaptureHub::Source : public DatagramSource {
 public:
  Source(CaptureHub* hub, std::string name_in, std::uint16_t port) : name(std::move(name_in)), hub_(hub), port_(port) {}

  ReceiveStatus receive(ByteSpan buffer, Received* received) override {
    const std::lock_guard<std::mutex> lock(hub_->mutex_);
    if (waiting.empty()) return ReceiveStatus::kNothing;
    const Arrival& next = waiting.front();
    received->size = std::min(buffer.size(), next.bytes.size());
    std::memcpy(buffer.data(), next.bytes.data(), received->size);
    received->from = next.from;
    received->kernel_stamp_ns = next.kernel_ns;
    waiting.pop_front();
    ++counters_.received;
    ++hub_->progress_->datagrams;
    return ReceiveStatus::kReceived;
  }
  bool sendTo(ByteView bytes, const Endpoint& /*to*/, int* /*error_number*/) override {
    const std::lock_guard<std::mutex> lock(hub_->mutex_);
    ++hub_->progress_->sent;
    if (bytes.size() <= kPathAt || std::memcmp(bytes.data(), "RREF", kLabelSize) != 0) return true;
    const auto rate = loadLittleEndian<std::int32_t>(bytes.data() + kLabelSize);
    const auto index = loadLittleEndian<std::int32_t>(bytes.data() + kLabelSize + sizeof rate);
    const std::uint8_t* const path = bytes.data() + kPathAt;
    const std::string asked(path, std::find(path, bytes.end(), std::uint8_t{0}));
    if (rate > 0) {
      indices[asked] = index;
    } else {
      // Another request may have taken the path over under another number.
      const auto found =
          std::find_if(indices.begin(), indices.end(), [index](const auto& each) { return each.second == index; });
      if (found != indices.end()) indices.erase(found);
    }
    client = bestClient();
    return true;
  }
  std::vector<std::string> joinOnAllInterfaces(std::uint32_t /*group*/) override { return {}; }
  std::uint16_t localPort() const override { return port_; }
  int receiveBuffer() const override { return UdpSocketOptions().receive_buffer; }
  UdpCounters counters() const override { return counters_; }

  const std::string name;
  // Guarded by the hub's mutex.
  std::map<std::string, std::int32_t> indices;  ///< of the datarefs asked for
  std::uint16_t client = 0;                     ///< of the capture, that serves this source
  std::deque<Arrival> waiting;
  bool ignored = false;

 private:
  std::uint16_t bestClient() const {
    std::uint16_t best = 0;
    std::size_t most = 0;
    for (const auto& [number, paths] : hub_->clients_) {
      const auto& theirs = paths;
      const auto common = static_cast<std::size_t>(std::count_if(
          indices.begin(), indices.end(), [&theirs](const auto& each) { return theirs.count(each.first) > 0; }));
      if (common > most) {
        most = common;
        best = number;
      }
    }
    return best;
  }

  CaptureHub* hub_;
  const std::uint16_t port_;
  UdpCounters counters_;  // of the thread that receives
};

CaptureHub::CaptureHub(const std::string& file, WireClock clock, WireTurn* turn,
                       std::shared_ptr<ReplayProgress> progress)
    : clock_(std::move(clock)), turn_(turn), progress_(std::move(progress)) {
  std::ifstream in(file, std::ios::binary);
  bytes_.assign(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  next_ = std::string(kCaptureMagic).size();
  if (!isCapture(file)) throw std::runtime_error("'" + file + "' (wire_replay) holds no capture");
  readNames();
  clock_.move(start_ns_ - kEarlyNs, start_ns_ - kEarlyNs + wall_minus_steady_ns_);
}

CaptureHub::~CaptureHub() = default;

void CaptureHub::readNames() {
  WireRecord record;
  bool any = false;
  for (std::size_t offset = next_; readRecord(bytes_, &offset, &record);) {
    if (record.kind == WireKind::kNamed) {
      const std::string path(record.payload.begin(), record.payload.end());
      names_[record.count] = path;
      clients_[record.source][path] = record.count;
      continue;
    }
    if (!any) {
      start_ns_ = record.steady_ns;
      wall_minus_steady_ns_ = record.wall_ns - record.steady_ns;
      any = true;
    }
    if (record.kind != WireKind::kValues) continue;
    if (!peer_.valid()) peer_ = record.peer;
    for (std::size_t at = 0; at + kPairSize <= record.payload.size(); at += kPairSize) {
      const auto name = names_.find(loadLittleEndian<std::uint32_t>(record.payload.data() + at));
      if (name == names_.end()) continue;
      first_values_.emplace(name->second, loadLittleEndian<float>(record.payload.data() + at + sizeof(std::uint32_t)));
    }
  }
}

std::shared_ptr<DatagramSource> CaptureHub::open(const std::string& name, const UdpSocketOptions& options) {
  const std::lock_guard<std::mutex> lock(mutex_);
  auto source = std::make_shared<Source>(this, name, options.bind_port);
  sources_.push_back(source);
  return source;
}

void CaptureHub::ignore(const DatagramSource& source) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const std::shared_ptr<Source>& each : sources()) {
    if (each.get() == &source) each->ignored = true;
  }
}

bool CaptureHub::hasInput(const DatagramSource& source) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto& ours = static_cast<const Source&>(source);
  return !ours.ignored && !ours.waiting.empty();
}

std::vector<std::shared_ptr<CaptureHub::Source>> CaptureHub::sources() const {
  std::vector<std::shared_ptr<Source>> out;
  for (const std::weak_ptr<Source>& weak : sources_) {
    if (auto source = weak.lock()) out.push_back(std::move(source));
  }
  return out;
}

void CaptureHub::moveTo(std::int64_t steady_ns) {
  clock_.move(std::max(steady_ns, clock_.steady()), std::max(steady_ns, clock_.steady()) + wall_minus_steady_ns_);
}

void CaptureHub::wait(int timeout_ms) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::int64_t end_ns = clock_.steady() + std::max(1, timeout_ms) * kNanosecondsPerMillisecond;
    if (const std::int64_t due_ns = turn_->nextDue(); due_ns != 0) {
      end_ns = std::clamp(due_ns, clock_.steady(), end_ns);
    }
    WireRecord record;
    std::size_t after = next_;
    while (readRecord(bytes_, &after, &record) && record.kind == WireKind::kNamed) next_ = after;
    after = next_;
    if (!readRecord(bytes_, &after, &record)) {
      if (!progress_->ended.exchange(true)) turn_->end();
      moveTo(end_ns);
      std::this_thread::sleep_for(kPause);
    } else if (record.steady_ns > end_ns) {
      moveTo(end_ns);
      if (clock_.steady() < start_ns_ && clock_.steady() - answered_ns_ >= kEarlyAnswerNs) answerEarly();
    } else {
      moveTo(record.steady_ns);
      deliver(record);
      next_ = after;
    }
  }
  turn_->runDue();
}

/// What the capture begins with, so that the node takes X-Plane for being there.
void CaptureHub::answerEarly() {
  answered_ns_ = clock_.steady();
  for (const std::shared_ptr<Source>& source : sources()) {
    if (source->name != kAnswering || source->indices.empty() || !peer_.valid()) continue;
    std::vector<std::uint8_t> answer = emptyAnswer();
    for (const auto& [path, index] : source->indices) {
      const auto value = first_values_.find(path);
      // A capture without this one: of a flight that is not paused.
      if (value == first_values_.end() && path != kPaused) continue;
      std::array<std::uint8_t, sizeof(float)> bytes;
      storeLittleEndian(value == first_values_.end() ? 0.0F : value->second, bytes.data());
      append(&answer, index, bytes.data());
    }
    if (answer.size() > kLabelSize) source->waiting.push_back({answer, peer_, clock_.wall()});
  }
}

void CaptureHub::deliver(const WireRecord& record) {
  if (record.kind == WireKind::kReceived) {
    // Data Output, positions and beacons have no numbers of the asker's; the first of the payload's words says whose.
    const std::uint8_t* const zero = std::find(record.payload.begin(), record.payload.end(), std::uint8_t{0});
    const std::string name(record.payload.begin(), zero);
    for (const std::shared_ptr<Source>& source : sources()) {
      if (source->name == name && zero != record.payload.end()) {
        source->waiting.push_back({{zero + 1, record.payload.end()}, record.peer, record.kernel_ns});
      }
    }
    return;
  }
  for (const std::shared_ptr<Source>& source : sources()) {
    if (source->client != record.source || source->ignored) continue;
    std::vector<std::uint8_t> answer = emptyAnswer();
    for (std::size_t at = 0; at + kPairSize <= record.payload.size(); at += kPairSize) {
      const auto name = names_.find(loadLittleEndian<std::uint32_t>(record.payload.data() + at));
      if (name == names_.end()) continue;
      const auto index = source->indices.find(name->second);
      if (index != source->indices.end()) append(&answer, index->second, record.payload.data() + at + 4);
    }
    if (answer.size() > kLabelSize) source->waiting.push_back({answer, record.peer, record.kernel_ns});
  }
}

}  // namespace xplane_bridge::core
