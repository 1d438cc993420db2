#include "xplane_bridge/core/control/control_channels.hpp"

#include <gtest/gtest.h>

#include <map>

namespace xplane_bridge::core {
namespace {

constexpr EncoderOptions kXp11{kXPlane11, false};
constexpr EncoderOptions kXp12{kXPlane12, false};

ChannelSet setOf(std::initializer_list<Channel> channels) {
  ChannelSet set;
  for (const Channel c : channels) set.set(index(c));
  return set;
}

TEST(ControlChannels, WritesTheDatarefsOfTheReference) {
  // docs/protocol.md 5.1, X-Plane 11 column.
  const std::map<Channel, std::string> expected = {
      {Channel::kRoll, "sim/joystick/yoke_roll_ratio"},
      {Channel::kPitch, "sim/joystick/yoke_pitch_ratio"},
      {Channel::kYaw, "sim/joystick/yoke_heading_ratio"},
      {leverChannel(0), "sim/cockpit2/engine/actuators/throttle_ratio[0]"},
      {leverChannel(7), "sim/cockpit2/engine/actuators/throttle_ratio[7]"},
      {motorChannel(0), "sim/flightmodel/engine/ENGN_thro_use[0]"},
      {motorChannel(3), "sim/flightmodel/engine/ENGN_thro_use[3]"},
      {Channel::kTrimRoll, "sim/cockpit2/controls/aileron_trim"},
      {Channel::kTrimPitch, "sim/cockpit2/controls/elevator_trim"},
      {Channel::kTrimYaw, "sim/cockpit2/controls/rudder_trim"},
      {Channel::kFlaps, "sim/cockpit2/controls/flap_ratio"},
      {Channel::kSpeedbrake, "sim/cockpit2/controls/speedbrake_ratio"},
      {Channel::kGear, "sim/cockpit2/controls/gear_handle_down"},
      {Channel::kParkingBrake, "sim/cockpit2/controls/parking_brake_ratio"},
      {Channel::kLeftBrake, "sim/cockpit2/controls/left_brake_ratio"},
      {Channel::kRightBrake, "sim/cockpit2/controls/right_brake_ratio"},
      {Channel::kThrustVector, "sim/cockpit2/controls/thrust_vector_ratio"},
  };
  for (const auto& [channel, dataref] : expected) EXPECT_EQ(writeDataref(channel, kXp11), dataref);
  for (const auto& [channel, dataref] : expected) {
    EXPECT_EQ(writeDataref(channel, kXp12),
              channel == Channel::kFlaps ? "sim/cockpit2/controls/flap_handle_request_ratio" : dataref);
  }
  EXPECT_EQ(writeDataref(leverChannel(1), {kXPlane11, true}),
            "sim/cockpit2/engine/actuators/throttle_jet_rev_ratio[1]");
}

TEST(ControlChannels, NeedsTheOverridesOfTheReferenceEachOnce) {
  EXPECT_EQ(requiredOverrides(setOf({Channel::kRoll, Channel::kPitch, Channel::kYaw}), kXp11),
            (std::vector<std::string>{"sim/operation/override/override_joystick_roll",
                                      "sim/operation/override/override_joystick_pitch",
                                      "sim/operation/override/override_joystick_heading"}));
  EXPECT_EQ(requiredOverrides(setOf({Channel::kYaw}), kXp12),
            std::vector<std::string>{"sim/operation/override/override_joystick_heading"})
      << "and nothing that stops another axis";
  EXPECT_EQ(requiredOverrides(setOf({leverChannel(0), Channel::kFlaps, Channel::kGear, Channel::kThrustVector}), kXp11),
            std::vector<std::string>{});
  EXPECT_EQ(
      requiredOverrides(setOf({motorChannel(0), motorChannel(1), Channel::kLeftBrake, Channel::kRightBrake}), kXp12),
      (std::vector<std::string>{"sim/operation/override/override_throttles",
                                "sim/operation/override/override_toe_brakes"}));
}

TEST(ControlChannels, ReleasesOnlyWhatABridgeCanHaveTaken) {
  const auto override_release = releaseOf("sim/operation/override/override_joystick");
  ASSERT_TRUE(override_release);
  EXPECT_EQ(override_release->value, 0.0f);
  const auto throttle_release = releaseOf("sim/flightmodel/engine/ENGN_thro_override[0]");
  ASSERT_TRUE(throttle_release);
  EXPECT_EQ(throttle_release->dataref, "sim/flightmodel/engine/ENGN_thro_override[0]");
  EXPECT_EQ(throttle_release->value, -2.0f);
  EXPECT_FALSE(releaseOf("sim/time/sim_speed"));
  EXPECT_FALSE(releaseOf("xsim/operation/override/override_joystick"));
}

TEST(ControlChannels, EncodesCommandedChannelsInOrder) {
  ChannelValues values{};
  values[index(Channel::kPitch)] = -0.5;
  values[index(leverChannel(1))] = 0.75;
  values[index(Channel::kGear)] = 0.49;
  values[index(Channel::kFlaps)] = 1.0;  // not commanded
  std::vector<DatarefWrite> writes;
  ControlEncoder(kXp11).encode(values, setOf({Channel::kGear, Channel::kPitch, leverChannel(1)}), writes);
  ASSERT_EQ(writes.size(), 3u);
  EXPECT_EQ(writes[0].dataref, "sim/joystick/yoke_pitch_ratio");
  EXPECT_EQ(writes[0].value, -0.5f);
  EXPECT_EQ(writes[1].dataref, "sim/cockpit2/engine/actuators/throttle_ratio[1]");
  EXPECT_EQ(writes[1].value, 0.75f);
  EXPECT_EQ(writes[2].dataref, "sim/cockpit2/controls/gear_handle_down");
  EXPECT_EQ(writes[2].value, 0.0f);
  EXPECT_EQ(wireValue(Channel::kGear, 0.5), 1.0f);
}

TEST(ControlChannels, HandlesAreSentOnChangeAndOverriddenChannelsContinuously) {
  for (const Channel c : {Channel::kFlaps, Channel::kGear, Channel::kTrimPitch, Channel::kThrustVector}) {
    EXPECT_EQ(channelWire(c, kXp11).refresh, Refresh::kOnChange) << channelName(c);
  }
  for (const Channel c : {Channel::kRoll, leverChannel(3), motorChannel(3), Channel::kLeftBrake}) {
    EXPECT_EQ(channelWire(c, kXp11).refresh, Refresh::kContinuous) << channelName(c);
  }
}

TEST(ControlChannels, ReadBackAllowsForFloat32AndDetents) {
  const ControlEncoder encoder(kXp11);
  EXPECT_TRUE(encoder.matches(Channel::kRoll, 0.1, static_cast<double>(0.1f)));
  EXPECT_FALSE(encoder.matches(Channel::kRoll, 0.1, 0.1001));
  EXPECT_TRUE(encoder.matches(Channel::kFlaps, 0.33, 0.3333));
  EXPECT_FALSE(encoder.matches(Channel::kFlaps, 0.33, 0.5));
  EXPECT_TRUE(encoder.matches(Channel::kGear, 0.7, 1.0));
}

}  // namespace
}  // namespace xplane_bridge::core
