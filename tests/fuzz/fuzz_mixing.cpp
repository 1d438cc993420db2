#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "xplane_bridge/core/surfaces/surface_mixing.hpp"

namespace core = xplane_bridge::core;

/// Reads arbitrary bytes as a mixing file: refused in words, or a model that is written and read again as it is.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  try {
    const core::MixingModel model = core::mixingFromText(std::string(bytes, bytes + size));
    const std::string text = core::toText(model);
    if (core::toText(core::mixingFromText(text)) != text) std::abort();
  } catch (const core::MixingFileError& error) {
    if (*error.what() == '\0') std::abort();
  }
  return 0;
}
