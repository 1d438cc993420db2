// What a reset ends, also one that X-Plane does not show, and what it leaves as it is.

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "actuation/actuation_rig.hpp"
#include "fake_flight.hpp"

namespace xplane_bridge {
namespace {

using core::EventKind;

constexpr const char* kEngine = "sim/operation/failures/rel_engfai0";

class ActuationResetsTest : public testing::Test, protected ActuationRig {
 protected:
  /// To where the aircraft is nearly: event 7.
  void reset() {
    core::FlightStart start;
    start.latitude_deg = core::FakeFlight::kLatitude;
    start.longitude_deg = core::FakeFlight::kLongitude;
    start.altitude_msl = core::FakeFlight::kHeight;
    start.heading_true_deg = 90.0;
    start.true_airspeed = 70.0;
    actuation_->jobs().reset(start, 7, "test");
    awaitJobs();
  }
  void awaitJobs() {
    while (actuation_->jobs().busy()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
};

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
  reset();
  EXPECT_EQ(flight.beginnings, 0U);
  ASSERT_EQ(eventsOf(EventKind::kReset).size(), before + 1) << "its outcome";
  EXPECT_TRUE(eventsOf(EventKind::kReset).back().success) << eventsOf(EventKind::kReset).back().text;
  EXPECT_EQ(eventsOf(EventKind::kReset).back().number, 7U);
  EXPECT_EQ(actuation_->control().mode.mode, core::FlightMode::kManual);
  EXPECT_EQ(modes_.back().reason, "the aircraft was placed; AUTO is off until it is asked for");
}

TEST_F(ActuationResetsTest, TheGroundOnTheWayToTheNewFlightTriggersNoFailure) {
  constexpr const char* kHeight = "sim/flightmodel/position/y_agl";
  core::FakeFlight flight(&sim_);
  flight.put(50.0, core::FakeFlight::kHeight);
  sim_.set(kHeight, 900.0F);
  sim_.set(kEngine, 0.0F);
  sim_.on_frame = [this, &flight] {
    flight.move();
    sim_.set(kHeight, actuation_->jobs().busy() ? 2.0F : 900.0F);
  };
  actuation_->onLink(sim_.status());
  run(0.2);
  const int below = static_cast<int>(core::FailureTrigger::kAtAltitudeBelow);
  ASSERT_EQ(actuation_->failures().set({"engine_1", "failed", {}, below, 150.0}, "test").code,
            core::ResultCode::kAccepted);
  reset();
  ASSERT_EQ(flight.beginnings, 1U);
  run(0.2);
  EXPECT_FALSE(broken_.back().labels.front().active);
  sim_.on_frame = [this] { sim_.set(kHeight, 100.0F); };
  run(0.2);
  EXPECT_TRUE(broken_.back().labels.front().active);
}

TEST_F(ActuationResetsTest, ALoadOfWhatXPlaneDoesNotHaveLeavesTriggersWorking) {
  constexpr const char* kHeight = "sim/flightmodel/position/y_agl";
  core::FakeFlight flight(&sim_);
  flight.has_files = false;
  flight.put(50.0, core::FakeFlight::kHeight);
  sim_.set(kHeight, 900.0F);
  sim_.set(kEngine, 0.0F);
  bool active = false;
  sim_.on_frame = [&] {
    flight.move();
    const bool loading = actuation_->jobs().busy();
    sim_.set(kHeight, loading ? 100.0F : 900.0F);
    active = active || (loading && sim_.value(kEngine) != 0.0F);
  };
  actuation_->onLink(sim_.status());
  run(0.2);
  const int below = static_cast<int>(core::FailureTrigger::kAtAltitudeBelow);
  ASSERT_EQ(actuation_->failures().set({"engine_1", "failed", {}, below, 150.0}, "test").code,
            core::ResultCode::kAccepted);
  actuation_->jobs().loadSituation("Output/situations/none.sit", 8, "test");
  awaitJobs();
  EXPECT_FALSE(eventsOf(EventKind::kSituation).back().success);
  EXPECT_TRUE(active) << "X-Plane has flown on meanwhile";
}

}  // namespace
}  // namespace xplane_bridge
