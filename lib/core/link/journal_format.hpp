#pragma once

#include <string>
#include <vector>

#include "xplane_bridge/core/link/journal.hpp"

/// The text of a journal's file: docs/nodes/journal.md.
namespace xplane_bridge::core {

constexpr int kJournalVersion = 1;

/// What a file holds, or why it cannot be understood. Of another version there are no entries.
struct JournalContent {
  int version = kJournalVersion;
  std::vector<JournalEntry> entries;
  std::string damage;
};

JournalContent parseJournal(const std::string& text);
/// Throws JournalError for a value that is not finite.
std::string toText(const std::vector<JournalEntry>& entries);

}  // namespace xplane_bridge::core
