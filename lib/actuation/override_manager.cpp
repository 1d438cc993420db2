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
#include "xplane_bridge/core/link/undo_each.hpp"

namespace xplane_bridge {
namespace {

using Lock = std::lock_guard<core::HandlerMutex>;

constexpr std::int32_t kWatchRate = 10;  // [Hz]
// Answers in a row that show a release: half a second, in which a restarted X-Plane is known to be one.
constexpr int kReleasedAnswers = 5;
constexpr float kSame = 1e-3F;
constexpr float kSamePreparation = 0.01F;
constexpr double kRecordPeriod = 1.0;  // [s]
constexpr double kLookPeriod = 1.0;    // [s]

std::string entryId(const std::string& dataref) { return "override:" + dataref; }

std::vector<std::string> entryIds(const std::set<std::string>& datarefs) {
  std::vector<std::string> out;
  out.reserve(datarefs.size());
  for (const std::string& dataref : datarefs) out.push_back(entryId(dataref));
  return out;
}

core::UndoOperation undoOf(const std::string& dataref) {
  if (const auto row = core::rowOfName(dataref)) {
    core::UndoData unused;
    unused.row.index = *row;
    return unused;
  }
  const auto release = core::releaseOf(dataref);
  return core::UndoDref{dataref, release ? release->value : 0.0F};
}

/// Whether the journal must be brought up to date; small changes are not worth its disk.
bool differ(const core::UndoOperations& a, const core::UndoOperations& b) {
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
  startRelease(dataref);
  for (const core::UndoOperation& operation : releaseOf(dataref)) link_->sendUndo(operation);
  prepared_.erase(dataref);  // from now on it may be commanded otherwise
  shown_.erase(dataref);
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

void OverrideManager::forgetPreparations() {
  const Lock lock(*mutex_);
  for (auto& [dataref, prepared] : prepared_) prepared.writes.clear();
  recorded_at_ = -1e9;  // the journal has them no second longer
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
    // SurfaceControl looks at its own in each frame.
    const bool of_surfaces = acquired.holders == std::set<OverrideHolder>{OverrideHolder::kSurfaces};
    if (acquired.refreshed && !of_surfaces) wanted.insert(dataref);
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
      if (core::rowOfName(dataref)) giveBack(dataref);  // commands have held it again since
    }
    try {
      if (const auto journal = link_->journal()) journal->remove(entryIds(all));
    } catch (const core::JournalError& error) {
      problem = error.what();
      for (const std::string& dataref : all) startRelease(dataref);  // so that the entries are taken out later
    }
    updateWatch();
  }
  if (!problem.empty()) report_(problem, false);
  report_(joined(all) + " was released by another client", true);
  return stopped;
}

void OverrideManager::watchRows() {
  const auto journal = link_->journal();
  std::map<std::string, std::string> rows;  // by the id of its entry
  std::uint64_t releases = 0;
  {
    const Lock lock(*mutex_);
    const double now = link_->clock().steadySeconds();
    if (!journal || now - rows_looked_at_ < kLookPeriod) return;
    rows_looked_at_ = now;
    releases = releases_;
    for (const std::string& dataref : required_) {
      if (core::rowOfName(dataref)) rows[entryId(dataref)] = dataref;
    }
  }
  if (rows.empty()) return;
  for (const core::JournalEntry& entry : journal->own()) rows.erase(entry.id);
  const Lock lock(*mutex_);
  if (releases_ != releases) return;  // given back meanwhile by this node, and perhaps taken anew: looked at again
  for (const auto& [id, dataref] : rows) shown_[dataref].released = kReleasedAnswers;
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
    bool changed = !taken.empty();
    for (auto it = required_.begin(); it != required_.end();) {
      if (std::find(wanted.begin(), wanted.end(), *it) != wanted.end()) {
        ++it;
        continue;
      }
      const std::string dataref = *it;
      it = required_.erase(it);
      changed = true;
      if (isSet(dataref)) continue;  // acquire() holds it on
      giveBack(dataref);
      given.insert(dataref);
    }
    if (changed) updateWatch();
  }
  if (!taken.empty()) report_("set " + joined(taken), true);
  if (!given.empty()) report_("gave back " + joined(given), true);
  if (failed) std::rethrow_exception(failed);
}

void OverrideManager::hold(OverrideHolder holder, const std::string& dataref, float value, bool refreshed) {
  Acquired& acquired = acquired_[dataref];
  acquired.value = value;
  acquired.refreshed = refreshed;
  acquired.holders.insert(holder);
}

bool OverrideManager::acquire(OverrideHolder holder, const std::string& dataref, float value, bool refreshed) {
  const Lock lock(*mutex_);
  if (required_.count(dataref) == 0 && !set(dataref, value)) return false;
  hold(holder, dataref, value, refreshed);
  updateWatch();
  return true;
}

