#include "xplane_bridge/core/link/terrain_query.hpp"

#include <poll.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "xplane_bridge/core/wire/udp_socket.hpp"

namespace xplane_bridge::core {
namespace {

constexpr int kLookMs = 50;
constexpr int kLooksAtOneQuestion = 6;  // a datagram may be lost
constexpr const char* kNoTerrain = "X-Plane finds no terrain there: its scenery is loaded only around the aircraft";

std::string nothingAnswers(const Endpoint& plugin, bool refused) {
  return "nothing " + std::string(refused ? "listens on " : "answers from ") + plugin.toString() +
         ": install NASA's plugin X-Plane Connect in X-Plane, or set the parameter xpc_port";
}

/// What there is to read of the plugin; nullopt: nothing.
std::optional<TerrainAnswer> read(UdpSocket* socket, const Endpoint& plugin) {
  std::array<std::uint8_t, kTerrSize + 1> buffer;
  Received received;
  while (socket->receive(buffer, &received) == ReceiveStatus::kReceived) {
    if (!isSameHost(received.from.address, plugin.address) || received.from.port != plugin.port) continue;
    const ByteView bytes(buffer.data(), received.size);
    // It answers in the order it is asked in, and GETP was sent after GETT.
    if (decodePosi(bytes)) return TerrainAnswer{std::nullopt, kNoTerrain};
    const DecodeResult<XpcTerrain> terrain = decodeTerr(bytes);
    if (terrain) return TerrainAnswer{*terrain, ""};
    if (terrain.error() == DecodeError::kOutOfRange) return TerrainAnswer{std::nullopt, kNoTerrain};
    return TerrainAnswer{std::nullopt, std::string("the answer is no TERR: ") + toString(terrain.error())};
  }
  return std::nullopt;
}

}  // namespace

TerrainAnswer askTerrain(const Endpoint& plugin, double latitude_deg, double longitude_deg, double timeout_s,
                         const std::function<bool()>& stopping) {
  std::array<std::uint8_t, kGettSize> question;
  const EncodeResult size = encodeGett(question, 0, latitude_deg, longitude_deg, 0.0);
  if (!size) return {std::nullopt, std::string("the place cannot be asked for: ") + toString(size.error())};
  // The plugin does not answer at all where its first probe of the ground fails; this it always answers.
  std::array<std::uint8_t, kGetpSize> is_there;
  encodeGetp(is_there, 0);
  try {
    UdpSocket socket{UdpSocketOptions{}};
    const int looks = static_cast<int>(std::ceil(1e3 * timeout_s / kLookMs));
    const int looks_at_one = std::clamp(looks / 2, 1, kLooksAtOneQuestion);
    for (int look = 0; look < looks && !stopping(); ++look) {
      if (look % looks_at_one == 0) {
        socket.sendTo({question.data(), *size}, plugin);
        if (look > 0) socket.sendTo({is_there.data(), is_there.size()}, plugin);
      }
      pollfd waiting{socket.fd(), POLLIN, 0};
      ::poll(&waiting, 1, kLookMs);
      if (const auto answer = read(&socket, plugin)) return *answer;
      if (socket.counters().refused > 0) return {std::nullopt, nothingAnswers(plugin, true)};
    }
  } catch (const SocketError& error) {
    return {std::nullopt, error.what()};
  }
  return {std::nullopt, nothingAnswers(plugin, false)};
}

}  // namespace xplane_bridge::core
