#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "xplane_bridge/core/base/bytes.hpp"
#include "xplane_bridge/core/wire/datagram_source.hpp"

namespace xplane_bridge::core {

/// The same computer, as far as addresses show: equal, or both in 127.0.0.0/8 (many systems resolve their own name to
/// 127.0.1.1 and answer from 127.0.0.1).
bool isSameHost(std::uint32_t a, std::uint32_t b);

/// IPv4 address of a host name or dotted-decimal text; may block for as long as the resolver does.
/// Throws SocketError with the name and the resolver's reason.
std::uint32_t resolveHost(const std::string& host);

/// The IPv4 addresses of this computer's interfaces, loopback included. Throws SocketError when they cannot be listed.
std::vector<std::uint32_t> ownAddresses();

/// Whether an address is one of ownAddresses().
bool isOwnAddress(std::uint32_t address);

/// The local address from which datagrams to `peer` leave. Throws SocketError when there is no route.
std::uint32_t localAddressTowards(const Endpoint& peer);

/// A non-blocking UDP socket over IPv4 with kernel receive times and drop counting.
///
/// Movable, not copyable.
class UdpSocket : public DatagramSource {
 public:
  /// Opens and binds. Throws SocketError.
  explicit UdpSocket(const UdpSocketOptions& options);
  ~UdpSocket() override;
  UdpSocket(UdpSocket&& other) noexcept;
  UdpSocket& operator=(UdpSocket&& other) noexcept;
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;

  int fd() const { return fd_; }
  std::uint16_t localPort() const override { return local_port_; }
  int receiveBuffer() const override { return receive_buffer_; }
  std::vector<std::string> joinOnAllInterfaces(std::uint32_t group) override;
  bool sendTo(ByteView bytes, const Endpoint& to, int* error_number = nullptr) override;
  ReceiveStatus receive(ByteSpan buffer, Received* received) override;
  UdpCounters counters() const override;

 private:
  void close();
  void drainErrorQueue();

  int fd_ = -1;
  std::uint16_t local_port_ = 0;
  int receive_buffer_ = 0;
  std::uint32_t last_drop_count_ = 0;
  UdpCounters received_;  // its receiving half; the other half is counted by any thread:
  std::atomic<std::uint64_t> sent_{0};
  std::atomic<std::uint64_t> sent_bytes_{0};
  std::atomic<std::uint64_t> send_failures_{0};
  std::atomic<std::uint64_t> refused_{0};
  std::atomic<bool> errors_queued_{false};  ///< some may be, which no call reports any more
  std::vector<std::string> joined_;
};

}  // namespace xplane_bridge::core
