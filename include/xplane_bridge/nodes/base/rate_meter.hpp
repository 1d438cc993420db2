#pragma once

#include <chrono>
#include <cstdint>

namespace xplane_bridge {

/// Rate of a counter between two reports.
class RateMeter {
 public:
  /// @param total the counter now
  /// @return its rate since the last call, or since this object was made [1/s]
  double update(std::uint64_t total) {
    const auto now = std::chrono::steady_clock::now();
    const double elapsed = std::chrono::duration<double>(now - at_).count();
    const double rate = elapsed > 0.0 ? static_cast<double>(total - total_) / elapsed : 0.0;
    at_ = now;
    total_ = total;
    return rate;
  }

 private:
  std::uint64_t total_ = 0;
  std::chrono::steady_clock::time_point at_ = std::chrono::steady_clock::now();
};

}  // namespace xplane_bridge
