#include "xplane_bridge/core/simulator/airport_start.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "xplane_bridge/core/base/units.hpp"

namespace xplane_bridge::core {
namespace {

// Two airports as apt.dat has them (rows shortened behind what is read): runway 09/27 of the first leads due east.
constexpr const char* kAirportData =
    "I\n1100 Version\n\n"
    "1 21 0 0 AAAA First Field\n"
    "100 30.00 1 0 0.00 0 0 0 01 10.0000 20.0000 0 0 1 0 0 0 19 10.0200 20.0000 0 0 1 0 0 0\n"
    "100 45.00 1 0 0.25 1 2 1 09 10.0100 20.0000 0 0 3 0 0 0 27 10.0100 20.0300 0 0 3 0 0 0\n"
    "1300 10.00500000 20.00500000 123.4 gate jets|heavy Gate 7\n"
    "15 10.00600000 20.00600000 270.00 South Apron\n"
    "1301 C airline abc\n"
    "\n"
    "17 5 0 0 HELI Pad\n"
    "102 H1 1.0 2.0 0.0 10 10 1 0 0 0.25 0\n"
    "1300 1.0 2.0 45.0 misc helos Only\n"
    "99\n";

AirportStart start(AirportSpot spot = AirportSpot::kRamp) {
  AirportStart out;
  out.spot = spot;
  out.airport = "AAAA";
  if (spot == AirportSpot::kFinal) {
    out.final_distance = 10000.0;
    out.true_airspeed = 60.0;
  }
  return out;
}

std::string find(AirportStart* start, const std::string& name) {
  std::istringstream in(kAirportData);
  start->name = name;
  return findSpot(in, start);
}

/// An aircraft that stands on the equator, with its nose to `heading_deg`.
ShownFlight standing(double latitude_deg, double longitude_deg, double heading_deg) {
  ShownFlight out;
  out.place = {latitude_deg, longitude_deg, 100.0};
  out.attitude.heading = heading_deg * kRadiansPerDegree;
  return out;
}

TEST(AirportStart, ImpossibleRequestsAreNamed) {
  EXPECT_FALSE(check(start()));
  EXPECT_FALSE(check(start(AirportSpot::kFinal)));
  const auto wrong = [](AirportSpot spot, auto change) {
    AirportStart out = start(spot);
    change(&out);
    return check(out).value_or("");
  };
  using Spot = AirportSpot;
  EXPECT_EQ(wrong(Spot::kRamp, [](auto* s) { s->airport = ""; }),
            "airport is \"\": expected an ICAO code of 1 to 7 capital letters and digits");
  EXPECT_NE(wrong(Spot::kRamp, [](auto* s) { s->airport = "rksi"; }), "");
  EXPECT_NE(wrong(Spot::kRamp, [](auto* s) { s->airport = "ABCDEFGH"; }), "");
  EXPECT_EQ(wrong(Spot::kRamp, [](auto* s) { s->index = -1; }), "spot_index is -1: expected 0 or more");
  EXPECT_EQ(wrong(Spot::kRunway, [](auto* s) { s->end = 2; }), "runway_end is 2: expected 0 or 1");
  EXPECT_EQ(wrong(Spot::kFinal, [](auto* s) { s->final_distance = 0.0; }),
            "final_distance is 0: expected 500..50000 [m]");
  EXPECT_EQ(wrong(Spot::kFinal, [](auto* s) { s->true_airspeed = 0.0; }), "true_airspeed is 0: expected 1..600 [m/s]");
  EXPECT_NE(wrong(Spot::kFinal, [](auto* s) { s->pitch_deg = std::nan(""); }), "");
  const std::string both = wrong(Spot::kRunway, [](auto* s) {
    s->name = "09";
    s->index = 1;
  });
  EXPECT_EQ(both, "spot and numbers are both given: expected a name, or spot_index and runway_end");
}

TEST(AirportStart, RunwaysAreFoundByName) {
  AirportStart runway = start(AirportSpot::kRunway);
  EXPECT_EQ(find(&runway, "27"), "");
  EXPECT_EQ(runway.index, 1);
  EXPECT_EQ(runway.end, 1);
  ASSERT_TRUE(runway.at);
  EXPECT_EQ(runway.at->latitude_deg, 10.01);
  EXPECT_EQ(runway.at->longitude_deg, 20.03);
  EXPECT_NEAR(runway.at->heading_true_deg, 270.0, 1e-6);
  EXPECT_EQ(find(&runway, "01"), "");
  EXPECT_EQ(runway.index, 0);
  EXPECT_EQ(runway.end, 0);
  EXPECT_NEAR(runway.at->heading_true_deg, 0.0, 1e-6);
}

TEST(AirportStart, RampsAreFoundByName) {
  AirportStart ramp = start();
  EXPECT_EQ(find(&ramp, "Gate 7"), "");
  EXPECT_EQ(ramp.index, 0);
  EXPECT_EQ(ramp.at->heading_true_deg, 123.4);
  EXPECT_EQ(find(&ramp, "South Apron"), "");
  EXPECT_EQ(ramp.index, 1);
  EXPECT_EQ(ramp.at->longitude_deg, 20.006);
}

TEST(AirportStart, WhatAnAirportDoesNotHaveIsReportedWithWhatItHas) {
  AirportStart runway = start(AirportSpot::kRunway);
  EXPECT_EQ(find(&runway, "33L"), "AAAA has no runway \"33L\", but 01, 19, 09, 27");
  AirportStart ramp = start();
  EXPECT_EQ(find(&ramp, "Only"), "AAAA has no ramp \"Only\", but Gate 7, South Apron");
  ramp.airport = "BBBB";
  EXPECT_EQ(find(&ramp, "Only"), "there is no airport BBBB");
  runway.airport = "HELI";
  EXPECT_EQ(find(&runway, "09"), "HELI has no runway \"09\", but none");
}

TEST(AirportStart, MessagesCarryTheSpot) {
  AirportStart given = start(AirportSpot::kFinal);
  given.index = 2;
  given.end = 1;
  const Placement final = placementOf(given);
  EXPECT_EQ(final.start, StartType::kRunway) << "an approach begins with the runway, which shows where it is";
  EXPECT_EQ(final.airport, "AAAA");
  EXPECT_EQ(final.runway, 2);
  EXPECT_EQ(final.runway_direction, 1);
  EXPECT_EQ(placementOf(start(AirportSpot::kRamp)).start, StartType::kRamp);
}

TEST(AirportStart, AnAircraftIsThereWhenItStandsAtTheSpot) {
  AirportStart given = start(AirportSpot::kRunway);
  ShownFlight shown = standing(0.0, 20.0, 5.0);
  EXPECT_TRUE(isThere(given, shown)) << "where its airport is X-Plane alone knows";
  given.at = AirportPlace{0.0, 20.0, 355.0};
  EXPECT_TRUE(isThere(given, shown)) << "10 deg between both headings, across north";
  given.at->heading_true_deg = 175.0;
  EXPECT_FALSE(isThere(given, shown)) << "the other end";
  given.at = AirportPlace{0.01, 20.0, 5.0};
  EXPECT_FALSE(isThere(given, shown)) << "1.1 km away";
  given.at.reset();
  shown.velocity_ned.x() = 20.0;
  EXPECT_FALSE(isThere(given, shown)) << "it does not stand";
}

TEST(AirportStart, FinalIsOnTheGlidePathBeforeTheRunway) {
  AirportStart given = start(AirportSpot::kFinal);
  given.pitch_deg = 2.0;
  const FlightStart out = finalStart(given, standing(0.0, 20.0, 90.0));
  // 10 km are 0.0898315 deg of a sphere of 6378145 m; tan 3 deg is 0.0524078.
  EXPECT_NEAR(out.longitude_deg, 20.0 - 0.0898315, 1e-6);
  EXPECT_NEAR(out.latitude_deg, 0.0, 1e-6);
  EXPECT_NEAR(out.altitude_msl, 100.0 + 15.0 + 524.078, 0.01);
  EXPECT_NEAR(out.heading_true_deg, 90.0, 1e-9);
  EXPECT_EQ(out.flight_path_angle_deg, -3.0);
  EXPECT_EQ(out.pitch_deg, 2.0);
  EXPECT_EQ(out.true_airspeed, 60.0);
  EXPECT_FALSE(check(out));
  const FlightStart north = finalStart(given, standing(0.0, 20.0, -0.001));
  EXPECT_NEAR(north.heading_true_deg, 359.999, 1e-6);
  EXPECT_LT(north.latitude_deg, -0.08);
}

}  // namespace
}  // namespace xplane_bridge::core
