/// control/surfaces under the arbiter: a ControlPath and a SurfaceControl on one FakeSimulator, wired as in tx_node.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "actuation/driven_surfaces_test.hpp"
#include "xplane_bridge/actuation/control_path.hpp"

namespace xplane_bridge {
namespace {

using core::FakeAirframe;
using core::FlightMode;
using State = SurfaceControlState;

const char* const kYokeRoll = "sim/joystick/yoke_roll_ratio";
const std::string kLeft = FakeAirframe::dataref(FakeAirframe::kLeft);

/// Frames of 0.02 s and the driver's 60 deg/s: a driven surface moves by 1.2 deg a frame.
class SurfaceAuthorityTest : public DrivenSurfacesTest {
 protected:
  explicit SurfaceAuthorityTest(FlightMode surfaces_source = FlightMode::kAuto) {
    ControlPathHooks hooks;
    hooks.mode = [this](const core::ModeStatus& status, double) { mode_ = status; };
    hooks.applied = [](const AppliedControls&) {};
    hooks.stick = [this](const std::array<double, 3>& stick) { surfaces_.setStick(stick); };
    hooks.excitation = [] { return core::ChannelExcitation{}; };
    hooks.end_excitation = [](const std::string&) {};
    hooks.release_surfaces = [this](const std::string& why) { surfaces_.release(why); };
    hooks.end_surface_commands = [this] { surfaces_.endCommands(); };
    hooks.event = [this](ControlPathHooks::Kind, const std::string& text, const std::string&) {
      events_.push_back(text);
    };
    hooks.warn = [](const std::string&) {};
    ControlPathOptions options;
    options.arbiter.transition_rate = std::numeric_limits<double>::infinity();
    options.arbiter.surfaces_source = surfaces_source;
    path_ = std::make_unique<ControlPath>(&sim_, &overrides_, options, std::move(hooks), mutex_);
    path_->onLink(sim_.status());
    sim_.set("sim/operation/override/override_joystick_roll", 0.0F);
    sim_.on_frame = [this] {
      airframe_.setStick(sim_.value(kYokeRoll));  // X-Plane's total follows what is written
      eachFrame();
      if (surfaces_.takeReleasedByAnother()) path_->onReleasedByAnother(core::kSurfaceOverride);
      if (stick_) path_->command(FlightMode::kManual, rolled(*stick_));
      if (controller_) path_->command(FlightMode::kAuto, rolled(*controller_));
      if (commanded_) commandSurface(*commanded_);
      path_->tick();
    };
  }

  static core::ControlCommand rolled(double roll) {
    core::ControlCommand command;
    command.fields = core::kFieldRoll;
    command.roll = roll;
    return command;
  }
  /// As TxNode does. Returns why it is refused; empty: taken.
  std::string commandSurface(float deflection_deg) {
    std::string refusal = path_->refusalOfSurfaces();
    if (refusal.empty()) refusal = surfaces_.command({FakeAirframe::kLeft}, {deflection_deg}, 1).value_or("");
    if (refusal.empty()) path_->onSurfaceCommand(false);
    return refusal;
  }
  void ask(FlightMode mode) { path_->requestMode({0, static_cast<int>(mode), "test", 0.0}); }
  /// In their mode, the left aileron commanded to 6 deg and there, the stick in the middle.
  void flySurface(FlightMode mode = FlightMode::kAuto) {
    stick_ = 0.0;
    ask(mode);
    commanded_ = 6.0F;
    sim_.run(0.3);
    ASSERT_FLOAT_EQ(sim_.value(kLeft), 6.0F);
    ASSERT_EQ(state(), State::kDriving);
    sim_.clearMessages();
  }
  /// Frames pass until the failsafe acts; what was written in that frame alone stays.
  void runUntilFailsafe() {
    for (int frame = 0; frame < 50 && !mode_.failsafe; ++frame) {
      EXPECT_FLOAT_EQ(sim_.value(kLeft), 6.0F) << "before the failsafe";
      sim_.clearMessages();
      sim_.frame();
    }
    ASSERT_TRUE(mode_.failsafe);
  }
  /// In the one frame since: as far as the driver moves it.
  void expectOnItsWay() const { EXPECT_EQ(written(kLeft), std::vector<float>{4.8F}) << "on its way in the same frame"; }
  /// From one frame to the next, no further than the driver moves it.
  void expectNoJump() const {
    float before = 6.0F;
    for (const float now : written(kLeft)) {
      EXPECT_LE(std::abs(now - before), 1.2F + 1e-4F);
      before = now;
    }
  }

