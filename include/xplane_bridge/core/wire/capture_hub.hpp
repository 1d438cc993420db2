#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/wire/datagram_source.hpp"
#include "xplane_bridge/core/wire/replay_hub.hpp"
#include "xplane_bridge/core/wire/wire_clock.hpp"
#include "xplane_bridge/core/wire/wire_record.hpp"

namespace xplane_bridge::core {

/// Whether a file holds what a CaptureHub plays.
bool isCapture(const std::string& file);

/// Plays what X-Plane has sent to another program, or at another time, to a node that asks for itself: answers come on
/// the node's own numbers for the same datarefs, each source of the node is served from the one of the program's that
/// has most of them. The clock is that of the capture. Before its first datagram the node has some seconds to find
/// X-Plane and to ask.
class CaptureHub : public DatagramHub {
 public:
  /// @throws std::runtime_error where the file cannot be read or is none
  CaptureHub(const std::string& file, WireClock clock, WireTurn* turn, std::shared_ptr<ReplayProgress> progress);
  ~CaptureHub() override;

  std::shared_ptr<DatagramSource> open(const std::string& name, const UdpSocketOptions& options) override;
  void wake() override { turn_->woken(); }
  void ignore(const DatagramSource& source) override;
  void wait(int timeout_ms) override;
  bool hasInput(const DatagramSource& source) const override;

 private:
  class Source;
  struct Arrival {
    std::vector<std::uint8_t> bytes;
    Endpoint from;
    std::int64_t kernel_ns = 0;
  };

  void readNames();
  void moveTo(std::int64_t steady_ns);
  void deliver(const WireRecord& record);
  void answerEarly();
  std::vector<std::shared_ptr<Source>> sources() const;

  WireClock clock_;
  WireTurn* turn_;
  std::shared_ptr<ReplayProgress> progress_;
  std::vector<std::uint8_t> bytes_;
  std::size_t next_ = 0;
  std::int64_t start_ns_ = 0;  // steady time of the first datagram
  std::int64_t wall_minus_steady_ns_ = 0;
  std::int64_t answered_ns_ = 0;  // early
  Endpoint peer_;                 // from which answers came
  std::map<std::uint32_t, std::string> names_;
  std::map<std::string, float> first_values_;
  std::map<std::uint16_t, std::map<std::string, std::uint32_t>> clients_;  // their datarefs
  mutable std::mutex mutex_;
  std::vector<std::weak_ptr<Source>> sources_;
};

/// The first bytes of a file of captured answers.
constexpr const char* kCaptureMagic = "xplane_bridge wire capture 1\n";

}  // namespace xplane_bridge::core
