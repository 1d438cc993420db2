#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "xplane_bridge/core/base/conformance.hpp"

namespace core = xplane_bridge::core;

/// Reads arbitrary bytes as what the doctor's card has found: refused in words, or taken.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  try {
    const core::Conformance found = core::conformanceFromText(std::string(bytes, bytes + size));
    if (found.refuted.empty() && found.otherwise() != 0) std::abort();
  } catch (const core::ConformanceError& error) {
    if (*error.what() == '\0') std::abort();
  }
  return 0;
}
