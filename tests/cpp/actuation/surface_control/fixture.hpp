#pragma once

/// What tests of SurfaceControl share.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "actuation/driven_surfaces_test.hpp"
#include "xplane_bridge/actuation/mixing_files.hpp"
#include "xplane_bridge/actuation/surface_control.hpp"

namespace xplane_bridge {

using core::FakeAirframe;
using core::kSurfaceOverride;
using core::SurfaceFault;
using State = SurfaceControlState;
using Names = std::vector<std::string>;
using Writes = std::vector<std::pair<std::string, float>>;

const std::string kLeft = FakeAirframe::dataref(FakeAirframe::kLeft);
const std::string kRight = FakeAirframe::dataref(FakeAirframe::kRight);
const std::string kElevator = FakeAirframe::dataref(FakeAirframe::kElevator);
const std::string kRudder = FakeAirframe::dataref(FakeAirframe::kRudder);
const std::size_t kLeftNumber = core::surfaceNumber(FakeAirframe::kLeft).value();

/// Expectations are worked out by hand from the mixing of FakeAirframe, frames of 0.02 s and the driver's 60 deg/s: a
/// driven surface moves by 1.2 deg a frame.
class SurfaceControlTest : public DrivenSurfacesTest {
 protected:
  explicit SurfaceControlTest(core::SimulatorVersion version = core::kXPlane11) : DrivenSurfacesTest(version) {}

  static core::SurfaceFailure stuckAt(double deflection_deg) {
    return {kLeftNumber, SurfaceFault::kStuck, deflection_deg};
  }
  /// The left aileron is broken, and driven at 6 deg.
  void drive() {
    surfaces_.setFailures({stuckAt(6.0)});
    sim_.run(0.2);
    ASSERT_EQ(state(), State::kDriving);
    ASSERT_FLOAT_EQ(sim_.value(kLeft), 6.0F);
    sim_.clearMessages();
    reports_.clear();
  }
};

class SurfaceControlTest12 : public SurfaceControlTest {
 protected:
  SurfaceControlTest12() : SurfaceControlTest(core::kXPlane12) {}
};

inline core::SimulatorVersion otherwise(core::Otherwise what) {
  return {core::kXPlane11.number, static_cast<std::uint32_t>(what)};
}

class SurfaceControlTestOfOtherBeta : public SurfaceControlTest {
 protected:
  SurfaceControlTestOfOtherBeta() : SurfaceControlTest(otherwise(core::Otherwise::kBetaSign)) {}
};

}  // namespace xplane_bridge
