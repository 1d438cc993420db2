#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "fake_simulator.hpp"
#include "xplane_bridge/core/simulator/flight_settings.hpp"
#include "xplane_bridge/core/simulator/flight_start.hpp"
#include "xplane_bridge/core/state/flight_watch.hpp"
#include "xplane_bridge/core/state/reset_detector.hpp"

namespace xplane_bridge::core {

/// The flight of a FakeSimulator: where the aircraft is, what PREL, VEHS, ACFN and SIMO do to it, weather, pausing.
///
/// The scenery's origin is at kLatitude, kLongitude, and the aircraft is above it or east of it, so that the local axes
/// are east, up and south of the place, and the quaternion is the attitude. X-Plane is as quick as a frame unless set
/// otherwise, reads nothing while it loads, and then reads all that was sent meanwhile, in order.
class FakeFlight {
 public:
  static constexpr double kLatitude = 47.5;               // [deg] a float32 holds it
  static constexpr double kLongitude = 8.0;               // [deg]
  static constexpr double kHeight = 1000.0;               // [m]
  static constexpr double kMetersPerLongitude = 75200.0;  // [m] a degree at that latitude, about
  static constexpr double kAirportEast = 3000.0;          // [m] the runway leads on to the east, the ramp faces north
  static constexpr double kAirportHeight = 50.0;          // [m] of an aircraft that stands there
  static constexpr const char* kAircraftPath = "Aircraft/Here/here.acf";

  explicit FakeFlight(FakeSimulator* sim) : sim_(sim) {
    const SimulatorVersion version = sim->status().version;
    for (const std::string& dataref : shownFlightDatarefs(version)) sim->set(dataref, 0.0F);
    sim->set(at("lat_ref"), static_cast<float>(kLatitude));
    sim->set(at("lon_ref"), static_cast<float>(kLongitude));
    sim->set("sim/physics/earth_radius_m", 6378145.0F);
    sim->setAll({at("Prad"), at("Qrad"), at("Rrad")}, 0.1F);
    sim->set(at("q[0]"), 1.0F);
    sim->set(kFlightTime, 60.0F);
    put(20000.0, 500.0);  // 20 km east
    setAircraft(kAircraftPath);
    sim->on_message = [this](const FakeSimulator::Message& message) { take(message); };
  }

  // What the test sets.

  double load_time = 0.0;     // [s] that X-Plane is silent for when it begins a flight or loads an aircraft
  bool ignores_vehs = false;  // the build, the pause or a replay does
  bool ignores_prel = false;
  int lose_prel = 0;             // the next ones get lost on the way
  std::string airport = "FAKE";  // the one X-Plane knows; its one ramp and its runway are kAirportEast of the origin
  bool resumes = false;          // beginning a flight ends a pause
  bool pauses = false;           // beginning a flight pauses
  bool ignores_pause = false;
  bool has_files = true;       // aircraft and situations that are asked for are there
  bool shows_aircraft = true;  // and which it is, afterwards

  // What the test looks at.

  std::vector<std::string> messages;  // labels of PREL, VEHS, ACFN, SIMO, and pause commands, as X-Plane read them
  unsigned identities = 1;            // how often X-Plane has shown its aircraft
  unsigned beginnings = 0;            // flights that were begun
  std::string aircraft = "HERE";      // as X-Plane shows it
  bool crashed = false;

  FlightWatch watch() const {
    FlightWatch out;
    out.flight_time = static_cast<double>(sim_->value(kFlightTime));
    out.sim_time = sim_->time();
    out.latitude_deg = kLatitude;
    out.longitude_deg = kLongitude + static_cast<double>(sim_->value(at("local_x"))) / kMetersPerLongitude;
    out.elevation = static_cast<double>(sim_->value(at("local_y")));
    out.crashed = crashed;
    return out;
  }
  /// How often the flight was seen to begin anew or to be placed elsewhere.
  unsigned resets() const { return resets_; }
  bool paused() const { return paused_; }
  /// The pilot, or another program.
  void setPaused(bool paused) {
    paused_ = paused;
    if (!silent()) sim_->setState(paused ? LinkState::kPaused : LinkState::kConnected);
  }
  /// Puts the aircraft there: [m] east of the origin, [m] above sea level.
  void put(double east, double height) {
    sim_->set(at("local_x"), static_cast<float>(east));
    sim_->set(at("local_y"), static_cast<float>(height));
  }
  /// What was sent in total.
  std::size_t sent(const std::string& label) const {
    std::size_t count = 0;
    for (const auto& message : sim_->messages()) count += message.label == label ? 1U : 0U;
    return count;
  }

