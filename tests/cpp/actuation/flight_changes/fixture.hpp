#pragma once

/// What tests of FlightChanges share.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fake_flight.hpp"
#include "xplane_bridge/actuation/flight_changes.hpp"
#include "xplane_bridge/actuation/release_worker.hpp"

namespace xplane_bridge {

using core::EventKind;
using core::FakeFlight;
using core::LinkState;
using Names = std::vector<std::string>;

constexpr const char* kToggle = "sim/operation/pause_toggle";
const std::string kPosition = "sim/flightmodel/position/";

/// At the origin of FakeFlight's scenery, level, towards the east, with 70 m/s.
inline core::FlightStart here() {
  core::FlightStart out;
  out.latitude_deg = FakeFlight::kLatitude;
  out.longitude_deg = FakeFlight::kLongitude;
  out.altitude_msl = FakeFlight::kHeight;
  out.heading_true_deg = 90.0;
  out.true_airspeed = 70.0;
  return out;
}

/// Expectations are worked out by hand from the axes of FakeFlight. A placement of which nothing is seen is sent again
/// after 3 s, a setting must be shown within 2 s, a place or a file within 20 s.
class FlightChangesTest : public testing::Test {
 protected:
  explicit FlightChangesTest(core::SimulatorVersion version = core::kXPlane11) : sim_(version) {
    sim_.on_frame = [this] {
      for (auto& [time, event] : events_) {
        if (event && sim_.time() >= time) std::exchange(event, nullptr)();
      }
      flight_.move();
    };
    sim_.run(0.1);
  }

  FlightChangeHooks hooks() {
    FlightChangeHooks out;
    out.watch = [this] { return flight_.watch(); };
    out.resets = [this] { return flight_.resets(); };
    out.placed = [this] { ++placed_; };
    out.identities = [this] { return flight_.identities; };
    out.aircraft = [this] { return flight_.aircraft; };
    out.suspend_control = [this](const std::string& reason) { suspensions_.push_back(reason); };
    out.pausing = [this](const std::string& who) { pausing_ = who; };
    out.pause_left = [this] { ++pauses_left_; };
    return out;
  }
  void after(double seconds, const std::function<void()>& event) { events_.emplace_back(sim_.time() + seconds, event); }

  /// From now on X-Plane follows a command to pause, or to go on, so many seconds late.
  void pauseLater(double seconds) {
    const auto obey = sim_.on_message;
    sim_.on_message = [this, obey, seconds](const core::FakeSimulator::Message& message) {
      if (message.label != "CMND") return obey(message);
      after(seconds, [obey, message] { obey(message); });
    };
  }

  void expect(const FlightChangeOutcome& outcome, EventKind kind, const std::string& text) {
    EXPECT_EQ(outcome.kind, kind);
    EXPECT_EQ(outcome.text, text);
    EXPECT_TRUE(outcome.success);
  }
  void expectFailure(const FlightChangeOutcome& outcome, EventKind kind, const std::string& text) {
    EXPECT_EQ(outcome.kind, kind);
    EXPECT_NE(outcome.text.find(text), std::string::npos) << outcome.text;
    EXPECT_FALSE(outcome.success);
  }
  void expectPlaced(const FlightChangeOutcome& outcome) {
    expect(outcome, EventKind::kReset, "the flight goes on at the place, attitude and speed asked for");
    EXPECT_EQ(at("local_x"), 0.0F);
    EXPECT_EQ(at("local_y"), 1000.0F);
    // 90 deg to the right about the axis down: a half turn's sine and cosine of 45 deg.
    EXPECT_NEAR(at("q[0]"), 0.70711, 1e-4);
    EXPECT_NEAR(at("q[3]"), 0.70711, 1e-4);
    EXPECT_NEAR(at("local_vx"), 70.0, 1e-3);
    EXPECT_NEAR(at("local_vz"), 0.0, 1e-3);
    EXPECT_EQ(at("Prad"), 0.0F);
  }
  /// A tenth of a second ago: a beginning now does not show in the flight's time.
  void justBegun() {
    sim_.set("sim/time/total_flight_time_sec", 0.1F);
    sim_.frame();
  }
  float at(const std::string& leaf) const { return sim_.value(kPosition + leaf); }
  FlightChangeOutcome place() { return changes_.place(here(), "node/reset_flight"); }

  core::FakeSimulator sim_;
  FakeFlight flight_{&sim_};
  std::vector<std::pair<double, std::function<void()>>> events_;  // [s] of the fake clock
  std::vector<std::string> suspensions_;
  std::string pausing_;
  int pauses_left_ = 0;
  int placed_ = 0;
  FlightChanges changes_{&sim_, {2.0, 20.0}, hooks()};
};

class FlightChangesTest12 : public FlightChangesTest {
 protected:
  FlightChangesTest12() : FlightChangesTest(core::kXPlane12) {}
};

class FlightChangesTestWithoutVehs : public FlightChangesTest {
 protected:
  FlightChangesTestWithoutVehs()
      : FlightChangesTest({core::kXPlane12.number, static_cast<std::uint32_t>(core::Otherwise::kVehs)}) {}
};

// ------------------------------------------------------------------------------------------------ placing, version 11

}  // namespace xplane_bridge
