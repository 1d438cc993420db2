#include "fixture.hpp"

namespace xplane_bridge {
namespace {

// ------------------------------------------------------------------------------------------------ triggers

struct TriggerCase {
  FailureTrigger trigger;
  double core::FlightWatch::*member;
  double value, before, after;
};

TEST_F(FailureManagerTest, ArmedFailureComesTrueAtItsTrigger) {
  const std::vector<TriggerCase> cases{
      {FailureTrigger::kAtAltitudeAbove, &core::FlightWatch::height_agl, 300.0, 299.0, 300.5},
      {FailureTrigger::kAtAltitudeBelow, &core::FlightWatch::height_agl, 300.0, 301.0, 299.5},
      {FailureTrigger::kAtSpeedAbove, &core::FlightWatch::indicated_airspeed, 50.0, 49.0, 50.5},
      {FailureTrigger::kAtSpeedBelow, &core::FlightWatch::indicated_airspeed, 50.0, 51.0, 49.5},
  };
  for (const TriggerCase& each : cases) {
    SCOPED_TRACE(static_cast<int>(each.trigger));
    reported_.clear();
    watch_.*each.member = each.before;
    const RequestResult result = set(triggered("engine_1", each.trigger, each.value));
    EXPECT_EQ(result.code, ResultCode::kAccepted);
    EXPECT_EQ(result.text, "armed; published on events and failures/state when it comes true");
    EXPECT_TRUE(reported("failure armed: engine_1 failed", kWho, true));
    watch_.*each.member = std::nan("");
    sim_.run(0.5);
    watch_.*each.member = each.before;
    sim_.run(0.5);
    EXPECT_FALSE(label("engine_1").active);
    EXPECT_TRUE(std::isnan(label("engine_1").since_sim_time));
    EXPECT_EQ(sim_.value(kEngine), 0.0F);
    watch_.*each.member = each.after;
    sim_.run(0.2);
    EXPECT_TRUE(label("engine_1").active);
    EXPECT_TRUE(label("engine_1").confirmed);
    EXPECT_EQ(sim_.value(kEngine), 6.0F);
    EXPECT_TRUE(reported("failure: engine_1 failed", kWho, true));
    requireClear();
  }
}

/// Engine 1 fails below 300 m and engine 2 below 50 m/s: the aircraft flies above both, and then stands on the ground.
class NotFlown : public FailureManagerTest {
 protected:
  NotFlown() { show(1000.0, 70.0); }
  void show(double height, double airspeed) {
    watch_.height_agl = height;
    watch_.indicated_airspeed = airspeed;
    sim_.run(0.1);
  }
  void arm() {
    for (const core::FailureRequest& request : {triggered("engine_1", FailureTrigger::kAtAltitudeBelow, 300.0),
                                                triggered("engine_2", FailureTrigger::kAtSpeedBelow, 50.0)}) {
      ASSERT_EQ(set(request).code, ResultCode::kAccepted);
    }
  }
  void expectNoneThenBothAfter(const std::function<void()>& end) {
    show(2.0, 0.0);
    EXPECT_FALSE(label("engine_1").active);
    EXPECT_FALSE(label("engine_2").active);
    end();
    sim_.run(0.1);
    EXPECT_TRUE(label("engine_1").active);
    EXPECT_TRUE(label("engine_2").active);
  }
};

TEST_F(NotFlown, HeightsAndSpeedsOnTheWayToAnotherFlightTriggerNothing) {
  arm();
  placing_ = true;
  expectNoneThenBothAfter([this] { placing_ = false; });
}

TEST_F(NotFlown, ThoseOfAReplayTriggerNothing) {
  arm();
  watch_.replay = true;
  expectNoneThenBothAfter([this] { watch_.replay = false; });
}

TEST_F(NotFlown, ThoseOfAPauseTriggerNothingAlsoWhereItWasArmedInIt) {
  setLink(LinkState::kPaused);
  show(2.0, 0.0);
  arm();
  expectNoneThenBothAfter([this] { setLink(LinkState::kConnected); });
}

TEST_F(FailureManagerTest, TimeTriggerCountsFromTheRequest) {
  ASSERT_EQ(set(triggered("engine_1", FailureTrigger::kAtSimTime, 5.0)).code, ResultCode::kAccepted);
  sim_.run(4.9);
  EXPECT_EQ(sim_.value(kEngine), 0.0F);
  sim_.run(0.2);
  EXPECT_EQ(sim_.value(kEngine), 6.0F);
}

TEST_F(FailureManagerTest, ArmedFailureThatIsClearedNeverComes) {
  ASSERT_EQ(set(triggered("engine_1", FailureTrigger::kAtSimTime, 1.0)).code, ResultCode::kAccepted);
  const auto done = clear({"engine_1"});
  EXPECT_EQ(done.result.code, ResultCode::kOk);
  EXPECT_EQ(done.cleared, Names{"engine_1"});
  sim_.run(2.0);
  EXPECT_EQ(sim_.value(kEngine), 0.0F);
}

TEST_F(FailureManagerTest, NothingComesTrueOnceTheNodeEnds) {
  ASSERT_EQ(set(triggered("engine_1", FailureTrigger::kAtSimTime, 1.0)).code, ResultCode::kAccepted);
  failures_.stop();
  sim_.run(2.0);
  EXPECT_EQ(sim_.value(kEngine), 0.0F);
}

}  // namespace
}  // namespace xplane_bridge