  std::shared_ptr<core::HandlerMutex> mutex_ = std::make_shared<core::HandlerMutex>();
  std::unique_ptr<ControlPath> path_;
  std::optional<double> stick_, controller_;  // what control/manual and control/auto repeat
  std::optional<float> commanded_;            // what control/surfaces repeats [deg]
  core::ModeStatus mode_;
  std::vector<std::string> events_;
};

TEST_F(SurfaceAuthorityTest, InManualNoSurfaceIsCommanded) {
  EXPECT_EQ(commandSurface(6.0F), "control/surfaces flies in AUTO, and the mode is MANUAL");
  commanded_ = 6.0F;
  sim_.run(0.5);
  EXPECT_EQ(state(), State::kIdle);
}

TEST_F(SurfaceAuthorityTest, AStickThatTakesOverEndsItInTheSameFrameWithoutAJump) {
  flySurface();
  stick_ = -0.5;  // the left aileron at -10 deg
  sim_.frame();
  EXPECT_EQ(mode_.mode, FlightMode::kManual);
  EXPECT_EQ(mode_.reason, "stick take-over: roll moved by -0.50 since AUTO was engaged; control/surfaces ends");
  EXPECT_EQ(events_.back(), "MANUAL: " + mode_.reason);
  expectOnItsWay();
  sim_.run(0.3);
  expectNoJump();
  EXPECT_NEAR(written(kLeft).back(), -10.0, 0.5) << "where the stick wants it";
  EXPECT_EQ(state(), State::kIdle) << "given back";
}

TEST_F(SurfaceAuthorityTest, ARequestForManualEndsItInTheSameFrame) {
  flySurface();
  ask(FlightMode::kManual);
  EXPECT_EQ(mode_.reason, "request; control/surfaces ends");
  sim_.frame();
  expectOnItsWay();
  sim_.run(0.3);
  expectNoJump();
  EXPECT_EQ(state(), State::kIdle);
}

TEST_F(SurfaceAuthorityTest, AFailsafeEndsItInTheSameFrame) {
  controller_ = -0.25;
  flySurface();
  controller_.reset();
  runUntilFailsafe();
  expectOnItsWay();
  EXPECT_EQ(mode_.reason, "timeout of control/auto; control/surfaces ends");
  sim_.run(0.3);
  expectNoJump();
  EXPECT_EQ(state(), State::kIdle) << "though commands keep coming";
  controller_ = 0.25;
  sim_.run(0.3);
  EXPECT_EQ(state(), State::kDriving) << "with the controller";
}

TEST_F(SurfaceAuthorityTest, CommandsThatAreNotRepeatedEnd) {
  flySurface();
  commanded_.reset();
  sim_.run(0.46);
  EXPECT_FLOAT_EQ(sim_.value(kLeft), 6.0F);
  sim_.run(0.3);
  expectNoJump();
  EXPECT_EQ(state(), State::kIdle);
  EXPECT_EQ(mode_.mode, FlightMode::kAuto);
}

TEST_F(SurfaceAuthorityTest, WhilePausedTheyNeedNotBeRepeated) {
  flySurface();
  commanded_.reset();
  setLink(core::LinkState::kPaused);
  path_->onLink(sim_.status());
  sim_.run(10.0);
  EXPECT_EQ(state(), State::kDriving);
  EXPECT_FLOAT_EQ(sim_.value(kLeft), 6.0F);
}

TEST_F(SurfaceAuthorityTest, EndedInAPauseTheyRunBackAfterItWithoutAJump) {
  flySurface();
  setLink(core::LinkState::kPaused);
  path_->onLink(sim_.status());
  commanded_.reset();
  ask(FlightMode::kManual);
  sim_.run(5.0);
  ASSERT_EQ(state(), State::kDriving);
  EXPECT_FLOAT_EQ(sim_.value(kLeft), 6.0F);
  sim_.clearMessages();
  setLink(core::LinkState::kConnected);
  path_->onLink(sim_.status());
  sim_.frame();
  expectOnItsWay();
  sim_.run(0.3);
  expectNoJump();
  EXPECT_NEAR(written(kLeft).back(), 0.0, 0.5) << "where the stick wants it";
  EXPECT_EQ(state(), State::kIdle) << "given back";
}

TEST_F(SurfaceAuthorityTest, ALostLinkDoesNotKeepThem) {
  flySurface();
  setLink(core::LinkState::kPaused);
  commanded_.reset();
  ask(FlightMode::kManual);
  sim_.run(0.1);
  ASSERT_EQ(state(), State::kDriving);
  sim_.setState(core::LinkState::kStale);
  surfaces_.onLink(sim_.status());
  sim_.setState(core::LinkState::kConnected);  // a frame comes before the link is up
  sim_.run(0.1);
  EXPECT_EQ(state(), State::kIdle);
}

TEST_F(SurfaceAuthorityTest, ThePanicToolEndsItUntilAModeIsAskedFor) {
  flySurface();
  sim_.set(core::kSurfaceOverride, 0.0F);
  sim_.run(1.0);
  EXPECT_EQ(path_->standing(), Standing::kWaitingForMode);
  EXPECT_EQ(state(), State::kIdle) << "though commands keep coming";
  EXPECT_FLOAT_EQ(sim_.value(core::kSurfaceOverride), 0.0F);
  ask(FlightMode::kAuto);
  sim_.run(0.3);
  EXPECT_EQ(state(), State::kDriving);
}

/// As with tx_node's `surfaces_source: manual`.
class ManualSurfaceAuthorityTest : public SurfaceAuthorityTest {
 protected:
  ManualSurfaceAuthorityTest() : SurfaceAuthorityTest(FlightMode::kManual) {}
};

TEST_F(ManualSurfaceAuthorityTest, ARequestForAutoEndsItInTheSameFrame) {
  controller_ = 0.0;
  flySurface(FlightMode::kManual);
  ask(FlightMode::kAuto);
  EXPECT_EQ(mode_.reason, "request; control/surfaces ends");
  EXPECT_EQ(commandSurface(6.0F), "control/surfaces flies in MANUAL, and the mode is AUTO");
  sim_.frame();
  expectOnItsWay();
  sim_.run(0.3);
  expectNoJump();
  EXPECT_EQ(state(), State::kIdle) << "though commands keep coming";
  ask(FlightMode::kManual);
  sim_.run(0.3);
  EXPECT_EQ(state(), State::kDriving);
}

TEST_F(ManualSurfaceAuthorityTest, ASilentStickEndsItInTheSameFrameAndAMovedOneDoesNot) {
  flySurface(FlightMode::kManual);
  stick_ = -0.5;
  sim_.run(0.3);
  EXPECT_FLOAT_EQ(sim_.value(kLeft), 6.0F) << "there is nothing to take over";
  stick_.reset();
  runUntilFailsafe();
  EXPECT_EQ(mode_.reason, "timeout of control/manual; control/surfaces ends");
  expectOnItsWay();
  sim_.run(0.3);
  expectNoJump();
  EXPECT_EQ(state(), State::kIdle);
}

}  // namespace
}  // namespace xplane_bridge
