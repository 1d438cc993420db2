#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/wire/datagram_source.hpp"

namespace xplane_bridge::core {

using Pairs = std::vector<std::pair<std::int32_t, float>>;

inline std::vector<std::uint8_t> rref(const Pairs& pairs) {
  std::vector<std::uint8_t> bytes = {'R', 'R', 'E', 'F', ','};
  for (const auto& [index, value] : pairs) {
    std::uint8_t pair[8];
    std::memcpy(pair, &index, 4);
    std::memcpy(pair + 4, &value, 4);
    bytes.insert(bytes.end(), pair, pair + 8);
  }
  return bytes;
}

/// Datagrams of a list instead of sockets, under a clock that only wait() moves: to the next datagram, or by the whole
/// time-out. What is sent is kept.
class ScriptedHub : public DatagramHub {
 public:
  struct Arrival {
    std::int64_t time_ns = 0;  ///< of the steady clock
    std::string source;        ///< by the name it was opened with
    std::vector<std::uint8_t> bytes;
    Endpoint from;
    std::int64_t kernel_stamp_ns = 0;
  };
  struct Sent {
    std::int64_t time_ns = 0;
    std::string source;
    Endpoint to;
    std::vector<std::uint8_t> bytes;
    friend bool operator==(const Sent& a, const Sent& b) {
      return std::tie(a.time_ns, a.source, a.to, a.bytes) == std::tie(b.time_ns, b.source, b.to, b.bytes);
    }
  };
  /// Outlives the hub, which the link owns.
  struct Wire {
    std::int64_t now_ns = 0;
    std::deque<Arrival> arrivals;  // by time
    std::vector<Sent> sent;
    bool refuses = false;       // to send
    std::uint64_t dropped = 0;  // as the kernel counts it, of each source
    std::uint64_t refused = 0;  // the same of "port unreachable"
    std::vector<std::string> opened, ignored;
    std::vector<std::string> awaited;  // of waitFor()
    std::string listened_to;           // by fdFor(); empty: by none, "any"

    Clock clock() {
      return {[this] { return now_ns; }, [this] { return now_ns + kSystemMinusSteady; }};
    }
  };
  static constexpr std::int64_t kSystemMinusSteady = 1'700'000'000 * kNanosecondsPerSecond;
  static constexpr int kFd = 1'000'000;  // of nothing

  explicit ScriptedHub(std::shared_ptr<Wire> wire) : wire_(std::move(wire)) {}

  std::shared_ptr<DatagramSource> open(const std::string& name, const UdpSocketOptions& options) override {
    auto source = std::make_shared<Source>(wire_, name, options);
    sources_[name] = source;  // the newest of a name gets what is for it
    wire_->opened.push_back(name);
    return source;
  }
  void wake() override {}
  void ignore(const DatagramSource& source) override {
    static_cast<const Source&>(source).ignored = true;
    wire_->ignored.push_back(static_cast<const Source&>(source).name);
  }
  void wait(int timeout_ms) override {
    const std::int64_t end_ns = wire_->now_ns + timeout_ms * kNanosecondsPerMillisecond;
    std::deque<Arrival>& arrivals = wire_->arrivals;
    if (arrivals.empty() || arrivals.front().time_ns > end_ns) {
      wire_->now_ns = end_ns;
      return;
    }
    wire_->now_ns = std::max(wire_->now_ns, arrivals.front().time_ns);
    while (!arrivals.empty() && arrivals.front().time_ns <= wire_->now_ns) {
      if (const auto source = sources_[arrivals.front().source].lock()) {
        source->waiting.push_back(std::move(arrivals.front()));
      }
      arrivals.pop_front();
    }
  }
  void waitFor(const DatagramSource& source, int timeout_ms) override {
    wire_->awaited.push_back(static_cast<const Source&>(source).name);
    wait(timeout_ms);
  }
  int fdFor(const DatagramSource* source) override {
    wire_->listened_to = source == nullptr ? "any" : static_cast<const Source*>(source)->name;
    return kFd;
  }
  bool hasInput(const DatagramSource& source) const override {
    const auto& scripted = static_cast<const Source&>(source);
    return !scripted.ignored && !scripted.waiting.empty();
  }

 private:
  struct Source : DatagramSource {
    Source(std::shared_ptr<Wire> wire_in, std::string name_in, const UdpSocketOptions& options)
        : wire(std::move(wire_in)), name(std::move(name_in)), port(options.bind_port) {}

    ReceiveStatus receive(ByteSpan buffer, Received* received) override {
      if (waiting.empty()) {
        return ReceiveStatus::kNothing;
      }
      const Arrival& arrival = waiting.front();
      received->size = std::min(buffer.size(), arrival.bytes.size());
      std::memcpy(buffer.data(), arrival.bytes.data(), received->size);
      received->from = arrival.from;
      received->kernel_stamp_ns = arrival.kernel_stamp_ns;
      waiting.pop_front();
      ++counts.received;
      return ReceiveStatus::kReceived;
    }
    bool sendTo(ByteView bytes, const Endpoint& to, int* /*error_number*/) override {
      if (wire->refuses) {
        ++counts.send_failures;
        return false;
      }
      wire->sent.push_back({wire->now_ns, name, to, {bytes.data(), bytes.data() + bytes.size()}});
      return true;
    }
    std::vector<std::string> joinOnAllInterfaces(std::uint32_t /*group*/) override { return {}; }
    std::uint16_t localPort() const override { return port; }
    int receiveBuffer() const override { return 1 << 20; }
    UdpCounters counters() const override {
      UdpCounters out = counts;
      out.dropped = wire->dropped;
      out.refused = wire->refused;
      return out;
    }

    const std::shared_ptr<Wire> wire;
    const std::string name;
    const std::uint16_t port;
    std::deque<Arrival> waiting;
    UdpCounters counts;
    mutable bool ignored = false;
  };

  std::shared_ptr<Wire> wire_;
  std::map<std::string, std::weak_ptr<Source>> sources_;
};

}  // namespace xplane_bridge::core
