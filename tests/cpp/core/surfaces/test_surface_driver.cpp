#include "xplane_bridge/core/surfaces/surface_driver.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace xplane_bridge::core {
namespace {

std::size_t numberOf(const char* name) { return surfaceNumber(name).value(); }
const std::size_t kLeft = numberOf("aileron1_wing2_left");
const std::size_t kRight = numberOf("aileron1_wing2_right");
const std::size_t kRudder = numberOf("rudder1_fin1");
const std::size_t kFlap = numberOf("flap1_wing1_left");

// Ailerons: 15 deg per unit roll down, 20 up, opposite on the right; rudder 22 deg a unit; neutral 1 deg on the left.
MixingModel model() {
  MixingModel m;
  const auto law = [&m](std::size_t surface, double bias, MixingTerm plus, double k_plus, double k_minus, double low,
                        double high) {
    SurfaceLaw l;
    l.surface = surface;
    l.slopes[0] = bias;
    l.slopes[static_cast<Eigen::Index>(plus)] = k_plus;
    l.slopes[static_cast<Eigen::Index>(plus) + 1] = k_minus;
    l.low_deg = low;
    l.high_deg = high;
    m.laws.push_back(l);
  };
  law(kLeft, 1.0, MixingTerm::kRollPlus, 15.0, 20.0, -19.0, 16.0);
  law(kRight, 0.0, MixingTerm::kRollPlus, -20.0, -15.0, -20.0, 15.0);
  law(kRudder, 0.0, MixingTerm::kYawPlus, 22.0, 22.0, -22.0, 22.0);
  return m;
}

std::vector<double> shown(std::vector<SurfaceDeflection> values = {}) {
  std::vector<double> out(surfaceTable().size(), 0.0);
  for (const auto& v : values) out[v.surface] = v.deflection_deg;
  return out;
}

double sent(const std::vector<SurfaceDeflection>& out, std::size_t surface) {
  for (const auto& s : out) {
    if (s.surface == surface) return s.deflection_deg;
  }
  return std::nan("");
}

MixingInputs stick(double roll, double yaw = 0.0) {
  MixingInputs in;
  in.roll = roll;
  in.yaw = yaw;
  return in;
}

constexpr double kLong = 10.0;  // [s] a step in which every surface arrives

TEST(SurfaceDriver, TakesOverWithoutAJumpAndFollowsTheLawAtItsRate) {
  SurfaceDriver driver(model());
  driver.engage(shown({{kLeft, 3.0}, {kFlap, 12.5}}));
  ASSERT_TRUE(driver.engaged());
  auto out = driver.step(stick(0.5), {}, 0.0);
  EXPECT_DOUBLE_EQ(sent(out, kLeft), 3.0) << "the snapshot comes first";
  EXPECT_DOUBLE_EQ(sent(out, kFlap), 12.5) << "what the law does not know stays where it was";
  EXPECT_EQ(out.size(), 4u);
  out = driver.step(stick(0.5), {}, 0.05);  // 60 deg/s: 3 deg on the way to 1 + 7.5 = 8.5
  EXPECT_NEAR(sent(out, kLeft), 6.0, 1e-9);
  EXPECT_NEAR(sent(out, kRight), -3.0, 1e-9);
  out = driver.step(stick(0.5), {}, kLong);
  EXPECT_NEAR(sent(out, kLeft), 8.5, 1e-9);
  EXPECT_NEAR(sent(out, kRight), -10.0, 1e-9);
  EXPECT_DOUBLE_EQ(sent(out, kFlap), 12.5);
}

TEST(SurfaceDriver, ABiasIsAddedToTheLawAndToItsNeutral) {
  SurfaceDriver driver(model());
  std::vector<double> bias(surfaceTable().size(), 0.0);
  bias[kLeft] = 2.0;
  driver.engage(shown({{kLeft, 3.0}}), bias);
  EXPECT_NEAR(sent(driver.step(stick(0.5), {}, kLong), kLeft), 10.5, 1e-9);  // 1 + 7.5 + 2
  driver.setFailures({{kLeft, SurfaceFault::kCentred, {}}});
  EXPECT_NEAR(sent(driver.step(stick(0.5), {}, kLong), kLeft), 3.0, 1e-9);
}

TEST(SurfaceDriver, RefusesToTakeOverFromAnUnknownDeflection) {
  SurfaceDriver driver(model());
  auto unknown = shown();
  unknown[kRudder] = std::nan("");
  EXPECT_THROW(driver.engage(unknown), std::invalid_argument);
  EXPECT_FALSE(driver.engaged());
  EXPECT_THROW(SurfaceDriver(model(), {0.0, 0.3, 0.2}), std::invalid_argument);
}

TEST(SurfaceDriver, OneStuckAtAnAngleTheOthersFly) {
  SurfaceDriver driver(model());
  driver.engage(shown());
  driver.setFailures({{kLeft, SurfaceFault::kStuck, 5.0}});
  auto out = driver.step(stick(-1.0, 0.5), {}, kLong);
  EXPECT_DOUBLE_EQ(sent(out, kLeft), 5.0);
  EXPECT_DOUBLE_EQ(sent(out, kRight), 15.0);
  EXPECT_DOUBLE_EQ(sent(out, kRudder), 11.0);
  driver.setFailures({});
  out = driver.step(stick(-1.0), {}, kLong);
  EXPECT_DOUBLE_EQ(sent(out, kLeft), -19.0) << "repaired";
}

TEST(SurfaceDriver, StuckWhereItIsStaysThereWhateverIsAddedLater) {
  SurfaceDriver driver(model());
  driver.engage(shown());
  driver.step(stick(0.2), {}, kLong);  // left at 1 + 3 = 4
  driver.setFailures({{kLeft, SurfaceFault::kStuck, std::nullopt}});
  EXPECT_NEAR(sent(driver.step(stick(-1.0), {}, kLong), kLeft), 4.0, 1e-9);
  driver.setFailures({{kLeft, SurfaceFault::kStuck, std::nullopt}, {kRudder, SurfaceFault::kCentred, std::nullopt}});
  EXPECT_NEAR(sent(driver.step(stick(-1.0), {}, kLong), kLeft), 4.0, 1e-9);
}

TEST(SurfaceDriver, EveryFaultDoesWhatItsNameSays) {
  const auto settled = [](SurfaceFault fault, std::optional<double> value, std::size_t surface = kLeft) {
    SurfaceDriver driver(model());
    driver.engage(shown());
    driver.setFailures({{surface, fault, value}});
    return sent(driver.step(stick(1.0, 1.0), {8.0, -4.0}, kLong), surface);
  };
  EXPECT_DOUBLE_EQ(settled(SurfaceFault::kHardOverUp, std::nullopt), -19.0);
  EXPECT_DOUBLE_EQ(settled(SurfaceFault::kHardOverDown, std::nullopt), 16.0);
  EXPECT_DOUBLE_EQ(settled(SurfaceFault::kCentred, std::nullopt), 1.0);
  EXPECT_NEAR(settled(SurfaceFault::kReduced, 0.4), 1.0 + 0.4 * 15.0, 1e-9);
  EXPECT_NEAR(settled(SurfaceFault::kFloating, std::nullopt), -0.3 * 8.0, 1e-9);
  EXPECT_NEAR(settled(SurfaceFault::kFloating, std::nullopt, kRudder), 1.2, 1e-9) << "flow from the left";
  SurfaceDriver slow(model());
  slow.engage(shown());
  slow.setFailures({{kLeft, SurfaceFault::kSlow, 2.0}});
  EXPECT_NEAR(sent(slow.step(stick(1.0), {}, 0.5), kLeft), 1.0, 1e-9);
  EXPECT_NEAR(sent(slow.step(stick(1.0), {}, 0.5), kRight), -20.0, 1e-9) << "a healthy one is fast";
}

TEST(SurfaceDriver, ASpoilerAndASpeedBrakeAreUpWhereTheyAreOpen) {
  for (const char* name : {"spoiler1_wing1_left", "speedbrake1_wing1_left"}) {
    SCOPED_TRACE(name);
    const auto settled = [name](SurfaceFault fault) {
      MixingModel m;
      SurfaceLaw law;
      law.surface = numberOf(name);
      law.slopes[static_cast<Eigen::Index>(MixingTerm::kSpeedbrake)] = 60.0;
      law.high_deg = 60.0;
      m.laws.push_back(law);
      SurfaceDriver driver(m);
      driver.engage(shown({{law.surface, 30.0}}));
      driver.setFailures({{law.surface, fault, std::nullopt}});
      MixingInputs half;
      half.speedbrake = 0.5;
      return sent(driver.step(half, {8.0, 0.0}, kLong), law.surface);
    };
    EXPECT_DOUBLE_EQ(settled(SurfaceFault::kHardOverUp), 60.0);
    EXPECT_DOUBLE_EQ(settled(SurfaceFault::kHardOverDown), 0.0);
    EXPECT_NEAR(settled(SurfaceFault::kFloating), 0.3 * 8.0, 1e-9) << "flow from below lifts it";
  }
}

TEST(SurfaceDriver, FloatingSurfaceLagsByItsTimeConstant) {
  SurfaceDriver driver(model());
  driver.engage(shown());
  driver.setFailures({{kLeft, SurfaceFault::kFloating, std::nullopt}});
  // After one time constant: 1 - 1/e = 0.632 of -3 deg.
  EXPECT_NEAR(sent(driver.step(stick(1.0), {10.0, 0.0}, 0.2), kLeft), -3.0 * 0.6321, 1e-3);
}

TEST(SurfaceDriver, LawNeverLeavesTheTravelButACommandMay) {
  SurfaceDriver driver(model());
  driver.engage(shown());
  EXPECT_DOUBLE_EQ(sent(driver.step(stick(1.5), {}, kLong), kLeft), 16.0);
  driver.setCommands({{kLeft, 30.0}});
  EXPECT_DOUBLE_EQ(sent(driver.step(stick(0.0), {}, kLong), kLeft), 30.0);
  driver.setFailures({{kLeft, SurfaceFault::kStuck, -2.0}});
  EXPECT_DOUBLE_EQ(sent(driver.step(stick(0.0), {}, kLong), kLeft), -2.0) << "broken is stronger";
  driver.setFailures({});
  driver.setCommands({});
  EXPECT_DOUBLE_EQ(sent(driver.step(stick(0.0), {}, kLong), kLeft), 1.0);
}

TEST(SurfaceDriver, CommandToASurfaceTheLawDoesNotKnowStartsFromZero) {
  SurfaceDriver driver(model());
  driver.engage(shown());
  driver.setCommands({{kFlap, 6.0}});
  EXPECT_NEAR(sent(driver.step({}, {}, 0.05), kFlap), 3.0, 1e-9);
  driver.setCommands({});
  EXPECT_NEAR(sent(driver.step({}, {}, kLong), kFlap), 0.0, 1e-9);
}

TEST(SurfaceDriver, OffsetIsAddedToAHealthySurfaceOnly) {
  SurfaceDriver driver(model());
  driver.engage(shown());
  driver.setOffset(kRudder, 4.0);
  EXPECT_DOUBLE_EQ(sent(driver.step(stick(0.0, 0.5), {}, kLong), kRudder), 15.0);
  driver.setFailures({{kRudder, SurfaceFault::kStuck, 0.0}});
  EXPECT_DOUBLE_EQ(sent(driver.step(stick(0.0, 0.5), {}, kLong), kRudder), 0.0);
  driver.setFailures({});
  driver.setOffset(kRudder, 0.0);
  EXPECT_DOUBLE_EQ(sent(driver.step(stick(0.0, 0.5), {}, kLong), kRudder), 11.0);
}

TEST(SurfaceDriver, AnOffsetDoesNotLeaveTheTravel) {
  SurfaceDriver driver(model());
  driver.engage(shown());
  driver.setOffset(kLeft, 50.0);
  EXPECT_DOUBLE_EQ(sent(driver.step(stick(0.0), {}, kLong), kLeft), 16.0);
  driver.setCommands({{kLeft, 30.0}});  // that may
  EXPECT_DOUBLE_EQ(sent(driver.step(stick(0.0), {}, kLong), kLeft), 30.0);
}

TEST(SurfaceDriver, StuckWhereItIsAfterStuckAtAnAngleStops) {
  SurfaceDriver driver(model());
  driver.engage(shown());
  driver.setFailures({{kLeft, SurfaceFault::kStuck, 13.0}});
  const double on_its_way = sent(driver.step(stick(0.0), {}, 0.05), kLeft);
  EXPECT_LT(on_its_way, 12.0);
  driver.setFailures({{kLeft, SurfaceFault::kStuck, std::nullopt}});
  EXPECT_DOUBLE_EQ(sent(driver.step(stick(0.0), {}, kLong), kLeft), on_its_way);
}

TEST(SurfaceDriver, UnknownInputsHoldTheSurface) {
  SurfaceDriver driver(model());
  driver.engage(shown());
  driver.step(stick(1.0), {}, kLong);
  EXPECT_DOUBLE_EQ(sent(driver.step(stick(std::nan("")), {}, kLong), kLeft), 16.0);
}

TEST(SurfaceDriver, FailureValuesAreChecked) {
  EXPECT_FALSE(validate(SurfaceFailure{kLeft, SurfaceFault::kStuck, std::nullopt}));
  EXPECT_TRUE(validate(SurfaceFailure{kLeft, SurfaceFault::kStuck, 91.0}));
  EXPECT_TRUE(validate(SurfaceFailure{kLeft, SurfaceFault::kStuck, std::nan("")}));
  EXPECT_TRUE(validate(SurfaceFailure{kLeft, SurfaceFault::kReduced, std::nullopt}));
  EXPECT_TRUE(validate(SurfaceFailure{kLeft, SurfaceFault::kReduced, 1.1}));
  EXPECT_TRUE(validate(SurfaceFailure{kLeft, SurfaceFault::kSlow, 0.0}));
  EXPECT_EQ(surfaceFaultFrom("hard_over_down"), SurfaceFault::kHardOverDown);
  EXPECT_FALSE(surfaceFaultFrom("failed"));
  EXPECT_TRUE(validate(SurfaceFailure{kLeft, SurfaceFault::kGone, std::nullopt}));
  EXPECT_STREQ(toString(SurfaceFault::kReduced), "reduced");
}

}  // namespace
}  // namespace xplane_bridge::core
