#include "fixture.hpp"

namespace xplane_bridge {
namespace {

// --- test signals ---

TEST_F(ControlPathTest, AnExcitationGoesOutWithEveryFrameAndItsEndToo) {
  start();
  path->command(FlightMode::kManual, rollCommand(0.1));
  sim.frame(0.001);
  sim.clearMessages();
  excitation.channels.set(core::index(core::Channel::kRoll));
  excitation.values.fill(0.3);
  sim.frame(0.001);
  sim.frame(0.001);
  EXPECT_EQ(writesTo(kStickRoll), (Floats{0.4F, 0.4F}));
  excitation = {};
  sim.frame(0.001);
  sim.frame(0.001);
  EXPECT_EQ(writesTo(kStickRoll), (Floats{0.4F, 0.4F, 0.1F})) << "without it, once";
}

TEST_F(ControlPathTest, AnAxisWithoutCommandsIsTakenForASignalAndGivenBack) {
  start();
  excitation.channels.set(core::index(core::Channel::kRoll));
  excitation.values.fill(0.3);
  excitation.rest = 0.1;
  sim.frame(0.001);
  EXPECT_EQ(sim.value(kStickOverride), 1.0F);
  EXPECT_EQ(sim.value(kPitchOverride), 0.0F);
  EXPECT_EQ(writesTo(kStickRoll), Floats{0.4F});
  EXPECT_TRUE(excitation_ends.empty());
  excitation = {};
  sim.frame(0.001);
  EXPECT_EQ(sim.value(kStickOverride), 0.0F);
  EXPECT_EQ(writesTo(kStickRoll), Floats{0.4F});
}

TEST_F(ControlPathTest, AnAxisOfASignalThatEndsWhileXPlaneIsSilentIsGivenBackWhenItAnswers) {
  start();
  excitation.channels.set(core::index(core::Channel::kRoll));
  excitation.values.fill(0.3);
  excitation.rest = 0.1;
  sim.frame(0.001);
  ASSERT_EQ(sim.value(kStickOverride), 1.0F);
  setState(LinkState::kStale);
  excitation = {};
  frame();
  EXPECT_EQ(sim.value(kStickOverride), 1.0F);
  setState(LinkState::kConnected);
  run(0.1);
  EXPECT_EQ(sim.value(kStickOverride), 0.0F);
  EXPECT_TRUE(overrides.active().empty());
}

TEST_F(ControlPathTest, AnExcitationOfSeveralAxesEndsWithTheFirstThatIsNotCommanded) {
  start();
  path->command(FlightMode::kManual, rollCommand(0.1));
  excitation.channels.set(core::index(core::Channel::kRoll));
  sim.frame(0.001);
  EXPECT_TRUE(excitation_ends.empty());
  excitation.channels.set(core::index(core::Channel::kPitch));
  sim.frame(0.001);
  EXPECT_EQ(excitation_ends, Texts{"the commands of the axis have ended"});
}

TEST_F(ControlPathTest, AnExcitationEndsWithTheSourceAndIsNotSentOnTheFailsafe) {
  start();
  path->command(FlightMode::kManual, rollCommand(0.1));
  excitation.channels.set(core::index(core::Channel::kRoll));
  excitation.values.fill(0.3);
  run(0.4);
  EXPECT_TRUE(excitation_ends.empty());
  run(0.2);
  EXPECT_EQ(excitation_ends, Texts{"the commands of the axis have ended"});
  const Floats rolls = writesTo(kStickRoll);
  EXPECT_EQ(rolls.back(), 0.0F);
  EXPECT_EQ(std::count(rolls.begin(), rolls.end(), 0.3F), 0) << "the signal on the failsafe's 0";
}

TEST_F(ControlPathTest, CommandedAreTheChannelsOfALivingSource) {
  start();
  EXPECT_TRUE(path->commanded().none());
  path->command(FlightMode::kManual, rollCommand(0.1));
  core::ChannelSet roll;
  roll.set(core::index(core::Channel::kRoll));
  EXPECT_EQ(path->commanded(), roll);
  path->suspend("loading");
  EXPECT_TRUE(path->commanded().none());
}

}  // namespace
}  // namespace xplane_bridge
