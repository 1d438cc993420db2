// What was sent once and given back since is not sent again before it is commanded.

#include "fixture.hpp"

namespace xplane_bridge {
namespace {

constexpr const char* kLever = "sim/cockpit2/engine/actuators/throttle_ratio[0]";

core::ControlCommand rollAndThrottle(double throttle) {
  core::ControlCommand command = rollCommand(0.25);
  command.fields |= core::kFieldThrottle;
  command.throttle = throttle;
  return command;
}

/// A lever that holds what it was sent, as config/aircraft has it; its controller flies for a second, and ends.
class GivenBackTest : public ControlPathTest {
 protected:
  GivenBackTest() {
    options.arbiter.channels[core::index(core::leverChannel(0))].failsafe = core::Failsafe::kHold;
    sim.set(kLever, 0.0F);
    sim.set(kFlightTime, 50.0F);
  }
  void flyAndEnd() {
    start();
    runWith(rollAndThrottle(0.9), 1.0);
    ASSERT_FLOAT_EQ(sim.value(kLever), 0.9F);
    run(2.0);
    ASSERT_FLOAT_EQ(sim.value(kStickOverride), 1.0F) << "its failsafe";
  }
  /// The pilot puts the lever to idle.
  void idle() {
    sim.set(kLever, 0.0F);
    run(1.0);
  }
  void expectNothingIsSent() {
    sim.clearMessages();
    run(1.0);
    EXPECT_FLOAT_EQ(sim.value(kLever), 0.0F);
    EXPECT_FLOAT_EQ(sim.value(kStickOverride), 0.0F);
    EXPECT_TRUE(sim.writes().empty()) << sim.writes().front().first;
  }
};

TEST_F(GivenBackTest, AModeAskedForAfterAReleaseMovesNothing) {
  flyAndEnd();
  releaseByAnother();
  idle();
  ask(FlightMode::kManual);
  ASSERT_EQ(path->standing(), Standing::kFlying);
  expectNothingIsSent();
}

TEST_F(GivenBackTest, AModeAskedForAfterAHangSendsWhatIsCommandedOnly) {
  flyAndEnd();
  sim.set(kStickOverride, 0.0F);
  path->onGivenBack("tx_node stood still");
  idle();
  ask(FlightMode::kManual);
  runWith(rollCommand(0.1), 1.0);
  EXPECT_FLOAT_EQ(sim.value(kStickRoll), 0.1F);
  EXPECT_FLOAT_EQ(sim.value(kLever), 0.0F) << "nothing commands it";
  runWith(rollAndThrottle(0.3), 0.1);
  EXPECT_FLOAT_EQ(sim.value(kLever), 0.3F);
}

TEST_F(GivenBackTest, AnAircraftThatWasLoadedIsNotFlownByWhoHasEnded) {
  flyAndEnd();
  path->suspend("another aircraft is being loaded");
  run(1.0);
  path->onNewFlight("the flight began anew");
  idle();
  path->resume();
  ASSERT_EQ(path->standing(), Standing::kFlying);
  expectNothingIsSent();
}

TEST_F(GivenBackTest, TheRightAircraftAfterAWrongOneIsNotFlownByWhoHasEnded) {
  flyAndEnd();
  path->onAircraft({"QUAD", ""});
  idle();
  path->onAircraft({"DA62", ""});
  ASSERT_EQ(path->standing(), Standing::kFlying);
  expectNothingIsSent();
}

TEST_F(GivenBackTest, ANewFlightBeginsWithItsOwnLever) {
  flyAndEnd();
  path->onNewFlight("the flight began anew");
  idle();
  EXPECT_FLOAT_EQ(sim.value(kLever), 0.0F);
  runWith(rollAndThrottle(0.9), 0.1);
  EXPECT_FLOAT_EQ(sim.value(kLever), 0.9F) << "commanded again";
}

TEST_F(GivenBackTest, WhoGoesOnCommandingFliesANewFlightAtOnce) {
  start();
  runWith(rollAndThrottle(0.9), 1.0);
  sim.set(kLever, 0.0F);
  path->onNewFlight("the flight began anew");
  runWith(rollAndThrottle(0.9), 0.1);
  EXPECT_FLOAT_EQ(sim.value(kLever), 0.9F);
}

}  // namespace
}  // namespace xplane_bridge
