#include "xplane_bridge/core/wire/udp_socket.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <utility>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

std::string addressText(std::uint32_t address) {
  const in_addr network{htonl(address)};
  char text[INET_ADDRSTRLEN] = {};
  inet_ntop(AF_INET, &network, text, sizeof(text));
  return text;
}

sockaddr_in toSockaddr(const Endpoint& endpoint) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(endpoint.address);
  address.sin_port = htons(endpoint.port);
  return address;
}

Endpoint toEndpoint(const sockaddr_in& address) { return {ntohl(address.sin_addr.s_addr), ntohs(address.sin_port)}; }

std::string errorText(int error_number) { return std::strerror(error_number); }

[[noreturn]] void throwSocketError(const std::string& what) {
  const int error_number = errno;
  throw SocketError(what + ": " + errorText(error_number), error_number);
}

void setOption(int fd, int level, int name, int value, const char* label) {
  if (setsockopt(fd, level, name, &value, sizeof(value)) != 0) {
    throwSocketError(std::string("cannot set ") + label);
  }
}

using InterfaceList = std::unique_ptr<ifaddrs, decltype(&freeifaddrs)>;

InterfaceList listInterfaces() {
  ifaddrs* interfaces = nullptr;
  if (getifaddrs(&interfaces) != 0) {
    throwSocketError("cannot list the network interfaces");
  }
  return {interfaces, &freeifaddrs};
}

}  // namespace

std::string Endpoint::addressString() const { return addressText(address); }

std::string Endpoint::toString() const { return addressText(address) + ":" + std::to_string(port); }

bool isSameHost(std::uint32_t a, std::uint32_t b) {
  constexpr std::uint32_t kLoopbackNet = kLoopbackAddress >> 24;
  return a == b || ((a >> 24) == kLoopbackNet && (b >> 24) == kLoopbackNet);
}

UdpCounters& UdpCounters::operator+=(const UdpCounters& more) {
  received += more.received;
  received_bytes += more.received_bytes;
  truncated += more.truncated;
  dropped += more.dropped;
  sent += more.sent;
  sent_bytes += more.sent_bytes;
  send_failures += more.send_failures;
  refused += more.refused;
  return *this;
}

std::uint32_t resolveHost(const std::string& host) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  const int status = getaddrinfo(host.c_str(), nullptr, &hints, &found);
  if (status != 0) {
    throw SocketError("host '" + host + "' has no IPv4 address: " +
                          (status == EAI_SYSTEM ? errorText(errno) : std::string(gai_strerror(status))) +
                          "; give an address such as 192.168.1.5, or a name that this computer can resolve",
                      status == EAI_SYSTEM ? errno : 0);
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owner(found, &freeaddrinfo);
  sockaddr_in address{};
  std::memcpy(&address, found->ai_addr, sizeof(address));
  return toEndpoint(address).address;
}

std::uint32_t localAddressTowards(const Endpoint& peer) {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) {
    throwSocketError("cannot open a UDP socket");
  }
  // Connecting a UDP socket sends nothing; it only makes the kernel choose the route.
  const sockaddr_in remote = toSockaddr(peer);
  sockaddr_in local{};
  socklen_t size = sizeof(local);
  const bool known = connect(fd, reinterpret_cast<const sockaddr*>(&remote), sizeof(remote)) == 0 &&
                     getsockname(fd, reinterpret_cast<sockaddr*>(&local), &size) == 0;
  const int error_number = errno;
  ::close(fd);
  if (!known) {
    throw SocketError("no route to " + peer.toString() + ": " + errorText(error_number), error_number);
  }
  return toEndpoint(local).address;
}

std::vector<std::uint32_t> ownAddresses() {
  std::vector<std::uint32_t> out;
  const InterfaceList interfaces = listInterfaces();
  for (const ifaddrs* each = interfaces.get(); each != nullptr; each = each->ifa_next) {
    if (each->ifa_addr != nullptr && each->ifa_addr->sa_family == AF_INET) {
      sockaddr_in own{};
      std::memcpy(&own, each->ifa_addr, sizeof(own));
      out.push_back(toEndpoint(own).address);
    }
  }
  return out;
}

bool isOwnAddress(std::uint32_t address) {
  const std::vector<std::uint32_t> own = ownAddresses();
  return std::any_of(own.begin(), own.end(), [address](std::uint32_t each) { return isSameHost(each, address); });
}

