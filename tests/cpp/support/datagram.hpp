#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "xplane_bridge/core/base/bytes.hpp"
#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core {

/// Bytes of a datagram and how the tests make them, from the layout in docs/protocol.md.
struct Datagram {
  std::vector<std::uint8_t> bytes;

  static Datagram fromHex(const std::string& hex) {
    Datagram d;
    for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
      d.bytes.push_back(static_cast<std::uint8_t>(std::stoi(hex.substr(i, 2), nullptr, 16)));
    }
    return d;
  }
  static Datagram labelled(const char* label) {
    Datagram d;
    for (int i = 0; i < 5; ++i) d.bytes.push_back(static_cast<std::uint8_t>(label[i]));
    return d;
  }
  template <typename T>
  Datagram& put(T value) {
    std::uint8_t raw[sizeof(T)];
    storeLittleEndian(value, raw);
    bytes.insert(bytes.end(), raw, raw + sizeof(T));
    return *this;
  }
  Datagram& row(std::int32_t index, const std::vector<float>& slots) {
    put(index);
    for (std::size_t i = 0; i < 8; ++i) put(i < slots.size() ? slots[i] : kUnusedSlot);
    return *this;
  }
  Datagram& pair(std::int32_t index, float value) { return put(index).put(value); }

  RrefView rref() const { return *decodeRref(bytes); }
  DataView data() const { return *decodeData(bytes); }
};

}  // namespace xplane_bridge::core
