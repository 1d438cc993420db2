#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "golden_packets.hpp"
#include "packet_bytes.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {
namespace {

/// Reads everything the decoders hand out, so that sanitizers see every byte that is touched. Returns how many decoders
/// accepted the datagram, and adds the NaN and infinite values met to `odd_values`.
int decodeEverything(ByteView datagram, std::size_t* odd_values) {
  int accepted = 0;
  if (const auto data = decodeData(datagram)) {
    ++accepted;
    *odd_values += inspect(*data).non_finite_values;
  }
  if (const auto rref = decodeRref(datagram)) {
    ++accepted;
    for (std::size_t i = 0; i < rref->size(); ++i) {
      *odd_values += std::isfinite((*rref)[i].value) ? 0U : 1U;
    }
  }
  if (const auto position = decodeRpos(datagram)) {
    ++accepted;
    EXPECT_LE(std::abs(position->latitude_deg), 90.0);
    EXPECT_TRUE(std::isfinite(position->yaw_rate_radps));
  }
  if (const auto becn = decodeBeacon(datagram)) {
    ++accepted;
    EXPECT_LE(becn->computer_name.size() + 22, datagram.size());
    EXPECT_NE(becn->port, 0);
    EXPECT_EQ(std::string(becn->computer_name).find('\0'), std::string::npos);
  }
  if (const auto dref = decodeDref(datagram)) {
    ++accepted;
    EXPECT_EQ(std::string(dref->path).find('\0'), std::string::npos);
  }
  if (const auto terrain = decodeTerr(datagram)) {
    ++accepted;
    EXPECT_TRUE(std::isfinite(terrain->terrain_elevation_m));
  }
  if (const auto posi = decodePosi(datagram)) {
    ++accepted;
    EXPECT_TRUE(std::isfinite(posi->elevation_m));
  }
  EXPECT_LE(accepted, 1) << "one datagram, two messages";
  return accepted;
}

TEST(Mutation, NoMutilatedPacketIsReadPastItsEnd) {
  std::minstd_rand random(20110601);
  const auto below = [&random](std::size_t limit) { return static_cast<std::size_t>(random()) % limit; };
  const std::vector<GoldenPacket> packets = loadGoldenPackets();
  int accepted = 0;
  std::size_t odd_values = 0;
  for (int round = 0; round < 20000; ++round) {
    Bytes packet = packets[below(packets.size())].bytes;
    if (packet.size() > 600) {
      packet.resize(5 + below(600));
    }
    for (std::size_t edits = below(6); edits > 0; --edits) {
      packet[below(packet.size())] = static_cast<std::uint8_t>(below(256));
    }
    switch (below(4)) {
      case 0:
        packet.resize(below(packet.size() + 1));
        break;
      case 1:
        packet.resize(packet.size() + below(80), static_cast<std::uint8_t>(below(256)));
        break;
      default:
        break;
    }
    accepted += decodeEverything(tight(packet), &odd_values);
  }
  // Both sides of the decoders' checks must have been walked often.
  EXPECT_GT(accepted, 1000);
  EXPECT_LT(accepted, 19000);
  EXPECT_GT(odd_values, 0U);
}

}  // namespace
}  // namespace xplane_bridge::core
