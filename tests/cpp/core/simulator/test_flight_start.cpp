#include "xplane_bridge/core/simulator/flight_start.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace xplane_bridge::core {
namespace {

FlightStart start() {
  FlightStart out;
  out.latitude_deg = 47.5;
  out.longitude_deg = 8.0;
  out.altitude_msl = 1000.0;
  out.heading_true_deg = 90.0;
  out.true_airspeed = 70.0;
  return out;
}

/// What X-Plane shows of an aircraft above the scenery origin, where the local axes are the level's, without wind.
std::vector<DatarefValue> above(double height, double wind_speed = 0.0, double wind_from_deg = 0.0) {
  std::vector<DatarefValue> out(15, 0.0F);
  out[0] = 47.5F;
  out[1] = 8.0F;
  out[2] = 6378145.0F;
  out[4] = static_cast<float>(height);
  out[6] = 1.0F;
  out[13] = static_cast<float>(wind_speed);
  out[14] = static_cast<float>(wind_from_deg);
  return out;
}

double valueOf(const std::vector<DatarefWrite>& writes, const std::string& leaf) {
  for (const DatarefWrite& write : writes) {
    if (write.dataref == "sim/flightmodel/position/" + leaf) return static_cast<double>(write.value);
  }
  ADD_FAILURE() << leaf << " is not written";
  return std::nan("");
}

TEST(FlightStart, ImpossibleNumbersAreNamed) {
  EXPECT_FALSE(check(start()));
  EXPECT_EQ(check(FlightStart{}).value_or(""),
            "no place is given: expected latitude and longitude, of which one is not 0");
  FlightStart wrong = start();
  wrong.latitude_deg = 95.0;
  EXPECT_EQ(check(wrong).value_or(""), "latitude is 95: expected -89.9..89.9 [deg, north +]");
  wrong = start();
  wrong.true_airspeed = std::nan("");
  EXPECT_EQ(check(wrong).value_or("").substr(0, 20), "true_airspeed is nan");
  wrong = start();
  wrong.flight_path_angle_deg = -91.0;
  EXPECT_TRUE(check(wrong));
}

TEST(FlightStart, MessagesCarryThePlace) {
  FlightStart given = start();
  given.roll_deg = -20.0;
  given.pitch_deg = 5.0;
  const Placement prel = placementOf(given);
  EXPECT_EQ(prel.start, StartType::kLatLonElevation);
  EXPECT_EQ(prel.aircraft, 0);
  EXPECT_EQ(prel.latitude_deg, 47.5);
  EXPECT_EQ(prel.longitude_deg, 8.0);
  EXPECT_EQ(prel.elevation_m, 1000.0);
  EXPECT_EQ(prel.true_heading_deg, 90.0);
  EXPECT_EQ(prel.speed_mps, 70.0);
  const VehiclePose vehs = poseOf(given);
  EXPECT_EQ(vehs.latitude_deg, 47.5);
  EXPECT_EQ(vehs.elevation_m, 1000.0);
  EXPECT_EQ(vehs.true_heading_deg, 90.0F);
  EXPECT_EQ(vehs.pitch_deg, 5.0F);
  EXPECT_EQ(vehs.roll_deg, -20.0F);
}

TEST(FlightStart, MotionIsThatOfThePathThroughTheAir) {
  FlightStart given = start();
  given.flight_path_angle_deg = 30.0;
  // Wind of 10 m/s from the north: the air goes south, which is +z.
  const auto shown = shownFlightFrom(above(1000.0, 10.0, 0.0));
  ASSERT_TRUE(shown);
  const auto writes = motionWrites(given, *shown);
  EXPECT_NEAR(valueOf(writes, "local_vx"), 70.0 * std::cos(M_PI / 6.0), 1e-4);  // to the east
  EXPECT_NEAR(valueOf(writes, "local_vy"), 35.0, 1e-4);                         // up
  EXPECT_NEAR(valueOf(writes, "local_vz"), 10.0, 1e-4);
  for (const char* rate : {"Prad", "Qrad", "Rrad"}) EXPECT_EQ(valueOf(writes, rate), 0.0);
}

TEST(FlightStart, AttitudeIsAQuaternionOfTheOriginsAxes) {
  FlightStart given = start();
  given.heading_true_deg = 0.0;
  given.roll_deg = 60.0;
  const auto shown = shownFlightFrom(above(1000.0));
  ASSERT_TRUE(shown);
  const auto writes = motionWrites(given, *shown);
  const double sign = valueOf(writes, "q[0]") < 0.0 ? -1.0 : 1.0;
  EXPECT_NEAR(sign * valueOf(writes, "q[0]"), std::cos(M_PI / 6.0), 1e-6);
  EXPECT_NEAR(sign * valueOf(writes, "q[1]"), 0.5, 1e-6);
  EXPECT_NEAR(valueOf(writes, "q[2]"), 0.0, 1e-6);
  EXPECT_NEAR(valueOf(writes, "q[3]"), 0.0, 1e-6);
  // One degree of longitude east of the origin north is turned by sin(47.5 deg) of a degree: the meridians meet.
  given.longitude_deg = 9.0;
  given.roll_deg = 0.0;
  const double half = 0.5 * std::sin(47.5 * M_PI / 180.0) * M_PI / 180.0;
  EXPECT_NEAR(std::abs(valueOf(motionWrites(given, *shown), "q[3]")), std::sin(half), 1e-4);
}

TEST(FlightStart, WhatWasSentIsWhatIsShown) {
  FlightStart given = start();
  given.latitude_deg = 47.7;
  given.longitude_deg = 8.4;
  given.roll_deg = 40.0;
  given.pitch_deg = -15.0;
  given.heading_true_deg = 250.0;
  given.flight_path_angle_deg = -5.0;
  auto values = above(0.0, 8.0, 200.0);
  const auto there = shownFlightFrom(values);
  ASSERT_TRUE(there);
  const Eigen::Vector3d enu = there->scenery.position({47.7, 8.4, 1000.0});
  values[3] = static_cast<float>(enu.x());
  values[4] = static_cast<float>(enu.z());
  values[5] = static_cast<float>(-enu.y());
  const auto writes = motionWrites(given, *there);
  const char* const leaves[] = {"q[0]", "q[1]", "q[2]", "q[3]", "local_vx", "local_vy", "local_vz"};
  for (std::size_t i = 0; i < 7; ++i) values[6 + i] = static_cast<float>(valueOf(writes, leaves[i]));
  const auto shown = shownFlightFrom(values);
  ASSERT_TRUE(shown);
  EXPECT_TRUE(isNear(given, *shown));
  EXPECT_EQ(differenceOf(given, *shown), "");
  EXPECT_NEAR(shown->attitude.roll * 180.0 / M_PI, 40.0, 1e-3);
  EXPECT_NEAR(shown->place.latitude_deg, 47.7, 1e-6);

  FlightStart other = given;
  other.roll_deg = 45.0;
  EXPECT_EQ(differenceOf(other, *shown).substr(0, 18), "its attitude is 5 ");
  other = given;
  other.true_airspeed = 75.0;
  EXPECT_EQ(differenceOf(other, *shown), "its velocity is 5 m/s off");
  other = given;
  other.altitude_msl = 1020.0;
  EXPECT_EQ(differenceOf(other, *shown).substr(0, 15), "its altitude is");
  other = given;
  other.latitude_deg = 47.71;
  EXPECT_NE(differenceOf(other, *shown).find("m away"), std::string::npos);
  EXPECT_EQ(placeDifferenceOf(other, *shown), differenceOf(other, *shown));
  EXPECT_FALSE(isNear(other, *shown)) << "1113 m";
}

TEST(FlightStart, WithoutAllValuesNothingIsShown) {
  auto values = above(1000.0);
  values[8].reset();
  EXPECT_FALSE(shownFlightFrom(values));
  EXPECT_FALSE(shownFlightFrom({}));
  EXPECT_EQ(shownFlightDatarefs(kXPlane11).size(), 15u);
  EXPECT_EQ(shownFlightDatarefs(kXPlane12)[13], "sim/weather/aircraft/wind_now_speed_msc");
}

}  // namespace
}  // namespace xplane_bridge::core
