// A reset that X-Plane does not show as one ends what every reset ends.

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "actuation/actuation_rig.hpp"
#include "fake_flight.hpp"

namespace xplane_bridge {
namespace {

using core::EventKind;

class ActuationResetsTest : public testing::Test, protected ActuationRig {};

TEST_F(ActuationResetsTest, OneToWhereTheAircraftIsEndsAutoOnTwelve) {
  sim_.setVersion(core::kXPlane12);
  core::FakeFlight flight(&sim_);
  flight.put(50.0, core::FakeFlight::kHeight);
  sim_.on_frame = [&flight] { flight.move(); };
  actuation_->onLink(sim_.status());
  run(0.2);
  actuation_->path().requestMode({1, 2, "test", 0.0});
  ASSERT_EQ(actuation_->control().mode.mode, core::FlightMode::kAuto);
  const std::size_t before = eventsOf(EventKind::kReset).size();
  core::FlightStart start;
  start.latitude_deg = core::FakeFlight::kLatitude;
  start.longitude_deg = core::FakeFlight::kLongitude;
  start.altitude_msl = core::FakeFlight::kHeight;
  start.heading_true_deg = 90.0;
  start.true_airspeed = 70.0;
  actuation_->jobs().reset(start, 7, "test");
  while (actuation_->jobs().busy()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(flight.beginnings, 0U);
  ASSERT_EQ(eventsOf(EventKind::kReset).size(), before + 1) << "its outcome";
  EXPECT_TRUE(eventsOf(EventKind::kReset).back().success) << eventsOf(EventKind::kReset).back().text;
  EXPECT_EQ(eventsOf(EventKind::kReset).back().number, 7U);
  EXPECT_EQ(actuation_->control().mode.mode, core::FlightMode::kManual);
  EXPECT_EQ(modes_.back().reason, "the aircraft was placed; AUTO is off until it is asked for");
}

}  // namespace
}  // namespace xplane_bridge
