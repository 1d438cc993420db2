#include "control_path/fixture.hpp"

namespace xplane_bridge {
namespace {

// --- down ---

TEST_F(ControlPathTest, SendsNothingBeforeTheFirstCommand) {
  start();
  run(2.0);
  EXPECT_EQ(path->standing(), Standing::kFlying);
  EXPECT_EQ(path->refusal(), "");
  EXPECT_TRUE(sim.writes().empty());
  ASSERT_EQ(modes.size(), 1u);
  EXPECT_EQ(modes[0].reason, "start");
}

TEST_F(ControlPathTest, ACommandGoesDownOnceAfterItsOverride) {
  start();
  bool recorded = false;
  sim.on_message = [&](const core::FakeSimulator::Message& message) {
    if (message.path == kStickOverride) recorded = inJournal(kStickOverride);
  };
  EXPECT_FALSE(path->command(FlightMode::kManual, rollCommand(0.25, 7)));
  const std::vector<std::pair<std::string, float>> expected = {{kStickOverride, 1.0F}, {kStickRoll, 0.25F}};
  EXPECT_EQ(sim.writes(), expected);
  EXPECT_TRUE(recorded) << "in the journal before it is sent";
  ASSERT_EQ(applied.size(), 1u);
  EXPECT_EQ(applied[0].controls.sequence, 7u);
  EXPECT_FALSE(applied[0].read_back);
  EXPECT_DOUBLE_EQ(stick[0], 0.25);
  EXPECT_TRUE(std::isnan(stick[1])) << "no source commands pitch";
}

TEST_F(ControlPathTest, ReadBackComesHomeOnceWithTheFrameThatShowsIt) {
  start();
  path->command(FlightMode::kManual, rollCommand(0.25, 7));
  const double sent_at = applied.at(0).sim_time;
  sim.frame();
  sim.frame();
  ASSERT_EQ(applied.size(), 2u);
  EXPECT_TRUE(applied[1].read_back);
  EXPECT_EQ(applied[1].controls.sequence, 7u);
  EXPECT_EQ(applied[1].sent_ns, applied[0].sent_ns);
  EXPECT_NEAR(applied[1].read_back_sim_time, sent_at + 0.02, 1e-4);
  EXPECT_NEAR(applied[1].read_back_frames, 1.0, 0.01);
}

TEST_F(ControlPathTest, OfCommandsWithinOneFrameTheNewestIsReadBackAndNoneTwice) {
  options.max_rate = 2000.0;
  start();
  path->command(FlightMode::kManual, rollCommand(0.1, 1));
  sim.frame();
  sim.frame(0.001);
  applied.clear();
  path->command(FlightMode::kManual, rollCommand(0.2, 2));
  sim.frame(0.0005);
  path->command(FlightMode::kManual, rollCommand(0.3, 3));
  applied.clear();
  sim.frame();
  sim.frame();
  ASSERT_EQ(applied.size(), 1u);
  EXPECT_EQ(applied[0].controls.sequence, 3u);
}

TEST_F(ControlPathTest, ReadBackGoesWithTheChannelsThatAreCommanded) {
  start();
  runWith(rollCommand(0.25, 1), 0.1);
  core::ControlCommand pitch;
  pitch.sequence = 2;
  pitch.fields = core::kFieldPitch;
  pitch.pitch = -0.5;
  path->command(FlightMode::kManual, pitch);
  EXPECT_EQ(applied.back().sent_ns, sim.clock().system_ns());
  sim.frame();
  sim.frame();
  EXPECT_TRUE(applied.back().read_back);
  EXPECT_EQ(applied.back().controls.sequence, 2u);
}

TEST_F(ControlPathTest, WhatStoodThereBeforeTheCommandIsNoReadBack) {
  start();
  runWith(rollCommand(0.25, 1), 0.1);
  const float stands = sim.value(kRunningTime);
  sim.on_frame = [&] { sim.set(kRunningTime, stands); };  // what X-Plane has sent before the command reached it
  applied.clear();
  path->command(FlightMode::kManual, rollCommand(0.25, 2));
  sim.frame();
  ASSERT_EQ(applied.size(), 1u);
  EXPECT_FALSE(applied[0].read_back);
  sim.on_frame = nullptr;
  sim.frame();
  ASSERT_EQ(applied.size(), 2u);
  EXPECT_TRUE(applied[1].read_back);
}

TEST_F(ControlPathTest, WhatXPlaneDoesNotShowIsNamed) {
  sim.setReadOnly(kStickRoll);
  start();
  core::ControlCommand command = rollCommand(0.5);
  command.fields |= core::kFieldPitch;
  command.pitch = -0.25;
  runWith(command, 0.5);
  EXPECT_EQ(path->notFollowed(), Texts{}) << "it is given a second";
  runWith(command, 1.0);
  EXPECT_EQ(path->notFollowed(), Texts{"roll"});
  sim.setReadOnly(kStickRoll, false);
  runWith(command, 0.1);
  EXPECT_EQ(path->notFollowed(), Texts{});
}

TEST_F(ControlPathTest, ARefusedCommandChangesNothing) {
  start();
  const auto refusal = path->command(FlightMode::kManual, rollCommand(1.5));
  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->reason, core::Refusal::kOutOfRange);
  EXPECT_TRUE(sim.writes().empty());
  EXPECT_EQ(path->statistics(FlightMode::kManual).refusedTotal(), 1u);
}

TEST_F(ControlPathTest, TheSourceThatDoesNotFlyIsHeardButNotSent) {
  start();
  path->command(FlightMode::kAuto, rollCommand(0.25));
  run(0.1);
  EXPECT_TRUE(sim.writes().empty());
  EXPECT_TRUE(modes.back().auto_alive);
}

TEST_F(ControlPathTest, HandlesAreSentForAMomentAfterAChangeOnly) {
  start();
  core::ControlCommand command;
  command.fields = core::kFieldFlaps;
  command.flaps = 0.5;
  runWith(command, 0.4);
  EXPECT_GE(writesTo(kFlapHandle).size(), 10u) << "one may be lost";
  sim.clearMessages();
  sim.set(kFlapHandle, 0.25F);  // moved in the cockpit
  runWith(command, 1.0);
  EXPECT_TRUE(writesTo(kFlapHandle).empty());
  command.flaps = 1.0;
  path->command(FlightMode::kManual, command);
  EXPECT_EQ(writesTo(kFlapHandle), Floats{1.0F});
}

TEST_F(ControlPathTest, XPlane12GetsItsOwnNames) {
  const char* const handle = "sim/cockpit2/controls/flap_handle_request_ratio";
  sim.set(handle, 0.0F);
  sim.setVersion({122015});
  start();
  core::ControlCommand command;
  command.fields = core::kFieldFlaps;
  command.flaps = 0.5;
  path->command(FlightMode::kManual, command);
  EXPECT_EQ(writesTo(handle), Floats{0.5F});
  sim.frame();
  sim.frame();
  EXPECT_TRUE(applied.back().read_back);
}

core::ControlCommand trimmedRoll() {
  core::ControlCommand command = rollCommand(0.3);
  command.fields |= core::kFieldTrimYaw;
  command.trim_yaw = 0.5;
  return command;
}

TEST_F(ControlPathTest, ATrimThatTheAircraftHasNotIsRefusedInWordsAndTheRestFlown) {
  sim.setAll(core::trimDatarefs(), 0.0F);
  sim.set(kRudderTrim, 0.0F);
  start();
  run(0.5);
  for (int i = 0; i < 3; ++i) {
    path->command(FlightMode::kManual, trimmedRoll());
    frame();
  }
  EXPECT_FLOAT_EQ(sim.value(kStickRoll), 0.3F);
  EXPECT_FLOAT_EQ(sim.value(kRudderTrim), 0.0F);
  ASSERT_FALSE(applied.empty());
  EXPECT_EQ(applied.back().controls.fields, core::kFieldRoll);
  EXPECT_EQ(path->commanded().count(), 1U);
  const auto reports = std::count_if(events.begin(), events.end(), [](const std::string& text) {
    return text.find("trim_yaw is not sent: this aircraft has no rudder trim") == 0;
  });
  EXPECT_EQ(reports, 1) << "once for an aircraft";

  // Another one, that has it.
  sim.set("sim/aircraft/controls/acf_max_trim_rudd", 0.4F);
  path->onAircraft({"DA62", "another"});
  run(0.5);
  path->command(FlightMode::kManual, trimmedRoll());
  frame();
  EXPECT_FLOAT_EQ(sim.value(kRudderTrim), 0.5F);
}

TEST_F(ControlPathTest, TrimsAreSentWhereXPlaneDoesNotReportThem) {
  sim.set(kRudderTrim, 0.0F);
  start();
  run(0.5);
  path->command(FlightMode::kManual, trimmedRoll());
  frame();
  EXPECT_FLOAT_EQ(sim.value(kRudderTrim), 0.5F);
}

}  // namespace
}  // namespace xplane_bridge
