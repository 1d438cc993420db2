#include "xplane_bridge/core/wire/udp_hub.hpp"

#include <poll.h>

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <memory>

namespace xplane_bridge::core {
namespace {

class UdpHubTest : public testing::Test {
 protected:
  std::shared_ptr<DatagramSource> open() {
    UdpSocketOptions options;
    options.bind_address = kLoopbackAddress;
    return hub_.open("test", options);
  }
  static void send(DatagramSource* from, const DatagramSource& to) {
    const std::array<std::uint8_t, 3> payload{1, 2, 3};
    ASSERT_TRUE(from->sendTo({payload.data(), payload.size()}, {kLoopbackAddress, to.localPort()}));
  }

  UdpHub hub_;
};

TEST_F(UdpHubTest, SaysWhichSourceHasADatagram) {
  const auto first = open();
  const auto second = open();
  hub_.wait(0);
  EXPECT_FALSE(hub_.hasInput(*first));
  send(first.get(), *second);
  hub_.wait(10'000);
  EXPECT_FALSE(hub_.hasInput(*first));
  ASSERT_TRUE(hub_.hasInput(*second));
  std::array<std::uint8_t, 16> buffer;
  Received received;
  ASSERT_EQ(second->receive(buffer, &received), ReceiveStatus::kReceived);
  EXPECT_EQ(received.size, 3U);
  EXPECT_EQ(received.from.port, first->localPort());
  hub_.wait(0);
  EXPECT_FALSE(hub_.hasInput(*second));
}

TEST_F(UdpHubTest, IgnoredSourcesMayStillSend) {
  const auto first = open();
  const auto second = open();
  hub_.ignore(*second);
  send(first.get(), *second);
  hub_.wait(0);
  EXPECT_FALSE(hub_.hasInput(*second));
  send(second.get(), *first);
  hub_.wait(10'000);
  EXPECT_TRUE(hub_.hasInput(*first));
}

TEST_F(UdpHubTest, WaitsForOneSourceAndFindsTheOthersWithIt) {
  const auto first = open();
  const auto second = open();
  send(first.get(), *first);
  hub_.waitFor(*second, 50);
  EXPECT_TRUE(hub_.hasInput(*first)) << "found, when the time is over";
  EXPECT_FALSE(hub_.hasInput(*second));
  send(first.get(), *second);
  hub_.waitFor(*second, 600'000);  // would last ten minutes
  EXPECT_TRUE(hub_.hasInput(*first));
  EXPECT_TRUE(hub_.hasInput(*second));
}

TEST_F(UdpHubTest, WakeEndsTheWaitForOneSource) {
  const auto source = open();
  hub_.wake();
  hub_.waitFor(*source, 600'000);  // would last ten minutes
  EXPECT_FALSE(hub_.hasInput(*source));
}

bool readable(int fd, int timeout_ms = 0) {
  pollfd asked{fd, POLLIN, 0};
  return poll(&asked, 1, timeout_ms) == 1;
}

TEST_F(UdpHubTest, HasADescriptorForOneSource) {
  const auto first = open();
  auto second = open();
  const int fd = hub_.fdFor(second.get());
  send(first.get(), *first);
  hub_.wait(10'000);
  ASSERT_TRUE(hub_.hasInput(*first));
  EXPECT_FALSE(readable(fd));
  EXPECT_EQ(hub_.fdFor(nullptr), fd);
  EXPECT_TRUE(readable(fd)) << "for any";
  EXPECT_EQ(hub_.fdFor(second.get()), fd);
  EXPECT_FALSE(readable(fd));
  send(first.get(), *second);
  EXPECT_TRUE(readable(fd, 10'000));
  second.reset();
  EXPECT_FALSE(readable(fd));
  EXPECT_EQ(hub_.fdFor(first.get()), fd);
  EXPECT_TRUE(readable(fd)) << "from one that is closed to another";
}

TEST_F(UdpHubTest, WakeMakesTheDescriptorForOneSourceReadable) {
  const auto source = open();
  const int fd = hub_.fdFor(source.get());
  EXPECT_FALSE(readable(fd));
  hub_.wake();
  EXPECT_TRUE(readable(fd));
  hub_.wait(0);
  EXPECT_FALSE(readable(fd));
}

TEST_F(UdpHubTest, WakeEndsTheNextWaitOnce) {
  hub_.wake();
  hub_.wake();
  hub_.wait(600'000);  // would last ten minutes
  const auto source = open();
  hub_.wait(0);
  EXPECT_FALSE(hub_.hasInput(*source));
}

TEST_F(UdpHubTest, TakenPortIsRefused) {
  const auto first = open();
  UdpSocketOptions options;
  options.bind_address = kLoopbackAddress;
  options.bind_port = first->localPort();
  EXPECT_THROW(hub_.open("second", options), SocketError);
}

}  // namespace
}  // namespace xplane_bridge::core
