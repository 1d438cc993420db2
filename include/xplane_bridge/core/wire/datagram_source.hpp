#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "xplane_bridge/core/base/bytes.hpp"

/// The seam below the link: every datagram is received and sent through a DatagramSource, and sources come from a
/// DatagramHub. UdpSocket and UdpHub are the real ones; a recording, or a test's list of datagrams, can stand in their
/// place.
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

/// A socket could not be made as asked. what() names the call, the address and the remedy.
class SocketError : public std::runtime_error {
 public:
  SocketError(const std::string& what, int error_number) : std::runtime_error(what), errno_(error_number) {}
  int errorNumber() const { return errno_; }

 private:
  int errno_;
};

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
  std::uint64_t dropped = 0;    ///< datagrams the kernel dropped because they were not read in time (SO_RXQ_OVFL)
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

/// Where datagrams come from and go to: a socket, or what stands for one. One thread receives; sendTo() may be called
/// from any thread at any time.
class DatagramSource {
 public:
  virtual ~DatagramSource() = default;

  /// Reads one datagram that is already there.
  virtual ReceiveStatus receive(ByteSpan buffer, Received* received) = 0;
  /// Sends one datagram. False, with `error_number` set if given, when the kernel refused it.
  virtual bool sendTo(ByteView bytes, const Endpoint& to, int* error_number = nullptr) = 0;
  /// Joins a multicast group (host byte order) on every interface that is up, loopback included. May be called again to
  /// catch new interfaces. Returns the names of the interfaces joined so far; none is no error. Throws SocketError when
  /// the interfaces cannot be listed.
  virtual std::vector<std::string> joinOnAllInterfaces(std::uint32_t group) = 0;

  virtual std::uint16_t localPort() const = 0;
  /// [bytes] receive buffer the kernel granted (it doubles the request for its own bookkeeping).
  virtual int receiveBuffer() const = 0;
  /// Copy of the counters; from the receiving thread, or when none receives.
  virtual UdpCounters counters() const = 0;
};

/// Opens sources and waits for all of them at once.
class DatagramHub {
 public:
  virtual ~DatagramHub() = default;

  /// From any thread. `name` says what the source is for ("control", "flight"). wait() looks at it from now on. Throws
  /// SocketError.
  virtual std::shared_ptr<DatagramSource> open(const std::string& name, const UdpSocketOptions& options) = 0;
  /// From any thread: wait() ends, now or when it is next called.
  virtual void wake() = 0;

  // From the receiving thread.

  /// wait() does not look at it any more, though it may still send.
  virtual void ignore(const DatagramSource& source) = 0;
  /// Waits up to `timeout_ms` until a source has a datagram.
  virtual void wait(int timeout_ms) = 0;
  /// The same for who can go on only once this source has one: what comes to others may not end the waiting, but is
  /// found with it.
  virtual void waitFor(const DatagramSource& source, int timeout_ms) {
    static_cast<void>(source);
    wait(timeout_ms);
  }
  /// Whether the last wait() found a datagram there.
  virtual bool hasInput(const DatagramSource& source) const = 0;
  /// Whether wait() has more to do at once, though nothing comes.
  virtual bool busy() const { return false; }
  /// Readable while wait() would find something to go on with; -1 where wait() does more than look for that.
  virtual int fd() const { return -1; }
  /// A descriptor, always the same one, that is from now on readable on wake() and while this source has a datagram;
  /// null: while any has. -1 as for fd().
  virtual int fdFor(const DatagramSource* source) {
    static_cast<void>(source);
    return -1;
  }
};

}  // namespace xplane_bridge::core
