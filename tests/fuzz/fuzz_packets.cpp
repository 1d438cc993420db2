#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "xplane_bridge/core/wire/packets.hpp"

namespace core = xplane_bridge::core;

namespace {

void require(bool condition) {
  if (!condition) {
    std::abort();
  }
}

bool isInside(const void* begin, std::size_t size, core::ByteView datagram) {
  const auto* at = static_cast<const std::uint8_t*>(begin);
  return at >= datagram.begin() && at + size <= datagram.end();
}

}  // namespace

/// Decodes arbitrary bytes as every message and checks what each decoder promises.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const core::ByteView datagram(bytes, size);
  int accepted = 0;
  if (const auto data = core::decodeData(datagram)) {
    ++accepted;
    require(size == core::kHeaderSize + data->size() * core::kDataRowSize);
    require(core::inspect(*data).unknown_rows <= data->size());
    require(data->find((*data)[data->size() - 1].index()).has_value());
  }
  if (const auto rref = core::decodeRref(datagram)) {
    ++accepted;
    require(size == core::kHeaderSize + rref->size() * core::kRrefPairSize);
    std::size_t own_index = 0;
    for (std::size_t i = 0; i < rref->size(); ++i) {
      own_index += (*rref)[i].index == static_cast<std::int32_t>(i) ? 1U : 0U;
    }
    require(own_index <= rref->size());
  }
  if (const auto rpos = core::decodeRpos(datagram)) {
    ++accepted;
    require(std::abs(rpos->latitude_deg) <= 90.0 && std::isfinite(rpos->elevation_m) && std::isfinite(rpos->roll_deg));
  }
  if (const auto beacon = core::decodeBeacon(datagram)) {
    ++accepted;
    require(beacon->port != 0 && isInside(beacon->computer_name.data(), beacon->computer_name.size() + 1, datagram));
  }
  if (const auto dref = core::decodeDref(datagram)) {
    ++accepted;
    require(!dref->path.empty() && isInside(dref->path.data(), dref->path.size() + 1, datagram));
  }
  if (const auto terrain = core::decodeTerr(datagram)) {
    ++accepted;
    require(std::isfinite(terrain->terrain_elevation_m));
  }
  if (const auto position = core::decodePosi(datagram)) {
    ++accepted;
    require(std::isfinite(position->elevation_m));
  }
  require(accepted <= 1);
  require(accepted == 0 || core::classify(datagram) != core::MessageKind::kUnknown);
  return 0;
}
