#pragma once

#include <cstdio>
#include <string>
#include <string_view>

namespace xplane_bridge::core {

/// `text_of(item)` of every item with `separator` between them: "a, b, c". Empty for no items.
template <class Items, class TextOf>
std::string join(const Items& items, std::string_view separator, const TextOf& text_of) {
  std::string out;
  bool first = true;
  for (const auto& item : items) {
    if (!first) out += separator;
    first = false;
    out += text_of(item);
  }
  return out;
}

/// Texts with `separator` between them.
template <class Texts>
std::string join(const Texts& texts, std::string_view separator = ", ") {
  return join(
      texts, separator, [](const auto& text) -> const auto& { return text; });
}

/// "override_joystick" of "sim/operation/override/override_joystick"; a text without a slash as it is.
inline std::string afterLastSlash(const std::string& path) { return path.substr(path.rfind('/') + 1); }

/// A refusal of a number: "low is 1.5: expected 0..1".
inline std::string wrongNumber(const std::string& key, double given, const std::string& expected) {
  char number[32];
  std::snprintf(number, sizeof number, "%g", given);
  return key + " is " + number + ": expected " + expected;
}

}  // namespace xplane_bridge::core
