#include "xplane_bridge/core/control/control_command.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

namespace xplane_bridge::core {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

Refusal refusalOf(const ControlCommand& command) {
  const auto wrong = checkCommand(command);
  return wrong ? wrong->reason : Refusal::kNone;
}

TEST(ControlCommand, BitsAreThoseOfTheMessage) {
  // ControlCommand.msg, written out.
  EXPECT_EQ(kFieldRoll, 1u);
  EXPECT_EQ(kFieldThrottle, 8u);
  EXPECT_EQ(kFieldMotors, 32u);
  EXPECT_EQ(kFieldTrimYaw, 256u);
  EXPECT_EQ(kFieldSpeedbrake, 1024u);
  EXPECT_EQ(kFieldToeBrakes, 8192u);
  EXPECT_EQ(kFieldThrustVector, 16384u);
  EXPECT_EQ(kAllFields, 32767u);
}

TEST(ControlCommand, ChannelsHaveDistinctNamesAndTheFieldTheyBelongTo) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < kChannelCount; ++i) names.insert(channelName(static_cast<Channel>(i)));
  EXPECT_EQ(kChannelCount, 29u);  // 3 axes, 8 levers, 8 motors, 3 trims, flaps, speed brake, gear, 3 brakes, vector
  EXPECT_EQ(names.size(), kChannelCount);
  EXPECT_EQ(channelName(leverChannel(2)), "engine_throttles[2]");
  EXPECT_EQ(channelName(motorChannel(7)), "motors[7]");
  EXPECT_EQ(fieldOf(Channel::kRightBrake), kFieldToeBrakes);
  EXPECT_EQ(fieldOf(motorChannel(7)), kFieldMotors);
  EXPECT_EQ(fieldOf(leverChannel(7)), kFieldEngineThrottles);
}

TEST(ControlCommand, RefusesAnyCommandedValueThatIsNotFiniteOrOutOfRange) {
  const struct {
    std::uint32_t field;
    double ControlCommand::*value;
    double low, high;
    const char* name;
  } fields[] = {{1, &ControlCommand::roll, -1, 1, "roll"},
                {2, &ControlCommand::pitch, -1, 1, "pitch"},
                {4, &ControlCommand::yaw, -1, 1, "yaw"},
                {8, &ControlCommand::throttle, -1, 1, "throttle"},
                {64, &ControlCommand::trim_roll, -1, 1, "trim_roll"},
                {128, &ControlCommand::trim_pitch, -1, 1, "trim_pitch"},
                {256, &ControlCommand::trim_yaw, -1, 1, "trim_yaw"},
                {512, &ControlCommand::flaps, 0, 1, "flaps"},
                {1024, &ControlCommand::speedbrake, -0.5, 1, "speedbrake"},
                {2048, &ControlCommand::gear, 0, 1, "gear"},
                {4096, &ControlCommand::parking_brake, 0, 1, "parking_brake"},
                {8192, &ControlCommand::left_brake, 0, 1, "left_brake"},
                {8192, &ControlCommand::right_brake, 0, 1, "right_brake"},
                {16384, &ControlCommand::thrust_vector, 0, 1, "thrust_vector"}};
  for (const auto& f : fields) {
    SCOPED_TRACE(f.name);
    ControlCommand command;
    command.fields = f.field;
    for (const double good : {f.low, f.high}) {
      command.*f.value = good;
      EXPECT_EQ(refusalOf(command), Refusal::kNone) << good;
    }
    for (const double bad : {f.low - 1e-6, f.high + 1e-6}) {
      command.*f.value = bad;
      EXPECT_EQ(refusalOf(command), Refusal::kOutOfRange) << bad;
    }
    for (const double bad : {kNan, kInf, -kInf}) {
      command.*f.value = bad;
      ASSERT_EQ(refusalOf(command), Refusal::kNotFinite) << bad;
      EXPECT_EQ(checkCommand(command)->text.find(f.name), 0u);
    }
    command.fields = 0;  // not commanded: ignored
    EXPECT_EQ(refusalOf(command), Refusal::kNone);
  }
}

