#include "fixture.hpp"

namespace xplane_bridge {
namespace {

// --- DATA rows ---

class ControlPathRowsTest : public ControlPathTest {
 protected:
  ControlPathRowsTest() { options.rows = true; }
  /// Slot of a row in each DATA message since the last clearMessages() that has the row.
  Floats slotsOf(std::int32_t row, std::size_t slot) const {
    Floats out;
    for (const auto& message : sim.messages()) {
      if (message.label != "DATA") continue;
      for (std::size_t at = 0; at + 36 <= message.body.size(); at += 36) {
        if (core::loadLittleEndian<std::int32_t>(message.body.data() + at) != row) continue;
        out.push_back(core::loadLittleEndian<float>(message.body.data() + at + 4 + 4 * slot));
      }
    }
    return out;
  }
};

TEST_F(ControlPathRowsTest, CommandsGoAsRowsUnderTheSameOverrides) {
  start();
  path->command(FlightMode::kManual, rollCommand(0.4));
  EXPECT_EQ(slotsOf(8, 1), Floats{0.4F});
  EXPECT_EQ(slotsOf(11, 1), Floats{0.4F});
  EXPECT_EQ(slotsOf(8, 0), Floats{-999.0F});
  EXPECT_TRUE(writesTo(kStickRoll).empty());
  EXPECT_EQ(sim.value(kStickOverride), 1.0F);
  EXPECT_TRUE(inJournal("DATA row 8"));
  EXPECT_TRUE(inJournal("DATA row 11"));
}

TEST_F(ControlPathRowsTest, RowsAreGivenBackWithTheOverrides) {
  start();
  path->command(FlightMode::kManual, rollCommand(0.4));
  sim.clearMessages();
  path->suspend("another aircraft is being loaded");
  EXPECT_EQ(slotsOf(8, 1), Floats{-999.0F});
  EXPECT_EQ(slotsOf(11, 1), Floats{-999.0F});
  EXPECT_EQ(sim.value(kStickOverride), 0.0F);
}

TEST_F(ControlPathRowsTest, RowsThatAnotherClientHasGivenBackAreNotSentAgain) {
  core::ControlCommand command;
  command.fields = core::kFieldThrottle;  // a lever has no override
  command.throttle = 0.5;
  const auto fly = [&](double seconds) {
    for (double end = sim.time() + seconds - 1e-6; sim.time() < end;) {
      runWith(command, 0.2);
      overrides.watchRows();  // as the ReleaseWorker does
    }
  };
  start();
  fly(3.0);
  ASSERT_EQ(path->standing(), Standing::kFlying);
  ASSERT_TRUE(inJournal("DATA row 25"));
  sim.journal()->remove({"override:DATA row 25"});  // as scripts/release_overrides does, after -999
  fly(1.4);
  EXPECT_EQ(path->standing(), Standing::kWaitingForMode);
  EXPECT_EQ(path->refusal(), "another client has released DATA row 25: ask for a mode to fly on");
  EXPECT_EQ(slotsOf(25, 0).back(), -999.0F) << "commands had gone on for a moment";
  EXPECT_TRUE(overrides.releasesPending());
  sim.clearMessages();
  fly(1.0);
  EXPECT_TRUE(slotsOf(25, 0).empty());
  ask(FlightMode::kManual);
  fly(3.0);
  EXPECT_EQ(path->standing(), Standing::kFlying);
  EXPECT_EQ(slotsOf(25, 0).back(), 0.5F);
  EXPECT_TRUE(inJournal("DATA row 25"));
}

TEST_F(ControlPathRowsTest, RowsTakenAnewAreNoRelease) {
  start();
  for (int i = 0; i < 10; ++i) {
    runWith(rollCommand(0.4), 0.3);
    path->suspend("loading");
    path->resume();
    overrides.confirmReleases(0.1);
    runWith(rollCommand(0.4), 0.1);
    overrides.watchRows();
  }
  runWith(rollCommand(0.4), 0.1);
  EXPECT_EQ(path->standing(), Standing::kFlying);
}

TEST_F(ControlPathRowsTest, HandlesAreLeftToTheCockpitAfterAChange) {
  core::ControlCommand command;
  command.fields = core::kFieldFlaps;
  command.flaps = 0.5;
  start();
  runWith(command, 0.5);
  const Floats flaps = slotsOf(13, 3);
  EXPECT_EQ(flaps.front(), 0.5F);
  EXPECT_EQ(flaps.back(), -999.0F);
}

}  // namespace
}  // namespace xplane_bridge
