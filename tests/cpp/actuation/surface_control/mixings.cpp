#include <algorithm>

#include "fixture.hpp"

namespace xplane_bridge {
namespace {

// ------------------------------------------------------------------------------------------------ the mixing

TEST_F(SurfaceControlTest, IdentifiedMixingIsKept) {
  surfaces_.onAircraft("NEW");
  for (double time = 0.0; time < 35.0; time += core::FakeSimulator::kFrame) {
    airframe_.setStick(0.4 * std::sin(1.3 * time), 0.4 * std::sin(0.83 * time + 1.0), 0.4 * std::sin(1.9 * time + 2.0));
    sim_.frame();
  }
  const auto kept = readMixingFile(folder(), "NEW");
  ASSERT_TRUE(kept);
  EXPECT_NEAR(kept->lawOf(kLeftNumber)->slopes[static_cast<Eigen::Index>(core::MixingTerm::kRollPlus)], 20.0, 1e-3);
  ASSERT_FALSE(reports_.empty());
  EXPECT_EQ(reports_[0].first.find("the mixing of the surfaces is identified, kept in " + folder()), 0U);
  EXPECT_EQ(surfaces_.blockReason(), "");
}

TEST_F(SurfaceControlTest, MixingThatCannotBeKeptIsStillFlownBy) {
  std::filesystem::remove_all(folder());
  std::ofstream(folder()) << "a file where the folder should be";
  surfaces_.onAircraft("NEW");
  for (double time = 0.0; time < 35.0; time += core::FakeSimulator::kFrame) {
    airframe_.setStick(0.4 * std::sin(1.3 * time), 0.4 * std::sin(0.83 * time + 1.0), 0.4 * std::sin(1.9 * time + 2.0));
    sim_.frame();
  }
  ASSERT_FALSE(reports_.empty());
  EXPECT_EQ(reports_[0].first.find("the mixing of the surfaces is identified, but could not be kept: "), 0U);
  EXPECT_FALSE(reports_[0].second);
  EXPECT_NE(surfaces_.status().file_problem, "");
  EXPECT_EQ(surfaces_.blockReason(), "");
}

TEST_F(SurfaceControlTest, AShippedMixingCountsForExactlyItsAircraftAndWhereThereIsNoOwn) {
  core::MixingModel model = *readMixingFile(folder(), "TEST");
  model.aircraft = "TEST Own one";
  writeMixingFile(shipped(), model);
  surfaces_.onAircraft("OTHER", "OTHER Own one");
  EXPECT_FALSE(surfaces_.status().mixing_known);
  std::filesystem::remove(core::mixingPath(folder(), "TEST"));
  surfaces_.onAircraft("TEST", "TEST Another");
  EXPECT_FALSE(surfaces_.status().mixing_known);
  surfaces_.onAircraft("OTHER");
  surfaces_.onAircraft("TEST", "TEST Own one");
  EXPECT_TRUE(surfaces_.status().mixing_known);
  sim_.run(2.0);
  EXPECT_EQ(surfaces_.blockReason(), "");
  model.aircraft = "TEST";
  model.laws.pop_back();
  writeMixingFile(folder(), model);
  surfaces_.onAircraft("OTHER");
  surfaces_.onAircraft("TEST", "TEST Own one");
  EXPECT_EQ(surfaces_.status().mixed_surfaces.size(), model.laws.size()) << "its own goes first";
}

TEST_F(SurfaceControlTest, FlapsThatAreUnderWayRunOnWhileTheSurfacesAreDriven) {
  constexpr const char* kFlap = "flap1_wing1_left";
  core::MixingModel model = FakeAirframe::mixing("FLAPS");
  core::SurfaceLaw law;
  law.surface = core::surfaceNumber(kFlap).value();
  law.slopes[static_cast<Eigen::Index>(core::MixingTerm::kFlap1)] = 30.0;
  law.high_deg = 30.0;
  const auto after = [&law](const core::SurfaceLaw& other) { return other.surface > law.surface; };
  model.laws.insert(std::find_if(model.laws.begin(), model.laws.end(), after), law);
  writeMixingFile(folder(), model);
  float flaps = 0.0F;
  sim_.on_frame = [&] {
    eachFrame();
    if (sim_.value(kSurfaceOverride) != 0.0F) return;  // then X-Plane moves nothing
    flaps = std::min(flaps + 0.003F, sim_.value("sim/cockpit2/controls/flap_ratio"));
    sim_.set("sim/flightmodel2/controls/flap1_deploy_ratio", flaps);
    sim_.set(FakeAirframe::dataref(kFlap), 30.0F * flaps);
  };
  surfaces_.onAircraft("FLAPS");
  sim_.run(1.2);
  ASSERT_EQ(surfaces_.blockReason(), "");
  sim_.set("sim/cockpit2/controls/flap_ratio", 1.0F);
  sim_.run(1.0);
  drive();
  EXPECT_LT(sim_.value(FakeAirframe::dataref(kFlap)), 8.0F);
  sim_.run(8.0);
  EXPECT_FLOAT_EQ(sim_.value(FakeAirframe::dataref(kFlap)), 30.0F);
}

TEST_F(SurfaceControlTest, FileThatCannotBeReadIsReported) {
  std::ofstream(core::mixingPath(folder(), "BAD")) << "no mixing";
  surfaces_.onAircraft("BAD");
  ASSERT_EQ(reports_.size(), 1U);
  EXPECT_FALSE(reports_[0].second);
  EXPECT_EQ(surfaces_.status().file_problem, reports_[0].first);
  EXPECT_FALSE(surfaces_.status().mixing_known);
  surfaces_.onAircraft("TEST");
  EXPECT_EQ(surfaces_.status().file_problem, "");
}

TEST_F(SurfaceControlTest, NothingIsLearnedWhileXPlaneHasSomethingBroken) {
  sim_.run(2.0);
  const std::size_t samples = surfaces_.status().samples;
  surfaces_.setDisturbed(true);
  sim_.run(2.0);
  EXPECT_EQ(surfaces_.status().samples, samples);
  surfaces_.setDisturbed(false);
  sim_.run(2.0);
  EXPECT_GT(surfaces_.status().samples, samples);
}

TEST_F(SurfaceControlTest, NothingIsLearnedWhileSurfacesAreDriven) {
  drive();
  const std::size_t samples = surfaces_.status().samples;
  sim_.run(2.0);
  EXPECT_EQ(surfaces_.status().samples, samples);
}

TEST_F(SurfaceControlTest12, AsksForTheDatarefsOfTheVersion) {
  const auto expected = core::surfaceWatchDatarefs(core::kXPlane12);
  EXPECT_EQ(sim_.subscribed(), std::multiset<std::string>(expected.begin(), expected.end()));
  drive();
}

}  // namespace
}  // namespace xplane_bridge
