#include "xplane_bridge/override_keeper.hpp"

#include <algorithm>

#include "xplane_bridge/core/control_channels.hpp"
#include "xplane_bridge/core/journal.hpp"

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

}  // namespace

const char* const kOverridePurpose = "override";

OverrideKeeper::OverrideKeeper(core::SimLink* link, Report report) : link_(link), report_(std::move(report)) {}

bool OverrideKeeper::set(const std::string& dataref, float value) {
  const auto journal = link_->journal();
  if (!journal) return false;
  // On disk first: a crash right after the datagram must find it there.
  journal->record(entryId(dataref), kOverridePurpose, {undoOf(dataref)});
  releasing_.erase(dataref);
  link_->sendDref(dataref, value);
  return true;
}

void OverrideKeeper::release(const std::string& dataref) {
  if (required_.count(dataref) != 0 || held_.count(dataref) != 0) return;
  releasing_.insert(dataref);
  link_->sendUndo(undoOf(dataref));
}

void OverrideKeeper::require(const std::vector<std::string>& wanted) {
  std::set<std::string> taken, given;
  {
    std::lock_guard<std::mutex> lock(mutex_);
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
  if (!taken.empty()) report_("set " + joined(taken), true);
  if (!given.empty()) report_("gave back " + joined(given), true);
}

bool OverrideKeeper::hold(const std::string& dataref, float value, bool refreshed) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (required_.count(dataref) == 0 && !set(dataref, value)) return false;
  held_[dataref] = {value, refreshed};
  return true;
}

void OverrideKeeper::unhold(const std::string& dataref) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (held_.erase(dataref) != 0) release(dataref);
}

void OverrideKeeper::refresh() {
  std::lock_guard<std::mutex> lock(mutex_);
  for (const std::string& dataref : required_) link_->sendDref(dataref, 1.0F);
  for (const auto& [dataref, held] : held_) {
    if (held.refreshed) link_->sendDref(dataref, held.value);
  }
}

bool OverrideKeeper::releasesPending() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return !releasing_.empty();
}

bool OverrideKeeper::confirm(const std::vector<std::string>& ids, const std::vector<core::UndoOperation>& operations,
                             double timeout_s, const std::string& what) {
  if (operations.empty()) return true;
  const bool shown = link_->undo(operations, timeout_s);
  const auto journal = link_->journal();
  if (shown && journal) journal->remove(ids);
  report_(shown ? "released " + what : what + " could not be seen released; it stays in the journal", shown);
  return shown;
}

void OverrideKeeper::confirmReleases(double timeout_s) {
  std::set<std::string> pending;
  {
    std::lock_guard<std::mutex> lock(mutex_);
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
  std::lock_guard<std::mutex> lock(mutex_);
  for (const std::string& dataref : pending) {
    // It may have been set again meanwhile.
    if (releasing_.erase(dataref) != 0 && journal) journal->remove({entryId(dataref)});
  }
}

bool OverrideKeeper::releaseAll(double timeout_s) {
  std::set<std::string> all;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    all = required_;
    for (const auto& [dataref, held] : held_) all.insert(dataref);
    all.insert(releasing_.begin(), releasing_.end());
    required_.clear();
    held_.clear();
    releasing_ = all;
  }
  std::vector<std::string> ids;
  std::vector<core::UndoOperation> operations;
  for (const std::string& dataref : all) {
    ids.push_back(entryId(dataref));
    operations.push_back(undoOf(dataref));
  }
  if (!confirm(ids, operations, timeout_s, joined(all))) return false;
  std::lock_guard<std::mutex> lock(mutex_);
  releasing_.clear();
  return true;
}

bool OverrideKeeper::releaseLeftovers(double timeout_s) {
  const auto journal = link_->journal();
  if (!journal) return false;
  std::vector<std::string> ids;
  std::vector<core::UndoOperation> operations;
  std::set<std::string> names;
  for (const core::JournalEntry& entry : journal->orphans(kOverridePurpose)) {
    ids.push_back(entry.id);
    names.insert(entry.id);
    operations.insert(operations.end(), entry.undo.begin(), entry.undo.end());
  }
  return confirm(ids, operations, timeout_s, joined(names) + " left by a run that crashed");
}

std::vector<std::string> OverrideKeeper::active() const {
  std::lock_guard<std::mutex> lock(mutex_);
  std::set<std::string> all = required_;
  for (const auto& [dataref, held] : held_) {
    if (held.refreshed) all.insert(dataref);
  }
  return {all.begin(), all.end()};
}

}  // namespace xplane_bridge
