#include "xplane_bridge/actuation/override_manager.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

#include "xplane_bridge/actuation/link_condition.hpp"
#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/core/control/control_channels.hpp"
#include "xplane_bridge/core/control/control_rows.hpp"
#include "xplane_bridge/core/link/journal.hpp"

namespace xplane_bridge {
namespace {

using Lock = std::lock_guard<core::HandlerMutex>;

constexpr std::int32_t kWatchRate = 10;  // [Hz]
// Answers in a row that show a release: half a second, in which a restarted X-Plane is known to be one.
constexpr int kReleasedAnswers = 5;
constexpr float kSame = 1e-3F;
constexpr float kSamePreparation = 0.01F;
constexpr double kRecordPeriod = 1.0;  // [s]

core::DataRow rowOfUnused(std::int32_t row) {
  core::DataRow out;
  out.index = row;
  return out;
}

std::string entryId(const std::string& dataref) { return "override:" + dataref; }

std::vector<std::string> entryIds(const std::set<std::string>& datarefs) {
  std::vector<std::string> out;
  out.reserve(datarefs.size());
  for (const std::string& dataref : datarefs) out.push_back(entryId(dataref));
  return out;
}

core::UndoOperation undoOf(const std::string& dataref) {
  if (const auto row = core::rowOfName(dataref)) return core::UndoData{rowOfUnused(*row)};
  const auto release = core::releaseOf(dataref);
  return core::UndoDref{dataref, release ? release->value : 0.0F};
}

std::vector<core::UndoOperation> undoOf(const std::set<std::string>& datarefs) {
  std::vector<core::UndoOperation> out;
  out.reserve(datarefs.size());
  for (const std::string& dataref : datarefs) out.push_back(undoOf(dataref));
  return out;
}

/// Whether the journal must be brought up to date; small changes are not worth its disk.
bool differ(const std::vector<core::UndoOperation>& a, const std::vector<core::UndoOperation>& b) {
  const auto same = [](const core::UndoOperation& one, const core::UndoOperation& other) {
    const auto& first = std::get<core::UndoDref>(one);
    const auto& second = std::get<core::UndoDref>(other);
    return first.path == second.path && std::abs(first.value - second.value) <= kSamePreparation;
  };
  return !std::equal(a.begin(), a.end(), b.begin(), b.end(), same);
}

std::string joined(const std::set<std::string>& names) { return core::join(names, ", ", core::afterLastSlash); }

}  // namespace

const char* const kOverridePurpose = "override";

OverrideManager::OverrideManager(core::SimulatorPort* link, Report report) : link_(link), report_(std::move(report)) {}

bool OverrideManager::isSet(const std::string& dataref) const {
  return required_.count(dataref) != 0 || acquired_.count(dataref) != 0;
}

std::vector<core::UndoOperation> OverrideManager::releaseOf(const std::string& dataref) const {
  const auto prepared = prepared_.find(dataref);
  std::vector<core::UndoOperation> out;
  if (prepared != prepared_.end()) out = prepared->second.writes;
  out.push_back(undoOf(dataref));
  return out;
}

/// Several at the price of one write to the disk. Where one cannot be noted the others are set all the same.
OverrideManager::Outcome OverrideManager::set(const std::vector<core::DatarefWrite>& wanted) {
  Outcome out;
  const auto journal = link_->journal();
  if (!journal || ended_ || wanted.empty()) return out;
  const auto note = [&](const std::vector<core::DatarefWrite>& writes) {
    std::vector<core::JournalRecord> records;
    records.reserve(writes.size());
    for (const core::DatarefWrite& each : writes) {
      records.push_back({entryId(each.dataref), kOverridePurpose, {undoOf(each.dataref)}});
    }
    try {
      journal->record(std::move(records));
      out.set.insert(out.set.end(), writes.begin(), writes.end());
    } catch (const core::JournalError&) {
      out.failed = std::current_exception();
    }
  };
  // On disk first: a crash right after the datagram must find it there.
  note(wanted);
  if (out.failed && wanted.size() > 1) {
    out.failed = nullptr;
    for (const core::DatarefWrite& each : wanted) note({each});
  }
  for (const core::DatarefWrite& each : out.set) {
    releasing_.erase(each.dataref);
    // A row goes out with the command that it is set for.
    if (!core::rowOfName(each.dataref)) link_->write(each.dataref, each.value);
  }
  return out;
}

bool OverrideManager::set(const std::string& dataref, float value) {
  const Outcome outcome = set(std::vector<core::DatarefWrite>{{dataref, value}});
  if (outcome.failed) std::rethrow_exception(outcome.failed);
  return !outcome.set.empty();
}

void OverrideManager::giveBack(const std::string& dataref) {
  if (isSet(dataref)) return;
  releasing_.insert(dataref);
  for (const core::UndoOperation& operation : releaseOf(dataref)) link_->sendUndo(operation);
  prepared_.erase(dataref);  // from now on it may be commanded otherwise
}

// --- what is written before a release ---

void OverrideManager::prepareRelease(const std::string& dataref, std::vector<core::UndoOperation> writes) {
  const Lock lock(*mutex_);
  if (isSet(dataref)) prepared_[dataref].writes = std::move(writes);
}

void OverrideManager::recordPreparations() {
  const auto journal = link_->journal();
  std::map<std::string, std::vector<core::UndoOperation>> changed;
  {
    const Lock lock(*mutex_);
    const double now = link_->clock().steadySeconds();
    if (!journal || now - recorded_at_ < kRecordPeriod) return;
    for (const auto& [dataref, prepared] : prepared_) {
      if (differ(prepared.writes, prepared.recorded)) changed[dataref] = prepared.writes;
    }
    if (!changed.empty()) recorded_at_ = now;
  }
  for (const auto& [dataref, writes] : changed) {
    std::vector<core::UndoOperation> undo = writes;
    undo.push_back(undoOf(dataref));
    journal->record(entryId(dataref), kOverridePurpose, std::move(undo));
    const Lock lock(*mutex_);
    if (isSet(dataref)) {
      prepared_[dataref].recorded = writes;
    } else if (releasing_.count(dataref) == 0) {  // released by another client meanwhile
      journal->remove({entryId(dataref)});
    }
  }
}

std::set<std::string> OverrideManager::takeAll() {
  std::set<std::string> all = std::exchange(required_, {});
  for (const auto& [dataref, acquired] : std::exchange(acquired_, {})) all.insert(dataref);
  return all;
}

void OverrideManager::giveBackAll() {
  const Lock lock(*mutex_);
  const std::set<std::string> all = takeAll();
  prepared_.clear();
  for (const std::string& dataref : all) giveBack(dataref);
  updateWatch();
}

// --- what X-Plane shows ---

void OverrideManager::updateWatch() {
  std::set<std::string> wanted;
  for (const std::string& dataref : required_) {
    if (!core::rowOfName(dataref)) wanted.insert(dataref);  // X-Plane does not show who holds a row
  }
  for (const auto& [dataref, acquired] : acquired_) {
    if (acquired.refreshed && dataref != core::kSurfaceOverride) wanted.insert(dataref);
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

void OverrideManager::onShown(const core::RrefView& view) {
  for (std::size_t i = 0; i < view.size(); ++i) {
    const core::RrefPair pair = view[i];
    if (pair.index < 0 || static_cast<std::size_t>(pair.index) >= watched_.size()) continue;
    const std::string& dataref = watched_[static_cast<std::size_t>(pair.index)];
    const auto acquired = acquired_.find(dataref);
    Shown& shown = shown_[dataref];
    if (std::abs(pair.value - (acquired == acquired_.end() ? 1.0F : acquired->second.value)) <= kSame) {
      shown.set = true;
      shown.released = 0;
    } else if (shown.set) {
      ++shown.released;
    }
  }
}

std::vector<std::string> OverrideManager::releasedByOthers() {
  std::vector<std::string> stopped;
  std::set<std::string> all;
  std::string problem;
  {
    const Lock lock(*mutex_);
    for (const auto& [dataref, shown] : shown_) {
      if (shown.released >= kReleasedAnswers) all.insert(dataref);
    }
    if (all.empty()) return stopped;
    for (const std::string& dataref : all) {
      if (required_.erase(dataref) != 0) stopped.push_back(dataref);
      acquired_.erase(dataref);
      prepared_.erase(dataref);
    }
    try {
      if (const auto journal = link_->journal()) journal->remove(entryIds(all));
    } catch (const core::JournalError& error) {
      problem = error.what();
      releasing_.insert(all.begin(), all.end());  // confirmReleases() tries again to take the entries out
    }
    updateWatch();
  }
  if (!problem.empty()) report_(problem, false);
  report_(joined(all) + " was released by another client", true);
  return stopped;
}

void OverrideManager::forgetShown() {
  const Lock lock(*mutex_);
  for (const std::string& dataref : watched_) shown_[dataref] = {false, 0, false};
}

// --- setting ---

void OverrideManager::setRequired(const std::vector<std::string>& wanted) {
  std::set<std::string> taken, given;
  std::exception_ptr failed;
  {
    const Lock lock(*mutex_);
    std::vector<core::DatarefWrite> missing;
    for (const std::string& dataref : wanted) {
      if (required_.count(dataref) != 0) continue;
      if (acquired_.count(dataref) == 0) {
        missing.push_back({dataref, 1.0F});
      } else {
        taken.insert(dataref);
      }
    }
    const Outcome outcome = set(missing);
    failed = outcome.failed;
    for (const core::DatarefWrite& each : outcome.set) taken.insert(each.dataref);
    required_.insert(taken.begin(), taken.end());
    for (auto it = required_.begin(); it != required_.end();) {
      if (std::find(wanted.begin(), wanted.end(), *it) != wanted.end()) {
        ++it;
        continue;
      }
      const std::string dataref = *it;
      it = required_.erase(it);
      giveBack(dataref);
      given.insert(dataref);
    }
    if (!taken.empty() || !given.empty()) updateWatch();
  }
  if (!taken.empty()) report_("set " + joined(taken), true);
  if (!given.empty()) report_("gave back " + joined(given), true);
  if (failed) std::rethrow_exception(failed);
}

bool OverrideManager::acquire(const std::string& dataref, float value, bool refreshed) {
  const Lock lock(*mutex_);
  if (required_.count(dataref) == 0 && !set(dataref, value)) return false;
  acquired_[dataref] = {value, refreshed};
  updateWatch();
  return true;
}

void OverrideManager::acquire(const std::vector<std::string>& datarefs) {
  const Lock lock(*mutex_);
  std::vector<core::DatarefWrite> missing;
  for (const std::string& dataref : datarefs) {
    if (required_.count(dataref) == 0) {
      missing.push_back({dataref, 1.0F});
    } else {
      acquired_[dataref] = {};
    }
  }
  const Outcome outcome = set(missing);
  for (const core::DatarefWrite& each : outcome.set) acquired_[each.dataref] = {};
  updateWatch();
  if (outcome.failed) std::rethrow_exception(outcome.failed);
}

void OverrideManager::release(const std::string& dataref) {
  const Lock lock(*mutex_);
  if (acquired_.erase(dataref) == 0) return;
  giveBack(dataref);
  updateWatch();
}

void OverrideManager::refresh() {
  const Lock lock(*mutex_);
  for (const std::string& dataref : required_) {
    if (!core::rowOfName(dataref)) resend(dataref, 1.0F);
  }
  for (const auto& [dataref, acquired] : acquired_) {
    if (acquired.refreshed) resend(dataref, acquired.value);
  }
}

void OverrideManager::resend(const std::string& dataref, float value) {
  const auto found = shown_.find(dataref);
  if (found != shown_.end() && found->second.released > 0) return;  // by which client is not known yet
  if (found == shown_.end() || found->second.in_journal) {
    link_->write(dataref, value);
    return;
  }
  // The panic tool may have taken the entry out.
  try {
    found->second.in_journal = set(dataref, value);
  } catch (const core::JournalError& error) {
    report_(error.what(), false);
  }
}

// --- confirming releases ---

bool OverrideManager::releasesPending() const {
  const Lock lock(*mutex_);
  return !releasing_.empty();
}

void OverrideManager::confirmReleases(double timeout_s) {
  std::set<std::string> pending;
  {
    const Lock lock(*mutex_);
    pending = releasing_;
    // Sent with the lock held, so that none goes out after one of them has been set again.
    for (const std::string& dataref : pending) link_->sendUndo(undoOf(dataref));
  }
  if (pending.empty() || !link_->waitUntilUndone(undoOf(pending), timeout_s)) return;
  const auto journal = link_->journal();
  const Lock lock(*mutex_);
  for (const std::string& dataref : pending) {
    // It may have been set again meanwhile.
    if (releasing_.count(dataref) == 0) continue;
    if (journal) journal->remove({entryId(dataref)});
    releasing_.erase(dataref);
  }
}

bool OverrideManager::confirm(const std::vector<core::UndoOperation>& operations, double timeout_s,
                              const std::string& what, const std::function<void(core::Journal&)>& remove) {
  if (operations.empty()) return true;
  const bool shown = link_->undo(operations, timeout_s);
  const auto journal = link_->journal();
  if (shown && journal) remove(*journal);
  if (shown) {
    report_("released " + what, true);
  } else if (std::exchange(unreleased_, what) != what) {  // it is tried again and again, but reported once
    if (answers()) {
      report_(what + " could not be seen released; it stays in the journal", false);
    } else {
      report_(
          what + " could not be released, because X-Plane went first, or is silent. If it still runs, the next start " +
              "releases it, or scripts/release_overrides",
          ended_);  // closing X-Plane before the bridge is nothing wrong
    }
  }
  return shown;
}

bool OverrideManager::releaseAll(double timeout_s) {
  std::set<std::string> all;
  std::vector<core::UndoOperation> operations;
  {
    const Lock lock(*mutex_);
    all = takeAll();
    all.insert(releasing_.begin(), releasing_.end());
    updateWatch();
    releasing_ = all;
    ended_ = true;
    for (const std::string& dataref : all) {
      const std::vector<core::UndoOperation> release = releaseOf(dataref);
      operations.insert(operations.end(), release.begin(), release.end());
    }
  }
  const auto remove = [&all](core::Journal& journal) { journal.remove(entryIds(all)); };
  if (!confirm(operations, timeout_s, joined(all), remove)) {
    const char* why = answers() ? "X-Plane did not show it released" : "X-Plane went first";
    if (const auto journal = link_->journal()) journal->leave(entryIds(all), why);
    return false;
  }
  const Lock lock(*mutex_);
  releasing_.clear();
  return true;
}

bool OverrideManager::releaseLeftovers(double timeout_s) {
  const auto journal = link_->journal();
  if (!journal) return false;
  const std::vector<core::JournalEntry> left = journal->orphans(kOverridePurpose);
  std::vector<core::UndoOperation> operations;
  std::map<std::string, std::set<std::string>> names;  // by the cause for which they were left
  for (const core::JournalEntry& entry : left) {
    names[entry.left].insert(entry.id);
    operations.insert(operations.end(), entry.undo.begin(), entry.undo.end());
  }
  std::vector<std::string> what;
  what.reserve(names.size());
  for (const auto& [cause, ids] : names) {
    what.push_back(joined(ids) + (cause.empty() ? " left by a run that crashed" : " left because " + cause));
  }
  const std::string all = core::join(what);
  if (!answers() && names.count("") == 0) unreleased_ = all;  // the runs that left them have said so
  // This run may have set one of them anew meanwhile: that entry is not theirs.
  return confirm(operations, timeout_s, all, [&left](core::Journal& journal_now) { journal_now.removeUndone(left); });
}

bool OverrideManager::answers() const { return isUp(link_->status()); }

std::vector<std::string> OverrideManager::active() const {
  const Lock lock(*mutex_);
  std::set<std::string> all = required_;
  for (const auto& [dataref, acquired] : acquired_) {
    if (acquired.refreshed) all.insert(dataref);
  }
  return {all.begin(), all.end()};
}

}  // namespace xplane_bridge
