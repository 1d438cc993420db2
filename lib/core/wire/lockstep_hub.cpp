#include "xplane_bridge/core/wire/lockstep_hub.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <deque>
#include <optional>
#include <string>
#include <utility>

#include "xplane_bridge/core/base/units.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {
namespace {

constexpr std::int32_t kFenceIndex = 0x4C530000;  // far from all indices that are used here
constexpr std::int32_t kFenceElements = 3;
constexpr std::int32_t kFenceRate = 1000;
constexpr std::size_t kRateAt = 5;    // of a request: after the label
constexpr int kLongestWaitMs = 5;     // while the clock goes at the host's pace
constexpr int kPassesAfterClose = 2;  // of the link: calls posted by the first are carried out in the second
constexpr std::int64_t kAskAgainNs = 300 * kNanosecondsPerMillisecond;

/// Whether a datagram to X-Plane asks for a stream.
bool asks(ByteView bytes) {
  if (bytes.size() <= kRateAt + 4) return false;
  if (std::memcmp(bytes.data(), "RPOS", 4) == 0) return bytes.data()[kRateAt] != '0';
  std::int32_t rate = 0;
  std::memcpy(&rate, bytes.data() + kRateAt, sizeof rate);
  return std::memcmp(bytes.data(), "RREF", 4) == 0 && rate > 0;
}

/// The frame that a datagram ends; nullopt: it is no fence.
std::optional<LockstepFrame> fenceIn(ByteView bytes) {
  const DecodeResult<RrefView> rref = decodeRref(bytes);
  if (!rref.ok() || rref->size() != kFenceElements) return std::nullopt;
  std::array<float, kFenceElements> elements{};
  for (std::size_t i = 0; i < rref->size(); ++i) {
    const RrefPair pair = (*rref)[i];
    const std::int32_t element = pair.index - kFenceIndex;
    if (element < 0 || element >= kFenceElements || !(pair.value >= 0.0F)) return std::nullopt;
    elements[static_cast<std::size_t>(element)] = pair.value;
  }
  LockstepFrame frame;
  frame.number = static_cast<std::uint32_t>(elements[0]);
  frame.sim_ns = static_cast<std::int64_t>(elements[1]) * kNanosecondsPerSecond +
                 static_cast<std::int64_t>(elements[2]) * kNanosecondsPerMillisecond / 1000;
  return frame;
}

}  // namespace

/// A source of the hub below, with what of it waits for a fence.
class LockstepHub::Source : public DatagramSource {
 public:
  struct Datagram {
    std::vector<std::uint8_t> bytes;
    Received received;
  };

  Source(LockstepHub* hub, std::shared_ptr<DatagramSource> below) : hub_(hub), inner(std::move(below)) {}

  ReceiveStatus receive(ByteSpan buffer, Received* received) override {
    if (handed_out.empty()) return ReceiveStatus::kNothing;
    const Datagram& next = handed_out.front();
    *received = next.received;
    received->size = std::min(buffer.size(), next.bytes.size());
    received->kernel_stamp_ns = 0;  // of the host, which says nothing about simulated time
    std::memcpy(buffer.data(), next.bytes.data(), received->size);
    handed_out.pop_front();
    return ReceiveStatus::kReceived;
  }
  bool sendTo(ByteView bytes, const Endpoint& to, int* error_number) override {
    if (!inner->sendTo(bytes, to, error_number)) return false;
    if (asks(bytes)) {
      const std::lock_guard<std::mutex> lock(hub_->mutex_);
      if (!fenced) {
        fenced = true;
        peer = to;
        hub_->askForFence(this);
      }
    }
    return true;
  }
  std::vector<std::string> joinOnAllInterfaces(std::uint32_t group) override {
    return inner->joinOnAllInterfaces(group);
  }
  std::uint16_t localPort() const override { return inner->localPort(); }
  int receiveBuffer() const override { return inner->receiveBuffer(); }
  UdpCounters counters() const override { return inner->counters(); }

  void request(std::int32_t rate_hz) {
    for (std::int32_t element = 0; element < kFenceElements; ++element) {
      std::array<std::uint8_t, kRrefRequestSize> message;
      const std::string path = std::string(kFenceDataref) + "[" + std::to_string(element) + "]";
      if (const EncodeResult size = encodeRref(message, path, rate_hz, kFenceIndex + element)) {
        inner->sendTo({message.data(), *size}, peer);
      }
    }
  }

 private:
  LockstepHub* hub_;

