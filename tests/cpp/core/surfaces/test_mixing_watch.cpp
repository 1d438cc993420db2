#include "xplane_bridge/core/surfaces/mixing_watch.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace xplane_bridge::core {
namespace {

std::size_t numberOf(const char* name) { return surfaceNumber(name).value(); }
const std::size_t kAileron = numberOf("aileron1_wing2_left");
const std::size_t kElevator = numberOf("elevator1_left");
const std::size_t kRudder = numberOf("rudder1_fin1");
constexpr double kFrame = 1.0 / 64.0;  // [s] exact in binary

// Ailerons 20 deg a unit, elevators -16 deg and -8 deg of trim, rudder 24 deg; `faulty` is added to the aileron.
SurfaceSample sampleOf(double time, const MixingInputs& inputs, double faulty = 0.0) {
  SurfaceSample out;
  out.sim_time = time;
  out.inputs = inputs;
  out.deflections_deg.assign(surfaceTable().size(), 0.0);
  out.deflections_deg[kAileron] = 20.0 * inputs.roll + faulty;
  out.deflections_deg[kElevator] = -16.0 * inputs.pitch - 8.0 * inputs.trim_pitch;
  out.deflections_deg[kRudder] = 24.0 * inputs.yaw;
  return out;
}

// 30 s of each axis by itself.
MixingInputs stickAt(double time) {
  MixingInputs in;
  in.roll = 0.4 * std::sin(1.3 * time);
  in.pitch = 0.4 * std::sin(0.83 * time + 1.0);
  in.yaw = 0.4 * std::sin(1.9 * time + 2.0);
  return in;
}

double fly(MixingWatch* watch, double from, double seconds, double faulty = 0.0, double trim = 0.0) {
  double time = from;
  for (; time < from + seconds; time += kFrame) {
    MixingInputs in = stickAt(time);
    in.trim_pitch = trim;
    watch->add(sampleOf(time, in, faulty));
  }
  return time;
}

double hold(MixingWatch* watch, double from, double seconds, double faulty = 0.0, double trim = 0.0) {
  double time = from;
  MixingInputs in;
  in.trim_pitch = trim;
  for (; time < from + seconds; time += kFrame) watch->add(sampleOf(time, in, faulty));
  return time;
}

TEST(MixingWatch, LearnsAtTenSamplesASecondAndThenAllowsDriving) {
  MixingWatch watch;
  watch.reset("TEST");
  EXPECT_NE(watch.refusal().find("move the stick"), std::string::npos);
  double time = fly(&watch, 0.0, 10.0);
  EXPECT_GT(watch.samples(), 80u);
  EXPECT_LE(watch.samples(), 100u);
  EXPECT_FALSE(watch.solve()) << "200 samples are needed";
  EXPECT_NE(watch.refusal().find("more time"), std::string::npos);
  time = fly(&watch, time, 20.0);
  ASSERT_TRUE(watch.solve()) << watch.quality().text();
  ASSERT_NE(watch.model(), nullptr);
  EXPECT_EQ(watch.model()->aircraft, "TEST");
  EXPECT_NEAR(watch.model()->lawOf(kAileron)->slopes[static_cast<Eigen::Index>(MixingTerm::kRollPlus)], 20.0, 1e-3);
  EXPECT_NE(watch.refusal(), "") << "it has to be seen to hold first";
  fly(&watch, time, 2.0);
  EXPECT_EQ(watch.refusal(), "");
  EXPECT_FALSE(watch.solve()) << "nothing new to be kept";
  watch.reset("OTHER");
  EXPECT_EQ(watch.model(), nullptr);
  EXPECT_EQ(watch.samples(), 0u);
}

TEST(MixingWatch, SurfaceThatXPlaneDoesNotShowIsNamed) {
  MixingWatch watch;
  const double time = fly(&watch, 0.0, 30.0);
  ASSERT_TRUE(watch.solve()) << watch.quality().text();
  SurfaceSample sample;
  for (double at = time; at < time + 2.0; at += kFrame) {
    sample = sampleOf(at, {});
    sample.deflections_deg[kRudder] = std::nan("");
    watch.add(sample);
  }
  EXPECT_EQ(watch.refusal(), "X-Plane does not show rudder1_fin1, which the mixing has");
}

TEST(MixingWatch, StickFasterThanSurfacesSaysNothing) {
  MixingWatch watch;
  double time = hold(&watch, 0.0, 1.0);
  const std::size_t before = watch.samples();
  for (int i = 0; i < 64; ++i, time += kFrame) {  // full stick to and fro, four times a second
    MixingInputs in;
    in.roll = i / 8 % 2 == 0 ? 1.0 : -1.0;
    watch.add(sampleOf(time, in));
  }
  EXPECT_LE(watch.samples(), before + 1);
  hold(&watch, time, 1.0);
  EXPECT_GT(watch.samples(), before + 2) << "and again once it is quiet";
}

TEST(MixingWatch, AStickCommandedInStepsIsNotFast) {
  MixingWatch watch;
  double time = hold(&watch, 0.0, 1.0);
  const std::size_t before = watch.samples();
  for (int i = 0; i < 128; ++i, time += kFrame) {  // 1/s, in steps of two frames
    MixingInputs in;
    in.roll = (i / 2 * 2) * kFrame;
    watch.add(sampleOf(time, in));
  }
  EXPECT_GT(watch.samples(), before + 15);
}

TEST(MixingWatch, PausedAndRestartedFramesAreNotSamples) {
  MixingWatch watch;
  hold(&watch, 5.0, 2.0);
  const std::size_t before = watch.samples();
  for (int i = 0; i < 100; ++i) watch.add(sampleOf(7.0, {}));
  EXPECT_LE(watch.samples(), before + 1);
  watch.add(sampleOf(0.1, {}));
  EXPECT_LE(watch.samples(), before + 1) << "the first after a jump is not believed to be quiet";
}

MixingModel knownModel() {
  MixingWatch watch;
  watch.reset("TEST");
  fly(&watch, 0.0, 30.0);
  EXPECT_TRUE(watch.solve());
  return *watch.model();
}

TEST(MixingWatch, AFileHasToBeSeenToHold) {
  MixingWatch watch;
  watch.reset("TEST");
  watch.adopt(knownModel());
  EXPECT_NE(watch.refusal().find("half a second"), std::string::npos);
  double time = hold(&watch, 0.0, 2.0);
  EXPECT_EQ(watch.refusal(), "");
  // Another aircraft under the same name: 3 deg more aileron.
  hold(&watch, time, 5.0, 3.0);
  EXPECT_NE(watch.refusal().find("aileron1_wing2_left stands 3.0 deg off"), std::string::npos) << watch.refusal();
  EXPECT_EQ(watch.bias()[kAileron], 0.0) << "no term explains that";
}

TEST(MixingWatch, ATrimThatTheLawDoesNotKnowBecomesABias) {
  MixingWatch watch;
  watch.reset("TEST");
  watch.adopt(knownModel());
  const double time = hold(&watch, 0.0, 2.0);
  hold(&watch, time, 10.0, 0.0, 0.5);
  EXPECT_EQ(watch.refusal(), "") << "that is no contradiction";
  EXPECT_NEAR(watch.bias()[kElevator], -4.0, 0.05);
  EXPECT_NEAR(watch.bias()[kAileron], 0.0, 1e-6);
  watch.interrupt();
  EXPECT_NEAR(watch.bias()[kElevator], -4.0, 0.05) << "driving the surfaces does not change that";
  watch.recheck();
  EXPECT_NE(watch.refusal(), "");
}

TEST(MixingWatch, ANewIdentificationDoesNotForgetTerms) {
  MixingModel old = knownModel();
  old.known[static_cast<std::size_t>(MixingTerm::kTrimPitch)] = true;
  MixingWatch watch;
  watch.reset("TEST");
  watch.adopt(old);
  fly(&watch, 0.0, 30.0);
  EXPECT_FALSE(watch.solve()) << "the file knows the trim, this flight does not";
  EXPECT_TRUE(watch.quality().good);
}

}  // namespace
}  // namespace xplane_bridge::core
