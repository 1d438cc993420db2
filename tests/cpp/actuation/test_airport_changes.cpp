#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "fake_flight.hpp"
#include "xplane_bridge/actuation/flight_changes.hpp"

namespace xplane_bridge {
namespace {

using core::AirportSpot;
using core::EventKind;
using core::FakeFlight;
using core::LinkState;
using Names = std::vector<std::string>;

constexpr const char* kToggle = "sim/operation/pause_toggle";
const std::string kPosition = "sim/flightmodel/position/";

/// Expectations are worked out by hand from the airport of FakeFlight, 3 km east of the scenery's origin.
class AirportChangesTest : public testing::Test {
 protected:
  explicit AirportChangesTest(core::SimulatorVersion version = core::kXPlane11) : sim_(version) {
    sim_.on_frame = [this] { flight_.move(); };
    sim_.run(0.1);
  }
  ~AirportChangesTest() override { std::remove(file_.c_str()); }

  FlightChangeHooks hooks() {
    FlightChangeHooks out;
    out.watch = [this] { return flight_.watch(); };
    out.resets = [this] { return flight_.resets(); };
    out.placed = [] {};
    out.identities = [this] { return flight_.identities; };
    out.aircraft = [this] { return flight_.aircraft; };
    out.suspend_control = [](const std::string&) {};
    out.pausing = [](const std::string&) {};
    return out;
  }
  static core::AirportStart at(AirportSpot spot) {
    core::AirportStart out;
    out.spot = spot;
    out.airport = "FAKE";
    out.final_distance = 5000.0;
    out.true_airspeed = 60.0;
    return out;
  }
  FlightChangeOutcome place(const core::AirportStart& start) { return changes_.placeAt(start, "node/reset_flight"); }
  float value(const std::string& leaf) const { return sim_.value(kPosition + leaf); }

  static void expect(const FlightChangeOutcome& outcome, const std::string& text) {
    EXPECT_EQ(outcome.kind, EventKind::kReset);
    EXPECT_EQ(outcome.text, text);
    EXPECT_TRUE(outcome.success);
  }
  static void expectFailure(const FlightChangeOutcome& outcome, const std::string& text) {
    EXPECT_EQ(outcome.kind, EventKind::kReset);
    EXPECT_NE(outcome.text.find(text), std::string::npos) << outcome.text;
    EXPECT_FALSE(outcome.success);
  }

