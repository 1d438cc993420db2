#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/wire/datagram_source.hpp"
#include "xplane_bridge/core/wire/wire_clock.hpp"
#include "xplane_bridge/core/wire/wire_log.hpp"

namespace xplane_bridge::core {

/// A hub that logs all that goes through it, in the order in which the node takes it up, and moves the node's clock by
/// it. Between datagrams the node has its turn.
class WireLogHub : public DatagramHub {
 public:
  /// @param turn null: the node acts by other means, and its clock is another; only datagrams are logged
  WireLogHub(std::unique_ptr<DatagramHub> inner, std::shared_ptr<WireLog> log, WireClock clock, Clock host,
             WireTurn* turn);

  std::shared_ptr<DatagramSource> open(const std::string& name, const UdpSocketOptions& options) override;
  void wake() override;
  void ignore(const DatagramSource& source) override;
  void wait(int timeout_ms) override;
  bool hasInput(const DatagramSource& source) const override;
  int fdFor(const DatagramSource* source) override;

 private:
  class Source;

  std::unique_ptr<DatagramHub> inner_;
  std::shared_ptr<WireLog> log_;
  WireClock clock_;
  Clock host_;
  WireTurn* turn_;
  std::mutex opening_;  // numbers are given in the order in which the log has them
  std::uint16_t opened_ = 0;
};

}  // namespace xplane_bridge::core
