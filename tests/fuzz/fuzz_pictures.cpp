#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "xplane_bridge/vision/picture_stream.hpp"

namespace vision = xplane_bridge::vision;

/// Reads arbitrary bytes as a sender's stream, in two pieces, and checks what the reader promises.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  vision::PictureStreamReader reader;
  const std::size_t first = size > 0 ? bytes[0] % size : 0;
  reader.add(bytes, first);
  for (int piece = 0; piece < 2; ++piece) {
    while (const auto message = reader.next()) {
      if (const auto* picture = std::get_if<vision::SentPicture>(&*message)) {
        const auto jpeg = vision::jpegSize(picture->jpeg.data(), picture->jpeg.size());
        if (!jpeg.has_value() || jpeg->first != picture->width || picture->jpeg.size() > size) std::abort();
      }
    }
    if ((reader.fault() == vision::StreamFault::kNone) != reader.problem().empty()) std::abort();
    reader.add(bytes + first, piece == 0 ? size - first : 0);
  }
  return 0;
}
