#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/base/log.hpp"
#include "xplane_bridge/core/wire/datagram_source.hpp"
#include "xplane_bridge/core/wire/wire_clock.hpp"
#include "xplane_bridge/core/wire/wire_record.hpp"

namespace xplane_bridge::core {

/// What was replayed, from any thread.
struct ReplayProgress {
  std::atomic<bool> ended{false};                ///< all records were handed out
  std::atomic<std::uint64_t> datagrams{0};       ///< handed out
  std::atomic<std::uint64_t> sent{0};            ///< by the node
  std::atomic<std::uint64_t> sent_otherwise{0};  ///< of these: not what was recorded there
};

/// Plays the records of a WireLog to a node as they came, and the node's clock with them: the same turns, the same
/// datagrams on the same sources, the same inputs. Nothing goes to a network. After the last record time goes on, but
/// nothing comes any more.
class ReplayHub : public DatagramHub {
 public:
  /// @throws std::runtime_error where the file cannot be read or is none
  ReplayHub(const std::string& file, WireClock clock, WireTurn* turn, std::shared_ptr<ReplayProgress> progress,
            LogFunction log);
  ~ReplayHub() override;

  std::shared_ptr<DatagramSource> open(const std::string& name, const UdpSocketOptions& options) override;
  void wake() override { turn_->woken(); }
  void ignore(const DatagramSource& source) override;
  void wait(int timeout_ms) override;
  bool hasInput(const DatagramSource& source) const override;

 private:
  class Source;
  /// A source of the recording.
  struct Opened {
    std::string name;
    std::uint16_t port = 0;
    bool claimed = false;
    bool ready = false;  // has datagrams before the next wait
  };

  bool read(std::size_t* offset, WireRecord* record) const;
  bool peek(WireRecord* record, std::size_t* after) const;
  bool skipTo(WireKind wanted, WireRecord* record);
  void findReady();
  bool nextInput(std::vector<std::uint8_t>* input);
  void goOn(int timeout_ms);
  bool takeReceived(std::uint16_t number, ByteSpan buffer, Received* received, std::uint64_t* dropped);
  bool takeSent(std::uint16_t number, ByteView bytes, const Endpoint& to, int* error_number);
  void takeRefused(std::uint16_t number, std::uint64_t* refused);

  WireClock clock_;
  WireTurn* turn_;
  std::shared_ptr<ReplayProgress> progress_;
  LogFunction log_;
  std::vector<std::uint8_t> bytes_;
  mutable std::mutex mutex_;
  std::size_t next_ = 0;  // offset of the record that comes next
  std::vector<Opened> opened_;
};

/// The first bytes of a file of records.
constexpr const char* kReplayMagic = "xplane_bridge wire records 1\n";

}  // namespace xplane_bridge::core
