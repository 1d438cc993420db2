#pragma once

/// What tests of ControlPath share.

#include <gtest/gtest.h>

#include <algorithm>

#include "actuation/flown_path.hpp"
#include "xplane_bridge/actuation/control_path.hpp"

namespace xplane_bridge {

using core::FlightMode;
using core::LinkState;
using Floats = std::vector<float>;
using Texts = std::vector<std::string>;

class ControlPathTest : public testing::Test, protected FlownPath {
 protected:
  bool inJournal(const std::string& dataref) const {
    for (const core::JournalEntry& entry : sim.journal()->entries()) {
      if (entry.id == "override:" + dataref) return true;
    }
    return false;
  }
  static constexpr const char* kRunningTime = "sim/time/total_running_time_sec";
  static constexpr const char* kRudderTrim = "sim/cockpit2/controls/rudder_trim";
  static constexpr const char* kFlightTime = "sim/time/total_flight_time_sec";

  /// Asks for the mode and flies in it, a quarter to the right.
  void fly(FlightMode mode, double seconds) {
    sim.set(kFlightTime, 50.0F);
    if (mode == FlightMode::kAuto) ask(mode);
    flyOn(mode, seconds);
    ASSERT_FLOAT_EQ(sim.value(kStickRoll), 0.25F);
    ASSERT_EQ(modes.back().mode, mode);
  }
  void flyOn(FlightMode mode, double seconds) {
    for (const double end = sim.time() + seconds - 1e-6; sim.time() < end;) {
      path->command(mode, rollCommand(0.25));
      frame();
    }
  }
  /// X-Plane ends and comes back with a flight of its own.
  void restartXPlane() {
    setState(LinkState::kLost);
    run(1.0);
    sim.set(kRunningTime, 1.0F);
    sim.set(kFlightTime, 1.0F);
    sim.set(kStickOverride, 0.0F);
    sim.set(kStickRoll, 0.0F);
    setState(LinkState::kConnected);
  }
  /// Another client, or the panic tool, takes the override back, and X-Plane shows it for the half second it takes to
  /// believe it.
  void releaseByAnother() {
    run(0.3);
    sim.set(kStickOverride, 0.0F);
    run(0.7);
  }
};

}  // namespace xplane_bridge
