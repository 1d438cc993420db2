#pragma once

/// What bench_window draws into the upper left corner of each picture, and how it is read back.

#include <array>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <optional>

namespace xplane_bridge::bench {

/// Of a picture: its number, and when its drawing began.
struct Drawn {
  std::uint32_t frame = 0;
  std::int64_t time_ns = 0;  ///< [ns] wall time
};

constexpr int kCell = 4;                         // [px] side of a bit's square
constexpr int kStripBits = 32 + 64 + 32;         // frame, time, check
constexpr int kStripWidth = kStripBits * kCell;  // [px]

inline std::int64_t wallTime() {
  timespec t{};
  clock_gettime(CLOCK_REALTIME, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

inline std::array<std::uint32_t, 4> stripWords(const Drawn& drawn) {
  const auto time = static_cast<std::uint64_t>(drawn.time_ns);
  const auto low = static_cast<std::uint32_t>(time);
  const auto high = static_cast<std::uint32_t>(time >> 32U);
  return {drawn.frame, low, high, ~(drawn.frame ^ low ^ high)};
}

/// @param pixels rows of `stride` bytes with `channels` bytes a pixel
inline void drawStrip(const Drawn& drawn, std::uint8_t* pixels, std::size_t stride, std::size_t channels) {
  const auto words = stripWords(drawn);
  for (std::size_t x = 0; x < kStripWidth; ++x) {
    const std::size_t bit = x / kCell;
    const auto value = static_cast<std::uint8_t>((words[bit / 32] >> (bit % 32) & 1U) * 255U);
    for (std::size_t y = 0; y < kCell; ++y) {
      for (std::size_t c = 0; c < channels; ++c) pixels[y * stride + x * channels + c] = value;
    }
  }
}

/// Empty when the picture has no strip.
inline std::optional<Drawn> readStrip(const std::uint8_t* pixels, std::size_t stride, std::size_t channels) {
  std::array<std::uint32_t, 4> words{};
  for (std::size_t bit = 0; bit < kStripBits; ++bit) {
    const std::uint8_t value = pixels[kCell / 2 * stride + (bit * kCell + kCell / 2) * channels];
    if (value > 127) words[bit / 32] |= 1U << (bit % 32);
  }
  const Drawn drawn{words[0], static_cast<std::int64_t>(std::uint64_t{words[2]} << 32U | words[1])};
  if (stripWords(drawn) != words) return std::nullopt;
  return drawn;
}

}  // namespace xplane_bridge::bench