 public:
  const std::shared_ptr<DatagramSource> inner;
  // Guarded by the hub's mutex.
  bool fenced = false;   ///< asked for; frames are complete with its fence only
  bool ignored = false;  ///< nothing of it is wanted any more
  Endpoint peer;
  // Of the thread that receives.
  std::deque<Datagram> waiting;     ///< for their fence
  std::deque<Datagram> handed_out;  ///< to be received
  std::size_t ended = 0;            ///< of `waiting`: up to the newest fence
  bool seen = false;                ///< a fence has come
  LockstepFrame newest;
};

LockstepHub::LockstepHub(std::unique_ptr<DatagramHub> inner, LockstepClock clock, Clock host, LockstepHooks hooks)
    : inner_(std::move(inner)),
      clock_(std::move(clock)),
      host_(std::move(host)),
      hooks_(std::move(hooks)),
      buffer_(1U << 16) {}

LockstepHub::~LockstepHub() = default;

std::shared_ptr<DatagramSource> LockstepHub::open(const std::string& name, const UdpSocketOptions& options) {
  auto source = std::make_shared<Source>(this, inner_->open(name, options));
  const std::lock_guard<std::mutex> lock(mutex_);
  sources_.push_back(source);
  return source;
}

void LockstepHub::ignore(const DatagramSource& source) {
  for (const std::shared_ptr<Source>& each : sources()) {
    if (each.get() != &source) continue;
    inner_->ignore(*each->inner);
    const std::lock_guard<std::mutex> lock(mutex_);
    each->ignored = true;
    if (std::exchange(each->fenced, false)) each->request(0);
  }
}

bool LockstepHub::hasInput(const DatagramSource& source) const {
  return !static_cast<const Source&>(source).handed_out.empty();
}

std::vector<std::shared_ptr<LockstepHub::Source>> LockstepHub::sources() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<std::shared_ptr<Source>> out;
  for (const std::weak_ptr<Source>& weak : sources_) {
    if (auto source = weak.lock()) out.push_back(std::move(source));
  }
  return out;
}

void LockstepHub::askForFence(Source* source) {
  source->request(kFenceRate);
  asked_ns_ = host_.steady_ns();
}

/// Requests may be lost as long as X-Plane is not in lock-step yet, or not there.
void LockstepHub::askAgain() {
  const std::vector<std::shared_ptr<Source>> all = sources();
  const std::lock_guard<std::mutex> lock(mutex_);
  if (host_.steady_ns() - asked_ns_ < kAskAgainNs) return;
  for (const std::shared_ptr<Source>& source : all) {
    const bool late = !source->seen || (stage_ == Stage::kCollecting && source->newest.number <= frame_.number);
    if (source->fenced && late) askForFence(source.get());
  }
}

void LockstepHub::take(Source* source) {
  Received received;
  while (source->inner->receive(buffer_, &received) == ReceiveStatus::kReceived) {
    const ByteView bytes(buffer_.data(), std::min(received.size, buffer_.size()));
    if (const auto frame = fenceIn(bytes)) {
      if (source->newest.number != frame->number) {
        // Of frame 0, which was not handed out in time; the first frame that flies brings all of it again.
        source->waiting.erase(source->waiting.begin(),
                              source->waiting.begin() + static_cast<std::ptrdiff_t>(source->ended));
      }
      source->seen = true;
      source->newest = *frame;
      source->ended = source->waiting.size();
      continue;
    }
    source->waiting.push_back({{bytes.data(), bytes.data() + bytes.size()}, received});
  }
}

void LockstepHub::collect(int timeout_ms) {
  inner_->wait(timeout_ms);
  takeAll();
}

/// Waits for one source whose fence is missing: the same each time while that is the last to come, so that a frame
/// wakes the thread once and not with each of its datagrams.
void LockstepHub::collectFrame(int timeout_ms) {
  const std::vector<std::shared_ptr<Source>> all = sources();
  std::shared_ptr<Source> awaited;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const std::shared_ptr<Source>& source : all) {
      const bool missing = source->fenced && (!source->seen || source->newest.number != frame_.number + 1);
      if (missing && (!awaited || source.get() == awaited_)) awaited = source;
    }
  }
  awaited_ = awaited.get();
  if (awaited) {
    inner_->waitFor(*awaited->inner, timeout_ms);
  } else {
    inner_->wait(timeout_ms);
  }
  takeAll();
}

void LockstepHub::takeAll() {
  for (const std::shared_ptr<Source>& source : sources()) {
    if (inner_->hasInput(*source->inner)) take(source.get());
  }
}

