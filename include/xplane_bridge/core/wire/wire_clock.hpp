#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "xplane_bridge/core/base/bytes.hpp"
#include "xplane_bridge/core/base/clock.hpp"

namespace xplane_bridge::core {

/// The clock of a node whose wire is logged or replayed: it shows the time of the newest event there, and stands in
/// between. So whatever the node works out of the time follows from the log. A copy is the same clock.
class WireClock {
 public:
  explicit WireClock(const Clock& host) : state_(std::make_shared<State>(host.steady_ns(), host.system_ns())) {}

  Clock clock() const {
    return {[state = state_] { return state->steady_ns.load(); }, [state = state_] { return state->wall_ns.load(); },
            state_->waiters};
  }
  std::int64_t steady() const { return state_->steady_ns; }
  std::int64_t wall() const { return state_->wall_ns; }
  /// From the thread that receives.
  void move(std::int64_t steady_ns, std::int64_t wall_ns) const {
    state_->steady_ns = steady_ns;
    state_->wall_ns = wall_ns;
    state_->waiters->wake(steady_ns);
  }

 private:
  struct State {
    State(std::int64_t steady, std::int64_t wall) : steady_ns(steady), wall_ns(wall) {}
    std::atomic<std::int64_t> steady_ns;
    std::atomic<std::int64_t> wall_ns;
    const std::shared_ptr<ClockWaiters> waiters = std::make_shared<ClockWaiters>();
  };
  std::shared_ptr<State> state_;
};

/// What a node does between datagrams, on the thread that receives, so that its order stands in the log.
class WireTurn {
 public:
  virtual ~WireTurn() = default;
  /// [ns] of the steady clock: when it has something to do next; none: 0.
  virtual std::int64_t nextDue() = 0;
  /// Whether an input waits: wait() is not to wait for datagrams.
  virtual bool hasInput() = 0;
  /// Live: hands over the next input that waits. False: there is none.
  virtual bool takeInput(std::vector<std::uint8_t>* input) = 0;
  /// Acts on an input.
  virtual void act(ByteView input) = 0;
  /// Does what is due, and lets the node's other threads have their turns.
  virtual void runDue() = 0;
  /// Another thread has asked for the end of wait(). From that thread.
  virtual void woken() = 0;
  /// Replayed: there are no more records.
  virtual void end() = 0;
};

}  // namespace xplane_bridge::core