  /// For FakeSimulator::on_frame.
  void move() {
    if (silent()) return;
    if (sim_->status().state == LinkState::kStale) {  // the loading has ended
      sim_->setState(paused_ ? LinkState::kPaused : LinkState::kConnected);
      for (const auto& message : std::exchange(queue_, {})) act(message);
      if (silent()) return;
    }
    if (shows_aircraft && ++frames_ % 50 == 0) ++identities;
    if (detector_.add(watch())) ++resets_;
    if (!paused_) {
      sim_->set(kFlightTime, sim_->value(kFlightTime) + static_cast<float>(FakeSimulator::kFrame));
    }
  }

 private:
  static constexpr std::int32_t kAtPlace = 6, kOnRunway = 11;  // PREL's start types
  static constexpr double kOneLatitude = 1e-4;                 // [deg] by which a straight way east leads off it
  static constexpr const char* kFlightTime = "sim/time/total_flight_time_sec";

  static std::string at(const std::string& leaf) { return "sim/flightmodel/position/" + leaf; }
  bool silent() const { return sim_->time() < silent_until_; }

  template <class Value>
  static Value read(const std::vector<std::uint8_t>& body, std::size_t offset) {
    Value out;
    std::memcpy(&out, body.data() + offset, sizeof out);
    return out;
  }

  void take(const FakeSimulator::Message& message) {
    if (message.label == "DREF") return;
    if (message.label == "PREL" && lose_prel > 0) {
      --lose_prel;
      return;
    }
    if (silent()) {
      queue_.push_back(message);
    } else {
      act(message);
    }
  }

  void act(const FakeSimulator::Message& message) {
    const std::vector<std::uint8_t>& body = message.body;
    messages.push_back(message.label == "CMND" ? message.path : message.label);
    if (message.label == "CMND" && !ignores_pause) {
      const bool knows_both = sim_->status().version.number >= 121000;
      if (message.path == "sim/operation/pause_toggle") setPaused(!paused_);
      if (message.path == "sim/operation/pause_on" && knows_both) setPaused(true);
      if (message.path == "sim/operation/pause_off" && knows_both) setPaused(false);
    }
    // Start type and aircraft; airport; runway and its direction; then latitude, longitude, elevation.
    if (message.label == "PREL" && !ignores_prel && read<std::int32_t>(body, 0) != kAtPlace) {
      standAtAirport(body);
    } else if (message.label == "PREL" && !ignores_prel) {
      place(read<double>(body, 24), read<double>(body, 32), read<double>(body, 40));
      begin();
    }
    // Aircraft; then latitude, longitude, elevation.
    if (message.label == "VEHS" && !ignores_vehs) {
      place(read<double>(body, 4), read<double>(body, 12), read<double>(body, 20));
    }
    if (message.label == "ACFN" && has_files) {
      setAircraft(std::string(reinterpret_cast<const char*>(body.data()) + 4));
      begin();
    }
    // Action 1 loads a situation.
    if (message.label == "SIMO" && has_files && read<std::int32_t>(body, 0) == 1) begin();
  }

  void place(double latitude, double longitude, double height) {
    put((longitude - kLongitude) * kMetersPerLongitude, height);
    if (std::abs(latitude - kLatitude) > kOneLatitude) throw std::logic_error("FakeFlight has one latitude");
  }

  void standAtAirport(const std::vector<std::uint8_t>& body) {
    const std::string asked(reinterpret_cast<const char*>(body.data()) + 8);
    const bool on_runway = read<std::int32_t>(body, 0) == kOnRunway;
    if (asked != airport || read<std::int32_t>(body, 16) != 0) return;
    put(kAirportEast, kAirportHeight);
    // A quarter turn to the right about the axis down on the runway, none on the ramp.
    sim_->set(at("q[0]"), on_runway ? std::sqrt(0.5F) : 1.0F);
    sim_->set(at("q[3]"), on_runway ? std::sqrt(0.5F) : 0.0F);
    for (const char* axis : {"x", "y", "z"}) sim_->set(at(std::string("local_v") + axis), 0.0F);
    begin();
  }

  void begin() {
    ++beginnings;
    sim_->set(kFlightTime, 0.0F);
    crashed = false;
    silent_until_ = sim_->time() + load_time;
    if (load_time > 0.0) sim_->setState(LinkState::kStale);
    if (resumes) setPaused(false);
    if (pauses) setPaused(true);
  }

  void setAircraft(const std::string& path) {
    for (std::size_t i = 0; i < 64; ++i) {
      const float character = i < path.size() ? static_cast<float>(path[i]) : 0.0F;
      // Version 11 does not show it.
      if (sim_->status().version.is12()) {
        sim_->set("sim/aircraft/view/acf_relative_path[" + std::to_string(i) + "]", character);
      }
    }
  }

  FakeSimulator* sim_;
  bool paused_ = false;
  ResetDetector detector_;
  unsigned resets_ = 0;
  int frames_ = 0;
  double silent_until_ = 0.0;  // [s]
  std::vector<FakeSimulator::Message> queue_;
};

}  // namespace xplane_bridge::core
