#include "xplane_bridge/actuation/pausing.hpp"

#include <algorithm>
#include <mutex>
#include <utility>
#include <vector>

#include "xplane_bridge/core/base/thread_turns.hpp"
#include "xplane_bridge/core/link/journal.hpp"
#include "xplane_bridge/core/simulator/simulator_settings.hpp"

namespace xplane_bridge {
namespace {

constexpr const char* kPauseEntry = "pause:flight change";

std::vector<core::JournalEntry> ownPauses(const core::Journal& journal) {
  std::vector<core::JournalEntry> own = journal.own();
  own.erase(std::remove_if(own.begin(), own.end(),
                           [](const core::JournalEntry& entry) { return entry.purpose != kPausePurpose; }),
            own.end());
  return own;
}

}  // namespace

PauseOutcome setPaused(core::SimulatorPort* link, bool pause, double timeout_s, const std::function<bool()>& given_up,
                       const std::function<void()>& before) {
  // One after the other: two that read before either has toggled would toggle twice.
  static core::TurnMutex turn;
  const std::lock_guard<core::TurnMutex> lock(turn);
  // Read now: the link's own status may be a fifth of a second old, and a toggle on that would do the opposite.
  const auto shown = link->read({core::kPausedDataref}, timeout_s);
  if (shown.empty() || !shown.front()) return PauseOutcome::kUnknown;
  const bool was_so = (*shown.front() != 0.0F) == pause;
  if (!was_so && before) before();
  if (!was_so) link->command(core::pauseCommand(pause, link->status().version));
  const auto is_so = [&] { return link->status().paused == pause; };
  link->waitUntil([&] { return given_up() || is_so(); }, timeout_s);
  if (!is_so()) return PauseOutcome::kNotFollowed;
  return was_so ? PauseOutcome::kWasSo : PauseOutcome::kFollowed;
}

const char* const kPausePurpose = "pause";

void recordPause(core::SimulatorPort* link) {
  if (const auto journal = link->journal()) journal->record(kPauseEntry, kPausePurpose, {core::UndoPause{}});
}

void forgetPause(core::SimulatorPort* link) {
  if (const auto journal = link->journal()) journal->remove({kPauseEntry});
}

bool isPauseOurs(core::SimulatorPort* link) {
  const auto journal = link->journal();
  return journal && !ownPauses(*journal).empty();
}

void leavePause(core::SimulatorPort* link) {
  if (const auto journal = link->journal()) journal->leave({kPauseEntry}, "X-Plane has not been seen to go on");
}

bool resumeLeftovers(core::SimulatorPort* link, double timeout_s) {
  const auto journal = link->journal();
  if (!journal) return false;
  std::vector<core::JournalEntry> left = journal->orphans(kPausePurpose);
  for (core::JournalEntry& own : ownPauses(*journal)) {
    if (!own.left.empty()) left.push_back(std::move(own));
  }
  if (left.empty()) return true;
  const PauseOutcome outcome = setPaused(link, false, timeout_s, [] { return false; });
  if (outcome != PauseOutcome::kWasSo && outcome != PauseOutcome::kFollowed) return false;
  // One that was recorded anew is of a change of the flight that has begun meanwhile.
  const std::vector<core::JournalEntry> own = ownPauses(*journal);
  const auto needed = [&own](const core::JournalEntry& entry) {
    return std::any_of(own.begin(), own.end(), [&entry](const core::JournalEntry& each) {
      return each.left.empty() && each.id == entry.id && each.owner == entry.owner;
    });
  };
  left.erase(std::remove_if(left.begin(), left.end(), needed), left.end());
  journal->removeUndone(left);
  return true;
}

}  // namespace xplane_bridge