void OverrideManager::acquire(OverrideHolder holder, const std::vector<std::string>& datarefs) {
  const Lock lock(*mutex_);
  std::vector<core::DatarefWrite> missing;
  for (const std::string& dataref : datarefs) {
    if (required_.count(dataref) == 0) {
      missing.push_back({dataref, 1.0F});
    } else {
      hold(holder, dataref, 1.0F, true);
    }
  }
  const Outcome outcome = set(missing);
  for (const core::DatarefWrite& each : outcome.set) hold(holder, each.dataref, each.value, true);
  updateWatch();
  if (outcome.failed) std::rethrow_exception(outcome.failed);
}

void OverrideManager::release(OverrideHolder holder, const std::string& dataref) {
  const Lock lock(*mutex_);
  const auto found = acquired_.find(dataref);
  if (found == acquired_.end() || found->second.holders.erase(holder) == 0) return;
  if (found->second.holders.empty()) {
    acquired_.erase(found);
    giveBack(dataref);
  }
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

void OverrideManager::startRelease(const std::string& dataref) { releasing_[dataref] = {++releases_, {}}; }

bool OverrideManager::releasesPending() const {
  const Lock lock(*mutex_);
  return !releasing_.empty();
}

bool OverrideManager::releasePending(const std::string& dataref) const {
  const Lock lock(*mutex_);
  return releasing_.count(dataref) != 0;
}

void OverrideManager::confirmReleases(double timeout_s) {
  std::vector<std::pair<std::string, std::uint64_t>> pending;
  std::vector<core::UndoOperations> operations;
  {
    const Lock lock(*mutex_);
    const double now = link_->clock().steadySeconds();
    const bool fresh =
        std::any_of(releasing_.begin(), releasing_.end(), [](const auto& r) { return !r.second.retries.attempts; });
    for (auto& [dataref, release] : releasing_) {
      // One that X-Plane does not show holds up no other.
      if (!release.retries.due(now) || (fresh && release.retries.attempts > 0)) continue;
      release.retries.attempted(now);
      // Sent with the lock held, so that none goes out after one of them has been set again.
      const core::UndoOperation undo = undoOf(dataref);
      if (link_->sendUndo(undo) != core::SendStatus::kSent) continue;
      pending.emplace_back(dataref, release.number);
      operations.push_back({undo});
    }
  }
  const std::vector<bool> shown = core::awaitEach(link_, operations, timeout_s);
  const auto journal = link_->journal();
  const Lock lock(*mutex_);
  std::set<std::string> done;
  for (std::size_t i = 0; i < pending.size(); ++i) {
    // It may have been set again meanwhile, and given back once more.
    const auto found = releasing_.find(pending[i].first);
    if (shown[i] && found != releasing_.end() && found->second.number == pending[i].second) done.insert(found->first);
  }
  if (journal && !done.empty()) journal->remove(entryIds(done));
  for (const std::string& dataref : done) releasing_.erase(dataref);
}

void OverrideManager::reportReleases(const std::string& released, const std::string& left) {
  if (!released.empty()) report_("released " + released, true);
  // It is tried again and again, but reported once.
  if (left.empty() || std::exchange(unreleased_, left) == left) return;
  const bool up = link_->status().up();
  const char* why = up ? " could not be seen released; it stays in the journal"
                       : " could not be released, because X-Plane went first, or is silent. If it still runs, the "
                         "next start releases it, or scripts/release_overrides";
  report_(left + why, !up && ended_);  // closing X-Plane before the bridge is nothing wrong
}

bool OverrideManager::releaseAll(double timeout_s) {
  std::vector<std::string> all;
  std::vector<core::UndoOperations> operations;
  {
    const Lock lock(*mutex_);
    for (const std::string& dataref : takeAll()) startRelease(dataref);
    updateWatch();
    ended_ = true;
    for (const auto& [dataref, release] : releasing_) {
      all.push_back(dataref);
      operations.push_back(releaseOf(dataref));
    }
  }
  const std::vector<bool> shown = core::undoEach(link_, operations, timeout_s);
  std::set<std::string> done, left;
  for (std::size_t i = 0; i < all.size(); ++i) (shown[i] ? done : left).insert(all[i]);
  if (const auto journal = link_->journal(); journal && !all.empty()) {
    journal->remove(entryIds(done));
    const char* why = link_->status().up() ? "X-Plane did not show it released" : "X-Plane went first";
    if (!left.empty()) journal->leave(entryIds(left), why);
  }
  reportReleases(joined(done), joined(left));
  const Lock lock(*mutex_);
  for (const std::string& dataref : done) releasing_.erase(dataref);
  return left.empty();
}

std::set<OverrideHolder> OverrideManager::holders(const std::string& dataref) const {
  const Lock lock(*mutex_);
  const auto acquired = acquired_.find(dataref);
  std::set<OverrideHolder> out;
  if (acquired != acquired_.end()) out = acquired->second.holders;
  if (required_.count(dataref) != 0) out.insert(OverrideHolder::kControls);
  return out;
}

std::vector<std::string> OverrideManager::active() const {
  const Lock lock(*mutex_);
  std::set<std::string> all = required_;
  for (const auto& [dataref, acquired] : acquired_) {
    if (acquired.refreshed) all.insert(dataref);
  }
  return {all.begin(), all.end()};
}

}  // namespace xplane_bridge
