#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "fake_simulator.hpp"
#include "xplane_bridge/core/control/control_channels.hpp"
#include "xplane_bridge/core/surfaces/surface_mixing.hpp"
#include "xplane_bridge/core/surfaces/surface_watch.hpp"

namespace xplane_bridge::core {

/// The control surfaces of a FakeSimulator's aircraft, moved by X-Plane's own stick, and its mixing as it would be
/// identified: ailerons 20 deg a unit of roll (the left one down, trailing edge down +), elevators -16 deg a unit of
/// pitch, rudder 24 deg a unit of yaw. Under kSurfaceOverride they stay where they are written.
class FakeAirframe {
 public:
  static constexpr const char* kLeft = "aileron1_wing2_left";
  static constexpr const char* kRight = "aileron1_wing2_right";
  static constexpr const char* kElevator = "elevator1_left";
  static constexpr const char* kRudder = "rudder1_fin1";

  explicit FakeAirframe(FakeSimulator* sim) : sim_(sim) {
    for (const std::string& dataref : surfaceWatchDatarefs(sim->status().version)) {
      if (dataref.rfind("sim/time/", 0) != 0) sim->set(dataref, dataref == kFrameRate ? sim->value(dataref) : 0.0F);
    }
  }

  /// The mixing, for aircraft `name`: all that moves the surfaces is known.
  static MixingModel mixing(const std::string& name) {
    MixingModel out;
    out.aircraft = name;
    out.samples = 1000;
    out.known.fill(true);
    const auto add = [&out](const char* surface, MixingTerm plus, double slope) {
      SurfaceLaw law;
      law.surface = surfaceNumber(surface).value();
      law.slopes[static_cast<Eigen::Index>(plus)] = slope;
      law.slopes[static_cast<Eigen::Index>(plus) + 1] = slope;  // the other half of the axis
      law.low_deg = -std::abs(slope);
      law.high_deg = std::abs(slope);
      out.laws.push_back(law);
    };
    add(kLeft, MixingTerm::kRollPlus, 20.0);
    add(kRight, MixingTerm::kRollPlus, -20.0);
    add(kElevator, MixingTerm::kPitchPlus, -16.0);
    add(kRudder, MixingTerm::kYawPlus, 24.0);
    return out;
  }

  static std::string dataref(const std::string& surface) {
    return surfaceTable()[surfaceNumber(surface).value()].dataref;
  }
  float shown(const std::string& surface) const { return sim_->value(dataref(surface)); }

  /// The pilot's stick, and with it the totals that X-Plane moves the surfaces by.
  void setStick(double roll, double pitch = 0.0, double yaw = 0.0) {
    const std::array<double, 3> axes{roll, pitch, yaw};
    const std::array<Channel, 3> channels{Channel::kRoll, Channel::kPitch, Channel::kYaw};
    for (std::size_t i = 0; i < axes.size(); ++i) {
      const auto value = static_cast<float>(axes[i]);
      sim_->set(readBackDataref(channels[i], {sim_->status().version, false}), value);
      sim_->set(mixingInputDatarefs()[i], value);
    }
    roll_ = roll;
    pitch_ = pitch;
    yaw_ = yaw;
  }
  /// X-Plane does not move this surface by itself: it stays where it was written, or stands.
  void setStanding(const std::string& surface) { standing_.insert(surface); }
  /// X-Plane's own failure holds this surface there, whatever is written.
  void hold(const std::string& surface, double deflection_deg) { held_[surface] = deflection_deg; }
  void letGo(const std::string& surface) { held_.erase(surface); }

  /// For FakeSimulator::on_frame.
  void move() {
    if (sim_->value(kSurfaceOverride) == 0.0F) {
      const std::map<std::string, double> angles{
          {kLeft, 20.0 * roll_}, {kRight, -20.0 * roll_}, {kElevator, -16.0 * pitch_}, {kRudder, 24.0 * yaw_}};
      for (const auto& [surface, angle] : angles) {
        if (standing_.count(surface) == 0) sim_->set(dataref(surface), static_cast<float>(angle));
      }
    }
    for (const auto& [surface, angle] : held_) sim_->set(dataref(surface), static_cast<float>(angle));
  }

 private:
  static constexpr const char* kFrameRate = "sim/operation/misc/frame_rate_period";

  FakeSimulator* sim_;
  double roll_ = 0.0, pitch_ = 0.0, yaw_ = 0.0;
  std::set<std::string> standing_;
  std::map<std::string, double> held_;  // [deg] by surface
};

}  // namespace xplane_bridge::core
