#include "xplane_bridge/core/link/terrain_query.hpp"

#include <poll.h>

#include <array>
#include <cmath>

#include "xplane_bridge/core/wire/udp_socket.hpp"

namespace xplane_bridge::core {
namespace {

constexpr int kLookMs = 50;
constexpr int kLooksAtOneQuestion = 6;  // a datagram may be lost

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
    const DecodeResult<XpcTerrain> terrain = decodeTerr({buffer.data(), received.size});
    if (terrain) return TerrainAnswer{*terrain, ""};
    if (terrain.error() == DecodeError::kOutOfRange) {
      return TerrainAnswer{std::nullopt,
                           "X-Plane finds no terrain there: its scenery is loaded only around the aircraft"};
    }
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
  try {
    UdpSocket socket{UdpSocketOptions{}};
    const int looks = static_cast<int>(std::ceil(1e3 * timeout_s / kLookMs));
    for (int look = 0; look < looks && !stopping(); ++look) {
      if (look % kLooksAtOneQuestion == 0) socket.sendTo({question.data(), *size}, plugin);
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
