#pragma once

#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>

namespace xplane_bridge::core {

/// What is wrong with the bits of a message's or request's `fields`: those beyond `known`; nullopt: nothing.
inline std::optional<std::string> unknownBits(std::uint32_t fields, std::uint32_t known) {
  const std::uint32_t unknown = fields & ~known;
  if (unknown == 0u) return std::nullopt;
  char text[64];
  std::snprintf(text, sizeof text, "fields is 0x%x: bits 0x%x have no meaning", fields, unknown);
  return text;
}

}  // namespace xplane_bridge::core
