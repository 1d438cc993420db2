#include "xplane_bridge/core/control/control_rows.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace xplane_bridge::core {
namespace {

constexpr float kNone = -999.0F;
using Slots = std::array<float, 8>;

EncoderOptions inRows() {
  EncoderOptions out;
  out.rows = true;
  return out;
}
ChannelSet setOf(std::initializer_list<Channel> channels) {
  ChannelSet out;
  for (const Channel channel : channels) out.set(index(channel));
  return out;
}
ChannelValues valuesOf(std::initializer_list<std::pair<Channel, double>> values) {
  ChannelValues out{};
  for (const auto& [channel, value] : values) out[index(channel)] = value;
  return out;
}

TEST(ControlRows, StickIsInTwoRowsAndAllElseStaysUntouched) {
  const ChannelSet stick = setOf({Channel::kRoll, Channel::kPitch});
  const auto rows = controlRows(valuesOf({{Channel::kRoll, 0.25}, {Channel::kPitch, -0.5}}), stick, stick, inRows());
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].index, 8);
  EXPECT_EQ(rows[0].values, (Slots{-0.5F, 0.25F, kNone, kNone, kNone, kNone, kNone, kNone}));
  EXPECT_EQ(rows[1].index, 11);
  EXPECT_EQ(rows[1].values, (Slots{-0.5F, 0.25F, kNone, kNone, kNone, kNone, kNone, kNone}));
}

TEST(ControlRows, TrimsFlapsSpeedBrakeAndLeversHaveTheirSlots) {
  const ChannelSet all = setOf({Channel::kTrimRoll, Channel::kTrimPitch, Channel::kTrimYaw, Channel::kFlaps,
                                Channel::kSpeedbrake, Channel::kYaw, leverChannel(0), leverChannel(7)});
  const auto rows = controlRows(valuesOf({{Channel::kTrimRoll, 0.1},
                                          {Channel::kTrimPitch, 0.2},
                                          {Channel::kTrimYaw, 0.3},
                                          {Channel::kFlaps, 0.5},
                                          {Channel::kSpeedbrake, 0.75},
                                          {Channel::kYaw, -1.0},
                                          {leverChannel(0), 0.6},
                                          {leverChannel(7), 0.9}}),
                                all, all, inRows());
  ASSERT_EQ(rows.size(), 4u);
  EXPECT_EQ(rows[0].values, (Slots{kNone, kNone, -1.0F, kNone, kNone, kNone, kNone, kNone}));
  EXPECT_EQ(rows[2].index, 13);
  EXPECT_EQ(rows[2].values, (Slots{0.2F, 0.1F, 0.3F, 0.5F, kNone, kNone, 0.75F, kNone}));
  EXPECT_EQ(rows[3].index, 25);
  EXPECT_EQ(rows[3].values, (Slots{0.6F, kNone, kNone, kNone, kNone, kNone, kNone, 0.9F}));
}

TEST(ControlRows, WhatIsNotToBeSentNowIsGivenBack) {
  const ChannelSet both = setOf({Channel::kFlaps, Channel::kTrimPitch});
  const auto rows = controlRows(valuesOf({{Channel::kFlaps, 0.5}, {Channel::kTrimPitch, 0.2}}), both,
                                setOf({Channel::kTrimPitch}), inRows());
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].values, (Slots{0.2F, kNone, kNone, kNone, kNone, kNone, kNone, kNone}));
}

TEST(ControlRows, CarryNothingElse) {
  const ChannelSet others = setOf({Channel::kGear, Channel::kLeftBrake, motorChannel(0), Channel::kThrustVector});
  EXPECT_TRUE(controlRows({}, others, others, inRows()).empty());
  const ChannelSet stick = setOf({Channel::kRoll});
  EXPECT_TRUE(controlRows({}, stick, stick, {}).empty()) << "datarefs are asked for";
  EncoderOptions reverse = inRows();
  reverse.reverse_thrust = true;
  EXPECT_TRUE(rowSlotsOf(leverChannel(0), reverse).empty());
}

TEST(ControlRows, EncoderLeavesTheirChannelsToThem) {
  const ChannelSet both = setOf({Channel::kRoll, Channel::kGear});
  std::vector<DatarefWrite> writes;
  ControlEncoder(inRows()).encode({}, both, writes);
  ASSERT_EQ(writes.size(), 1u);
  EXPECT_EQ(writes[0].dataref, "sim/cockpit2/controls/gear_handle_down");
  EXPECT_EQ(requiredOverrides(both, inRows()),
            (std::vector<std::string>{"sim/operation/override/override_joystick_roll", "DATA row 8", "DATA row 11"}));
}

TEST(ControlRows, HaveNames) {
  EXPECT_EQ(rowName(25), "DATA row 25");
  EXPECT_EQ(rowOfName("DATA row 25"), 25);
  EXPECT_FALSE(rowOfName("sim/operation/override/override_joystick_roll"));
}

}  // namespace
}  // namespace xplane_bridge::core