TEST(ControlCommand, RefusesUnknownBits) {
  ControlCommand command;
  command.fields = 32768u | kFieldRoll;
  ASSERT_EQ(refusalOf(command), Refusal::kUnknownBits);
  EXPECT_NE(checkCommand(command)->text.find("0x8000"), std::string::npos);
}

TEST(ControlCommand, RefusesTwoThrottleKindsAndBadEngineCounts) {
  ControlCommand command;
  command.engine_count = 2;
  for (const std::uint32_t both : {8u | 16u, 8u | 32u, 16u | 32u, 8u | 16u | 32u}) {
    command.fields = both;
    EXPECT_EQ(refusalOf(command), Refusal::kThrottleConflict) << both;
  }
  for (const std::uint32_t field : {16u, 32u}) {
    command.fields = field;
    for (const int count : {0, 9, 255}) {
      command.engine_count = count;
      EXPECT_EQ(refusalOf(command), Refusal::kEngineCount) << count;
    }
    command.engine_count = 8;
    EXPECT_EQ(refusalOf(command), Refusal::kNone);
  }
}

TEST(ControlCommand, ChecksOnlyTheEnginesCounted) {
  ControlCommand command;
  command.fields = kFieldMotors;
  command.engine_count = 2;
  command.motors[2] = kNan;
  EXPECT_EQ(refusalOf(command), Refusal::kNone);
  command.engine_count = 3;
  ASSERT_EQ(refusalOf(command), Refusal::kNotFinite);
  EXPECT_EQ(checkCommand(command)->text.find("motors[2]"), 0u);
}

TEST(ControlCommand, OneThrottleBecomesALeverForEachEngine) {
  ControlCommand command;
  command.fields = kFieldThrottle | kFieldYaw;
  command.throttle = 0.6;
  command.yaw = -0.25;
  const ExpandedCommand out = expand(command, 2);
  EXPECT_EQ(out.commanded.count(), 3u);
  EXPECT_DOUBLE_EQ(out.values[index(leverChannel(0))], 0.6);
  EXPECT_DOUBLE_EQ(out.values[index(leverChannel(1))], 0.6);
  EXPECT_FALSE(out.commanded.test(index(leverChannel(2))));
  EXPECT_DOUBLE_EQ(out.values[index(Channel::kYaw)], -0.25);
}

TEST(ControlCommand, EngineArraysGoToTheirOwnEngines) {
  ControlCommand command;
  command.engine_count = 3;
  command.engine_throttles = {0.1, 0.2, 0.3, 0.4};
  command.motors = {0.5, 0.6, 0.7, 0.8};
  command.fields = kFieldEngineThrottles;
  ExpandedCommand out = expand(command, 2);  // the aircraft's own count serves only the single lever
  EXPECT_EQ(out.commanded.count(), 3u);
  EXPECT_DOUBLE_EQ(out.values[index(leverChannel(2))], 0.3);
  command.fields = kFieldMotors;
  out = expand(command, 2);
  EXPECT_EQ(out.commanded.count(), 3u);
  EXPECT_DOUBLE_EQ(out.values[index(motorChannel(1))], 0.6);
}

TEST(ControlCommand, ToeBrakesAreTwoChannelsOfOneField) {
  ControlCommand command;
  command.fields = kFieldToeBrakes;
  command.left_brake = 0.3;
  command.right_brake = 0.8;
  const ExpandedCommand out = expand(command, 1);
  EXPECT_EQ(out.commanded.count(), 2u);
  EXPECT_DOUBLE_EQ(out.values[index(Channel::kLeftBrake)], 0.3);
  EXPECT_DOUBLE_EQ(out.values[index(Channel::kRightBrake)], 0.8);
}

}  // namespace
}  // namespace xplane_bridge::core
