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
constexpr std::int32_t kFenceElements = 4;
constexpr std::int32_t kSocketsIndex = kFenceIndex + 8;
constexpr std::int32_t kFenceRate = 1000;
constexpr std::size_t kRateAt = 5;    // of a request: after the label
constexpr int kPassesAfterClose = 2;  // of the link: calls posted by the first are carried out in the second
constexpr std::int64_t kAskAgainNs = 300 * kNanosecondsPerMillisecond;
constexpr int kFramesUntilForgotten = 2;  // by then X-Plane has read that a source wants no more

/// Whether a datagram to X-Plane asks for a stream.
bool asks(ByteView bytes) {
  if (bytes.size() <= kRateAt + 4) return false;
  if (std::memcmp(bytes.data(), "RPOS", 4) == 0) return bytes.data()[kRateAt] != '0';
  std::int32_t rate = 0;
  std::memcpy(&rate, bytes.data() + kRateAt, sizeof rate);
  return std::memcmp(bytes.data(), "RREF", 4) == 0 && rate > 0;
}

/// What a datagram ends with.
struct Fence {
  std::size_t begin = 0;  ///< [bytes] of the datagram before it
  bool whole = false;     ///< else X-Plane has read a part of what asks for it, or ends it
  LockstepFrame frame;
  std::uint32_t sockets = 0;  ///< of this node to which the frame's fence is sent; 0: to all
};

/// The fence at the end of a datagram; nullopt: there is none.
std::optional<Fence> fenceIn(ByteView bytes) {
  const DecodeResult<RrefView> rref = decodeRref(bytes);
  if (!rref.ok()) return std::nullopt;
  std::array<float, kFenceElements> elements{};
  std::size_t at = rref->size();
  int found = 0;
  Fence fence;
  for (; at > 0; --at) {
    const RrefPair pair = (*rref)[at - 1];
    const std::int32_t element = pair.index - kFenceIndex;
    if (pair.index == kSocketsIndex && pair.value >= 0.0F) {
      fence.sockets = static_cast<std::uint32_t>(pair.value);
      continue;
    }
    if (element < 0 || element >= kFenceElements || !(pair.value >= 0.0F)) break;
    elements[static_cast<std::size_t>(element)] = pair.value;
    ++found;
  }
  if (at == rref->size()) return std::nullopt;
  fence.begin = at == 0 ? 0 : kHeaderSize + at * kRrefPairSize;
  fence.whole = found == kFenceElements;
  LockstepFrame& frame = fence.frame;
  frame.number = static_cast<std::uint32_t>(elements[0]);
  frame.sim_ns = static_cast<std::int64_t>(elements[1]) * kNanosecondsPerSecond +
                 static_cast<std::int64_t>(elements[2]) * kNanosecondsPerMillisecond / 1000;
  frame.picture = static_cast<std::uint32_t>(elements[3]);
  return fence;
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

  // X-Plane may fly a frame between any two of these requests: a source it counts in the group has the whole fence.

  /// `group`: port of the source that gets every fence; this one does with what else it gets.
  void join(std::uint16_t group) {
    requestElements(kFenceRate);
    request(kFenceGroupDataref, group, kFenceRate, kSocketsIndex);
  }
  void leave(std::uint16_t group) {
    request(kFenceGroupDataref, group, 0, kSocketsIndex);
    requestElements(0);
  }

 private:
  void requestElements(std::int32_t rate_hz) {
    for (std::int32_t element = 0; element < kFenceElements; ++element) {
      request(kFenceDataref, element, rate_hz, kFenceIndex + element);
    }
  }
  void request(const char* dataref, std::int32_t element, std::int32_t rate_hz, std::int32_t index) {
    std::array<std::uint8_t, kRrefRequestSize> message;
    const std::string path = std::string(dataref) + "[" + std::to_string(element) + "]";
    if (const EncodeResult size = encodeRref(message, path, rate_hz, index)) {
      inner->sendTo({message.data(), *size}, peer);
    }
  }

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
  std::uint32_t sockets = 0;  ///< as the newest fence says
};

LockstepHub::LockstepHub(std::unique_ptr<DatagramHub> inner, LockstepClock clock, Clock host, LockstepHooks hooks)
    : inner_(std::move(inner)),
      clock_(std::move(clock)),
      host_(std::move(host)),
      hooks_(std::move(hooks)),
      buffer_(1U << 16),
      fd_(inner_->fdFor(nullptr)) {}

LockstepHub::~LockstepHub() = default;

std::shared_ptr<DatagramSource> LockstepHub::open(const std::string& name, const UdpSocketOptions& options) {
  auto source = std::make_shared<Source>(this, inner_->open(name, options));
  const std::lock_guard<std::mutex> lock(mutex_);
  sources_.push_back(source);
  return source;
}

