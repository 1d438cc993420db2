#include "xplane_bridge/actuation/traffic_control.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fake_simulator.hpp"
#include "journal_file.hpp"

namespace xplane_bridge {
namespace {

const std::string kPlane3 = std::string("sim/multiplayer/position/") + "plane3_";
const std::string kOverride3 = "sim/operation/override/override_planepath[3]";
const std::string kOverride4 = "sim/operation/override/override_planepath[4]";

core::TrafficPose poseOf(int number, double north_mps = 60.0) {
  core::TrafficPose pose;
  pose.number = number;
  pose.place = {0.0, 10.0, 500.0};
  pose.velocity_ned = {north_mps, 0.0, 0.0};
  return pose;
}

class Simulator : public core::FakeSimulator {
 public:
  bool inLockstep() const override { return lockstep; }
  bool lockstep = false;
};

/// X-Plane with the scenery's origin below the aircraft; frames of 0.02 s, poses at 25 Hz: every second frame.
class TrafficControlTest : public testing::Test {
 protected:
  TrafficControlTest() {
    sim_.set("sim/flightmodel/position/lat_ref", 0.0F);
    sim_.set("sim/flightmodel/position/lon_ref", 10.0F);
    for (int number = 3; number <= 4; ++number) sim_.set(core::trafficOverride(number), 0.0F);
    for (const char* leaf : {"x", "y", "z", "the", "phi", "psi", "v_x", "v_y", "v_z"}) sim_.set(kPlane3 + leaf, 0.0F);
    sim_.frame();
  }

  TrafficControl& control(bool vehx = false) {
    TrafficOptions options;
    options.rate = 25.0;
    options.vehx = vehx;
    control_ = std::make_unique<TrafficControl>(&sim_, &overrides_, options,
                                                [this](const std::string& text, bool) { reports_.push_back(text); });
    return *control_;
  }
  double now() const { return static_cast<double>(*sim_.status().sim_time_s); }
  void fly(double seconds) {
    for (int i = 0; i < std::lround(seconds / core::FakeSimulator::kFrame); ++i) {
      sim_.frame();
      control_->tick(now());
    }
  }
  std::size_t inJournal() { return sim_.journal()->entries().size(); }

