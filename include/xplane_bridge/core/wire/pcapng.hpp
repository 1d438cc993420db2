#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "xplane_bridge/core/base/bytes.hpp"
#include "xplane_bridge/core/wire/datagram_source.hpp"

/// Blocks of pcapng, the format of Wireshark (draft-ietf-opsawg-pcapng), little-endian, times in nanoseconds.
namespace xplane_bridge::core::pcapng {

constexpr std::uint16_t kLinkRawIp = 101;
constexpr std::uint16_t kLinkUser0 = 147;

struct Packet {
  std::uint32_t interface = 0;
  std::int64_t stamp_ns = 0;  ///< [ns] since 1970
  bool outbound = false;
  std::uint64_t dropped = 0;  ///< since the packet before
  ByteView head;              ///< headers, before
  ByteView payload;
  std::string comment;
};

/// `comment` may have any length.
void appendSection(const std::string& application, const std::string& comment, std::vector<std::uint8_t>* out);
void appendInterface(std::uint16_t link_type, const std::string& name, const std::string& description,
                     std::vector<std::uint8_t>* out);
void appendPacket(const Packet& packet, std::vector<std::uint8_t>* out);

/// Bytes of the headers of IPv4 and UDP.
constexpr std::size_t kUdpHeadersSize = 28;
/// The headers of a datagram, with the checksum of IPv4's and none of UDP's.
std::array<std::uint8_t, kUdpHeadersSize> udpHeaders(const Endpoint& from, const Endpoint& to, std::size_t size);

}  // namespace xplane_bridge::core::pcapng
