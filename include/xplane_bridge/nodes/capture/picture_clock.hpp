#pragma once

#include <cstdint>
#include <utility>

#include "xplane_bridge/core/base/clock.hpp"
#include "xplane_bridge/core/state/clock_filter.hpp"

namespace xplane_bridge {

/// The clock that pictures are paired by: the host's steady one, which nothing sets. So a step of the wall clock (NTP,
/// an operator) moves what is published, never a picture against its frame. Any thread, but for received() and
/// follow().
class PictureClock {
 public:
  /// @param host CLOCK_MONOTONIC and CLOCK_REALTIME
  explicit PictureClock(core::Clock host) : host_(std::move(host)) { follow(); }

  /// [ns] now
  [[nodiscard]] std::int64_t now() const { return host_.steady_ns(); }

  /// When a datagram came; one thread. @param wall_ns [ns] the kernel's stamp, by the wall clock
  [[nodiscard]] std::int64_t received(std::int64_t wall_ns) {
    const std::int64_t wall_now_ns = host_.system_ns();
    const std::int64_t now_ns = now();
    const std::int64_t came_ns = now_ns - (wall_now_ns - wall_ns);
    // Outside these bounds the wall clock was set after the stamp. The clock filter bears what is late, not what is
    // early.
    received_ns_ = came_ns < received_ns_ || came_ns > now_ns ? now_ns : came_ns;
    return received_ns_;
  }

  /// Keeps up with a wall clock that was set; one thread, several times a second.
  void follow() {
    const std::int64_t wall_ns = host_.system_ns();
    wall_.read(wall_ns, host_.steady_ns());
  }
  /// [ns] as it is published, by a wall clock that runs evenly and follows a step of the host's after
  /// `core::ReceiveClock::kReadings` to twice as many calls of follow()
  [[nodiscard]] std::int64_t toWall(std::int64_t time_ns) const { return time_ns + wall_.offsetNs(); }
  /// [ns] the reverse
  [[nodiscard]] std::int64_t fromWall(std::int64_t wall_ns) const { return wall_ns - wall_.offsetNs(); }

 private:
  const core::Clock host_;
  core::ReceiveClock wall_;
  std::int64_t received_ns_ = 0;  // of the last datagram
};

}  // namespace xplane_bridge
