#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "scripted_hub.hpp"
#include "xplane_bridge/core/link/sim_link.hpp"

/// A SimLink on a list of datagrams instead of sockets, under a clock moved by hand.
namespace xplane_bridge::core {

inline constexpr Endpoint kXPlane{0x0A010203U, 49000};
inline constexpr std::int64_t kMs = kNanosecondsPerMillisecond;

/// Row 3 with this speed in all slots.
inline std::vector<std::uint8_t> data(float speed) {
  std::vector<std::uint8_t> bytes = {'D', 'A', 'T', 'A', '*', 3, 0, 0, 0};
  std::uint8_t value[4];
  std::memcpy(value, &speed, 4);
  for (int slot = 0; slot < 8; ++slot) {
    bytes.insert(bytes.end(), value, value + 4);
  }
  return bytes;
}

inline std::vector<std::uint8_t> beacon(const std::string& computer_name = "sim") {
  std::vector<std::uint8_t> bytes = {'B', 'E', 'C', 'N', 0, 1, 2, 1, 0, 0, 0};
  const std::int32_t version = 122015;
  const auto* begin = reinterpret_cast<const std::uint8_t*>(&version);
  bytes.insert(bytes.end(), begin, begin + sizeof(version));
  bytes.insert(bytes.end(), {1, 0, 0, 0, 0x68, 0xBF});  // master, port 49000
  bytes.insert(bytes.end(), computer_name.begin(), computer_name.end());
  bytes.push_back(0);
  return bytes;
}

/// What a handler got: steady time, stamp, whether it is the kernel's, epoch, index and value.
using Delivery = std::tuple<std::int64_t, std::int64_t, bool, std::uint32_t, std::int32_t, float>;

class ScriptedLink : public testing::Test {
 protected:
  static SimLinkOptions defaults() {
    SimLinkOptions options;
    options.host = "10.1.2.3";
    options.port = 49000;
    options.listen_for_beacon = false;
    return options;
  }
  /// Data Output that X-Plane sends already.
  static SimLinkOptions withRows(std::int32_t unheard_version = 0) {
    SimLinkOptions options = defaults();
    options.unheard_version = unheard_version;
    options.data_output.enabled = true;
    options.data_output.configure = false;
    options.data_output.rows = {3};
    return options;
  }
  void makeLink(const SimLinkOptions& options = defaults()) {
    SimLinkCallbacks callbacks;
    callbacks.on_data = [this](const DataView& data, const ReceiveInfo&) { rows_.push_back(data[0].value(0)); };
    callbacks.on_state = [this](const LinkStatus& status) {
      if (states_.empty() || states_.back().second != status.state) {
        states_.emplace_back(wire_->now_ns, status.state);
      }
    };
    link_ = std::make_unique<SimLink>(
        options, callbacks, wire_->clock(),
        [this](LogLevel level, const std::string& line) { log_.emplace_back(level, line); }, JournalFactory{},
        std::make_unique<ScriptedHub>(wire_));
    flight_ = link_->subscribe({"flight", {"a/b", "c/d"}, kEveryFrameRateHz, 0},
                               [this](const RrefView& view, const ReceiveInfo& info) {
                                 for (std::size_t i = 0; i < view.size(); ++i) {
                                   delivered_.emplace_back(info.steady_ns, info.stamp_ns, info.kernel_stamp,
                                                           info.link_epoch, view[i].index, view[i].value);
                                 }
                               });
  }

  void arrive(std::int64_t time_ns, const std::string& source, const std::vector<std::uint8_t>& bytes,
              Endpoint from = kXPlane, std::int64_t kernel_stamp_ns = 0) {
    wire_->arrivals.push_back({time_ns, source, bytes, from, kernel_stamp_ns});
  }
  /// The status that the link asks for by itself: version, paused, simulator time.
  void arriveStatus(std::int64_t time_ns, float sim_time) {
    arrive(time_ns, "control", rref({{0, 115501.0F}, {1, 0.0F}, {2, sim_time}}));
  }
  void runUntil(std::int64_t time_ns) {
    while (wire_->now_ns < time_ns) {
      link_->step(20);
    }
  }

  std::shared_ptr<ScriptedHub::Wire> wire_ = std::make_shared<ScriptedHub::Wire>();
  std::vector<std::pair<LogLevel, std::string>> log_;
  std::vector<std::pair<std::int64_t, LinkState>> states_;
  std::vector<Delivery> delivered_;
  std::vector<float> rows_;  // first slots of the first rows of DATA
  std::unique_ptr<SimLink> link_;
  Subscription flight_;
};

}  // namespace xplane_bridge::core
