#include "xplane_bridge/core/link/sim_link_options.hpp"

#include <cmath>
#include <stdexcept>

#include "xplane_bridge/core/wire/rref_subscription.hpp"

namespace xplane_bridge::core {
namespace {

void require(bool condition, const std::string& message) {
  if (!condition) {
    throw std::invalid_argument(message);
  }
}

}  // namespace

void requireRange(const char* name, double value, double low, double high) {
  require(std::isfinite(value) && value >= low && value <= high, std::string(name) + " is " + std::to_string(value) +
                                                                     ", expected " + std::to_string(low) + " to " +
                                                                     std::to_string(high));
}

void requireRows(const std::vector<std::int32_t>& rows) {
  for (const std::int32_t row : rows) {
    require(row >= 0 && row < kDataRowLimit,
            "Data Output row " + std::to_string(row) + ", expected 0 to " + std::to_string(kDataRowLimit - 1));
  }
}

SimLinkOptions checked(SimLinkOptions options, bool has_journals) {
  constexpr double kHour = 3600.0;
  require(options.port != 0, "port is 0, expected the port X-Plane listens on (49000)");
  require(!options.host.empty() || options.listen_for_beacon,
          "no host is given and the beacon is not listened to: X-Plane cannot be found; set host");
  requireRange("stale_after_s", options.stale_after_s, 0.01, kHour);
  requireRange("lost_after_s", options.lost_after_s, options.stale_after_s, kHour);
  requireRange("beacon_timeout_s", options.beacon_timeout_s, 0.01, kHour);
  requireRange("beacon_settle_s", options.beacon_settle_s, 0.0, kHour);
  requireRange("probe_period_s", options.probe_period_s, 0.01, kHour);
  requireRange("batch_size", static_cast<double>(options.batch_size), 1.0, 1e6);
  requireRange("batch_frames", options.batch_frames, 0.0, 1e3);
  requireRange("batch_spacing_s", options.batch_spacing_s, 0.0, kHour);
  requireRange("request_timeout_s", options.request_timeout_s, 0.01, kHour);
  requireRange("rpos_rate_hz", options.rpos_rate_hz, 0, kEveryFrameRateHz);
  require(options.xpc_rate_hz > 0.0 && options.xpc_rate_hz <= 1000.0, "xpc_rate_hz must be above 0 and at most 1000");
  const DataOutputOptions& data = options.data_output;
  require(data.port != kXPlaneSendPort, "data_port 49001 is X-Plane's own sending port; choose another, such as 49003");
  requireRows(data.rows);
  if (data.enabled) {
    require(data.port != 0 || data.configure, "data_port 0 (any) needs X-Plane to be configured by the bridge");
    require(!data.configure || has_journals,
            "Data Output cannot be configured without a journal in which its previous settings are kept");
    require(!data.configure || !data.rows.empty(), "no Data Output rows are asked for");
    requireRange("data output rate", data.rate_hz, 1, 99);
  }
  return options;
}

}  // namespace xplane_bridge::core
