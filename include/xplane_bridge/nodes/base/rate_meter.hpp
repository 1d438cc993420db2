#pragma once

#include <cstdint>
#include <optional>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge {

/// Rate of a counter between two reports.
class RateMeter {
 public:
  /// @param total the counter now
  /// @param steady_ns [ns] now, by a steady clock
  /// @return its rate since the last call [1/s]; 0 at the first call and while the clock stands
  double update(std::uint64_t total, std::int64_t steady_ns) {
    const double elapsed = at_ns_ ? core::toSeconds(steady_ns - *at_ns_) : 0.0;
    const double rate = elapsed > 0.0 ? static_cast<double>(total - total_) / elapsed : 0.0;
    at_ns_ = steady_ns;
    total_ = total;
    return rate;
  }

 private:
  std::uint64_t total_ = 0;
  std::optional<std::int64_t> at_ns_;
};

}  // namespace xplane_bridge
