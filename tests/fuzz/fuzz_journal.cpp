#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <unistd.h>

#include "xplane_bridge/core/link/journal.hpp"

namespace core = xplane_bridge::core;
namespace fs = std::filesystem;

/// Finds arbitrary bytes in a journal's file: read, or put aside with a word and empty from then on; what it says is to
/// be undone can be sent.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const fs::path folder = fs::temp_directory_path() / ("fuzz_journal_" + std::to_string(::getpid()));
  const std::string path = (folder / "journal.json").string();
  fs::create_directories(folder);
  std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(bytes), static_cast<std::streamsize>(size));
  const core::Journal journal(path, core::JournalOwner{"/fuzz", 1, 1, "boot", "computer"},
                              [](const core::JournalOwner&) { return false; });
  try {
    for (const core::JournalEntry& entry : journal.entries()) {
      for (const core::UndoOperation& operation : entry.undo) {
        std::uint8_t datagram[core::kMaxUndoSize];
        const auto encoded = core::encodeUndo(core::ByteSpan(datagram, sizeof datagram), operation);
        if (encoded.ok() && *encoded > sizeof datagram) std::abort();
      }
    }
  } catch (const core::JournalError& error) {
    if (*error.what() == '\0') std::abort();
    const bool aside = !fs::exists(path);
    // A journal of another version stays where it is; whatever else cannot be understood is put aside, once.
    if (aside && !journal.entries().empty()) std::abort();
  }
  fs::remove_all(folder);
  return 0;
}
