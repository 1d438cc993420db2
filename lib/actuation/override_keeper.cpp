#include "xplane_bridge/actuation/override_keeper.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "xplane_bridge/core/control/control_channels.hpp"
#include "xplane_bridge/core/link/journal.hpp"

namespace xplane_bridge {
namespace {

std::string entryId(const std::string& dataref) { return "override:" + dataref; }

core::UndoOperation undoOf(const std::string& dataref) {
  const auto release = core::releaseOf(dataref);
  return core::UndoDref{dataref, release ? release->value : 0.0F};
}

std::string joined(const std::set<std::string>& names) {
  std::string out;
  for (const std::string& name : names) out += (out.empty() ? "" : ", ") + name.substr(name.rfind('/') + 1);
  return out;
}

constexpr std::int32_t kWatchRate = 10;  // [Hz]
// Answers in a row that show a release: half a second, in which a restarted X-Plane is known to be one.
constexpr int kReleasedAnswers = 5;
constexpr float kSame = 1e-3F;

}  // namespace

const char* const kOverridePurpose = "override";

OverrideKeeper::OverrideKeeper(core::SimulatorPort* link, Report report) : link_(link), report_(std::move(report)) {}

bool OverrideKeeper::set(const std::string& dataref, float value) {
  const auto journal = link_->journal();
  if (!journal || ended_) return false;
  // On disk first: a crash right after the datagram must find it there.
  journal->record(entryId(dataref), kOverridePurpose, {undoOf(dataref)});
  releasing_.erase(dataref);
  link_->write(dataref, value);
  return true;
}

void OverrideKeeper::watch() {
  std::set<std::string> wanted = required_;
  for (const auto& [dataref, held] : held_) {
    if (held.refreshed && dataref != core::kSurfaceOverride) wanted.insert(dataref);
  }
  const std::vector<std::string> list(wanted.begin(), wanted.end());
  if (list == watched_) return;
  for (const std::string& dataref : watched_) {
    if (wanted.count(dataref) == 0) shown_.erase(dataref);
  }
  watched_ = list;
  if (list.empty()) {
    subscription_.reset();
    return;
  }
  core::RrefGroup group{"overrides", list, kWatchRate, 1};
  if (subscription_) {
    subscription_.replace(std::move(group));
  } else {
    subscription_ = link_->subscribe(
        std::move(group), [this](const core::RrefView& view, const core::ReceiveInfo&) { onShown(view); }, mutex_);
  }
}

void OverrideKeeper::onShown(const core::RrefView& view) {
  for (std::size_t i = 0; i < view.size(); ++i) {
    const core::RrefPair pair = view[i];
    if (pair.index < 0 || static_cast<std::size_t>(pair.index) >= watched_.size()) continue;
    const std::string& dataref = watched_[static_cast<std::size_t>(pair.index)];
    const auto held = held_.find(dataref);
    Shown& shown = shown_[dataref];
    if (std::abs(pair.value - (held == held_.end() ? 1.0F : held->second.value)) <= kSame) {
      shown.set = true;
      shown.released = 0;
    } else if (shown.set) {
      ++shown.released;
    }
  }
}

std::vector<std::string> OverrideKeeper::releasedByOthers() {
  std::vector<std::string> stopped;
  std::set<std::string> all;
  {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    for (const auto& [dataref, shown] : shown_) {
      if (shown.released >= kReleasedAnswers) all.insert(dataref);
    }
    if (all.empty()) return stopped;
    const auto journal = link_->journal();
    for (const std::string& dataref : all) {
      if (required_.erase(dataref) != 0) stopped.push_back(dataref);
      held_.erase(dataref);
      if (journal) journal->remove({entryId(dataref)});
    }
    watch();
  }
  report_(joined(all) + " was released by somebody else", true);
  return stopped;
}

void OverrideKeeper::forgetShown() {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  for (const std::string& dataref : watched_) shown_[dataref] = {false, 0, false};
}

void OverrideKeeper::release(const std::string& dataref) {
  if (required_.count(dataref) != 0 || held_.count(dataref) != 0) return;
  releasing_.insert(dataref);
  link_->sendUndo(undoOf(dataref));
}

void OverrideKeeper::require(const std::vector<std::string>& wanted) {
  std::set<std::string> taken, given;
  {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    for (const std::string& dataref : wanted) {
      if (required_.count(dataref) != 0) continue;
      if (held_.count(dataref) == 0 && !set(dataref, 1.0F)) continue;
      required_.insert(dataref);
      taken.insert(dataref);
    }
    for (auto it = required_.begin(); it != required_.end();) {
      if (std::find(wanted.begin(), wanted.end(), *it) != wanted.end()) {
        ++it;
        continue;
      }
      const std::string dataref = *it;
      it = required_.erase(it);
      release(dataref);
      given.insert(dataref);
    }
  }
  if (!taken.empty() || !given.empty()) {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    watch();
  }
  if (!taken.empty()) report_("set " + joined(taken), true);
  if (!given.empty()) report_("gave back " + joined(given), true);
}

bool OverrideKeeper::hold(const std::string& dataref, float value, bool refreshed) {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  if (required_.count(dataref) == 0 && !set(dataref, value)) return false;
  held_[dataref] = {value, refreshed};
  watch();
  return true;
}

void OverrideKeeper::unhold(const std::string& dataref) {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  if (held_.erase(dataref) == 0) return;
  release(dataref);
  watch();
}

void OverrideKeeper::refresh() {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  for (const std::string& dataref : required_) send(dataref, 1.0F);
  for (const auto& [dataref, held] : held_) {
    if (held.refreshed) send(dataref, held.value);
  }
}

void OverrideKeeper::send(const std::string& dataref, float value) {
  const auto found = shown_.find(dataref);
  if (found != shown_.end() && found->second.released > 0) return;  // by whom is not known yet
  if (found == shown_.end() || found->second.in_journal) {
    link_->write(dataref, value);
    return;
  }
  // It may be that the panic tool has taken the entry out.
  try {
    found->second.in_journal = set(dataref, value);
  } catch (const core::JournalError& error) {
    report_(error.what(), false);
  }
}

bool OverrideKeeper::releasesPending() const {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  return !releasing_.empty();
}

bool OverrideKeeper::confirm(const std::vector<core::UndoOperation>& operations, double timeout_s,
                             const std::string& what, const std::function<void(core::Journal&)>& remove) {
  if (operations.empty()) return true;
  const bool shown = link_->undo(operations, timeout_s);
  const auto journal = link_->journal();
  if (shown && journal) remove(*journal);
  // It is tried again and again, but told once.
  if (shown || std::exchange(unreleased_, what) != what) {
    report_(shown ? "released " + what : what + " could not be seen released; it stays in the journal", shown);
  }
  return shown;
}

void OverrideKeeper::confirmReleases(double timeout_s) {
  std::set<std::string> pending;
  {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    pending = releasing_;
  }
  std::vector<std::string> ids;
  std::vector<core::UndoOperation> operations;
  for (const std::string& dataref : pending) {
    ids.push_back(entryId(dataref));
    operations.push_back(undoOf(dataref));
  }
  if (operations.empty() || !link_->undo(operations, timeout_s)) return;
  const auto journal = link_->journal();
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  for (const std::string& dataref : pending) {
    // It may have been set again meanwhile.
    if (releasing_.erase(dataref) != 0 && journal) journal->remove({entryId(dataref)});
  }
}

bool OverrideKeeper::releaseAll(double timeout_s) {
  std::set<std::string> all;
  {
    std::lock_guard<core::HandlerMutex> lock(*mutex_);
    all = required_;
    for (const auto& [dataref, held] : held_) all.insert(dataref);
    all.insert(releasing_.begin(), releasing_.end());
    required_.clear();
    held_.clear();
    watch();
    releasing_ = all;
    ended_ = true;
  }
  std::vector<std::string> ids;
  std::vector<core::UndoOperation> operations;
  for (const std::string& dataref : all) {
    ids.push_back(entryId(dataref));
    operations.push_back(undoOf(dataref));
  }
  const auto remove = [&ids](core::Journal& journal) { journal.remove(ids); };
  if (!confirm(operations, timeout_s, joined(all), remove)) return false;
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  releasing_.clear();
  return true;
}

bool OverrideKeeper::releaseLeftovers(double timeout_s) {
  const auto journal = link_->journal();
  if (!journal) return false;
  const std::vector<core::JournalEntry> left = journal->orphans(kOverridePurpose);
  std::vector<core::UndoOperation> operations;
  std::set<std::string> names;
  for (const core::JournalEntry& entry : left) {
    names.insert(entry.id);
    operations.insert(operations.end(), entry.undo.begin(), entry.undo.end());
  }
  // This run may have set one of them anew meanwhile: that entry is not theirs.
  return confirm(operations, timeout_s, joined(names) + " left by a run that crashed",
                 [&left](core::Journal& journal_now) { journal_now.removeUndone(left); });
}

std::vector<std::string> OverrideKeeper::active() const {
  std::lock_guard<core::HandlerMutex> lock(*mutex_);
  std::set<std::string> all = required_;
  for (const auto& [dataref, held] : held_) {
    if (held.refreshed) all.insert(dataref);
  }
  return {all.begin(), all.end()};
}

}  // namespace xplane_bridge
