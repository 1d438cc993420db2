#include "xplane_bridge/core/link/terrain_query.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "xplane_bridge/core/wire/udp_socket.hpp"

namespace xplane_bridge::core {
namespace {

/// An X-Plane Connect whose first probe of the ground fails: it answers GETP, and GETT never.
class PluginWithoutScenery {
 public:
  PluginWithoutScenery() : socket_(loopback()), thread_([this] { answer(); }) {}
  ~PluginWithoutScenery() {
    quit_ = true;
    thread_.join();
  }
  PluginWithoutScenery(const PluginWithoutScenery&) = delete;
  PluginWithoutScenery& operator=(const PluginWithoutScenery&) = delete;

  Endpoint endpoint() const { return {kLoopbackAddress, socket_.localPort()}; }

 private:
  static UdpSocketOptions loopback() {
    UdpSocketOptions options;
    options.bind_address = kLoopbackAddress;
    return options;
  }
  void answer() {
    std::array<std::uint8_t, 64> question;
    Received received;
    while (!quit_) {
      if (socket_.receive(question, &received) != ReceiveStatus::kReceived) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      } else if (std::string(question.begin(), question.begin() + 4) == "GETP") {
        std::vector<std::uint8_t> position(kPosiSize, 0);
        const std::string label = "POSI";
        std::copy(label.begin(), label.end(), position.begin());
        socket_.sendTo({position.data(), position.size()}, received.from);
      }
    }
  }

  UdpSocket socket_;
  std::atomic<bool> quit_{false};
  std::thread thread_;
};

TEST(TerrainQuery, APluginThatAnswersWithoutSceneryIsNotTakenForNone) {
  const PluginWithoutScenery plugin;
  for (const double timeout_s : {0.2, 5.0}) {
    const TerrainAnswer answer = askTerrain(plugin.endpoint(), 37.0, 127.0, timeout_s, [] { return false; });
    EXPECT_FALSE(answer.terrain);
    EXPECT_EQ(answer.problem, "X-Plane finds no terrain there: its scenery is loaded only around the aircraft");
  }
}

}  // namespace
}  // namespace xplane_bridge::core
