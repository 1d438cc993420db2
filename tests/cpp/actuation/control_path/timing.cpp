#include "fixture.hpp"

namespace xplane_bridge {
namespace {

// --- when ---

TEST_F(ControlPathTest, ACommandNeverWaitsForARefresh) {
  start();
  path->command(FlightMode::kManual, rollCommand(0.1));
  sim.clearMessages();
  frame();  // a refresh, 20 ms later
  ASSERT_EQ(writesTo(kStickRoll), Floats{0.1F});
  sim.frame(0.001);
  path->command(FlightMode::kManual, rollCommand(0.2));
  EXPECT_EQ(writesTo(kStickRoll), (Floats{0.1F, 0.2F})) << "within the same call";
  EXPECT_FALSE(path->deadline());
}

TEST_F(ControlPathTest, ACommandThatMustWaitIsSentWhenItMay) {
  options.max_rate = 200.0;
  start();
  path->command(FlightMode::kManual, rollCommand(0.1));
  const std::int64_t first = sim.clock().steady_ns();
  sim.clearMessages();
  sim.frame(0.001);
  path->command(FlightMode::kManual, rollCommand(0.2));
  sim.frame(0.001);
  path->command(FlightMode::kManual, rollCommand(0.3));  // takes the place of the one that waits
  EXPECT_TRUE(writesTo(kStickRoll).empty());
  ASSERT_TRUE(path->deadline());
  EXPECT_EQ(*path->deadline(), first + 5'000'000);
  sim.frame(0.0029);
  path->tick();
  EXPECT_TRUE(writesTo(kStickRoll).empty()) << "not before it may";
  sim.frame(0.0001);
  path->tick();
  EXPECT_EQ(writesTo(kStickRoll), Floats{0.3F});
  EXPECT_FALSE(path->deadline());
  sim.frame(0.004);
  path->command(FlightMode::kManual, rollCommand(0.4));
  ASSERT_TRUE(path->deadline()) << "the one that waited counts from when it was sent";
  EXPECT_EQ(*path->deadline(), first + 10'000'000);
}

TEST_F(ControlPathTest, AStreamAtTheHighestRateIsSentAtThatRate) {
  options.max_rate = 100.0;
  start();
  sim.clearMessages();
  for (int i = 0; i < 1000; ++i) {  // a second of a command each millisecond
    path->command(FlightMode::kManual, rollCommand(i * 1e-3));
    const auto wait = path->deadline();
    sim.frame(0.001);
    if (wait && sim.clock().steady_ns() >= *wait) path->tick();
  }
  EXPECT_NEAR(static_cast<double>(writesTo(kStickRoll).size()), 100.0, 1.0);
}

TEST_F(ControlPathTest, ALostCommandIsRepeatedByTheRefresh) {
  start();
  path->command(FlightMode::kManual, rollCommand(0.1));
  sim.loseMessages(1);
  frame();
  path->command(FlightMode::kManual, rollCommand(0.5));
  sim.loseMessages(1);
  sim.clearMessages();
  frame();
  EXPECT_EQ(writesTo(kStickRoll), Floats{0.5F}) << "this one is lost";
  frame();
  EXPECT_FLOAT_EQ(sim.value(kStickRoll), 0.5F);
}

TEST_F(ControlPathTest, ALostOverrideIsSetAgainWithinASecond) {
  start();
  sim.loseMessages(1);
  path->command(FlightMode::kManual, rollCommand(0.1));
  EXPECT_FLOAT_EQ(sim.value(kStickOverride), 0.0F);
  runWith(rollCommand(0.1), 1.1);
  EXPECT_FLOAT_EQ(sim.value(kStickOverride), 1.0F);
}

}  // namespace
}  // namespace xplane_bridge
