#include "xplane_bridge/core/surfaces/surface_watch.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace xplane_bridge::core {
namespace {

const double kNan = std::nan("");

std::size_t indexOf(const std::vector<std::string>& names, const std::string& name) {
  const auto it = std::find(names.begin(), names.end(), name);
  EXPECT_NE(it, names.end()) << name;
  return static_cast<std::size_t>(it - names.begin());
}

TEST(SurfaceWatch, SamplesAreWhatIsSubscribed) {
  const auto names = surfaceWatchDatarefs(kXPlane11);
  std::vector<float> values(names.size(), 0.0f);
  const auto set = [&](const std::string& name, float value) { values[indexOf(names, name)] = value; };
  set("sim/time/total_running_time_sec", 12.5f);
  set("sim/operation/override/override_control_surfaces", 1.0f);
  set("sim/flightmodel/position/alpha", 3.0f);
  set("sim/joystick/yoke_pitch_ratio", -0.25f);
  set("sim/cockpit2/controls/total_heading_ratio", 0.5f);
  set("sim/cockpit2/controls/flap_ratio", 0.75f);
  set("sim/flightmodel/controls/wing2l_ail1def", 7.0f);
  SurfaceSample sample;
  ASSERT_TRUE(surfaceSampleFrom(values, &sample));
  EXPECT_EQ(sample.sim_time, 12.5);
  EXPECT_EQ(sample.override_shown, 1.0);
  EXPECT_EQ(sample.alpha_deg, 3.0);
  EXPECT_EQ(sample.stick[1], -0.25);
  EXPECT_EQ(sample.inputs.yaw, 0.5);
  EXPECT_EQ(sample.flap_handle, 0.75);
  EXPECT_EQ(sample.deflections_deg[surfaceNumber("aileron1_wing2_left").value()], 7.0);
  values.pop_back();
  EXPECT_FALSE(surfaceSampleFrom(values, &sample));
  EXPECT_NO_FATAL_FAILURE(indexOf(surfaceWatchDatarefs(kXPlane12), "sim/cockpit2/controls/flap_handle_request_ratio"));
}

SurfaceSample frame(double stick, double total, double flap_handle = 0.0, double flap = 0.0) {
  SurfaceSample out;
  out.stick = {stick, 0.0, 0.0};
  out.inputs.roll = total;
  out.flap_handle = flap_handle;
  out.speedbrake_handle = 0.0;
  out.inputs.flap1 = out.inputs.flap2 = flap;
  return out;
}

const std::array<double, 3> kNoCommands = {kNan, kNan, kNan};

TEST(DrivenInputs, OwnCommandsActAtOnceOnTopOfWhatXPlaneAdds) {
  DrivenInputs inputs;
  inputs.begin(frame(0.25, 0.375));  // trim or stability augmentation: 0.125
  EXPECT_DOUBLE_EQ(inputs.step(frame(0.25, 0.375), kNoCommands, 0.02).roll, 0.375);
  EXPECT_DOUBLE_EQ(inputs.step(frame(0.25, 0.375), {0.5, kNan, kNan}, 0.02).roll, 0.625);
  EXPECT_DOUBLE_EQ(inputs.step(frame(0.25, 0.375), {1.0, kNan, kNan}, 0.02).roll, 1.0) << "no more than full stick";
}

TEST(DrivenInputs, ATotalThatStandsStillIsReplacedByTheStick) {
  DrivenInputs inputs;
  inputs.begin(frame(0.0, 0.125));
  double roll = 0.0;
  for (int i = 0; i < 20; ++i) roll = inputs.step(frame(0.5, 0.125), kNoCommands, 0.02).roll;
  EXPECT_DOUBLE_EQ(roll, 0.625);
  // One that follows late is believed again.
  roll = inputs.step(frame(0.5, 0.6), kNoCommands, 0.02).roll;
  EXPECT_DOUBLE_EQ(roll, 0.6);
}

TEST(DrivenInputs, FlapsRunToTheirHandleOnceItIsMoved) {
  DrivenInputs inputs(0.5);
  inputs.begin(frame(0.0, 0.0, 0.25, 0.2));  // it stands, but not where its handle does
  EXPECT_DOUBLE_EQ(inputs.step(frame(0, 0, 0.25, 0.2), kNoCommands, 1.0).flap1, 0.2) << "they stay where they are";
  EXPECT_DOUBLE_EQ(inputs.step(frame(0, 0, 1.0, 0.2), kNoCommands, 1.0).flap1, 0.7);
  EXPECT_DOUBLE_EQ(inputs.step(frame(0, 0, 1.0, 0.2), kNoCommands, 1.0).flap1, 1.0);
  const MixingInputs up = inputs.step(frame(0, 0, 0.0, 0.2), kNoCommands, 1.0);
  EXPECT_DOUBLE_EQ(up.flap1, 0.5);
  EXPECT_DOUBLE_EQ(up.flap2, 0.5);
}

TEST(DrivenInputs, FlapsAndSpeedBrakesThatWereUnderWayRunOnToTheirHandles) {
  const auto shown = [](double time, double flap, double brake) {
    SurfaceSample out = frame(0.0, 0.0, 1.0, flap);
    out.inputs.flap2 = 0.0;  // the aircraft has none
    out.inputs.speedbrake = brake;
    out.speedbrake_handle = 0.5;
    out.sim_time = time;
    return out;
  };
  DrivenInputs inputs(0.5, 0.25);
  for (const SurfaceSample& sample : {shown(10.0, 0.199, 0.2), shown(10.005, 0.2, 0.2)}) inputs.watch(sample);
  inputs.watch(shown(10.005, 0.2, 0.2));  // the same frame once more
  inputs.begin(shown(10.005, 0.2, 0.2));
  const MixingInputs out = inputs.step(shown(10.01, 0.2, 0.2), kNoCommands, 1.0);
  EXPECT_DOUBLE_EQ(out.flap1, 0.7);
  EXPECT_DOUBLE_EQ(out.speedbrake, 0.2) << "it stood";
  // The next time the speed brake is under way, and X-Plane has been restarted.
  for (const SurfaceSample& sample : {shown(1.0, 0.2, 0.2), shown(1.005, 0.2, 0.205)}) inputs.watch(sample);
  inputs.begin(shown(1.005, 0.2, 0.205));
  const MixingInputs then = inputs.step(shown(1.01, 0.2, 0.205), kNoCommands, 1.0);
  EXPECT_DOUBLE_EQ(then.flap1, 0.2);
  EXPECT_DOUBLE_EQ(then.speedbrake, 0.455);
}

TEST(DrivenInputs, AHandleThatIsNotReceivedForAFrameStopsNothing) {
  DrivenInputs inputs(0.5);
  inputs.begin(frame(0.0, 0.0, kNan, 0.2));
  EXPECT_DOUBLE_EQ(inputs.step(frame(0, 0, 0.25, 0.2), kNoCommands, 1.0).flap1, 0.2)
      << "where it is when it is first received";
  EXPECT_DOUBLE_EQ(inputs.step(frame(0, 0, 1.0, 0.2), kNoCommands, 1.0).flap1, 0.7);
  EXPECT_DOUBLE_EQ(inputs.step(frame(0, 0, kNan, 0.2), kNoCommands, 1.0).flap1, 0.7);
  EXPECT_DOUBLE_EQ(inputs.step(frame(0, 0, 1.0, 0.2), kNoCommands, 1.0).flap1, 1.0);
}

}  // namespace
}  // namespace xplane_bridge::core