UdpSocket::UdpSocket(const UdpSocketOptions& options) {
  fd_ = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd_ < 0) {
    throwSocketError("cannot open a UDP socket");
  }
  try {
    if (options.share_port) {
      setOption(fd_, SOL_SOCKET, SO_REUSEADDR, 1, "SO_REUSEADDR");
    }
    setOption(fd_, SOL_SOCKET, SO_RCVBUF, options.receive_buffer, "SO_RCVBUF");
    setOption(fd_, SOL_SOCKET, SO_TIMESTAMPNS, 1, "SO_TIMESTAMPNS");
    setOption(fd_, SOL_SOCKET, SO_RXQ_OVFL, 1, "SO_RXQ_OVFL");
    // Reports "port unreachable" although the socket is not connected.
    setOption(fd_, IPPROTO_IP, IP_RECVERR, 1, "IP_RECVERR");
    // Only groups joined here, not those that another program of this computer has joined.
    setOption(fd_, IPPROTO_IP, IP_MULTICAST_ALL, 0, "IP_MULTICAST_ALL");

    const Endpoint wanted{options.bind_address, options.bind_port};
    const sockaddr_in address = toSockaddr(wanted);
    if (bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
      const int error_number = errno;
      std::string what = "cannot use UDP port " + wanted.toString() + ": " + errorText(error_number);
      if (error_number == EADDRINUSE) {
        what += "; another program has it (ss -lunp shows which): end that program or choose another port";
      }
      throw SocketError(what, error_number);
    }
    sockaddr_in bound{};
    socklen_t size = sizeof(bound);
    if (getsockname(fd_, reinterpret_cast<sockaddr*>(&bound), &size) != 0) {
      throwSocketError("cannot read the port of a socket");
    }
    local_port_ = toEndpoint(bound).port;
    size = sizeof(receive_buffer_);
    if (getsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &receive_buffer_, &size) != 0) {
      throwSocketError("cannot read SO_RCVBUF");
    }
  } catch (const SocketError&) {
    close();
    throw;
  }
}

UdpSocket::~UdpSocket() { close(); }

UdpSocket::UdpSocket(UdpSocket&& other) noexcept { *this = std::move(other); }

UdpSocket& UdpSocket::operator=(UdpSocket&& other) noexcept {
  if (this != &other) {
    close();
    fd_ = std::exchange(other.fd_, -1);
    local_port_ = other.local_port_;
    receive_buffer_ = other.receive_buffer_;
    last_drop_count_ = other.last_drop_count_;
    received_ = other.received_;
    sent_.store(other.sent_.load());
    sent_bytes_.store(other.sent_bytes_.load());
    send_failures_.store(other.send_failures_.load());
    refused_.store(other.refused_.load());
    errors_queued_.store(other.errors_queued_.load());
    joined_ = std::move(other.joined_);
  }
  return *this;
}

void UdpSocket::close() {
  if (fd_ >= 0) {
    ::close(fd_);
    fd_ = -1;
  }
}

std::vector<std::string> UdpSocket::joinOnAllInterfaces(std::uint32_t group) {
  const InterfaceList interfaces = listInterfaces();
  for (const ifaddrs* each = interfaces.get(); each != nullptr; each = each->ifa_next) {
    const bool usable = each->ifa_addr != nullptr && each->ifa_addr->sa_family == AF_INET &&
                        (each->ifa_flags & IFF_UP) != 0 &&
                        (each->ifa_flags & (static_cast<unsigned>(IFF_MULTICAST) | IFF_LOOPBACK)) != 0;
    if (!usable) {
      continue;
    }
    ip_mreqn request{};
    request.imr_multiaddr.s_addr = htonl(group);
    request.imr_ifindex = static_cast<int>(if_nametoindex(each->ifa_name));
    const int status = setsockopt(fd_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &request, sizeof(request));
    // EADDRINUSE: joined before. Other failures are an interface without multicast, or one that has just gone.
    const bool listed = std::find(joined_.begin(), joined_.end(), each->ifa_name) != joined_.end();
    if ((status == 0 || errno == EADDRINUSE) && !listed) {
      joined_.emplace_back(each->ifa_name);
    }
  }
  return joined_;
}

