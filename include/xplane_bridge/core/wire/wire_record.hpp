#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "xplane_bridge/core/base/bytes.hpp"
#include "xplane_bridge/core/wire/datagram_source.hpp"

/// What happens at the seam of datagram_source.hpp, one record each, in the order in which a node took it up. The same
/// bytes stand in the buffer of a WireLog and in the file that a ReplayHub plays.
namespace xplane_bridge::core {

enum class WireKind : std::uint8_t {
  kOpened = 1,    ///< a source was opened; payload: its name, peer.port: its own port
  kReceived = 2,  ///< payload: the datagram; count: what the kernel has dropped on this source so far
  kSent = 3,      ///< payload: the datagram; count: error number of one that was refused
  kWaited = 4,    ///< wait() has ended
  kInput = 5,     ///< what reached the node by another way; payload: its name, a zero byte, its bytes
  kRefused = 6,   ///< count: "port unreachable" on this source so far
  kLost = 7,      ///< count: records for which there was no room
  kNamed = 8,     ///< of another program's recording: payload: a dataref, count: its number
  kValues = 9,    ///< of another program's recording: answers; payload: pairs of a dataref's number and its value
};

struct WireRecord {
  WireKind kind = WireKind::kWaited;
  std::uint16_t source = 0;    ///< number of the source, in the order of opening
  std::int64_t wall_ns = 0;    ///< [ns] since 1970, the host's
  std::int64_t steady_ns = 0;  ///< [ns] of the host's steady clock
  std::int64_t kernel_ns = 0;  ///< [ns] since 1970: receive time of the kernel; 0: none
  Endpoint peer;               ///< from, or to
  std::uint32_t count = 0;
  ByteView payload;
};

/// Bytes of a record before its payload.
constexpr std::size_t kWireRecordSize = 44;

/// Appends the record, little-endian.
void appendRecord(const WireRecord& record, std::vector<std::uint8_t>* out);

/// Reads the record at `offset` and moves it on. False at the end, and where the bytes are cut off. The payload is a
/// view of `bytes`.
bool readRecord(ByteView bytes, std::size_t* offset, WireRecord* record);

}  // namespace xplane_bridge::core
