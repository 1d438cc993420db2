#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "xplane_bridge/core/base/bytes.hpp"

namespace xplane_bridge::core {

/// An IPv4 address and port, both in host byte order. 0.0.0.0:0 is "none".
struct Endpoint {
  std::uint32_t address = 0;
  std::uint16_t port = 0;

  bool valid() const { return address != 0 && port != 0; }
  /// "192.168.1.5:49000"
  std::string toString() const;
  /// "192.168.1.5"
  std::string addressString() const;
  friend bool operator==(const Endpoint& a, const Endpoint& b) { return a.address == b.address && a.port == b.port; }
  friend bool operator!=(const Endpoint& a, const Endpoint& b) { return !(a == b); }
};

constexpr std::uint32_t kLoopbackAddress = 0x7F000001U;

/// The same computer, as far as addresses tell: equal, or both in 127.0.0.0/8 (many systems resolve their own name to
/// 127.0.1.1 and answer from 127.0.0.1).
bool isSameHost(std::uint32_t a, std::uint32_t b);

/// A socket could not be made as asked. what() names the call, the address and the remedy.
class SocketError : public std::runtime_error {
 public:
  SocketError(const std::string& what, int error_number) : std::runtime_error(what), errno_(error_number) {}
  int errorNumber() const { return errno_; }

 private:
  int errno_;
};

/// IPv4 address of a host name or dotted-decimal text; may block for as long as the resolver does.
/// Throws SocketError with the name and the resolver's reason.
std::uint32_t resolveHost(const std::string& host);

/// Whether an address is one of this computer's interfaces, loopback included.
bool isOwnAddress(std::uint32_t address);

/// The local address from which datagrams to `peer` leave. Throws SocketError when there is no route.
std::uint32_t localAddressTowards(const Endpoint& peer);

struct UdpSocketOptions {
  std::uint32_t bind_address = 0;  ///< host byte order; 0: all interfaces
  std::uint16_t bind_port = 0;     ///< 0: any free port
  bool share_port = false;         ///< SO_REUSEADDR: several listeners on one port (beacon)
  int receive_buffer = 4 << 20;    ///< [bytes] asked of the kernel; what it granted is in receiveBuffer()
};

struct UdpCounters {
  std::uint64_t received = 0;  ///< datagrams read
  std::uint64_t received_bytes = 0;
  std::uint64_t truncated = 0;  ///< datagrams longer than the caller's buffer
  std::uint64_t dropped = 0;    ///< datagrams the kernel dropped because nobody read them (SO_RXQ_OVFL)
  std::uint64_t sent = 0;
  std::uint64_t sent_bytes = 0;
  std::uint64_t send_failures = 0;  ///< datagrams the kernel refused to send
  std::uint64_t refused = 0;        ///< ICMP "port unreachable": the computer is there, nothing listens on the port

  UdpCounters& operator+=(const UdpCounters& more);
};

/// What came with a datagram.
struct Received {
  std::size_t size = 0;  ///< [bytes] in the buffer
  Endpoint from;
  std::int64_t kernel_stamp_ns = 0;  ///< [ns] CLOCK_REALTIME at which the kernel took it from the wire; 0 unknown
};

enum class ReceiveStatus : std::uint8_t { kReceived, kNothing, kFailed };

/// A non-blocking UDP socket over IPv4 with kernel receive times and drop counting.
///
/// One thread receives; sendTo() may be called from any thread at any time. Movable, not copyable.
class UdpSocket {
 public:
  /// Opens and binds. Throws SocketError.
  explicit UdpSocket(const UdpSocketOptions& options);
  ~UdpSocket();
  UdpSocket(UdpSocket&& other) noexcept;
  UdpSocket& operator=(UdpSocket&& other) noexcept;
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;

  int fd() const { return fd_; }
  std::uint16_t localPort() const { return local_port_; }
  /// [bytes] receive buffer the kernel granted (it doubles the request for its own bookkeeping).
  int receiveBuffer() const { return receive_buffer_; }

  /// Joins a multicast group (host byte order) on every interface that is up, loopback included. May be called again to
  /// catch new interfaces. Returns the names of the interfaces joined so far; none is no error. Throws SocketError when
  /// the interfaces cannot be listed.
  std::vector<std::string> joinOnAllInterfaces(std::uint32_t group);

  /// Sends one datagram. False, with `error_number` set if given, when the kernel refused it.
  bool sendTo(ByteView bytes, const Endpoint& to, int* error_number = nullptr);

  /// Reads one datagram that is already there.
  ReceiveStatus receive(ByteSpan buffer, Received* received);

  /// Copy of the counters; from the receiving thread, or when none receives.
  UdpCounters counters() const;

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
  std::vector<std::string> joined_;
};

}  // namespace xplane_bridge::core
