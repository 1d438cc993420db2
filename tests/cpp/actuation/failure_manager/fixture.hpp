#pragma once

/// What tests of FailureManager share.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "actuation/driven_surfaces_test.hpp"
#include "xplane_bridge/actuation/failure_manager.hpp"
#include "xplane_bridge/core/failures/failure_names.hpp"

namespace xplane_bridge {

using core::FailureTrigger;
using core::FakeAirframe;
using core::kSurfaceOverride;
using core::LinkState;
using core::ResultCode;
using Names = std::vector<std::string>;

const std::string kLeft = FakeAirframe::dataref(FakeAirframe::kLeft);
const std::string kRight = FakeAirframe::dataref(FakeAirframe::kRight);
const std::string kEngine = "sim/operation/failures/rel_engfai0";
const std::string kPitot = "sim/operation/failures/rel_pitot";
const std::string kLock = "sim/operation/failures/rel_fcon_ailn_1_lft_lock";
constexpr const char* kWho = "node/set_failure";

inline core::FailureRequest failed(const std::string& name) { return {name, "failed", {}, 0, 0.0}; }
inline core::FailureRequest broken(const std::string& surface, const std::string& kind,
                                   std::optional<double> value = {}) {
  return {surface, kind, value, 0, 0.0};
}
inline core::FailureRequest triggered(const std::string& name, FailureTrigger trigger, double value) {
  return {name, "failed", {}, static_cast<int>(trigger), value};
}

/// Expectations are worked out by hand: X-Plane must show within 2 s what it is asked for, a failure is 6 while it is
/// set, and FakeAirframe's left aileron is at 20 deg a unit of roll.
class FailureManagerTest : public DrivenSurfacesTest {
 protected:
  explicit FailureManagerTest(core::SimulatorVersion version = core::kXPlane11) : DrivenSurfacesTest(version) {
    sim_.setAll(core::simulatorFailures(version), 0.0F);
    failures_.onLink(sim_.status());
    sim_.on_frame = [this] {
      watch_.sim_time = static_cast<double>(sim_.value("sim/time/total_running_time_sec"));
      for (auto& [time, event] : events_) {
        if (event && sim_.time() >= time) std::exchange(event, nullptr)();
      }
      if (core::answers(sim_.status().state)) failures_.onFrame(watch_, placing_);
      eachFrame();
      failures_.tick();
    };
    sim_.run(1.2);
    published_.clear();
    sim_.clearMessages();
  }

  void setLink(LinkState state) {
    DrivenSurfacesTest::setLink(state);
    failures_.onLink(sim_.status());
  }
  /// Another aircraft, whose mixing has one law more.
  void adopt(core::MixingModel mixing, const core::SurfaceLaw& more) {
    mixing.laws.push_back(more);
    std::sort(mixing.laws.begin(), mixing.laws.end(),
              [](const auto& a, const auto& b) { return a.surface < b.surface; });
    writeMixingFile(folder(), mixing);
    surfaces_.onAircraft(mixing.aircraft);
    surfaces_.takeAbandoned();
  }
  /// What happens while a call under test waits.
  void after(double seconds, const std::function<void()>& event) { events_.emplace_back(sim_.time() + seconds, event); }

  RequestResult set(const core::FailureRequest& request) { return failures_.set(request, kWho); }
  void require(const core::FailureRequest& request) {
    const RequestResult result = set(request);
    ASSERT_EQ(result.code, ResultCode::kOk) << result.text;
    ASSERT_EQ(result.text, "X-Plane shows it");
  }
  FailureManager::ClearResult clear(const Names& names = {}, bool include_simulator = false) {
    return failures_.clear(names, include_simulator, kWho);
  }
  void requireClear(const Names& names = {}, bool include_simulator = false) {
    const auto done = clear(names, include_simulator);
    ASSERT_EQ(done.result.code, ResultCode::kOk) << done.result.text;
  }
  void refused(const core::FailureRequest& request, ResultCode code, const std::string& text) {
    SCOPED_TRACE(request.name + " " + request.kind);
    const Names before = labelNames();
    const RequestResult result = set(request);
    EXPECT_EQ(result.code, code);
    EXPECT_NE(result.text.find(text), std::string::npos) << result.text;
    EXPECT_EQ(labelNames(), before);
  }

  core::FailureLabel label(const std::string& name) const {
    for (const core::FailureLabel& each : failures_.snapshot().labels) {
      if (each.name == name) return each;
    }
    ADD_FAILURE() << "no label " << name;
    return {};
  }
  Names labelNames() const {
    Names out;
    for (const core::FailureLabel& each : failures_.snapshot().labels) out.push_back(each.name);
    return out;
  }
  bool reported(const std::string& text, const std::string& who, bool success) const {
    return std::find(reported_.begin(), reported_.end(), std::make_tuple(text, who, success)) != reported_.end();
  }
  bool isInJournal(const std::string& dataref) {
    const auto entries = sim_.journal()->entries();
    return std::any_of(entries.begin(), entries.end(),
                       [&](const core::JournalEntry& entry) { return entry.id == "override:" + dataref; });
  }

  core::FlightWatch watch_;
  bool placing_ = false;                                          // the aircraft is on its way to another flight
  std::vector<std::pair<double, std::function<void()>>> events_;  // [s] of the fake clock
  std::vector<FailureSnapshot> published_;
  std::vector<std::tuple<std::string, std::string, bool>> reported_;  // text, who, success
  FailureManager failures_{&sim_,
                           &overrides_,
                           &surfaces_,
                           2.0,
                           [this](const FailureSnapshot& snapshot) { published_.push_back(snapshot); },
                           [this](const std::string& text, const std::string& who, bool success) {
                             reported_.emplace_back(text, who, success);
                           }};
};

class FailureManagerTest12 : public FailureManagerTest {
 protected:
  FailureManagerTest12() : FailureManagerTest(core::kXPlane12) {}
};

}  // namespace xplane_bridge
