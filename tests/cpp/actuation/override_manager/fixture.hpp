#pragma once

/// What tests of OverrideManager share.

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "fake_simulator.hpp"
#include "xplane_bridge/actuation/override_manager.hpp"
#include "xplane_bridge/core/control/control_channels.hpp"

namespace xplane_bridge {

using Names = std::vector<std::string>;
using Writes = std::vector<std::pair<std::string, float>>;
using Reports = std::vector<std::pair<std::string, bool>>;

constexpr const char* kJoystick = "sim/operation/override/override_joystick";
constexpr const char* kThrottles = "sim/operation/override/override_throttles";
constexpr const char* kUnknown = "sim/operation/override/override_joystik";  // to X-Plane
constexpr const char* kFailure = "sim/operation/failures/rel_elv_L_jam";
constexpr const char* kThrottle12 = "sim/flightmodel/engine/ENGN_thro_override[0]";

/// Expectations are worked out by hand from the contract in override_manager.hpp: overrides are 1 while set and 0 when
/// given back, X-Plane is asked at 10 Hz, and five answers in a row confirm a release.
class OverrideManagerTest : public testing::Test {
 protected:
  OverrideManagerTest() { sim_.setAll({kJoystick, kThrottles, core::kSurfaceOverride, kFailure}, 0.0F); }

  /// Entries of the journal by what they give back.
  Names inJournal() {
    Names out;
    for (const core::JournalEntry& entry : sim_.journal()->entries()) {
      for (const core::UndoOperation& operation : entry.undo) out.push_back(std::get<core::UndoDref>(operation).path);
    }
    std::sort(out.begin(), out.end());
    return out;
  }
  void crashedRunHas(const std::string& dataref) {
    sim_.set(dataref, 1.0F);
    sim_.journalOfAnother().record("override:" + dataref, kOverridePurpose, {core::UndoDref{dataref, 0.0F}});
  }
  /// Half a second and a bit, so that X-Plane has answered six times.
  void letSixAnswersPass() { sim_.run(0.56); }

  core::FakeSimulator sim_;
  Reports reports_;
  OverrideManager manager_{&sim_,
                           [this](const std::string& text, bool success) { reports_.emplace_back(text, success); }};
};

}  // namespace xplane_bridge
