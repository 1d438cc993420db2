#include "xplane_bridge/core/wire/udp_socket.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <string>
#include <utility>
#include <vector>

#include "xplane_bridge/core/base/clock.hpp"

namespace xplane_bridge::core {
namespace {

constexpr int kPatienceMs = 5000;

UdpSocketOptions onLoopback(std::uint16_t port = 0) {
  UdpSocketOptions options;
  options.bind_address = kLoopbackAddress;
  options.bind_port = port;
  return options;
}

Endpoint endpointOf(const UdpSocket& socket) { return {kLoopbackAddress, socket.localPort()}; }

const std::array<std::uint8_t, 3> kPayload = {1, 2, 3};

/// Reads one datagram; waits for it while the socket is silent for no longer than `timeout_ms`.
ReceiveStatus receiveWithin(int timeout_ms, UdpSocket* socket, ByteSpan buffer, Received* received) {
  pollfd waiting{socket->fd(), POLLIN, 0};
  while (poll(&waiting, 1, timeout_ms) > 0) {
    const ReceiveStatus status = socket->receive(buffer, received);
    if (status != ReceiveStatus::kNothing) return status;
  }
  return socket->receive(buffer, received);
}

TEST(Endpoint, IsWrittenAsPeopleDo) {
  EXPECT_EQ((Endpoint{0xC0A8010AU, 49000}).toString(), "192.168.1.10:49000");
  EXPECT_EQ((Endpoint{0xC0A8010AU, 49000}).addressString(), "192.168.1.10");
  EXPECT_FALSE(Endpoint{}.valid());
  EXPECT_FALSE((Endpoint{kLoopbackAddress, 0}).valid());
  EXPECT_TRUE((Endpoint{kLoopbackAddress, 1}).valid());
}

TEST(SameHost, LoopbackAddressesAreOneComputer) {
  EXPECT_TRUE(isSameHost(0x7F000001U, 0x7F000101U));
  EXPECT_TRUE(isSameHost(0xC0A8010AU, 0xC0A8010AU));
  EXPECT_FALSE(isSameHost(0xC0A8010AU, 0xC0A8010BU));
  EXPECT_FALSE(isSameHost(0x7F000001U, 0xC0A8010AU));
}

TEST(ResolveHost, NamesAndAddresses) {
  EXPECT_EQ(resolveHost("127.0.0.1"), kLoopbackAddress);
  EXPECT_EQ(resolveHost("10.20.30.40"), 0x0A141E28U);
  EXPECT_EQ(resolveHost("localhost") >> 24, 127U);
  try {
    resolveHost("no-such-host.invalid");
    FAIL() << "an unknown name must be refused";
  } catch (const SocketError& error) {
    EXPECT_NE(std::string(error.what()).find("'no-such-host.invalid'"), std::string::npos) << error.what();
  }
}

TEST(LocalAddress, TowardsLoopbackIsLoopback) {
  EXPECT_EQ(localAddressTowards({kLoopbackAddress, 49000}), kLoopbackAddress);
}

TEST(UdpSocket, DeliversWithKernelTimeAndSender) {
  UdpSocket sender(onLoopback());
  UdpSocket receiver(onLoopback());
  ASSERT_NE(receiver.localPort(), 0);
  const Clock clock = hostClock();
  const std::int64_t before = clock.system_ns();
  ASSERT_TRUE(sender.sendTo(kPayload, endpointOf(receiver)));
  std::array<std::uint8_t, 64> buffer{};
  Received received;
  ASSERT_EQ(receiveWithin(kPatienceMs, &receiver, buffer, &received), ReceiveStatus::kReceived);
  const std::int64_t after = clock.system_ns();
  EXPECT_EQ(received.size, 3U);
  EXPECT_TRUE(std::equal(kPayload.begin(), kPayload.end(), buffer.begin()));
  EXPECT_EQ(received.from, endpointOf(sender));
  EXPECT_GE(received.kernel_stamp_ns, before);
  EXPECT_LE(received.kernel_stamp_ns, after);
  EXPECT_EQ(receiver.counters().received, 1U);
  EXPECT_EQ(receiver.counters().received_bytes, 3U);
  EXPECT_EQ(sender.counters().sent, 1U);
  EXPECT_EQ(sender.counters().sent_bytes, 3U);
}

TEST(UdpSocket, NothingThereReturnsAtOnce) {
  UdpSocket socket(onLoopback());
  std::array<std::uint8_t, 8> buffer{};
  Received received;
  EXPECT_EQ(socket.receive(buffer, &received), ReceiveStatus::kNothing);
}

TEST(UdpSocket, TakenPortIsSaidWithTheRemedy) {
  UdpSocket first(onLoopback());
  try {
    UdpSocket second(onLoopback(first.localPort()));
    FAIL() << "two exclusive sockets on one port";
  } catch (const SocketError& error) {
    EXPECT_EQ(error.errorNumber(), EADDRINUSE);
    const std::string what = error.what();
    EXPECT_NE(what.find("127.0.0.1:" + std::to_string(first.localPort())), std::string::npos) << what;
    EXPECT_NE(what.find("choose another port"), std::string::npos) << what;
  }
}

TEST(UdpSocket, PortCanBeSharedWhenAsked) {
  UdpSocketOptions options = onLoopback();
  options.share_port = true;
  UdpSocket first(options);
  options.bind_port = first.localPort();
  EXPECT_NO_THROW(UdpSocket{options});
}

TEST(UdpSocket, RefusalIsCountedAndHarmless) {
  UdpSocket socket(onLoopback());
  Endpoint closed_port;
  {
    UdpSocket gone(onLoopback());
    closed_port = endpointOf(gone);
  }
  ASSERT_TRUE(socket.sendTo(kPayload, closed_port));
  std::array<std::uint8_t, 8> buffer{};
  Received received;
  // The refusal ends the wait or is found by the read; either way there is nothing to read and no busy loop later.
  EXPECT_EQ(receiveWithin(20, &socket, buffer, &received), ReceiveStatus::kNothing);
  EXPECT_EQ(socket.counters().refused, 1U);
  EXPECT_TRUE(socket.sendTo(kPayload, closed_port)) << "a later send must not fail because of an earlier refusal";
  EXPECT_TRUE(socket.sendTo(kPayload, endpointOf(socket))) << "nor to another address";
  EXPECT_EQ(receiveWithin(kPatienceMs, &socket, buffer, &received), ReceiveStatus::kReceived);
  EXPECT_EQ(socket.counters().send_failures, 0U);
}

TEST(UdpSocket, ARefusalThatSendingMetDoesNotKeepPollAwake) {
  UdpSocket socket(onLoopback());
  Endpoint closed_port;
  {
    UdpSocket gone(onLoopback());
    closed_port = endpointOf(gone);
  }
  pollfd end{socket.fd(), POLLIN, 0};
  ASSERT_TRUE(socket.sendTo(kPayload, closed_port));
  ASSERT_EQ(poll(&end, 1, kPatienceMs), 1);
  ASSERT_TRUE(socket.sendTo(kPayload, endpointOf(socket)));
  ASSERT_EQ(socket.counters().refused, 1U);
  std::array<std::uint8_t, 8> buffer{};
  Received received;
  ASSERT_EQ(receiveWithin(kPatienceMs, &socket, buffer, &received), ReceiveStatus::kReceived);
  EXPECT_EQ(socket.receive(buffer, &received), ReceiveStatus::kNothing);
  EXPECT_EQ(poll(&end, 1, 0), 0);
}

TEST(UdpSocket, DropsOfTheKernelAreCounted) {
  UdpSocketOptions options = onLoopback();
  options.receive_buffer = 4096;
  UdpSocket receiver(options);
  EXPECT_GT(receiver.receiveBuffer(), 0);
  UdpSocket sender(onLoopback());
  const std::vector<std::uint8_t> payload(1000);
  constexpr std::uint64_t kSent = 200;
  for (std::uint64_t i = 0; i < kSent; ++i) {
    ASSERT_TRUE(sender.sendTo(payload, endpointOf(receiver)));
  }
  std::array<std::uint8_t, 2048> buffer{};
  Received received;
  std::uint64_t read = 0;
  while (receiver.receive(buffer, &received) == ReceiveStatus::kReceived) {
    ++read;
  }
  ASSERT_LT(read, kSent);
  // The kernel reports the count with the next datagram.
  ASSERT_TRUE(sender.sendTo(payload, endpointOf(receiver)));
  ASSERT_EQ(receiveWithin(kPatienceMs, &receiver, buffer, &received), ReceiveStatus::kReceived);
  EXPECT_EQ(receiver.counters().dropped, kSent - read);
}

TEST(UdpSocket, TruncationIsCounted) {
  UdpSocket socket(onLoopback());
  const std::vector<std::uint8_t> payload(100);
  ASSERT_TRUE(socket.sendTo(payload, endpointOf(socket)));
  std::array<std::uint8_t, 10> buffer{};
  Received received;
  ASSERT_EQ(receiveWithin(kPatienceMs, &socket, buffer, &received), ReceiveStatus::kReceived);
  EXPECT_EQ(received.size, 10U);
  EXPECT_EQ(socket.counters().truncated, 1U);
}

TEST(UdpSocket, LargestDatagramArrivesWhole) {
  UdpSocket socket(onLoopback());
  std::vector<std::uint8_t> payload(65507);
  payload.back() = 77;
  ASSERT_TRUE(socket.sendTo(payload, endpointOf(socket)));
  std::vector<std::uint8_t> buffer(65536);
  Received received;
  ASSERT_EQ(receiveWithin(kPatienceMs, &socket, buffer, &received), ReceiveStatus::kReceived);
  EXPECT_EQ(received.size, payload.size());
  EXPECT_EQ(buffer[65506], 77);
  EXPECT_EQ(socket.counters().truncated, 0U);
}

TEST(UdpSocket, TooLargeIsRefusedWithAReason) {
  UdpSocket socket(onLoopback());
  int reason = 0;
  EXPECT_FALSE(socket.sendTo(std::vector<std::uint8_t>(70000), endpointOf(socket), &reason));
  EXPECT_EQ(reason, EMSGSIZE);
  EXPECT_EQ(socket.counters().send_failures, 1U);
}

TEST(UdpSocket, MovesWithItsPort) {
  UdpSocket first(onLoopback());
  const std::uint16_t port = first.localPort();
  UdpSocket second(std::move(first));
  EXPECT_EQ(second.localPort(), port);
  ASSERT_TRUE(second.sendTo(kPayload, {kLoopbackAddress, port}));
  std::array<std::uint8_t, 8> buffer{};
  Received received;
  EXPECT_EQ(receiveWithin(kPatienceMs, &second, buffer, &received), ReceiveStatus::kReceived);
}

TEST(UdpSocket, HearsMulticastOnLoopback) {
  const std::uint32_t group = 0xEFFF0101U;  // 239.255.1.1
  UdpSocketOptions options;
  options.share_port = true;
  UdpSocket listener(options);
  const std::vector<std::string> joined = listener.joinOnAllInterfaces(group);
  ASSERT_NE(std::find(joined.begin(), joined.end(), "lo"), joined.end());
  EXPECT_EQ(listener.joinOnAllInterfaces(group), joined) << "joining again is harmless";

  const int sender = socket(AF_INET, SOCK_DGRAM, 0);
  ip_mreqn interface {};
  interface.imr_ifindex = static_cast<int>(if_nametoindex("lo"));
  ASSERT_EQ(setsockopt(sender, IPPROTO_IP, IP_MULTICAST_IF, &interface, sizeof(interface)), 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(group);
  to.sin_port = htons(listener.localPort());
  ASSERT_EQ(sendto(sender, kPayload.data(), kPayload.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof(to)), 3);
  std::array<std::uint8_t, 8> buffer{};
  Received received;
  EXPECT_EQ(receiveWithin(kPatienceMs, &listener, buffer, &received), ReceiveStatus::kReceived);
  close(sender);
}

}  // namespace
}  // namespace xplane_bridge::core
