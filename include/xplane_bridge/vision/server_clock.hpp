#pragma once

#include <cstdint>
#include <deque>
#include <utility>

namespace xplane_bridge::vision {

/// Turns the X server's millisecond stamps into host time.
///
/// An event carries the server's time of the drawing, but in milliseconds of a clock of its own; its arrival has our
/// clock, but is late by whatever the scheduler did. The least delay seen lately gives the offset between the two
/// clocks; a late arrival is then moved back to when the window was really drawn.
class ServerClock {
 public:
  /// @param server_ms [ms] stamp of the event, wraps at 2^32
  /// @param arrival_ns [ns] host time at which the event was read
  /// @return [ns] host time of the drawing, never after the arrival; resolution 1 ms
  [[nodiscard]] std::int64_t toHost(std::uint32_t server_ms, std::int64_t arrival_ns);

  /// Forgets the offset (another server).
  void reset();

 private:
  bool started_ = false;
  std::uint32_t last_ms_ = 0;
  std::int64_t unwrapped_ms_ = 0;
  std::deque<std::pair<std::int64_t, std::int64_t>> delays_;  // (arrival, arrival - server) [ns], the latter increasing
};

}  // namespace xplane_bridge::vision
