// What a wire log costs the link's thread: a datagram received through a WireLogHub, less the same one received
// without. Prints one JSON object, in microseconds: the median and the worst of many batches, and what was left out.
//   bench_wire_log FOLDER

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "xplane_bridge/core/wire/wire_log_hub.hpp"

namespace xplane_bridge::core {
namespace {

constexpr int kBatches = 20;
constexpr int kBatchSize = 4000;            // fits twice into the log's memory
constexpr std::size_t kDatagramSize = 437;  // of a flight state
constexpr std::chrono::milliseconds kUntilWritten{300};

/// Has the same datagram again and again.
class Source : public DatagramSource {
 public:
  ReceiveStatus receive(ByteSpan buffer, Received* received) override {
    std::memcpy(buffer.data(), bytes_.data(), bytes_.size());
    received->size = bytes_.size();
    received->from = {kLoopbackAddress, 49000};
    received->kernel_stamp_ns = ++stamp_;
    return ReceiveStatus::kReceived;
  }
  bool sendTo(ByteView /*bytes*/, const Endpoint& /*to*/, int* /*error_number*/) override { return true; }
  std::vector<std::string> joinOnAllInterfaces(std::uint32_t /*group*/) override { return {}; }
  std::uint16_t localPort() const override { return 50000; }
  int receiveBuffer() const override { return 0; }
  UdpCounters counters() const override { return {}; }

 private:
  std::array<std::uint8_t, kDatagramSize> bytes_{};
  std::int64_t stamp_ = 0;
};

class Hub : public DatagramHub {
 public:
  std::shared_ptr<DatagramSource> open(const std::string& /*name*/, const UdpSocketOptions& /*options*/) override {
    return std::make_shared<Source>();
  }
  void wake() override {}
  void ignore(const DatagramSource& /*source*/) override {}
  void wait(int /*timeout_ms*/) override {}
  bool hasInput(const DatagramSource& /*source*/) const override { return true; }
};

/// A node that has nothing else to do.
class Turn : public WireTurn {
 public:
  std::int64_t nextDue() override { return 0; }
  bool hasInput() override { return false; }
  bool takeInput(std::vector<std::uint8_t>* /*input*/) override { return false; }
  void act(ByteView /*input*/) override {}
  void runDue() override {}
  void woken() override {}
  void end() override {}
};

std::vector<double> batches(DatagramSource* source) {
  using Time = std::chrono::steady_clock;
  std::vector<double> out;
  std::vector<std::uint8_t> buffer(1U << 16U);
  Received received;
  for (int batch = 0; batch < kBatches; ++batch) {
    const Time::time_point start = Time::now();
    for (int i = 0; i < kBatchSize; ++i) source->receive(buffer, &received);
    out.push_back(std::chrono::duration<double, std::micro>(Time::now() - start).count() / kBatchSize);
    std::this_thread::sleep_for(kUntilWritten);
  }
  std::sort(out.begin(), out.end());
  return out;
}

int run(const std::string& folder) {
  Source bare;
  const std::vector<double> without = batches(&bare);
  WireFileOptions file;
  file.file = folder + "/bench";
  file.node = "rx_node";
  auto log = std::make_shared<WireLog>(file, hostClock(), [](LogLevel, const std::string&) {});
  Turn turn;
  WireLogHub hub(std::make_unique<Hub>(), log, WireClock(hostClock()), hostClock(), &turn);
  const std::vector<double> with = batches(hub.open("flight", {}).get());
  std::printf("{\"median_us\": %.3f, \"worst_us\": %.3f, \"lost\": %llu}\n", with[kBatches / 2] - without[kBatches / 2],
              with.back() - without[kBatches / 2], static_cast<unsigned long long>(log->lost()));
  return 0;
}

}  // namespace
}  // namespace xplane_bridge::core

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "bench_wire_log: expected a folder\n");
    return 2;
  }
  return xplane_bridge::core::run(argv[1]);
}
