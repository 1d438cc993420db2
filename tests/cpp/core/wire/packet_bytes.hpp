#pragma once

/// Packets put together byte by byte, without the library.

#include <array>
#include <cstdint>
#include <cstring>
#include <vector>

namespace xplane_bridge::core {

using Bytes = std::vector<std::uint8_t>;

inline Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

inline Bytes text(const char* chars, std::size_t size) {
  Bytes bytes(size, 0);
  std::memcpy(bytes.data(), chars, std::strlen(chars));
  return bytes;
}

/// Little-endian bytes of the bits given: the tests' own way, not the library's.
inline Bytes word(std::uint32_t bits) {
  return {static_cast<std::uint8_t>(bits & 0xFFU), static_cast<std::uint8_t>((bits >> 8) & 0xFFU),
          static_cast<std::uint8_t>((bits >> 16) & 0xFFU), static_cast<std::uint8_t>(bits >> 24)};
}

inline Bytes number(float value) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof(bits));
  return word(bits);
}

inline Bytes number(double value) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof(bits));
  return word(static_cast<std::uint32_t>(bits & 0xFFFFFFFFU)) + word(static_cast<std::uint32_t>(bits >> 32));
}

inline Bytes dataRow(std::int32_t index, const std::array<float, 8>& values) {
  Bytes row = word(static_cast<std::uint32_t>(index));
  for (const float value : values) {
    row = row + number(value);
  }
  return row;
}

inline Bytes rpos(double longitude, double latitude, float roll_rate) {
  Bytes packet = text("RPOS4", 5) + number(longitude) + number(latitude) + number(100.0);
  for (int i = 0; i < 7; ++i) {
    packet = packet + number(0.5F);
  }
  return packet + number(roll_rate) + number(0.0F) + number(0.0F);
}

/// A vector with exactly its bytes on the heap, so that the address sanitizer sees a read one past the end.
inline Bytes tight(const Bytes& bytes) {
  Bytes copy(bytes);
  copy.shrink_to_fit();
  return copy;
}

}  // namespace xplane_bridge::core
