// Every field of commands, of what was sent of them and of the mode, as in test_every_field_of_actuation.cpp.

#include <gtest/gtest.h>

#include <cmath>

#include "expected_fields.hpp"
#include "xplane_bridge/nodes/messages/actuation_conversions.hpp"
#include "xplane_bridge/nodes/messages/control_conversions.hpp"

namespace xplane_bridge {
namespace {

using core::Channel;
using core::FlightMode;

const std::set<std::string> kNone;
const std::set<std::string> kHeader = headerAnd({});
constexpr std::int64_t kSent = 1'700'000'000'250'000'000;  // [ns]

std::size_t surface(const char* name) { return core::surfaceNumber(name).value(); }

const std::vector<core::SurfaceDeflection> kSurfaces{{surface("rudder1_fin1"), 41.0},
                                                     {surface("aileron1_wing2_left"), 42.0}};

TEST(EveryField, OfAControlCommandGoesIntoTheCoreAndBack) {
  FilledMessage<ControlCommand> sent;
  const core::ControlCommand got = toCore(sent.message());
  EXPECT_EQ(got.sequence, sent.number("sequence"));
  EXPECT_EQ(got.fields, sent.number("fields"));
  EXPECT_EQ(got.roll, sent.number("roll"));
  EXPECT_EQ(got.pitch, sent.number("pitch"));
  EXPECT_EQ(got.yaw, sent.number("yaw"));
  EXPECT_EQ(got.throttle, sent.number("throttle"));
  EXPECT_EQ(got.engine_count, sent.number("engine_count"));
  const auto list = [](const auto& values) { return std::vector<double>(values.begin(), values.end()); };
  EXPECT_EQ(list(got.engine_throttles), sent.numbers("engine_throttles"));
  EXPECT_EQ(list(got.motors), sent.numbers("motors"));
  EXPECT_EQ(got.trim_roll, sent.number("trim_roll"));
  EXPECT_EQ(got.trim_pitch, sent.number("trim_pitch"));
  EXPECT_EQ(got.trim_yaw, sent.number("trim_yaw"));
  EXPECT_EQ(got.flaps, sent.number("flaps"));
  EXPECT_EQ(got.speedbrake, sent.number("speedbrake"));
  EXPECT_EQ(got.gear, sent.number("gear"));
  EXPECT_EQ(got.parking_brake, sent.number("parking_brake"));
  EXPECT_EQ(got.left_brake, sent.number("left_brake"));
  EXPECT_EQ(got.right_brake, sent.number("right_brake"));
  EXPECT_EQ(got.thrust_vector, sent.number("thrust_vector"));
  EXPECT_EQ(sent.unasked(), kNone);

  ControlCommand back;
  toMessage(got, &back);
  MessageValues expected;
  for (const std::string& field : sent.layout().fields()) {
    if (kHeader.count(field) == 0) expected[field] = sent.numbers(field);
  }
  expectMessage(back, {expected, {}}, kHeader);
}

/// Each channel has 100 and its number; five levers or motors are commanded.
core::ArbitratedControls someControls(std::uint32_t fields, Channel first_engine) {
  core::ArbitratedControls controls;
  for (std::size_t i = 0; i < core::kChannelCount; ++i) controls.values[i] = 100.0 + static_cast<double>(i);
  for (std::size_t engine = 0; engine < 5; ++engine) controls.active.set(core::index(first_engine) + engine);
  controls.mode = FlightMode::kAuto;
  controls.source = core::CommandSource::kManual;
  controls.sequence = 31;
  controls.source_age = 32.25;
  controls.fields = fields;
  controls.limited = 34;
  controls.excited = 35;
  return controls;
}

MessageContent expectedControls(std::uint32_t fields, Channel first_engine) {
  const auto value = [](Channel channel) { return 100.0 + static_cast<double>(core::index(channel)); };
  std::vector<double> engines;
  for (std::size_t i = 0; i < 8; ++i) engines.push_back(value(first_engine) + static_cast<double>(i));
  MessageContent out;
  out.values = {
      {"mode", {ControlMode::AUTO}},
      {"source", {AppliedCommand::SOURCE_MANUAL}},
      {"sequence", {31.0}},
      {"source_age", {32.25}},
      {"fields", {static_cast<double>(fields)}},
      {"limited", {34.0}},
      {"excited", {35.0}},
      {"roll", {value(Channel::kRoll)}},
      {"pitch", {value(Channel::kPitch)}},
      {"yaw", {value(Channel::kYaw)}},
      {"engine_count", {5.0}},
      {"throttles", engines},
      {"trim_roll", {value(Channel::kTrimRoll)}},
      {"trim_pitch", {value(Channel::kTrimPitch)}},
      {"trim_yaw", {value(Channel::kTrimYaw)}},
      {"flaps", {value(Channel::kFlaps)}},
      {"speedbrake", {value(Channel::kSpeedbrake)}},
      {"gear", {value(Channel::kGear)}},
      {"parking_brake", {value(Channel::kParkingBrake)}},
      {"left_brake", {value(Channel::kLeftBrake)}},
      {"right_brake", {value(Channel::kRightBrake)}},
      {"thrust_vector", {value(Channel::kThrustVector)}},
  };
  return out;
}

TEST(EveryField, OfAppliedCommandIsWhatWasSentAndShown) {
  for (const bool motors : {false, true}) {
    SCOPED_TRACE(motors ? "motors" : "levers");
    const std::uint32_t fields = motors ? core::kFieldRoll | core::kFieldMotors : core::kFieldEngineThrottles;
    const Channel first = motors ? Channel::kMotor0 : Channel::kLever0;
    AppliedControls applied;
    applied.controls = someControls(fields, first);
    applied.sent_ns = kSent;
    applied.sim_time = 36.0;  // no field
    applied.read_back = true;
    applied.read_back_sim_time = 37.0;
    applied.read_back_frames = 38.0;
    AppliedCommand message;
    toMessage(applied, kSurfaces, &message);
    MessageContent expected = expectedControls(fields, first);
    expected.values["header.stamp"] = {1'700'000'000.25};
    expected.values["surface_deflections_deg"] = {41.0, 42.0};
    expected.values["read_back"] = {1.0};
    expected.values["read_back_sim_time"] = {37.0};
    expected.values["read_back_frames"] = {38.0};
    expected.texts["surface_names"] = {"rudder1_fin1", "aileron1_wing2_left"};
    expectMessage(message, expected, {"header.seq", "header.frame_id"});

    toMessage(applied, {}, &message);
    EXPECT_TRUE(message.surface_names.empty());
    EXPECT_TRUE(message.surface_deflections_deg.empty());
    applied.read_back = false;
    applied.controls.active.reset();
    toMessage(applied, {}, &message);
    EXPECT_FALSE(message.read_back);
    EXPECT_EQ(message.engine_count, 0);
  }
}

TEST(EveryField, OfAppliedCommandThatTheArbiterKnows) {
  AppliedCommand message;
  toMessage(someControls(core::kFieldEngineThrottles, Channel::kLever0), &message);
  expectMessage(
      message, expectedControls(core::kFieldEngineThrottles, Channel::kLever0),
      headerAnd({"surface_names", "surface_deflections_deg", "read_back", "read_back_sim_time", "read_back_frames"}));
}

TEST(EveryField, OfTheEchoOfSurfacesThatASurfaceCommandHas) {
  SurfaceControl::Echo echo;
  echo.sequence = 31;
  echo.read_back = true;
  echo.sim_time = 37.0;
  echo.frames = 38.0;
  AppliedCommand message;
  message.source = AppliedCommand::SOURCE_MANUAL;  // of the one before
  toMessage(echo, FlightMode::kAuto, kSurfaces, &message);
  MessageContent expected;
  expected.values = {{"mode", {ControlMode::AUTO}}, {"source", {AppliedCommand::SOURCE_NONE}},
                     {"sequence", {31.0}},          {"surface_deflections_deg", {41.0, 42.0}},
                     {"read_back", {1.0}},          {"read_back_sim_time", {37.0}},
                     {"read_back_frames", {38.0}}};
  expected.texts = {{"surface_names", {"rudder1_fin1", "aileron1_wing2_left"}}};
  expectMessage(message, expected,
                headerAnd({"source_age", "fields", "limited", "excited", "roll", "pitch", "yaw", "engine_count",
                           "throttles", "trim_roll", "trim_pitch", "trim_yaw", "flaps", "speedbrake", "gear",
                           "parking_brake", "left_brake", "right_brake", "thrust_vector"}));
}

TEST(EveryField, OfControlModeIsTheArbitersStatus) {
  for (unsigned pass = 0; pass < kPasses; ++pass) {
    core::ModeStatus status;
    status.mode = FlightMode::kAuto;
    status.previous = FlightMode::kManual;
    status.requested_by = "who";
    status.reason = "why";
    status.request_sequence = 31;
    status.accepted = flag(0, pass);
    status.since = 32.0;  // no field
    status.manual_alive = flag(1, pass);
    status.auto_alive = flag(2, pass);
    status.failsafe = flag(3, pass);
    status.revision = 33;  // no field
    ControlMode message;
    toMessage(status, 34.0, &message);
    MessageContent expected;
    expected.values = {{"mode", {ControlMode::AUTO}},
                       {"previous", {ControlMode::MANUAL}},
                       {"request_sequence", {31.0}},
                       {"accepted", {flag(0, pass) ? 1.0 : 0.0}},
                       {"sim_time", {34.0}},
                       {"manual_alive", {flag(1, pass) ? 1.0 : 0.0}},
                       {"auto_alive", {flag(2, pass) ? 1.0 : 0.0}},
                       {"failsafe", {flag(3, pass) ? 1.0 : 0.0}}};
    expected.texts = {{"requested_by", {"who"}}, {"reason", {"why"}}};
    expectMessage(message, expected, kHeader);
    status.previous.reset();
    toMessage(status, 34.0, &message);
    EXPECT_EQ(message.previous, 0) << "at the start";
  }
}

}  // namespace
}  // namespace xplane_bridge
