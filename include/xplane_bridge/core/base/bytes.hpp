#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

namespace xplane_bridge::core {

/// Bytes of another owner, read only. The owner must outlive the view.
class ByteView {
 public:
  constexpr ByteView() = default;
  constexpr ByteView(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  template <std::size_t N>
  constexpr ByteView(const std::array<std::uint8_t, N>& bytes)
      : data_(bytes.data()), size_(N) {}  // NOLINT(google-explicit-constructor)
  ByteView(const std::vector<std::uint8_t>& bytes)
      : data_(bytes.data()), size_(bytes.size()) {}  // NOLINT(google-explicit-constructor)

  constexpr const std::uint8_t* data() const { return data_; }
  constexpr std::size_t size() const { return size_; }
  constexpr bool empty() const { return size_ == 0; }
  constexpr std::uint8_t operator[](std::size_t i) const { return data_[i]; }
  constexpr const std::uint8_t* begin() const { return data_; }
  constexpr const std::uint8_t* end() const { return data_ + size_; }
  /// The first `size` bytes; all of them when there are fewer.
  constexpr ByteView first(std::size_t size) const { return {data_, size < size_ ? size : size_}; }

 private:
  const std::uint8_t* data_ = nullptr;
  std::size_t size_ = 0;
};

/// Bytes of another owner, to be written. The owner must outlive the span.
class ByteSpan {
 public:
  constexpr ByteSpan() = default;
  constexpr ByteSpan(std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  template <std::size_t N>
  constexpr ByteSpan(std::array<std::uint8_t, N>& bytes)
      : data_(bytes.data()), size_(N) {}  // NOLINT(google-explicit-constructor)
  ByteSpan(std::vector<std::uint8_t>& bytes)
      : data_(bytes.data()), size_(bytes.size()) {}  // NOLINT(google-explicit-constructor)

  constexpr std::uint8_t* data() const { return data_; }
  constexpr std::size_t size() const { return size_; }

 private:
  std::uint8_t* data_ = nullptr;
  std::size_t size_ = 0;
};

/// Reads a little-endian number (integer or IEEE 754) from an address of any alignment and on a host of any byte order.
/// The caller guarantees sizeof(T) readable bytes.
template <typename T>
T loadLittleEndian(const std::uint8_t* from) {
  static_assert(std::is_arithmetic_v<T>, "numbers only");
  std::array<std::uint8_t, sizeof(T)> bytes;
  std::memcpy(bytes.data(), from, sizeof(T));
#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
  std::reverse(bytes.begin(), bytes.end());
#endif
  T value;
  std::memcpy(&value, bytes.data(), sizeof(T));
  return value;
}

/// Writes a little-endian number; the mirror of loadLittleEndian().
template <typename T>
void storeLittleEndian(T value, std::uint8_t* to) {
  static_assert(std::is_arithmetic_v<T>, "numbers only");
  std::array<std::uint8_t, sizeof(T)> bytes;
  std::memcpy(bytes.data(), &value, sizeof(T));
#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
  std::reverse(bytes.begin(), bytes.end());
#endif
  std::memcpy(to, bytes.data(), sizeof(T));
}

}  // namespace xplane_bridge::core