bool UdpSocket::sendTo(ByteView bytes, const Endpoint& to, int* error_number) {
  const sockaddr_in address = toSockaddr(to);
  // A pending "port unreachable" of an earlier datagram is reported here once, instead of sending: hence the second
  // try.
  for (int attempt = 0; attempt < 2; ++attempt) {
    const ssize_t sent = sendto(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL,
                                reinterpret_cast<const sockaddr*>(&address), sizeof(address));
    if (sent >= 0) {
      sent_.fetch_add(1, std::memory_order_relaxed);
      sent_bytes_.fetch_add(bytes.size(), std::memory_order_relaxed);
      return true;
    }
    errors_queued_ = true;
    if (errno != ECONNREFUSED) {
      break;
    }
    refused_.fetch_add(1, std::memory_order_relaxed);
  }
  if (error_number != nullptr) {
    *error_number = errno;
  }
  send_failures_.fetch_add(1, std::memory_order_relaxed);
  return false;
}

void UdpSocket::drainErrorQueue() {
  // Unless it is read, poll() would report POLLERR for ever.
  std::array<std::uint8_t, 64> payload;
  std::array<std::uint8_t, 512> control;
  iovec buffer{payload.data(), payload.size()};
  msghdr message{};
  message.msg_iov = &buffer;
  message.msg_iovlen = 1;
  do {
    message.msg_control = control.data();
    message.msg_controllen = control.size();
  } while (recvmsg(fd_, &message, MSG_ERRQUEUE) >= 0);
}

ReceiveStatus UdpSocket::receive(ByteSpan buffer, Received* received) {
  constexpr int kMaxPendingErrors = 16;
  for (int attempt = 0; attempt < kMaxPendingErrors; ++attempt) {
    alignas(cmsghdr) std::array<std::uint8_t, 256> control;
    sockaddr_in from{};
    iovec vector{buffer.data(), buffer.size()};
    msghdr message{};
    message.msg_name = &from;
    message.msg_namelen = sizeof(from);
    message.msg_iov = &vector;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    const ssize_t size = recvmsg(fd_, &message, 0);
    if (size < 0) {
      const int error_number = errno;
      if (error_number == EAGAIN || error_number == EWOULDBLOCK) {
        // An error is reported by one call, of sending or of receiving, and stays queued.
        if (errors_queued_.exchange(false)) drainErrorQueue();
        return ReceiveStatus::kNothing;
      }
      if (error_number == EINTR) {
        continue;
      }
      if (error_number == ECONNREFUSED || error_number == EHOSTUNREACH || error_number == ENETUNREACH) {
        refused_.fetch_add(error_number == ECONNREFUSED ? 1 : 0, std::memory_order_relaxed);
        drainErrorQueue();
        continue;
      }
      errors_queued_ = true;
      return ReceiveStatus::kFailed;
    }
    received->size = static_cast<std::size_t>(size);
    received->from = toEndpoint(from);
    received->kernel_stamp_ns = 0;
    for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr; header = CMSG_NXTHDR(&message, header)) {
      if (header->cmsg_level != SOL_SOCKET) {
        continue;
      }
      if (header->cmsg_type == SCM_TIMESTAMPNS) {
        timespec stamp{};
        std::memcpy(&stamp, CMSG_DATA(header), sizeof(stamp));
        received->kernel_stamp_ns =
            static_cast<std::int64_t>(stamp.tv_sec) * kNanosecondsPerSecond + static_cast<std::int64_t>(stamp.tv_nsec);
      } else if (header->cmsg_type == SO_RXQ_OVFL) {
        std::uint32_t drops = 0;
        std::memcpy(&drops, CMSG_DATA(header), sizeof(drops));
        received_.dropped += static_cast<std::uint32_t>(drops - last_drop_count_);  // the kernel's counter wraps
        last_drop_count_ = drops;
      }
    }
    ++received_.received;
    received_.received_bytes += received->size;
    received_.truncated += (message.msg_flags & MSG_TRUNC) != 0 ? 1U : 0U;
    return ReceiveStatus::kReceived;
  }
  return ReceiveStatus::kNothing;
}

UdpCounters UdpSocket::counters() const {
  UdpCounters counters = received_;
  counters.sent = sent_.load(std::memory_order_relaxed);
  counters.sent_bytes = sent_bytes_.load(std::memory_order_relaxed);
  counters.send_failures = send_failures_.load(std::memory_order_relaxed);
  counters.refused = refused_.load(std::memory_order_relaxed);
  return counters;
}

}  // namespace xplane_bridge::core
