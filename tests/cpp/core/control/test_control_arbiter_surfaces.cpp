#include "xplane_bridge/core/control/control_arbiter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "arbiter_commands.hpp"

namespace xplane_bridge::core {
namespace {

TEST(ControlArbiter, SurfacesFlyInTheirModeOnly) {
  ControlArbiter arbiter(direct(), 0.0);
  EXPECT_EQ(arbiter.refusalOfSurfaces(0.0), "control/surfaces flies in AUTO, and the mode is MANUAL");
  arbiter.onModeRequest(request(2, 1), 0.0);
  EXPECT_EQ(arbiter.refusalOfSurfaces(0.0), "");
  arbiter.onSurfaces(0.0);
  EXPECT_TRUE(arbiter.surfacesFly());
  arbiter.endSurfaces();
  EXPECT_FALSE(arbiter.surfacesFly());

  ArbiterOptions options = direct();
  options.surfaces_source = kManual;
  ControlArbiter other(options, 0.0);
  EXPECT_EQ(other.refusalOfSurfaces(0.0), "");
  other.onModeRequest(request(2, 1), 0.0);
  EXPECT_EQ(other.refusalOfSurfaces(0.0), "control/surfaces flies in MANUAL, and the mode is AUTO");
}

TEST(ControlArbiter, SurfacesHaveToBeRepeatedWhileXPlaneRuns) {
  ControlArbiter arbiter(direct(), 0.0);
  arbiter.onModeRequest(request(2, 1), 0.0);
  arbiter.onSurfaces(0.0);
  arbiter.step(0.49);
  EXPECT_TRUE(arbiter.surfacesFly());
  arbiter.setTimeRunning(false, 0.49);
  arbiter.step(10.0);
  EXPECT_TRUE(arbiter.surfacesFly()) << "paused";
  arbiter.setTimeRunning(true, 10.0);
  arbiter.step(10.9);
  EXPECT_TRUE(arbiter.surfacesFly()) << "a second of grace";
  arbiter.step(11.1);
  EXPECT_FALSE(arbiter.surfacesFly());
}

TEST(ControlArbiter, TheStickThatTakesOverEndsSurfacesAndSaysSo) {
  ControlArbiter arbiter(direct(), 0.0);
  arbiter.onCommand(kManual, stick(0.0), 0.0);
  arbiter.onModeRequest(request(2, 1), 0.0);
  arbiter.onSurfaces(0.1);
  arbiter.onCommand(kManual, stick(0.5), 0.2);
  EXPECT_EQ(arbiter.status().mode, kManual);
  EXPECT_FALSE(arbiter.surfacesFly());
  EXPECT_EQ(arbiter.status().reason,
            "stick take-over: roll moved by 0.50 since AUTO was engaged; control/surfaces ends");
  arbiter.onModeRequest(request(2, 2), 0.3);
  EXPECT_EQ(arbiter.status().reason, "request");
  EXPECT_FALSE(arbiter.surfacesFly()) << "until they are commanded again";
}

TEST(ControlArbiter, ARequestForTheOtherModeEndsSurfaces) {
  ControlArbiter arbiter(direct(), 0.0);
  arbiter.onModeRequest(request(2, 1), 0.0);
  arbiter.onSurfaces(0.1);
  arbiter.onModeRequest(request(1, 2), 0.2);
  EXPECT_EQ(arbiter.status().reason, "request; control/surfaces ends");
  EXPECT_FALSE(arbiter.surfacesFly());
}

TEST(ControlArbiter, AFailsafeEndsSurfacesUntilTheSourceIsBackOrTheModeIsAskedFor) {
  ControlArbiter arbiter(direct(), 0.0);
  arbiter.onModeRequest(request(2, 1), 0.0);
  arbiter.onCommand(kAuto, stick(0.4), 0.0);
  for (double t = 0.0; t < 0.45; t += 0.1) {
    arbiter.onSurfaces(t);
    arbiter.step(t);
  }
  EXPECT_TRUE(arbiter.surfacesFly());
  EXPECT_EQ(arbiter.step(0.51).source, CommandSource::kFailsafe);
  EXPECT_TRUE(arbiter.status().failsafe) << "control/auto flew with them, and is silent";
  EXPECT_FALSE(arbiter.surfacesFly());
  EXPECT_EQ(arbiter.status().reason, "timeout of control/auto; control/surfaces ends");
  EXPECT_EQ(arbiter.refusalOfSurfaces(0.6),
            "control/auto is silent and the failsafe acts: it must be back, or AUTO asked for again");
  arbiter.onCommand(kAuto, stick(0.4), 0.7);
  arbiter.step(0.7);
  EXPECT_EQ(arbiter.refusalOfSurfaces(0.7), "");
  arbiter.step(1.3);
  EXPECT_NE(arbiter.refusalOfSurfaces(1.3), "");
  arbiter.onModeRequest(request(2, 2), 1.3);
  EXPECT_EQ(arbiter.refusalOfSurfaces(1.3), "");
}

TEST(ControlArbiter, SurfacesAloneFlyWithoutAFailsafeAndTheirSilenceIsOne) {
  ControlArbiter arbiter(direct(), 0.0);
  arbiter.onCommand(kManual, stick(0.4), 0.0);
  arbiter.step(0.0);
  arbiter.onModeRequest(request(2, 1), 0.1);
  arbiter.onSurfaces(0.1);
  const auto& out = arbiter.step(0.2);
  EXPECT_FALSE(arbiter.status().failsafe);
  EXPECT_EQ(out.source, CommandSource::kAuto);
  EXPECT_DOUBLE_EQ(roll(out), 0.0) << "no source commands it";
  EXPECT_EQ(arbiter.step(0.7).source, CommandSource::kFailsafe);
  EXPECT_EQ(arbiter.status().reason, "timeout of control/surfaces");
  EXPECT_EQ(arbiter.refusalOfSurfaces(0.8), "") << "it may come back";
  arbiter.onSurfaces(0.8);
  arbiter.step(0.8);
  EXPECT_FALSE(arbiter.status().failsafe);
  EXPECT_EQ(arbiter.status().reason, "control/surfaces is back");
}

}  // namespace
}  // namespace xplane_bridge::core