/// Whether all sources show a frame beyond the last one, the same.
bool LockstepHub::frameIsComplete() const {
  const std::vector<std::shared_ptr<Source>> all = sources();
  const std::lock_guard<std::mutex> lock(mutex_);
  bool any = false;
  for (const std::shared_ptr<Source>& source : all) {
    if (!source->fenced) continue;
    if (!source->seen || source->newest.number != frame_.number + 1) return false;
    any = true;
  }
  return any;
}

void LockstepHub::handOut(bool whole_frame) {
  for (const std::shared_ptr<Source>& source : sources()) {
    bool fenced = false;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      fenced = source->fenced && source->seen;
    }
    // In flight, what no fence stands behind belongs to no frame.
    std::size_t count = fenced ? source->ended : source->waiting.size();
    if (whole_frame && !fenced) {
      source->waiting.clear();
      count = 0;
    }
    for (; count > 0; --count) {
      source->handed_out.push_back(std::move(source->waiting.front()));
      source->waiting.pop_front();
    }
    source->ended = 0;
  }
}

bool LockstepHub::anythingHandedOut() const {
  const std::vector<std::shared_ptr<Source>> all = sources();
  return std::any_of(all.begin(), all.end(),
                     [](const auto& source) { return !source->ignored && !source->handed_out.empty(); });
}

void LockstepHub::wait(int timeout_ms) {
  if (anythingHandedOut()) return;
  switch (clock_.phase()) {
    case LockstepClock::Phase::kHeld:
      waitHeld(timeout_ms);
      return;
    case LockstepClock::Phase::kReleased:
      waitReleased(timeout_ms);
      return;
    case LockstepClock::Phase::kFlying:
      while (advance(timeout_ms)) {
      }
      return;
  }
}

void LockstepHub::waitHeld(int timeout_ms) {
  clock_.tick();
  if (stage_ == Stage::kClosing) {
    if (--passes_ > 0) return;
    stage_ = Stage::kCollecting;
    hooks_.end(frame_);
  }
  collect(std::min(timeout_ms, kLongestWaitMs));
  askAgain();
  if (frameIsComplete() && frame_.number == 0) {
    // The simulator flies: this frame is the first.
    for (const std::shared_ptr<Source>& source : sources()) frame_ = source->seen ? source->newest : frame_;
    clock_.move(frame_.sim_ns);
    hooks_.begin(frame_);
    handOut(true);
    stage_ = Stage::kHandling;
    return;
  }
  bool flies = false;
  for (const std::shared_ptr<Source>& source : sources()) flies = flies || (source->seen && source->newest.number > 0);
  if (flies) return;
  handOut(false);
  hooks_.close(frame_);
  if (hooks_.ready(frame_)) {
    stage_ = Stage::kClosing;
    passes_ = kPassesAfterClose;
  }
}

void LockstepHub::waitReleased(int timeout_ms) {
  clock_.tick();
  if (released_frame_ < frame_.number) {
    released_frame_ = frame_.number;
    hooks_.end(frame_);
  }
  collect(std::min(timeout_ms, kLongestWaitMs));
  for (const std::shared_ptr<Source>& source : sources()) {
    if (source->seen && source->newest.number > frame_.number) frame_ = source->newest;
  }
  handOut(false);
}

/// One stage on. Returns whether there is more to do before the caller has its turn.
bool LockstepHub::advance(int timeout_ms) {
  switch (stage_) {
    case Stage::kHandling:
      stage_ = Stage::kAnswering;
      return true;
    case Stage::kAnswering:
      if (!hooks_.ready(frame_)) {
        collect(timeout_ms);
        return hooks_.ready(frame_) && clock_.phase() == LockstepClock::Phase::kFlying;
      }
      hooks_.close(frame_);
      stage_ = Stage::kClosing;
      passes_ = kPassesAfterClose;
      return false;
    case Stage::kClosing:
      if (--passes_ > 0) return false;
      stage_ = Stage::kCollecting;
      hooks_.end(frame_);
      return true;
    case Stage::kCollecting:
      break;
  }
  if (!frameIsComplete()) collectFrame(timeout_ms);
  if (!frameIsComplete()) {
    askAgain();
    return false;
  }
  for (const std::shared_ptr<Source>& source : sources()) {
    if (source->seen && source->newest.number > frame_.number) frame_ = source->newest;
  }
  clock_.move(frame_.sim_ns);
  hooks_.begin(frame_);
  handOut(true);
  stage_ = Stage::kHandling;
  return false;
}

}  // namespace xplane_bridge::core
