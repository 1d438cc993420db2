#include "xplane_bridge/actuation/release_worker.hpp"

#include <utility>

#include "xplane_bridge/actuation/link_condition.hpp"
#include "xplane_bridge/actuation/pausing.hpp"
#include "xplane_bridge/core/link/journal.hpp"

namespace xplane_bridge {
namespace {

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

}  // namespace

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
  const bool was_up = std::exchange(was_up_, isUp(status));
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
