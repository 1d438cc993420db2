#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "fake_xplane.hpp"
#include "xplane_bridge/core/link/sim_link.hpp"

namespace xplane_bridge::core {

/// A SimLink stepped by the test under a clock that only the test moves, against one or more fake X-Planes.
class SimLinkRig : public testing::Test {
 protected:
  SimLinkRig() {
    std::string pattern = (std::filesystem::temp_directory_path() / "sim-link-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  ~SimLinkRig() override {
    tick_ns_ =
        50 * kNanosecondsPerMillisecond;  // no X-Plane answers any more: let the link's last requests time out quickly
    link_.reset();
    std::filesystem::remove_all(folder_);
  }

  static SimLinkOptions optionsFor(const FakeXPlane& sim) {
    SimLinkOptions options;
    options.host = "127.0.0.1";
    options.port = sim.port();
    options.listen_for_beacon = false;
    return options;
  }

  static SimLinkOptions optionsForBeacon() {
    SimLinkOptions options;
    options.beacon_port = 0;
    return options;
  }

  Clock clock() {
    return {[this] { return now_ns_ += tick_ns_; },
            [this] { return now_ns_.load() + 1'000'000 * kNanosecondsPerSecond; }};
  }

  void makeLink(const SimLinkOptions& options) {
    SimLinkCallbacks callbacks;
    callbacks.on_data = [this](const DataView& data, const ReceiveInfo&) {
      ++data_datagrams_;
      for (std::size_t i = 0; i < data.size(); ++i) {
        rows_[data[i].index()] = data[i].value(0);
      }
    };
    callbacks.on_xpc = [this](const XpcPosition& position, const ReceiveInfo&) {
      ++xpc_datagrams_;
      last_xpc_ = position;
    };
    callbacks.on_rpos = [this](const Rpos& rpos, const ReceiveInfo&) {
      ++rpos_datagrams_;
      last_rpos_ = rpos;
    };
    callbacks.on_state = [this](const LinkStatus& status) {
      if (states_.empty() || states_.back() != status.state) {
        states_.push_back(status.state);
      }
    };
    const LogFunction log = [this](LogLevel, const std::string& line) { log_.push_back(line); };
    link_ = std::make_unique<SimLink>(options, std::move(callbacks), clock(), log, journalsIn(folder_, "/test", log));
  }

  /// Subscribes a group whose datagrams are counted, and values kept, under the number returned.
  int subscribe(RrefGroup group) {
    const auto id = static_cast<int>(subscriptions_.size());
    subscriptions_.push_back(
        link_->subscribe(std::move(group), [this, id](const RrefView& values, const ReceiveInfo& info) {
          ++datagrams_[id];
          last_info_ = info;
          for (std::size_t i = 0; i < values.size(); ++i) {
            values_[{id, values[i].index}] = values[i].value;
          }
        }));
    return id;
  }

  /// Lets time pass in steps of 5 ms; each fake renders a frame every 15 ms and announces itself once a second.
  void run(double seconds, const std::vector<FakeXPlane*>& sims) {
    runUntil([] { return false; }, seconds, sims);
  }

  /// Returns the seconds it took, or a negative number when it did not come about.
  double runUntil(const std::function<bool()>& condition, double limit_s, const std::vector<FakeXPlane*>& sims) {
    const std::int64_t begin = now_ns_;
    while (static_cast<double>(now_ns_ - begin) < limit_s * 1e9) {
      for (FakeXPlane* sim : sims) {
        if (beacons_ && now_ns_ >= next_beacon_ns_[sim]) {
          sim->sendBeacon(link_->beaconPort(), "fake-" + std::to_string(sim->port()));
          next_beacon_ns_[sim] = now_ns_ + kNanosecondsPerSecond;
        }
        if (steps_ % 3 == 0) {
          sim->pump();
          most_requests_ = std::max(most_requests_, sim->requests_in_pump);
        }
      }
      link_->step(0);
      if (condition()) {
        return static_cast<double>(now_ns_ - begin) / 1e9;
      }
      ++steps_;
      now_ns_ += 5 * kNanosecondsPerMillisecond;
    }
    return -1.0;
  }

  double runUntilState(LinkState state, double limit_s, const std::vector<FakeXPlane*>& sims) {
    return runUntil([&] { return link_->status().state == state; }, limit_s, sims);
  }

  bool hasProblem(const std::string& text) const {
    for (const std::string& problem : link_->status().problems) {
      if (problem.find(text) != std::string::npos) {
        return true;
      }
    }
    return false;
  }

  std::atomic<std::int64_t> now_ns_{5'000 * kNanosecondsPerSecond};
  std::int64_t tick_ns_ = 0;  // by how much reading the clock moves it
  std::string folder_;
  std::unique_ptr<SimLink> link_;
  bool beacons_ = false;
  std::map<FakeXPlane*, std::int64_t> next_beacon_ns_;
  int steps_ = 0;
  std::size_t most_requests_ = 0;

  std::vector<Subscription> subscriptions_;
  std::map<int, int> datagrams_;
  std::map<std::pair<int, std::int32_t>, float> values_;
  ReceiveInfo last_info_;
  int data_datagrams_ = 0;
  std::map<std::int32_t, float> rows_;
  int rpos_datagrams_ = 0;
  Rpos last_rpos_;
  int xpc_datagrams_ = 0;
  XpcPosition last_xpc_;
  std::vector<LinkState> states_;
  std::vector<std::string> log_;
};

class SimLinkTest : public SimLinkRig {
 protected:
  static RrefGroup group(std::vector<std::string> datarefs) { return {"test", std::move(datarefs), 50, 0}; }
};

}  // namespace xplane_bridge::core
