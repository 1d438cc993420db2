// ReleaseWorker, and what it carries out: OverrideManager's release of what earlier runs have left.

#include "xplane_bridge/actuation/release_worker.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "xplane_bridge/actuation/link_condition.hpp"
#include "xplane_bridge/actuation/pausing.hpp"
#include "xplane_bridge/core/base/text.hpp"
#include "xplane_bridge/core/link/journal.hpp"
#include "xplane_bridge/core/link/undo_each.hpp"

namespace xplane_bridge {
namespace {

using Lock = std::lock_guard<core::HandlerMutex>;

constexpr double kPeriod = 0.2;          // [s]
constexpr double kReleaseAttempt = 1.0;  // [s] of one attempt

/// A step that may throw core::JournalError, which is noted in `problem`. Returns what the step does; false then.
bool attempt(std::string* problem, const std::function<bool()>& step) {
  try {
    return step();
  } catch (const core::JournalError& error) {
    *problem = error.what();
    return false;
  }
}

/// By the cause for which they were left.
std::string causes(const std::vector<core::JournalEntry>& entries) {
  std::map<std::string, std::set<std::string>> names;
  for (const core::JournalEntry& entry : entries) names[entry.left].insert(entry.id);
  std::vector<std::string> out;
  out.reserve(names.size());
  for (const auto& [cause, ids] : names) {
    out.push_back(core::join(ids, ", ", core::afterLastSlash) +
                  (cause.empty() ? " left by a run that crashed" : " left because " + cause));
  }
  return core::join(out);
}

/// Ids of what this run has in the journal, taken over from an earlier one perhaps.
std::set<std::string> ownIds(const core::Journal& journal) {
  std::set<std::string> out;
  for (const core::JournalEntry& entry : journal.own()) out.insert(entry.id);
  return out;
}

}  // namespace

bool OverrideManager::releaseLeftovers(double timeout_s) {
  const auto journal = link_->journal();
  if (!journal) return false;
  const core::Deadline deadline(link_->clock(), timeout_s);
  const std::vector<core::JournalEntry> orphans = journal->orphans(kOverridePurpose);
  std::vector<core::UndoOperations> operations;
  operations.reserve(orphans.size());
  for (const core::JournalEntry& entry : orphans) operations.push_back(entry.undo);
  core::dropPreparationsOfReleased(link_, &operations, timeout_s / 2.0);
  std::vector<core::JournalEntry> sent, done, left;
  std::vector<core::UndoOperations> awaited;
  {
    // Sent with the lock held, so that none goes out after this run has set what it is of.
    const Lock lock(*mutex_);
    const std::set<std::string> own = ownIds(*journal);
    for (std::size_t i = 0; i < orphans.size(); ++i) {
      if (own.count(orphans[i].id) != 0) continue;
      if (core::sendUndo(link_, operations[i])) {
        sent.push_back(orphans[i]);
        awaited.push_back(std::move(operations[i]));
      } else {
        left.push_back(orphans[i]);
      }
    }
  }
  const std::vector<bool> shown = core::awaitEach(link_, awaited, deadline.left());
  {
    // What this run has set meanwhile is no leftover any more, whatever X-Plane has shown of it.
    const Lock lock(*mutex_);
    const std::set<std::string> own = ownIds(*journal);
    for (std::size_t i = 0; i < sent.size(); ++i) {
      if (own.count(sent[i].id) == 0) (shown[i] ? done : left).push_back(sent[i]);
    }
  }
  if (!done.empty()) journal->removeUndone(done);  // not the entry of one that this run sets just now
  const bool known = std::none_of(left.begin(), left.end(), [](const auto& entry) { return entry.left.empty(); });
  if (!link_->status().up() && known) unreleased_ = causes(left);  // the runs that left them have said so
  reportReleases(causes(done), causes(left));
  return left.empty();
}

bool giveBackLeftovers(core::SimulatorPort* link, OverrideManager* overrides, double timeout_s, std::string* problem) {
  const bool released = attempt(problem, [&] { return overrides->releaseLeftovers(timeout_s); });
  const bool resumed = attempt(problem, [&] { return resumeLeftovers(link, timeout_s); });
  return released && resumed;
}

ReleaseWorker::ReleaseWorker(core::SimulatorPort* link, OverrideManager* overrides,
                             std::function<void(const std::string&)> problem, std::shared_ptr<core::ThreadTurns> turns,
                             std::function<void()> watch)
    : link_(link),
      overrides_(overrides),
      problem_(std::move(problem)),
      watch_(std::move(watch)),
      turns_(std::move(turns)) {}

ReleaseWorker::~ReleaseWorker() { stop(); }

void ReleaseWorker::start() {
  seat_ = std::make_unique<core::ThreadSeat>(turns_);
  thread_ = std::thread([this] { loop(); });
}

void ReleaseWorker::wake() {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    now_ = true;
  }
  wanted_.notifyAll();
}

void ReleaseWorker::lookAgain() { look_again_ = true; }

void ReleaseWorker::stop() {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    ends_ = true;
  }
  wanted_.notifyAll();
  if (!thread_.joinable()) return;
  seat_->letEnd();
  thread_.join();
}

void ReleaseWorker::loop() {
  const core::ThreadSeat::Taken turns(seat_.get());
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    wanted_.waitUntil(&lock, core::Deadline(link_->clock(), kPeriod), [this] { return ends_ || now_; });
    now_ = false;
    if (ends_) return;
    lock.unlock();
    work();
    lock.lock();
  }
}

void ReleaseWorker::work() {
  const core::LinkStatus status = link_->status();
  const bool was_up = std::exchange(was_up_, status.up());
  if (!was_up_) return;
  std::string problem;  // of the journal
  const auto always = [&problem](const std::function<void()>& step) {
    attempt(&problem, [&step] {
      step();
      return true;
    });
  };
  const double now = link_->clock().steadySeconds();
  const bool other_epoch = std::exchange(epoch_, status.epoch) != status.epoch;
  const bool asked = look_again_.exchange(false);
  // A pause may have been left while X-Plane was silent, for however short a time.
  if (other_epoch || !was_up || asked) {
    leftovers_ = true;
    retries_ = {};
  }
  if (leftovers_ && retries_.due(now)) {
    retries_.attempted(now);
    leftovers_ = !giveBackLeftovers(link_, overrides_, kReleaseAttempt, &problem);
  }
  always([this] { overrides_->recordPreparations(); });
  always([this] { overrides_->watchRows(); });
  if (watch_) always(watch_);
  always([this] {
    if (overrides_->releasesPending()) overrides_->confirmReleases(kReleaseAttempt);
  });
  if (!problem.empty()) problem_(problem);
}

}  // namespace xplane_bridge