void LockstepHub::ignore(const DatagramSource& source) {
  const std::vector<std::shared_ptr<Source>> all = sources();
  for (const std::shared_ptr<Source>& each : all) {
    if (each.get() != &source) continue;
    if (listened_to_.lock() == each) listenTo(nullptr);
    const std::lock_guard<std::mutex> lock(mutex_);
    each->ignored = true;
    if (std::exchange(each->fenced, false)) {
      const std::uint16_t left = group_;
      if (each->inner->localPort() == group_) gatherBehindAnother(all);
      each->leave(left);
    }
    if (clock_.phase() == LockstepClock::Phase::kReleased) {
      inner_->ignore(*each->inner);
    } else {
      retired_.push_back({each, 0});  // a frame that is under way counts it
    }
  }
}

bool LockstepHub::hasInput(const DatagramSource& source) const {
  return !static_cast<const Source&>(source).handed_out.empty();
}

bool LockstepHub::busy() const {
  const bool goes_on = stage_ == Stage::kHandling || stage_ == Stage::kClosing;
  return goes_on && clock_.phase() != LockstepClock::Phase::kReleased;
}

/// Who waits by fd() is to be woken by what this one gets; null: by anything.
void LockstepHub::listenTo(const std::shared_ptr<Source>& source) {
  listened_to_ = source;
  inner_->fdFor(source == nullptr ? nullptr : source->inner.get());
}

std::vector<std::shared_ptr<LockstepHub::Source>> LockstepHub::sources() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<std::shared_ptr<Source>> out;
  out.reserve(sources_.size());
  for (const std::weak_ptr<Source>& weak : sources_) {
    if (auto source = weak.lock()) out.push_back(std::move(source));
  }
  return out;
}

/// The one that got every fence ends: another does from now on.
void LockstepHub::gatherBehindAnother(const std::vector<std::shared_ptr<Source>>& all) {
  group_ = 0;
  for (const std::shared_ptr<Source>& each : all) {
    if (each->fenced) askForFence(each.get());
  }
}

void LockstepHub::askForFence(Source* source) {
  if (group_ == 0) group_ = source->inner->localPort();
  source->join(group_);
  asked_ns_ = host_.steady_ns();
}

/// Requests may be lost as long as X-Plane is not in lock-step yet, or not there.
void LockstepHub::askAgain() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (host_.steady_ns() - asked_ns_ < kAskAgainNs) return;
  for (const std::shared_ptr<Source>& source : open_) {
    const bool late = !source->seen || (stage_ == Stage::kCollecting && source->newest.number <= frame_.number);
    if (source->fenced && late) askForFence(source.get());
  }
}

void LockstepHub::take(Source* source) {
  std::uint16_t peer_port = 0;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    peer_port = source->peer.port;
  }
  Received received;
  while (source->inner->receive(buffer_, &received) == ReceiveStatus::kReceived) {
    ByteView bytes(buffer_.data(), std::min(received.size, buffer_.size()));
    // Another program's is data, which the link drops. (A computer of many addresses may answer from any of them.)
    const std::optional<Fence> fence = received.from.port == peer_port ? fenceIn(bytes) : std::nullopt;
    if (fence) {
      bytes = {buffer_.data(), fence->begin};
      if (fence->whole && source->newest.number != fence->frame.number) {
        // Of frame 0, which was not handed out in time; the first frame that flies brings all of it again.
        source->waiting.erase(source->waiting.begin(),
                              source->waiting.begin() + static_cast<std::ptrdiff_t>(source->ended));
      }
    }
    if (bytes.size() > 0) source->waiting.push_back({{bytes.data(), bytes.data() + bytes.size()}, received});
    if (fence && fence->whole) {
      source->seen = true;
      source->newest = fence->frame;
      source->sockets = fence->sockets;
      source->ended = source->waiting.size();
      // Nothing more of this frame comes: asking for it would take as long as reading the datagram did.
      const bool flying = clock_.phase() == LockstepClock::Phase::kFlying;
      if (flying && source->newest.number > frame_.number) return;
    }
  }
}

void LockstepHub::collect(int timeout_ms) {
  inner_->wait(timeout_ms);
  takeAll();
}

/// One source whose fence is missing: the one that gets every fence, as the last, else the same each time while that
/// is the last to come.
std::shared_ptr<LockstepHub::Source> LockstepHub::missing() {
  std::shared_ptr<Source> awaited;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const bool counted =
        std::any_of(open_.begin(), open_.end(), [](const auto& source) { return source->sockets > 0; });
    for (const std::shared_ptr<Source>& source : open_) {
      const bool missing = source->fenced && (!source->seen || source->newest.number != frame_.number + 1);
      const bool last = counted ? source->inner->localPort() == group_ : source.get() == awaited_;
      if (missing && (!awaited || last)) awaited = source;
    }
  }
  awaited_ = awaited.get();
  return awaited;
}

