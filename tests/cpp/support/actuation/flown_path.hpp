#pragma once

#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "fake_simulator.hpp"
#include "xplane_bridge/actuation/control_path.hpp"

namespace xplane_bridge {

constexpr const char* kStickRoll = "sim/joystick/yoke_roll_ratio";
constexpr const char* kStickPitch = "sim/joystick/yoke_pitch_ratio";
constexpr const char* kStickYaw = "sim/joystick/yoke_heading_ratio";
constexpr const char* kStickOverride = "sim/operation/override/override_joystick_roll";
constexpr const char* kPitchOverride = "sim/operation/override/override_joystick_pitch";
constexpr const char* kYawOverride = "sim/operation/override/override_joystick_heading";
constexpr const char* kFlapHandle = "sim/cockpit2/controls/flap_ratio";

inline core::ControlCommand rollCommand(double roll, std::uint32_t sequence = 1) {
  core::ControlCommand command;
  command.sequence = sequence;
  command.fields = core::kFieldRoll;
  command.roll = roll;
  return command;
}

/// A ControlPath on a FakeSimulator, and what it says. Changes are immediate (no slew, no transition), so that a test
/// sees only what it is about.
struct FlownPath {
  core::FakeSimulator sim;
  std::shared_ptr<core::HandlerMutex> mutex = std::make_shared<core::HandlerMutex>();
  OverrideManager overrides{&sim, [this](const std::string& text, bool) { override_reports.push_back(text); }};
  ControlPathOptions options;
  std::unique_ptr<ControlPath> path;

  // What the path has said, oldest first.
  std::vector<core::ModeStatus> modes;
  std::vector<AppliedControls> applied;
  std::vector<std::string> events, warnings, excitation_ends, surface_releases, override_reports;
  std::array<double, 3> stick{};
  int surface_ends = 0;
  core::ChannelExcitation excitation;  // the test's: what is to be added
  bool shows_aircraft = true;

  FlownPath() {
    options.arbiter.transition_rate = std::numeric_limits<double>::infinity();
    options.aircraft = {"DA62"};
    options.aircraft_file = "config/aircraft/fixed_wing.yaml";
    sim.setAll(core::flightWatchDatarefs(), 0.0F);
    sim.set("sim/time/total_running_time_sec", 100.0F);
    for (const char* name :
         {kStickRoll, kStickPitch, kStickYaw, kStickOverride, kPitchOverride, kYawOverride, kFlapHandle}) {
      sim.set(name, 0.0F);
    }
  }

  /// X-Plane's side of the path starts, connected and with the right aircraft unless the test says otherwise.
  void start(core::LinkState state = core::LinkState::kConnected, const std::string& icao = "DA62") {
    ControlPathHooks hooks;
    hooks.mode = [this](const core::ModeStatus& status, double) { modes.push_back(status); };
    hooks.applied = [this](const AppliedControls& what) { applied.push_back(what); };
    hooks.stick = [this](const std::array<double, 3>& now) { stick = now; };
    hooks.excitation = [this] { return excitation; };
    hooks.end_excitation = [this](const std::string& why) {
      if (excitation.channels.none()) return;
      excitation = {};
      excitation_ends.push_back(why);
    };
    hooks.release_surfaces = [this](const std::string& why) { surface_releases.push_back(why); };
    hooks.end_surface_commands = [this] { ++surface_ends; };
    hooks.event = [this](ControlPathHooks::Kind, const std::string& text, const std::string& who) {
      events.push_back(who.empty() ? text : text + " (" + who + ")");
    };
    hooks.warn = [this](const std::string& text) { warnings.push_back(text); };
    path = std::make_unique<ControlPath>(&sim, &overrides, options, std::move(hooks), mutex);
    watching_ = sim.subscribe(
        {"flight watch", core::flightWatchDatarefs(), core::kEveryFrameRateHz, 2},
        [this](const core::RrefView& view, const core::ReceiveInfo&) {
          core::updateFlightWatch(view, &watch_);
          path->onFrame(watch_);
        },
        mutex);
    setState(state);
    if (!icao.empty()) path->onAircraft({icao, ""});
    frame();
    sim.clearMessages();
  }

  /// The link says so, as SimLink does.
  void setState(core::LinkState state) {
    sim.setState(state);
    path->onLink(sim.status());
  }
  /// A frame of X-Plane, then the node's timer. By then it has shown which aircraft it has, unless the test keeps that
  /// back.
  void frame(double dt = core::FakeSimulator::kFrame) {
    if (shows_aircraft) path->onSameAircraft();
    sim.frame(dt);
    path->tick();
  }
  void run(double seconds) {
    for (double end = sim.time() + seconds - 1e-6; sim.time() < end;) frame();
  }
  /// The same, with a stick that repeats its command every frame.
  void runWith(const core::ControlCommand& command, double seconds) {
    for (double end = sim.time() + seconds - 1e-6; sim.time() < end;) {
      path->command(core::FlightMode::kManual, command);
      frame();
    }
  }
  /// Values written to a dataref since the last clearMessages(), oldest first.
  std::vector<float> writesTo(const std::string& path_of) const {
    std::vector<float> out;
    for (const auto& [name, value] : sim.writes()) {
      if (name == path_of) out.push_back(value);
    }
    return out;
  }
  core::RequestOutcome ask(core::FlightMode mode) {
    return path->requestMode({0, static_cast<int>(mode), "test", 0.0});
  }

 private:
  core::FlightWatch watch_;
  core::Subscription watching_;
};

}  // namespace xplane_bridge
