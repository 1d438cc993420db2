#include "xplane_bridge/core/state/reset_detector.hpp"

#include <gtest/gtest.h>

namespace xplane_bridge::core {
namespace {

FlightWatch flying(double time) {
  FlightWatch out;
  out.sim_time = 100.0 + time;
  out.flight_time = time;
  out.latitude_deg = 47.0 + time * 6.3e-4;  // 70 m/s to the north: 1 deg is 111 318 m on X-Plane's sphere
  out.longitude_deg = 8.0;
  out.elevation = 1000.0;
  out.ground_speed = 70.0;
  return out;
}

TEST(ResetDetector, LetsAFlightGoOn) {
  ResetDetector detector;
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(detector.add(flying(0.02 * i)));
  EXPECT_FALSE(detector.add(flying(30.0))) << "a gap of 28 s is flown through";
  FlightWatch late = flying(29.9);
  EXPECT_FALSE(detector.add(late)) << "datagrams overtake each other";
}

TEST(ResetDetector, ReportsAFlightThatBeginsAnewWhereItIs) {
  ResetDetector detector;
  detector.add(flying(10.0));
  FlightWatch again = flying(10.02);
  again.flight_time = 0.0;
  const auto reported = detector.add(again);
  ASSERT_TRUE(reported);
  EXPECT_EQ(*reported, "the flight began anew");
  again.flight_time = 0.02;
  EXPECT_FALSE(detector.add(again)) << "once";
}

TEST(ResetDetector, ReportsAPlaceThatCannotHaveBeenFlownTo) {
  ResetDetector detector;
  detector.add(flying(10.0));
  FlightWatch away = flying(10.02);
  away.latitude_deg += 0.01;  // 1113 m, and 1.4 m flown
  const auto reported = detector.add(away);
  ASSERT_TRUE(reported);
  EXPECT_EQ(*reported, "the aircraft was placed 1115 m away");

  detector.add(flying(10.0));
  FlightWatch up = flying(10.02);
  up.elevation = 1101.0;
  EXPECT_FALSE(detector.add(flying(10.01)));
  EXPECT_FALSE(detector.add(up)) << "100 m, and twice what it flies in 0.01 s";
  up.elevation = 1210.0;
  EXPECT_TRUE(detector.add(up));
}

TEST(ResetDetector, AfterASilenceOnlyTheTimeOfTheFlightShowsAReset) {
  ResetDetector detector;
  FlightWatch standing = flying(10.0);
  standing.ground_speed = 0.0;
  detector.add(standing);
  detector.forgetPlace();
  EXPECT_FALSE(detector.add(flying(70.0))) << "it may have taken off";
  detector.forgetPlace();
  EXPECT_TRUE(detector.add(flying(0.3)));
}

TEST(ResetDetector, ReportsAPlacementWhilePaused) {
  ResetDetector detector;
  detector.add(flying(10.0));
  FlightWatch away = flying(10.0);
  away.latitude_deg += 0.001;  // 111 m
  EXPECT_TRUE(detector.add(away));
}

TEST(ResetDetector, SaysNothingOfTheFirstFlightNorOfAnotherXPlane) {
  ResetDetector detector;
  FlightWatch nothing;
  EXPECT_FALSE(detector.add(nothing));
  nothing.latitude_deg = nothing.longitude_deg = nothing.elevation = 0.0;
  nothing.flight_time = 0.0;
  EXPECT_FALSE(detector.add(nothing));
  EXPECT_FALSE(detector.add(flying(50.0))) << "loaded";
  EXPECT_FALSE(detector.add(nothing)) << "another flight is being loaded";
  EXPECT_TRUE(detector.add(flying(0.1)));
  EXPECT_FALSE(detector.add(flying(50.0)));
  detector.restart();
  EXPECT_FALSE(detector.add(flying(1.0)));
}

}  // namespace
}  // namespace xplane_bridge::core
