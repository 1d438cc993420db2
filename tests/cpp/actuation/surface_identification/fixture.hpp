#pragma once

/// What tests of SurfaceIdentification share.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "actuation/quiet_hooks.hpp"
#include "fake_airframe.hpp"
#include "fake_simulator.hpp"
#include "xplane_bridge/actuation/actuation.hpp"
#include "xplane_bridge/actuation/mixing_files.hpp"
#include "xplane_bridge/actuation/surface_identification.hpp"
#include "xplane_bridge/core/failures/failure_names.hpp"

namespace xplane_bridge {

using core::EventKind;
using core::FakeAirframe;
using core::ResultCode;

const std::string kPosition = "sim/flightmodel/position/";
constexpr const char* kOnGround = "sim/flightmodel/failures/onground_any";
const std::array<std::string, 3> kSticks{"sim/joystick/yoke_roll_ratio", "sim/joystick/yoke_pitch_ratio",
                                         "sim/joystick/yoke_heading_ratio"};
const std::array<std::string, 3> kOverrides{"sim/operation/override/override_joystick_roll",
                                            "sim/operation/override/override_joystick_pitch",
                                            "sim/operation/override/override_joystick_heading"};

/// An Actuation on a FakeSimulator whose aircraft flies steadily and moves its surfaces as FakeAirframe's mixing says;
/// no mixing is known. A stick that is overridden is where it was written, else where the pilot holds it.
class SurfaceIdentificationTest : public testing::Test {
 protected:
  SurfaceIdentificationTest() {
    sim_.setAll(core::flightWatchDatarefs(), 0.0F);
    sim_.set("sim/time/total_running_time_sec", 100.0F);
    sim_.set(kPosition + "y_agl", 900.0F);
    sim_.set(kPosition + "elevation", 1000.0F);
    sim_.set(kPosition + "indicated_airspeed", 130.0F);
    sim_.set(kPosition + "groundspeed", 70.0F);
    sim_.setAll({kOverrides.begin(), kOverrides.end()}, 0.0F);
    sim_.setAll({kSticks.begin(), kSticks.end()}, 0.0F);
    sim_.setAll(core::simulatorFailures(core::kXPlane11), 0.0F);
    showAircraft("DA62");
    sim_.on_frame = [this] { eachFrame(); };
    ActuationHooks hooks = quietHooks();
    hooks.excitation = [this](const ExcitationLabel& label) { labels_.push_back(label); };
    hooks.event = [this](const ActuationEvent& event) { events_.push_back(event); };
    ActuationOptions options;
    options.surfaces.mixing_folder = folder();
    options.control.arbiter.transition_rate = 1000.0;
    actuation_ = std::make_unique<Actuation>(&sim_, options, std::move(hooks));
    actuation_->onLink(sim_.status());
    run(0.3);
  }

  std::string folder() const { return sim_.folder() + "/mixing"; }
  void showAircraft(const std::string& icao) {
    sim_.setAll(core::AircraftIdentityReader::datarefs(), 0.0F);
    for (std::size_t i = 0; i < icao.size(); ++i) {
      sim_.set("sim/aircraft/view/acf_ICAO[" + std::to_string(i) + "]", static_cast<float>(icao[i]));
    }
  }
  void eachFrame() {
    std::array<double, 3> stick{};
    for (std::size_t i = 0; i < 3; ++i) {
      const bool taken = sim_.value(kOverrides[i]) != 0.0F;
      stick[i] = taken ? static_cast<double>(sim_.value(kSticks[i])) : pilot_[i];
      low_[i] = std::min(low_[i], stick[i]);
      high_[i] = std::max(high_[i], stick[i]);
      ever_taken_[i] = ever_taken_[i] || taken;
    }
    airframe_.setStick(stick[0], stick[1], stick[2]);
    airframe_.move();
    if (each_frame_) each_frame_();
  }
  void run(double seconds) {
    for (double end = sim_.time() + seconds - 1e-6; sim_.time() < end;) {
      sim_.frame();
      actuation_->tick();
    }
  }
  Actuation::Identifying identify(const IdentificationRequest& request = {}) {
    return actuation_->identifySurfaces(request, "test", [this] { return ++reserved_; });
  }
  std::string refusal(const IdentificationRequest& request = {}) {
    const auto out = identify(request);
    EXPECT_EQ(out.event_number, 0U) << out.result.text;
    EXPECT_EQ(reserved_, 0U) << "a number of no event";
    return out.result.text;
  }
  void begin(const IdentificationRequest& request = {}) {
    const auto out = identify(request);
    ASSERT_EQ(out.result.code, ResultCode::kAccepted) << out.result.text;
    ASSERT_EQ(out.event_number, 1U);
  }
  /// The promised event; none yet: nothing in it.
  ActuationEvent outcome() const {
    const auto it = std::find_if(events_.begin(), events_.end(), [](const auto& event) { return event.number == 1; });
    return it == events_.end() ? ActuationEvent{} : *it;
  }
  /// Runs until the roll signal moves the stick.
  void beginSignal() {
    begin();
    run(1.5);
    ASSERT_TRUE(labels_.back().active);
    ASSERT_EQ(labels_.back().target, "roll");
  }
  /// It was given up, nothing is moved any more, and what the pilot flies with is his again.
  void expectGivenUp(const std::string& why) {
    EXPECT_FALSE(outcome().success);
    EXPECT_EQ(outcome().text.find("identify_surfaces is given up: "), 0U) << outcome().text;
    EXPECT_NE(outcome().text.find(why), std::string::npos) << outcome().text;
    EXPECT_FALSE(labels_.back().active);
    run(0.2);
    for (const std::string& name : kOverrides) EXPECT_EQ(sim_.value(name), 0.0F) << name;
    EXPECT_NE(actuation_->surfaces().blockReason(), "");
    EXPECT_FALSE(std::filesystem::exists(folder()));
  }
  std::string setCentred() {
    core::FailureRequest request;
    request.name = FakeAirframe::kLeft;
    request.kind = "centred";
    return actuation_->failures().set(request, "test").text;
  }
  /// X-Plane's frames go on while the failure is waited for.
  void breakAtOnce(const std::string& name, const std::string& kind = "failed") {
    each_frame_ = [this] { actuation_->tick(); };
    EXPECT_TRUE(actuation_->failures().set({name, kind, {}, 0, 0.0}, "test").success());
    each_frame_ = nullptr;
  }

  core::FakeSimulator sim_;
  FakeAirframe airframe_{&sim_};
  std::array<double, 3> pilot_{};  // where the pilot holds the stick
  std::array<double, 3> low_{}, high_{};
  std::array<bool, 3> ever_taken_{};
  std::function<void()> each_frame_;
  std::vector<ExcitationLabel> labels_;
  std::vector<ActuationEvent> events_;
  std::uint32_t reserved_ = 0;
  std::unique_ptr<Actuation> actuation_;
};

// ------------------------------------------------------------------------------------------------------ it succeeds

}  // namespace xplane_bridge
