#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "xplane_bridge/actuation/override_manager.hpp"
#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/base/thread_turns.hpp"
#include "xplane_bridge/core/link/simulator_port.hpp"

namespace xplane_bridge {

/// Gives back what earlier runs have left in X-Plane: the aircraft first, then a pause, also where one of the first is
/// not shown released. Waits up to `timeout_s` for each. Returns whether nothing is left.
/// @param problem what is wrong with the journal; as it was where nothing is
bool giveBackLeftovers(core::SimulatorPort* link, OverrideManager* overrides, double timeout_s, std::string* problem);

/// The thread that waits until X-Plane has shown what was given back, and gives back what a crashed run has left in
/// each X-Plane the link finds, so that nothing else has to wait for that.
class ReleaseWorker {
 public:
  /// `problem(text)`: the journal cannot be used; called again and again while that lasts. `watch()`: looks into the
  /// journal for another part of the node, each time X-Plane is up; may throw core::JournalError; null: no other part.
  /// @param turns of the thread; null: it runs as it likes
  ReleaseWorker(core::SimulatorPort* link, OverrideManager* overrides,
                std::function<void(const std::string& text)> problem,
                std::shared_ptr<core::ThreadTurns> turns = nullptr, std::function<void()> watch = nullptr);
  /// stop()
  ~ReleaseWorker();
  ReleaseWorker(const ReleaseWorker&) = delete;
  ReleaseWorker& operator=(const ReleaseWorker&) = delete;

  void start();
  /// Looks at once, instead of at the end of its period: the link has changed.
  void wake();
  /// At the end of its period it looks also for what was left in this X-Plane meanwhile: this run, too, leaves a pause
  /// that X-Plane does not end. Not at once: a change of the flight that waits may begin with that pause.
  void lookAgain();
  /// Waits for the release that is under way, up to a second.
  void stop();

  /// What it does each time. Waits.
  void work();

 private:
  void loop();

  core::SimulatorPort* link_;
  OverrideManager* overrides_;
  std::function<void(const std::string&)> problem_;
  std::function<void()> watch_;
  std::uint32_t epoch_ = 0;              // of the link
  bool was_up_ = false;                  // the link, at the last look
  bool leftovers_ = true;                // may be in this X-Plane
  Retries retries_;                      // to give them back
  std::atomic<bool> look_again_{false};  // there are new ones
  std::mutex mutex_;
  core::ClockCondition wanted_;
  bool now_ = false;  // without waiting for the end of the period
  bool ends_ = false;
  const std::shared_ptr<core::ThreadTurns> turns_;
  std::unique_ptr<core::ThreadSeat> seat_;  // from start() on
  std::thread thread_;
};

}  // namespace xplane_bridge