  core::FakeSimulator sim_;
  FakeFlight flight_{&sim_};
  const std::string file_ = testing::TempDir() + "test_airport_changes_apt.dat";
  FlightChanges changes_{&sim_, {2.0, 20.0, file_}, hooks()};
};

class AirportChangesTest12 : public AirportChangesTest {
 protected:
  AirportChangesTest12() : AirportChangesTest(core::kXPlane12) {}
};

TEST_F(AirportChangesTest, BeginsAFlightOnTheRampWhileItIsPaused) {
  expect(place(at(AirportSpot::kRamp)), "the flight begins at ramp 0 of FAKE");
  EXPECT_EQ(flight_.messages, (Names{kToggle, "PREL", kToggle}));
  EXPECT_EQ(value("local_x"), 3000.0F);
  EXPECT_EQ(value("q[0]"), 1.0F);
  EXPECT_FALSE(flight_.paused()) << "as it was";
  EXPECT_TRUE(sim_.journal()->entries().empty());
}

TEST_F(AirportChangesTest, ItsPauseIsInTheJournalWhileItLasts) {
  std::size_t while_paused = 0;
  sim_.on_frame = [this, &while_paused] {
    flight_.move();
    if (flight_.paused() && !sim_.journal()->entries().empty()) ++while_paused;
  };
  EXPECT_TRUE(place(at(AirportSpot::kRunway)).success);
  EXPECT_GT(while_paused, 0U);
  EXPECT_TRUE(sim_.journal()->entries().empty());
}

TEST_F(AirportChangesTest, PausedFlightStaysPaused) {
  flight_.setPaused(true);
  flight_.resumes = true;
  sim_.run(0.1);
  expect(place(at(AirportSpot::kRunway)), "the flight begins at runway 0, end 0 of FAKE");
  EXPECT_TRUE(flight_.paused());
}

TEST_F(AirportChangesTest, LoadingIsWaitedFor) {
  flight_.load_time = 8.0;
  expect(place(at(AirportSpot::kRamp)), "the flight begins at ramp 0 of FAKE");
  EXPECT_EQ(flight_.beginnings, 1U);
}

TEST_F(AirportChangesTest, LostDatagramIsSentOnceMore) {
  flight_.lose_prel = 1;
  EXPECT_TRUE(place(at(AirportSpot::kRamp)).success);
  EXPECT_EQ(flight_.sent("PREL"), 2U);
}

TEST_F(AirportChangesTest, AirportThatXPlaneDoesNotHaveIsReported) {
  flight_.put(3000.0, 50.0);  // it stands where it would be put
  core::AirportStart elsewhere = at(AirportSpot::kRamp);
  elsewhere.airport = "NONE";
  const double begin = sim_.time();
  expectFailure(place(elsewhere), "reset_flight: X-Plane begins no flight at ramp 0 of NONE");
  EXPECT_NEAR(sim_.time() - begin, 6.1, 0.5) << "twice asked for, twice nothing";
  EXPECT_EQ(flight_.sent("PREL"), 2U);
  EXPECT_FALSE(flight_.paused());
  elsewhere = at(AirportSpot::kRunway);
  elsewhere.index = 1;
  expectFailure(place(elsewhere), "X-Plane begins no flight at runway 1, end 0 of FAKE");
}

TEST_F(AirportChangesTest, FlightThatHasOnlyJustBegunIsNotBegunAnew) {
  flight_.setPaused(true);
  sim_.set("sim/time/total_flight_time_sec", 0.1F);
  sim_.run(0.1);
  expectFailure(place(at(AirportSpot::kRamp)), "the flight has only just begun");
  EXPECT_EQ(flight_.sent("PREL"), 0U);
}

TEST_F(AirportChangesTest, FinalIsFlownFromWhereTheRunwayIs) {
  expect(place(at(AirportSpot::kFinal)), "the flight goes on 5000 m before runway 0, end 0 of FAKE");
  EXPECT_EQ(flight_.beginnings, 2U) << "on the runway, then before it";
  EXPECT_NEAR(value("local_x"), 3000.0 - 5000.0, 5.0);
  // 50 m, 15 m and 5 km of 3 deg, 262.04 m; the airport, 3 km from the origin, is 0.71 m below the plane of its axes.
  EXPECT_NEAR(value("local_y"), 327.75, 0.05);
  // To the east through calm air, down 60 m/s * sin 3 deg.
  EXPECT_NEAR(value("local_vx"), 59.918, 0.01);
  EXPECT_NEAR(value("local_vy"), -3.140, 0.05);
}

TEST_F(AirportChangesTest12, FinalMovesTheAircraftFromTheRunway) {
  expect(place(at(AirportSpot::kFinal)), "the flight goes on 5000 m before runway 0, end 0 of FAKE");
  EXPECT_EQ(flight_.beginnings, 1U);
  EXPECT_NEAR(value("local_y"), 327.75, 0.05);
}

TEST_F(AirportChangesTest, NamesComeFromTheFile) {
  core::AirportStart named = at(AirportSpot::kRamp);
  named.name = "Apron";
  FlightChanges without(&sim_, {2.0, 20.0, ""}, hooks());
  expectFailure(without.placeAt(named, "node/reset_flight"),
                "\"Apron\" is a name: set tx_node's parameter airport_data to X-Plane's apt.dat");
  expectFailure(place(named), "cannot be read: expected X-Plane's apt.dat");
  // The ramp where FakeFlight's is, and one that X-Plane has elsewhere.
  std::ofstream(file_) << "1 0 0 0 FAKE Field\n1300 47.5 8.0399 0.0 misc all Apron\n"
                       << "1 0 0 0 NEXT Field\n1300 47.6 8.0399 0.0 misc all Apron\n99\n";
  expect(place(named), "the flight begins at ramp Apron of FAKE");
  sim_.run(1.0);
  named.name = "Gate";
  expectFailure(place(named), "FAKE has no ramp \"Gate\", but Apron (in " + file_ + ")");
  named.name = "Apron";
  named.airport = flight_.airport = "NEXT";
  expectFailure(place(named), "X-Plane has begun a flight, but the aircraft does not stand at ramp Apron of NEXT");
}

}  // namespace
}  // namespace xplane_bridge
