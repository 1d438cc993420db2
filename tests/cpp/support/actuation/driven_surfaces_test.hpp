#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fake_airframe.hpp"
#include "fake_simulator.hpp"
#include "xplane_bridge/actuation/mixing_files.hpp"
#include "xplane_bridge/actuation/override_manager.hpp"
#include "xplane_bridge/actuation/surface_control.hpp"

namespace xplane_bridge {

/// A SurfaceControl that is ready to drive the surfaces of a FakeAirframe, whose mixing it has from a file.
class DrivenSurfacesTest : public testing::Test {
 protected:
  using Reports = std::vector<std::pair<std::string, bool>>;

  explicit DrivenSurfacesTest(core::SimulatorVersion version = core::kXPlane11) : sim_(version) {
    writeMixingFile(folder(), core::FakeAirframe::mixing("TEST"));
    sim_.on_frame = [this] { eachFrame(); };
    surfaces_.onLink(sim_.status());
    surfaces_.onAircraft("TEST");
    // Half a second of steady stick, then five samples at 10 Hz that fit the mixing.
    sim_.run(1.2);
    EXPECT_EQ(surfaces_.blockReason(), "");
    sim_.clearMessages();
    reports_.clear();
    surfaces_.takeAbandoned();  // that another aircraft was loaded
  }

  void eachFrame() {
    airframe_.move();
    surfaces_.tick(blocked_);
  }
  /// Nothing may be sent from the next frame on.
  void block(const std::string& why) { blocked_ = RequestResult{core::ResultCode::kRefused, why}; }
  std::string folder() const { return sim_.folder() + "/mixing"; }
  std::string shipped() const { return sim_.folder() + "/shipped"; }
  SurfaceControlOptions options() const {
    SurfaceControlOptions out;
    out.mixing_folder = folder();
    out.shipped_mixing = shipped();
    return out;
  }
  SurfaceControlState state() const { return surfaces_.status().state; }
  void setLink(core::LinkState state) {
    sim_.setState(state);
    surfaces_.onLink(sim_.status());
  }
  /// What was written to a dataref.
  std::vector<float> written(const std::string& dataref) const {
    std::vector<float> out;
    for (const auto& [path, value] : sim_.writes()) {
      if (path == dataref) out.push_back(value);
    }
    return out;
  }

  core::FakeSimulator sim_;
  core::FakeAirframe airframe_{&sim_};
  std::optional<RequestResult> blocked_;  // nothing may be sent
  Reports reports_;                       // of surfaces_
  std::vector<SurfaceControl::Echo> echoes_;
  OverrideManager overrides_{&sim_, [](const std::string&, bool) {}};
  SurfaceControl surfaces_{&sim_, &overrides_, options(),
                           [this](const std::string& text, bool success) { reports_.emplace_back(text, success); },
                           [this] {
                             while (const auto echo = surfaces_.takeEcho()) echoes_.push_back(*echo);
                           }};
};

}  // namespace xplane_bridge
