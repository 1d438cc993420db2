#include "fixture.hpp"

namespace xplane_bridge {
namespace {

constexpr const char* kMotorOverride = "sim/operation/override/override_throttles";

core::ControlCommand motorsCommand(double first, double second) {
  core::ControlCommand command;
  command.fields = core::kFieldMotors;
  command.engine_count = 2;
  command.motors = {first, second};
  return command;
}

/// Motors 0 and 1 with their levers.
class MotorsTest : public ControlPathTest {
 protected:
  MotorsTest() {
    options.arbiter.engines = 2;
    sim.set(kMotorOverride, 0.0F);
    for (const char* name :
         {"sim/flightmodel/engine/ENGN_thro_use[0]", "sim/flightmodel/engine/ENGN_thro_use[1]",
          "sim/cockpit2/engine/actuators/throttle_ratio[0]", "sim/cockpit2/engine/actuators/throttle_ratio[1]"}) {
      sim.set(name, 0.0F);
    }
  }
  float lever(int engine) {
    return sim.value("sim/cockpit2/engine/actuators/throttle_ratio[" + std::to_string(engine) + "]");
  }
};

TEST_F(MotorsTest, LeversAreWhereTheMotorsAreWhenTheirOverrideEnds) {
  std::vector<float> at_release;
  sim.on_message = [&](const core::FakeSimulator::Message& message) {
    if (message.path == kMotorOverride && message.value == 0.0F) at_release = {lever(0), lever(1)};
  };
  start();
  runWith(motorsCommand(0.6, 0.7), 0.5);
  EXPECT_FLOAT_EQ(lever(0), 0.0F) << "theirs is the cockpit";
  runWith(rollCommand(0.0), 0.02);
  path->suspend("loading");
  ASSERT_EQ(at_release.size(), 2U);
  EXPECT_FLOAT_EQ(at_release[0], 0.6F);
  EXPECT_FLOAT_EQ(at_release[1], 0.7F);
}

TEST_F(MotorsTest, LeverWithoutReverseIsNotBelowZero) {
  start();
  core::ControlCommand command = motorsCommand(-0.5, 0.7);
  if (path->command(FlightMode::kManual, command)) GTEST_SKIP() << "motors take no negative values";
  runWith(command, 0.5);
  path->suspend("loading");
  EXPECT_FLOAT_EQ(lever(0), 0.0F);
}

TEST_F(MotorsTest, JournalHasWhatIsToBeWrittenBeforeTheRelease) {
  start();
  runWith(motorsCommand(0.6, 0.7), 0.5);
  overrides.recordPreparations();
  ASSERT_EQ(sim.journal()->entries().size(), 1U);
  const std::vector<core::UndoOperation> undo = sim.journal()->entries()[0].undo;
  ASSERT_EQ(undo.size(), 3U);
  const auto& first = std::get<core::UndoDref>(undo[0]);
  EXPECT_EQ(first.path, "sim/cockpit2/engine/actuators/throttle_ratio[0]");
  EXPECT_FLOAT_EQ(first.value, 0.6F);
  EXPECT_FALSE(first.confirm) << "a throttle of X-Plane's own may move it again";
  EXPECT_EQ(std::get<core::UndoDref>(undo[2]).path, kMotorOverride) << "last";
}

}  // namespace
}  // namespace xplane_bridge