/// Waits for one source, so that a frame wakes the thread once and not with each of its datagrams.
void LockstepHub::collectFrame(int timeout_ms) {
  if (const std::shared_ptr<Source> awaited = missing()) {
    inner_->waitFor(*awaited->inner, timeout_ms);
  } else {
    inner_->wait(timeout_ms);
  }
  takeAll();
}

void LockstepHub::takeAll() {
  for (const std::shared_ptr<Source>& source : open_) {
    if (inner_->hasInput(*source->inner)) take(source.get());
  }
}

/// Whether all sources show a frame beyond the last one, the same; of a simulator that counts them, so many.
bool LockstepHub::frameIsComplete() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::uint32_t shown = 0;
  std::uint32_t shown_of_group = 0;
  std::uint32_t counted = 0;
  bool missing = false;
  for (const std::shared_ptr<Source>& source : open_) {
    if (source->seen && source->newest.number == frame_.number + 1) {
      ++shown;
      if (source->sockets > 0) ++shown_of_group;
      counted = std::max(counted, source->sockets);
    } else if (source->fenced) {
      missing = true;
    }
  }
  return counted > 0 ? shown_of_group >= counted : shown > 0 && !missing;
}

/// What was ignored a few frames ago: X-Plane sends nothing there any more.
void LockstepHub::forgetRetired() {
  std::vector<Retired> kept;
  for (Retired& each : retired_) {
    if (++each.frames < kFramesUntilForgotten) {
      kept.push_back(std::move(each));
    } else {
      inner_->ignore(*each.source->inner);
    }
  }
  retired_ = std::move(kept);
}

void LockstepHub::handOut(bool whole_frame) {
  for (const std::shared_ptr<Source>& source : open_) {
    bool fenced = false;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      fenced = source->fenced && source->seen;
      if (source->ignored) source->waiting.clear();
    }
    // In flight, what no fence stands behind belongs to no frame.
    std::size_t count = fenced ? std::min(source->ended, source->waiting.size()) : source->waiting.size();
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
  return std::any_of(open_.begin(), open_.end(),
                     [](const auto& source) { return !source->ignored && !source->handed_out.empty(); });
}

void LockstepHub::wait(int timeout_ms) {
  open_ = sources();
  if (listened_to_.expired()) listenTo(nullptr);
  if (!anythingHandedOut()) goOn(timeout_ms);
  open_.clear();
}

void LockstepHub::goOn(int timeout_ms) {
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

void LockstepHub::goToNewestFrame() {
  for (const std::shared_ptr<Source>& source : open_) {
    if (source->seen && source->newest.number > frame_.number) frame_ = source->newest;
  }
}

void LockstepHub::waitHeld(int timeout_ms) {
  clock_.tick();
  if (stage_ == Stage::kClosing) {
    if (--passes_ > 0) return;
    stage_ = Stage::kCollecting;
    hooks_.end(frame_);
    return;  // frame 0 is answered again and again: the next time when something comes, or time has passed
  }
  collect(std::min(timeout_ms, kLongestWaitMs));
  askAgain();
  if (frameIsComplete() && frame_.number == 0) {
    // The simulator flies: this frame is the first.
    goToNewestFrame();
    handOutFrame();
    return;
  }
  bool flies = false;
  for (const std::shared_ptr<Source>& source : open_) flies = flies || (source->seen && source->newest.number > 0);
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
  listenTo(nullptr);
  if (released_frame_ < frame_.number) {
    released_frame_ = frame_.number;
    hooks_.end(frame_);
  }
  collect(std::min(timeout_ms, kLongestWaitMs));
  goToNewestFrame();
  handOut(false);
}

void LockstepHub::handOutFrame() {
  clock_.move(frame_.sim_ns);
  hooks_.begin(frame_);
  handOut(true);
  stage_ = Stage::kHandling;
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
      if (frameIsComplete()) return true;
      // Who waits by fd() has published its answer, which is not to wait until the next frame is looked for in vain.
      listenTo(missing());
      return false;
    case Stage::kCollecting:
      break;
  }
  if (!frameIsComplete()) collectFrame(timeout_ms);
  if (!frameIsComplete()) {
    listenTo(missing());
    askAgain();
    return false;
  }
  goToNewestFrame();
  forgetRetired();
  handOutFrame();
  return false;
}

}  // namespace xplane_bridge::core
