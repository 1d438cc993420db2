#include "xplane_bridge/core/base/lockstep_clock.hpp"

#include <mutex>
#include <utility>

namespace xplane_bridge::core {
namespace {

constexpr std::int64_t kBegin = (std::int64_t{1} << 20) * kNanosecondsPerSecond;  // the same power of two for days

}  // namespace

struct LockstepClock::State {
  State(Clock host_in, std::int64_t start) : host(std::move(host_in)), start_ns(start), system_ns(start) {
    host_mark_ns = host.steady_ns();
  }

  std::int64_t steady() {
    const std::lock_guard<std::mutex> lock(mutex);
    return phase == Phase::kFlying ? steady_mark_ns : steady_mark_ns + host.steady_ns() - host_mark_ns;
  }
  std::int64_t system() {
    const std::lock_guard<std::mutex> lock(mutex);
    return system_ns;
  }

  const Clock host;
  const std::int64_t start_ns;
  const std::shared_ptr<ClockWaiters> waiters = std::make_shared<ClockWaiters>();
  std::mutex mutex;  // guards the following
  Phase phase = Phase::kHeld;
  std::int64_t host_mark_ns = 0;         // when the host's pace began to count
  std::int64_t steady_mark_ns = kBegin;  // steady time then, or of the frame
  std::int64_t system_ns;
  std::int64_t sim_ns = 0;    // of the newest frame
  std::int64_t frame_ns = 0;  // that the newest frame lasted in which time went on
};

LockstepClock::LockstepClock(Clock host, std::int64_t start_ns)
    : state_(std::make_shared<State>(std::move(host), start_ns)) {}

Clock LockstepClock::clock() const {
  return {[state = state_] { return state->steady(); }, [state = state_] { return state->system(); }, state_->waiters};
}

LockstepClock::Phase LockstepClock::phase() const {
  const std::lock_guard<std::mutex> lock(state_->mutex);
  return state_->phase;
}

void LockstepClock::move(std::int64_t sim_ns) {
  {
    const std::lock_guard<std::mutex> lock(state_->mutex);
    State& s = *state_;
    if (s.phase == Phase::kReleased) return;
    if (s.phase == Phase::kHeld) {
      // On to a whole second: sums and differences of seconds are then rounded alike in all runs.
      const std::int64_t now_ns = s.steady_mark_ns + s.host.steady_ns() - s.host_mark_ns;
      s.steady_mark_ns = (now_ns + kNanosecondsPerSecond - 1) / kNanosecondsPerSecond * kNanosecondsPerSecond;
      s.phase = Phase::kFlying;
    } else if (sim_ns > s.sim_ns) {  // X-Plane's time may run back, the steady one may not
      s.frame_ns = sim_ns - s.sim_ns;
      s.steady_mark_ns += s.frame_ns;
    } else if (sim_ns == s.sim_ns) {
      s.steady_mark_ns += s.frame_ns;  // paused: deadlines are counted in frames
    }
    s.sim_ns = sim_ns;
    s.system_ns = s.start_ns + sim_ns;
  }
  tick();
}

void LockstepClock::release() {
  {
    const std::lock_guard<std::mutex> lock(state_->mutex);
    State& s = *state_;
    if (s.phase == Phase::kFlying) s.host_mark_ns = s.host.steady_ns();
    s.phase = Phase::kReleased;
  }
  tick();
}

void LockstepClock::tick() { state_->waiters->wake(state_->steady()); }

}  // namespace xplane_bridge::core
