#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "actuation/quiet_hooks.hpp"
#include "fake_simulator.hpp"
#include "xplane_bridge/actuation/actuation.hpp"

namespace xplane_bridge {

/// An Actuation on a FakeSimulator that shows a DA62, wired as in tx_node, without its threads.
class ActuationRig {
 protected:
  static constexpr const char* kRoll = "sim/joystick/yoke_roll_ratio";
  static constexpr const char* kFlightTime = "sim/time/total_flight_time_sec";

  ActuationRig() {
    sim_.setAll(core::flightWatchDatarefs(), 0.0F);
    sim_.set("sim/time/total_running_time_sec", 100.0F);
    sim_.set(kFlightTime, 10.0F);
    sim_.set("sim/flightmodel/position/latitude", 37.46F);
    sim_.setAll(core::requiredOverrides(rollOnly(), {}), 0.0F);
    sim_.set(kRoll, 0.0F);
    showAircraft("DA62");
    sim_.on_frame = [this] { sim_.set(kFlightTime, sim_.value(kFlightTime) + 0.02F); };
    ActuationHooks hooks = quietHooks();
    hooks.mode = [this](const core::ModeStatus& status, double) { modes_.push_back(status); };
    hooks.applied = [this](const AppliedControls& applied, const auto&) { applied_.push_back(applied); };
    hooks.failures = [this](const FailureSnapshot& snapshot) { broken_.push_back(snapshot); };
    hooks.excitation = [this](const ExcitationLabel& label) { labels_.push_back(label); };
    hooks.event = [this](const ActuationEvent& event) { events_.push_back(event); };
    ActuationOptions options;
    options.control.aircraft = {"DA62"};
    actuation_ = std::make_unique<Actuation>(&sim_, options, std::move(hooks));
    actuation_->onLink(sim_.status());
    run(0.2);
  }

  static core::ChannelSet rollOnly() {
    core::ChannelSet out;
    out.set(core::index(core::Channel::kRoll));
    return out;
  }
  /// As X-Plane shows texts: a number for each letter, 0 at the end.
  void showAircraft(const std::string& icao) {
    sim_.setAll(core::AircraftIdentityReader::datarefs(), 0.0F);
    for (const auto& [name, text] : {std::pair<std::string, std::string>{"acf_ICAO", icao}, {"acf_descrip", "Twin"}}) {
      for (std::size_t i = 0; i < text.size(); ++i) {
        sim_.set("sim/aircraft/view/" + name + "[" + std::to_string(i) + "]", static_cast<float>(text[i]));
      }
    }
  }
  void setPaused(bool paused) {
    sim_.setState(paused ? core::LinkState::kPaused : core::LinkState::kConnected);
    actuation_->onLink(sim_.status());
  }
  void run(double seconds) {
    for (double end = sim_.time() + seconds - 1e-6; sim_.time() < end;) {
      sim_.frame();
      actuation_->tick();
    }
  }
  void fly(double seconds) {
    core::ControlCommand command;
    command.fields = core::kFieldRoll;
    command.roll = 0.25;
    for (double end = sim_.time() + seconds - 1e-6; sim_.time() < end;) {
      actuation_->path().command(core::FlightMode::kManual, command);
      run(0.02);
    }
  }
  /// Events of a kind, oldest first.
  std::vector<ActuationEvent> eventsOf(core::EventKind kind) const {
    std::vector<ActuationEvent> out;
    std::copy_if(events_.begin(), events_.end(), std::back_inserter(out),
                 [kind](const ActuationEvent& event) { return event.kind == kind; });
    return out;
  }

  core::FakeSimulator sim_;
  std::vector<core::ModeStatus> modes_;
  std::vector<AppliedControls> applied_;
  std::vector<ActuationEvent> events_;
  std::vector<FailureSnapshot> broken_;
  std::vector<ExcitationLabel> labels_;
  std::unique_ptr<Actuation> actuation_;
};

}  // namespace xplane_bridge
