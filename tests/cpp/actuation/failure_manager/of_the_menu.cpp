#include "fixture.hpp"

namespace xplane_bridge {
namespace {

// ------------------------------------------------------------------------------------------------ the simulator's menu

TEST_F(FailureManagerTest, FailureOfTheMenuIsNoticedAndSoIsItsRepair) {
  sim_.set(kPitot, 6.0F);
  sim_.run(1.1);
  EXPECT_FALSE(label("rel_pitot").by_bridge);
  EXPECT_TRUE(label("rel_pitot").active);
  EXPECT_TRUE(label("rel_pitot").confirmed);
  EXPECT_TRUE(reported("rel_pitot was failed in the simulator", "", true));
  sim_.set(kPitot, 0.0F);
  sim_.run(1.1);
  EXPECT_TRUE(labelNames().empty());
  EXPECT_TRUE(reported("rel_pitot was repaired in the simulator", "", true));
  EXPECT_TRUE(sim_.messages().empty());
}

TEST_F(FailureManagerTest, FailureOfTheMenuIsClearedOnRequestOnly) {
  sim_.set(kPitot, 6.0F);
  sim_.run(1.1);
  EXPECT_EQ(clear().result.text, "nothing was broken");
  const auto done = clear({"rel_pitot"});
  EXPECT_EQ(done.result.code, ResultCode::kRefused);
  EXPECT_EQ(done.result.text, "rel_pitot was failed in the simulator: set include_simulator");
  EXPECT_EQ(sim_.value(kPitot), 6.0F);
  requireClear({}, true);
  EXPECT_EQ(sim_.value(kPitot), 0.0F);
}

TEST_F(FailureManagerTest, ClearedWhileXPlaneIsAwayOnlyOursIsRepaired) {
  require(failed("pitot_1"));
  sim_.set(kEngine, 6.0F);
  sim_.run(1.1);
  setLink(LinkState::kStale);
  const auto done = clear({}, true);
  EXPECT_EQ(done.result.code, ResultCode::kNoLink);
  EXPECT_EQ(done.result.text,
            "X-Plane is not connected; what the bridge has broken is repaired when it comes back, what was failed in "
            "the simulator has to be cleared then");
  EXPECT_EQ(done.cleared, Names{"pitot_1"});
  EXPECT_EQ(clear({"rel_engfai0"}, true).result.text, done.result.text);
  EXPECT_EQ(clear().result.text, "X-Plane is not connected; what the bridge has broken is repaired when it comes back");
  EXPECT_EQ(labelNames(), Names{"rel_engfai0"});
  setLink(LinkState::kConnected);
  overrides_.confirmReleases(1.0);
  EXPECT_EQ(sim_.value(kPitot), 0.0F);
  requireClear({}, true);
  EXPECT_EQ(sim_.value(kEngine), 0.0F);
}

TEST_F(FailureManagerTest, ValuesFromBeforeARepairAreIgnored) {
  sim_.set(kPitot, 6.0F);
  sim_.run(1.1);
  reported_.clear();
  sim_.setReadOnly(kPitot);
  after(0.3, [this] { sim_.set(kPitot, 0.0F); });
  requireClear({}, true);
  sim_.run(2.0);
  EXPECT_TRUE(labelNames().empty());
  EXPECT_FALSE(reported("rel_pitot was failed in the simulator", "", true));
}

TEST_F(FailureManagerTest, FailureOfTheMenuGivesWayToOneOfTheBridge) {
  sim_.set(kEngine, 6.0F);
  sim_.run(1.1);
  ASSERT_EQ(labelNames(), Names{"rel_engfai0"});
  require(failed("engine_1"));
  EXPECT_EQ(labelNames(), Names{"engine_1"});
  requireClear();
  EXPECT_EQ(sim_.value(kEngine), 0.0F);
}

TEST_F(FailureManagerTest, FailureOfTheMenuIsLabelledThoughOneIsArmed) {
  for (const char* name : {"engine_1", "rel_engfai0"}) {
    SCOPED_TRACE(name);
    reported_.clear();
    ASSERT_EQ(set(triggered(name, FailureTrigger::kAtSimTime, 8.0)).code, ResultCode::kAccepted);
    sim_.set(kEngine, 6.0F);
    sim_.run(1.1);
    EXPECT_EQ(labelNames(), (Names{name, "rel_engfai0"}));
    EXPECT_TRUE(reported("rel_engfai0 was failed in the simulator", "", true));
    sim_.set(kEngine, 0.0F);
    sim_.run(1.1);
    EXPECT_EQ(labelNames(), Names{name});
    EXPECT_TRUE(reported("rel_engfai0 was repaired in the simulator", "", true));
    sim_.set(kEngine, 6.0F);
    sim_.run(1.1);
    ASSERT_EQ(set(triggered(name, FailureTrigger::kAtSimTime, 1.0)).code, ResultCode::kAccepted);
    EXPECT_EQ(sim_.value(kEngine), 6.0F) << "to arm one repairs nothing";
    EXPECT_EQ(labelNames(), (Names{name, "rel_engfai0"}));
    sim_.run(1.2);
    EXPECT_EQ(labelNames(), Names{name});
    EXPECT_TRUE(label(name).active && label(name).confirmed && label(name).by_bridge);
    requireClear();
    EXPECT_EQ(sim_.value(kEngine), 0.0F);
    sim_.run(2.0);
    EXPECT_TRUE(labelNames().empty());
  }
}

TEST_F(FailureManagerTest, ClearedTheArmedOneLeavesThatOfTheMenu) {
  ASSERT_EQ(set(triggered("engine_1", FailureTrigger::kAtSimTime, 100.0)).code, ResultCode::kAccepted);
  sim_.set(kEngine, 6.0F);
  sim_.run(1.1);
  requireClear();
  sim_.run(1.1);
  EXPECT_EQ(labelNames(), Names{"rel_engfai0"});
  EXPECT_EQ(sim_.value(kEngine), 6.0F);
}

TEST_F(FailureManagerTest, OursThatIsRepairedInTheSimulatorIsLetGo) {
  require(failed("engine_1"));
  sim_.set(kEngine, 0.0F);
  sim_.run(0.4);
  EXPECT_FALSE(label("engine_1").confirmed);
  sim_.run(0.3);
  EXPECT_TRUE(labelNames().empty());
  EXPECT_TRUE(reported("engine_1 was repaired in the simulator", "", true));
  EXPECT_TRUE(overrides_.releasesPending()) << "its journal entry goes";
}

TEST_F(FailureManagerTest, ShortDropOfAValueIsNoRepair) {
  require(failed("engine_1"));
  sim_.set(kEngine, 0.0F);
  sim_.run(0.3);
  sim_.set(kEngine, 6.0F);
  sim_.run(1.0);
  EXPECT_TRUE(label("engine_1").confirmed);
}

TEST_F(FailureManagerTest, NoMixingIsLearnedFromBrokenControls) {
  sim_.set("sim/operation/failures/rel_conlock", 6.0F);
  sim_.run(1.1);
  const std::size_t samples = surfaces_.status().samples;
  sim_.run(2.0);
  EXPECT_EQ(surfaces_.status().samples, samples);
  sim_.set("sim/operation/failures/rel_conlock", 0.0F);
  sim_.run(3.0);
  EXPECT_GT(surfaces_.status().samples, samples);
}

}  // namespace
}  // namespace xplane_bridge
