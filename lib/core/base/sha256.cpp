#include "xplane_bridge/core/base/sha256.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace xplane_bridge::core {
namespace {

constexpr std::size_t kBlockSize = 64;
constexpr std::size_t kLengthSize = 8;
constexpr std::size_t kRounds = 64;
constexpr unsigned kByteBits = 8;

constexpr std::array<std::uint32_t, kRounds> kConstants = {
    0x428a2f98U, 0x71374491U, 0xb5c0fbcfU, 0xe9b5dba5U, 0x3956c25bU, 0x59f111f1U, 0x923f82a4U, 0xab1c5ed5U,
    0xd807aa98U, 0x12835b01U, 0x243185beU, 0x550c7dc3U, 0x72be5d74U, 0x80deb1feU, 0x9bdc06a7U, 0xc19bf174U,
    0xe49b69c1U, 0xefbe4786U, 0x0fc19dc6U, 0x240ca1ccU, 0x2de92c6fU, 0x4a7484aaU, 0x5cb0a9dcU, 0x76f988daU,
    0x983e5152U, 0xa831c66dU, 0xb00327c8U, 0xbf597fc7U, 0xc6e00bf3U, 0xd5a79147U, 0x06ca6351U, 0x14292967U,
    0x27b70a85U, 0x2e1b2138U, 0x4d2c6dfcU, 0x53380d13U, 0x650a7354U, 0x766a0abbU, 0x81c2c92eU, 0x92722c85U,
    0xa2bfe8a1U, 0xa81a664bU, 0xc24b8b70U, 0xc76c51a3U, 0xd192e819U, 0xd6990624U, 0xf40e3585U, 0x106aa070U,
    0x19a4c116U, 0x1e376c08U, 0x2748774cU, 0x34b0bcb5U, 0x391c0cb3U, 0x4ed8aa4aU, 0x5b9cca4fU, 0x682e6ff3U,
    0x748f82eeU, 0x78a5636fU, 0x84c87814U, 0x8cc70208U, 0x90befffaU, 0xa4506cebU, 0xbef9a3f7U, 0xc67178f2U};

using Hash = std::array<std::uint32_t, 8>;

constexpr std::uint32_t rotated(std::uint32_t value, unsigned bits) { return value >> bits | value << (32U - bits); }

std::uint32_t wordAt(const std::string& padded, std::size_t at) {
  std::uint32_t word = 0;
  for (std::size_t i = 0; i < sizeof(word); ++i) {
    word = word << kByteBits | static_cast<std::uint8_t>(padded[at + i]);
  }
  return word;
}

void takeBlock(const std::string& padded, std::size_t at, Hash* hash) {
  std::array<std::uint32_t, kRounds> words{};
  for (std::size_t i = 0; i < kRounds; ++i) {
    if (i < 16) {
      words[i] = wordAt(padded, at + i * sizeof(std::uint32_t));
      continue;
    }
    const std::uint32_t w15 = words[i - 15];
    const std::uint32_t w2 = words[i - 2];
    words[i] = words[i - 16] + (rotated(w15, 7) ^ rotated(w15, 18) ^ w15 >> 3U) + words[i - 7] +
               (rotated(w2, 17) ^ rotated(w2, 19) ^ w2 >> 10U);
  }
  auto [a, b, c, d, e, f, g, h] = *hash;
  for (std::size_t i = 0; i < kRounds; ++i) {
    const std::uint32_t first =
        h + (rotated(e, 6) ^ rotated(e, 11) ^ rotated(e, 25)) + ((e & f) ^ (~e & g)) + kConstants[i] + words[i];
    const std::uint32_t second = (rotated(a, 2) ^ rotated(a, 13) ^ rotated(a, 22)) + ((a & b) ^ (a & c) ^ (b & c));
    h = g;
    g = f;
    f = e;
    e = d + first;
    d = c;
    c = b;
    b = a;
    a = first + second;
  }
  const Hash added = {a, b, c, d, e, f, g, h};
  for (std::size_t i = 0; i < added.size(); ++i) (*hash)[i] += added[i];
}

}  // namespace

std::string sha256(std::string_view bytes) {
  std::string padded(bytes);
  padded += '\x80';
  while (padded.size() % kBlockSize != kBlockSize - kLengthSize) padded += '\0';
  const std::uint64_t bits = static_cast<std::uint64_t>(bytes.size()) * kByteBits;
  for (unsigned i = kLengthSize; i-- > 0;) padded += static_cast<char>(bits >> (i * kByteBits) & 0xFFU);

  Hash hash = {0x6a09e667U, 0xbb67ae85U, 0x3c6ef372U, 0xa54ff53aU, 0x510e527fU, 0x9b05688cU, 0x1f83d9abU, 0x5be0cd19U};
  for (std::size_t at = 0; at < padded.size(); at += kBlockSize) takeBlock(padded, at, &hash);

  std::string out;
  for (const std::uint32_t word : hash) {
    for (unsigned shift = 32U; shift > 0; shift -= 4U) out += "0123456789abcdef"[word >> (shift - 4U) & 0xFU];
  }
  return out;
}

}  // namespace xplane_bridge::core