  Simulator sim_;
  OverrideManager overrides_{&sim_, [](const std::string&, bool) {}};
  std::unique_ptr<TrafficControl> control_;
  std::vector<std::string> reports_;
};

TEST_F(TrafficControlTest, TakesNoneThatCannotBeWrittenDownAndFliesThoseItHas) {
  TrafficControl& traffic = control();
  EXPECT_EQ(traffic.command({poseOf(3)}, now()), "");
  fly(0.1);
  sim_.breakJournal();
  EXPECT_NE(traffic.command({poseOf(3, 30.0), poseOf(4)}, now()).find("journal"), std::string::npos);
  EXPECT_EQ(traffic.numbers(), std::vector<int>{3});
  fly(0.1);
  EXPECT_EQ(sim_.value(kOverride4), 0.0F);
  EXPECT_EQ(sim_.value(kPlane3 + "v_z"), -30.0F) << "by the newest command";
  sim_.breakJournal(false);
  EXPECT_EQ(traffic.command({poseOf(3), poseOf(4)}, now()), "");
  EXPECT_EQ(traffic.numbers(), (std::vector<int>{3, 4}));
}

TEST_F(TrafficControlTest, WritesAllThatItTakesDownAtOnce) {
  std::vector<core::TrafficPose> poses;
  for (int number = 1; number < 20; ++number) {
    sim_.set(core::trafficOverride(number), 0.0F);
    poses.push_back(poseOf(number));
  }
  std::optional<std::size_t> noted;
  sim_.on_message = [&](const auto&) {
    if (!noted) noted = inJournal();
  };
  const Replacements replacements(std::filesystem::path(sim_.journal()->path()).parent_path().string());
  EXPECT_EQ(control().command(poses, now()), "");
  EXPECT_EQ(replacements.count(), 1U) << "of the file, for all of them";
  EXPECT_EQ(noted, 19U) << "before the first is sent";
  EXPECT_EQ(control_->numbers().size(), 19U);
}

TEST_F(TrafficControlTest, PlacesAnAircraftAndMovesItOnBetweenCommands) {
  TrafficControl& traffic = control();
  EXPECT_EQ(traffic.command({poseOf(3)}, now()), "");
  EXPECT_EQ(inJournal(), 1U) << "before anything is sent";
  fly(0.1);
  EXPECT_EQ(sim_.value(kOverride3), 1.0F);
  EXPECT_EQ(sim_.value(kPlane3 + "y"), 500.0F);
  EXPECT_EQ(sim_.value(kPlane3 + "v_z"), -60.0F);
  fly(0.9);
  // 60 m/s for one second; the newest pose is up to two frames old.
  EXPECT_LE(sim_.value(kPlane3 + "z"), -60.0F + 2.5F);
  EXPECT_GE(sim_.value(kPlane3 + "z"), -60.1F);
  sim_.clearMessages();
  fly(0.4);
  std::size_t poses = 0;
  for (const auto& each : sim_.writes()) poses += each.first == kPlane3 + "x" ? 1U : 0U;
  EXPECT_EQ(poses, 10U) << "25 a second";
}

TEST_F(TrafficControlTest, InLockstepEveryFrameHasAPoseOfItsTime) {
  sim_.lockstep = true;
  TrafficControl& traffic = control();
  EXPECT_EQ(traffic.command({poseOf(3)}, now()), "");
  fly(0.1);
  for (int frame = 0; frame < 5; ++frame) {
    const float before = sim_.value(kPlane3 + "z");
    fly(core::FakeSimulator::kFrame);
    EXPECT_NEAR(sim_.value(kPlane3 + "z"), before - 60.0F * 0.02F, 1e-3F);
  }
}

TEST_F(TrafficControlTest, GivesBackWhatAListDoesNotHaveAnyMore) {
  TrafficControl& traffic = control();
  EXPECT_EQ(traffic.command({poseOf(3), poseOf(4)}, now()), "");
  EXPECT_EQ(traffic.numbers(), (std::vector<int>{3, 4}));
  fly(0.1);
  EXPECT_EQ(traffic.command({poseOf(3)}, now()), "");
  EXPECT_EQ(sim_.value(kOverride4), 0.0F);
  EXPECT_EQ(sim_.value(kOverride3), 1.0F);
  EXPECT_EQ(traffic.command({}, now()), "");
  EXPECT_EQ(sim_.value(kOverride3), 0.0F);
  overrides_.confirmReleases(1.0);
  EXPECT_EQ(inJournal(), 0U);
  EXPECT_EQ(reports_, (std::vector<std::string>{"traffic: 3, 4 placed by command", "traffic: 4 given back",
                                                "traffic: 3 given back"}));
}

TEST_F(TrafficControlTest, LeavesSetWhatSetDatarefHolds) {
  overrides_.acquire(OverrideHolder::kRequest, kOverride3);
  TrafficControl& traffic = control();
  EXPECT_EQ(traffic.command({poseOf(3)}, now()), "");
  fly(0.1);
  EXPECT_EQ(sim_.value(kPlane3 + "v_z"), -60.0F);
  EXPECT_EQ(traffic.command({}, now()), "");
  EXPECT_EQ(sim_.value(kOverride3), 1.0F);
  EXPECT_EQ(inJournal(), 1U) << "it is given back at the end";
}

TEST_F(TrafficControlTest, GivesAllBackWhenItsSourceIsSilent) {
  TrafficControl& traffic = control();
  EXPECT_EQ(traffic.command({poseOf(3)}, now()), "");
  fly(1.9);
  EXPECT_EQ(sim_.value(kOverride3), 1.0F);
  fly(0.2);
  EXPECT_EQ(sim_.value(kOverride3), 0.0F);
  EXPECT_TRUE(traffic.numbers().empty());
  EXPECT_TRUE(sim_.subscribed().count("sim/flightmodel/position/lat_ref") == 0);
}

TEST_F(TrafficControlTest, SilenceOfAPausedSimulatorIsNone) {
  TrafficControl& traffic = control();
  EXPECT_EQ(traffic.command({poseOf(3)}, now()), "");
  fly(0.2);
  sim_.setState(core::LinkState::kPaused);
  fly(10.0);
  EXPECT_EQ(sim_.value(kOverride3), 1.0F);
}

TEST_F(TrafficControlTest, RefusesAWrongListWhole) {
  TrafficControl& traffic = control();
  core::TrafficPose wrong = poseOf(4);
  wrong.place.height = 1e6;
  EXPECT_EQ(traffic.command({poseOf(3), wrong}, now()), "aircraft 4: altitude_msl is 1e+06: expected -1000..30000");
  EXPECT_TRUE(traffic.numbers().empty());
  sim_.setState(core::LinkState::kStale);
  EXPECT_EQ(traffic.command({poseOf(3)}, now()), "X-Plane is not connected");
  EXPECT_EQ(inJournal(), 0U);
}

TEST_F(TrafficControlTest, LeavesWhatAnotherClientHasGivenBack) {
  TrafficControl& traffic = control();
  EXPECT_EQ(traffic.command({poseOf(3)}, now()), "");
  fly(0.5);
  sim_.set(kOverride3, 0.0F);
  fly(0.6);
  overrides_.releasedByOthers();
  fly(0.1);
  EXPECT_TRUE(traffic.numbers().empty());
  EXPECT_EQ(
      traffic.command({poseOf(3)}, now()),
      "aircraft 3 released by another client: not placed until a command leaves them out, and a later one names them");
  EXPECT_EQ(sim_.value(kOverride3), 0.0F) << "as long as its source goes on";
  EXPECT_EQ(traffic.command({}, now()), "");
  EXPECT_EQ(traffic.command({poseOf(3)}, now()), "");
  EXPECT_EQ(sim_.value(kOverride3), 1.0F);
}

TEST_F(TrafficControlTest, SendsVehxWhereThatIsTheWay) {
  TrafficControl& traffic = control(true);
  EXPECT_EQ(traffic.command({poseOf(3)}, now()), "");
  sim_.clearMessages();
  fly(0.1);
  std::size_t poses = 0;
  for (const auto& message : sim_.messages()) {
    if (message.label != "VEHX") continue;
    ++poses;
    ASSERT_EQ(message.body.size(), 40U);
    EXPECT_EQ(message.body[0], 3);
  }
  EXPECT_GE(poses, 2U);
  EXPECT_TRUE(sim_.writes().empty() || sim_.writes().size() < 2U) << "no positions beside it";
  EXPECT_EQ(sim_.value(kOverride3), 1.0F) << "so that it can be given back";
}

}  // namespace
}  // namespace xplane_bridge
