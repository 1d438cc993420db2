#pragma once

/// What the codecs of X-Plane's packets share: fields in a row, labels and lengths, limits. Of lib/core/wire alone.

#include <cmath>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <string_view>

#include "xplane_bridge/core/wire/packets.hpp"

namespace xplane_bridge::core::packet_fields {

constexpr double kMaxLatitudeDeg = 90.0;
constexpr double kMaxLongitudeDeg = 360.0;  // X-Plane sends -180..180; a sender using 0..360 is no reason to lose a fix

inline bool hasLabel(ByteView datagram, const char* label) { return std::memcmp(datagram.data(), label, 4) == 0; }

inline bool isFinite(float value) {
  // By bits, so that -ffast-math in a user's flags cannot remove the check.
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof(bits));
  return (bits & 0x7F800000U) != 0x7F800000U;
}

inline bool isFinite(double value) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof(bits));
  return (bits & 0x7FF0000000000000ULL) != 0x7FF0000000000000ULL;
}

template <typename T>
inline bool allFinite(std::initializer_list<T> values) {
  for (const T value : values) {
    if (!isFinite(value)) {
      return false;
    }
  }
  return true;
}

inline bool isPosition(double latitude_deg, double longitude_deg) {
  return std::abs(latitude_deg) <= kMaxLatitudeDeg && std::abs(longitude_deg) <= kMaxLongitudeDeg;
}

/// Label and length of a message with one size.
inline DecodeError checkFixed(ByteView datagram, const char* label, std::size_t size) {
  if (datagram.size() < kHeaderSize) {
    return DecodeError::kTooShort;
  }
  if (!hasLabel(datagram, label)) {
    return DecodeError::kWrongLabel;
  }
  if (datagram.size() < size) {
    return DecodeError::kTooShort;
  }
  return datagram.size() > size ? DecodeError::kTooLong : DecodeError::kNone;
}

/// Reads consecutive fields; the caller has checked the length.
class FieldReader {
 public:
  explicit FieldReader(const std::uint8_t* from) : at_(from) {}
  template <typename T>
  T next() {
    const T value = loadLittleEndian<T>(at_);
    at_ += sizeof(T);
    return value;
  }

 private:
  const std::uint8_t* at_;
};

/// Writes consecutive fields; the caller has checked the room.
class FieldWriter {
 public:
  FieldWriter(ByteSpan out, const char* label) : begin_(out.data()), at_(out.data()) {
    std::memcpy(at_, label, 4);
    at_[4] = 0;
    at_ += kHeaderSize;
  }

  template <typename T>
  void put(T value) {
    storeLittleEndian(value, at_);
    at_ += sizeof(T);
  }

  void putText(std::string_view text) {
    if (!text.empty()) {
      std::memcpy(at_, text.data(), text.size());
      at_ += text.size();
    }
  }

  /// Text in a field of fixed width, the rest NUL.
  void putText(std::string_view text, std::size_t width) {
    putText(text);
    putZeros(width - text.size());
  }

  void putZeros(std::size_t count) {
    std::memset(at_, 0, count);
    at_ += count;
  }

  std::size_t size() const { return static_cast<std::size_t>(at_ - begin_); }

 private:
  std::uint8_t* begin_;
  std::uint8_t* at_;
};

}  // namespace xplane_bridge::core::packet_fields
