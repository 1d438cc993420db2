#include "xplane_bridge/core/wire/wire_record.hpp"

#include <array>
#include <cstring>

namespace xplane_bridge::core {

void appendRecord(const WireRecord& record, std::vector<std::uint8_t>* out) {
  std::array<std::uint8_t, kWireRecordSize> head{};
  storeLittleEndian(static_cast<std::uint32_t>(record.payload.size()), head.data());
  head[4] = static_cast<std::uint8_t>(record.kind);
  storeLittleEndian(record.source, &head[6]);
  storeLittleEndian(record.wall_ns, &head[8]);
  storeLittleEndian(record.steady_ns, &head[16]);
  storeLittleEndian(record.kernel_ns, &head[24]);
  storeLittleEndian(record.peer.address, &head[32]);
  storeLittleEndian(record.peer.port, &head[36]);
  storeLittleEndian(record.count, &head[40]);
  out->insert(out->end(), head.begin(), head.end());
  out->insert(out->end(), record.payload.begin(), record.payload.end());
}

bool readRecord(ByteView bytes, std::size_t* offset, WireRecord* record) {
  if (*offset + kWireRecordSize > bytes.size()) return false;
  const std::uint8_t* head = bytes.data() + *offset;
  const auto size = loadLittleEndian<std::uint32_t>(head);
  if (size > bytes.size() - *offset - kWireRecordSize) return false;
  record->kind = static_cast<WireKind>(head[4]);
  record->source = loadLittleEndian<std::uint16_t>(head + 6);
  record->wall_ns = loadLittleEndian<std::int64_t>(head + 8);
  record->steady_ns = loadLittleEndian<std::int64_t>(head + 16);
  record->kernel_ns = loadLittleEndian<std::int64_t>(head + 24);
  record->peer.address = loadLittleEndian<std::uint32_t>(head + 32);
  record->peer.port = loadLittleEndian<std::uint16_t>(head + 36);
  record->count = loadLittleEndian<std::uint32_t>(head + 40);
  record->payload = {head + kWireRecordSize, size};
  *offset += kWireRecordSize + size;
  return true;
}

}  // namespace xplane_bridge::core
