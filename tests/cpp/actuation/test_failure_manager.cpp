#include "failure_manager/fixture.hpp"

namespace xplane_bridge {
namespace {

// ------------------------------------------------------------------------------------------ X-Plane's own failures

TEST_F(FailureManagerTest, FailureIsSetWrittenDownSeenAndLabelled) {
  bool in_journal = false;
  sim_.on_message = [&](const core::FakeSimulator::Message& message) {
    if (message.path == kEngine) in_journal = isInJournal(kEngine);
  };
  const double begin = watch_.sim_time;
  require(failed("engine_1"));
  EXPECT_TRUE(in_journal) << "before it is sent";
  EXPECT_EQ(sim_.value(kEngine), 6.0F);
  EXPECT_EQ(written(kEngine), std::vector<float>{6.0F});
  const core::FailureLabel engine = label("engine_1");
  EXPECT_EQ(engine.kind, "failed");
  EXPECT_TRUE(engine.by_bridge);
  EXPECT_TRUE(engine.active);
  EXPECT_TRUE(engine.confirmed);
  EXPECT_NEAR(engine.since_sim_time, begin, 0.05);
  EXPECT_TRUE(reported("failure: engine_1 failed", kWho, true));
  sim_.frame();
  ASSERT_FALSE(published_.empty());
  EXPECT_TRUE(published_.back().labels.at(0).confirmed);
  EXPECT_FALSE(published_.back().surrogate_mixing);
  EXPECT_NEAR(published_.back().sim_time, watch_.sim_time, 0.03);
}

struct SystemCase {
  std::string name;
  Names leaves;  // of its datarefs
};

TEST_F(FailureManagerTest, EachSystemIsBrokenAndRepaired) {
  const std::vector<SystemCase> cases{
      {"engine_1", {"rel_engfai0"}},    {"engine_8", {"rel_engfai7"}},
      {"bus_1", {"rel_esys"}},          {"bus_6", {"rel_esys6"}},
      {"generator_1", {"rel_genera0"}}, {"battery_2", {"rel_batter1"}},
      {"pitot_1", {"rel_pitot"}},       {"pitot_2", {"rel_pitot2"}},
      {"static_1", {"rel_static"}},     {"gyro_1", {"rel_ss_ahz", "rel_ss_dgy"}},
      {"rel_vacuum", {"rel_vacuum"}},   {"gyro_2", {"rel_cop_ahz", "rel_cop_dgy"}},
  };
  for (const SystemCase& each : cases) {
    SCOPED_TRACE(each.name);
    require(failed(each.name));
    EXPECT_EQ(labelNames(), Names{each.name});
    for (const std::string& leaf : each.leaves) EXPECT_EQ(sim_.value("sim/operation/failures/" + leaf), 6.0F) << leaf;
    requireClear({each.name});
    for (const std::string& leaf : each.leaves) EXPECT_EQ(sim_.value("sim/operation/failures/" + leaf), 0.0F) << leaf;
    EXPECT_TRUE(labelNames().empty());
  }
}

TEST_F(FailureManagerTest, FullDatarefIsLabelledWithoutItsFolder) {
  require(failed(kPitot));
  EXPECT_EQ(labelNames(), Names{"rel_pitot"});
  requireClear({kPitot});
  EXPECT_TRUE(reported("cleared: rel_pitot", kWho, true));
}

TEST_F(FailureManagerTest, LostDatagramIsSentAgain) {
  sim_.loseMessages(1);
  require(failed("engine_1"));
  EXPECT_EQ(written(kEngine), (std::vector<float>{6.0F, 6.0F}));
}

TEST_F(FailureManagerTest, WhatXPlaneDoesNotShowIsGivenUp) {
  sim_.setReadOnly(kEngine);
  const double begin = sim_.time();
  const RequestResult result = set(failed("engine_1"));
  EXPECT_EQ(result.code, ResultCode::kTimeout);
  EXPECT_EQ(result.text, "X-Plane does not show it");
  EXPECT_NEAR(sim_.time() - begin, 2.0, 0.1);
  std::vector<float> sent = written(kEngine);
  ASSERT_GE(sent.size(), 6U);
  EXPECT_EQ(std::count(sent.begin(), sent.end(), 6.0F), 7) << "at once and six times at 0.3 s";
  EXPECT_EQ(sent.back(), 0.0F);
  EXPECT_TRUE(labelNames().empty());
  EXPECT_TRUE(reported("failure of engine_1 is given up: X-Plane does not show it", kWho, false));
  EXPECT_TRUE(overrides_.releasesPending());
}

TEST_F(FailureManagerTest, AllDatarefsOfAFailureMustBeShown) {
  sim_.setReadOnly("sim/operation/failures/rel_ss_dgy");
  EXPECT_EQ(set(failed("gyro_1")).code, ResultCode::kTimeout);
  EXPECT_EQ(sim_.value("sim/operation/failures/rel_ss_ahz"), 0.0F) << "the other one is repaired";
}

TEST_F(FailureManagerTest, WithoutTheJournalNothingIsBroken) {
  sim_.breakJournal();
  const RequestResult result = set(failed("engine_1"));
  EXPECT_EQ(result.code, ResultCode::kTimeout);
  EXPECT_EQ(result.text.find("it could not be given back after a crash, should there be one: "), 0U) << result.text;
  EXPECT_EQ(sim_.value(kEngine), 0.0F);
  EXPECT_TRUE(labelNames().empty());
  const auto sent = written(kEngine);
  EXPECT_EQ(std::count(sent.begin(), sent.end(), 6.0F), 0);
}

// ------------------------------------------------------------------------------------------------ refusals

TEST_F(FailureManagerTest, RefusesWhatCannotBeBroken) {
  refused(failed("wing_9"), ResultCode::kRefused, "name is \"wing_9\": expected a surface (docs/control/surfaces.md)");
  refused(failed("engine_9"), ResultCode::kRefused, "name is \"engine_9\": expected engine_1 to engine_8");
  refused(broken("engine_1", "stuck"), ResultCode::kRefused, "kind is \"stuck\": expected failed for engine_1");
  refused(broken(FakeAirframe::kLeft, "bent"), ResultCode::kRefused, "kind is \"bent\": expected stuck");
  refused(broken(FakeAirframe::kLeft, "stuck", 100.0), ResultCode::kRefused, "value is 100, expected -90..90 deg");
  refused(broken(FakeAirframe::kLeft, "reduced"), ResultCode::kRefused, "value is missing, expected 0..1");
  refused(broken(FakeAirframe::kLeft, "slow", 0.0), ResultCode::kRefused, "value is 0, expected a rate above 0");
  refused(broken(FakeAirframe::kLeft, "gone"), ResultCode::kNotSupported, "cannot be expressed by X-Plane 11");
  refused(triggered("engine_1", static_cast<FailureTrigger>(6), 1.0), ResultCode::kRefused, "trigger is 6");
  refused(triggered("engine_1", FailureTrigger::kAtSpeedAbove, std::nan("")), ResultCode::kRefused, "trigger_value");
  refused(triggered("engine_1", FailureTrigger::kAtSimTime, -1.0), ResultCode::kRefused, "expected 0 s or more");
  refused(failed("rel_nothing"), ResultCode::kNotSupported,
          "this X-Plane does not answer to sim/operation/failures/rel_nothing: is the name right?");
  refused(broken("flap1_wing1_left", "stuck"), ResultCode::kRefused,
          "flap1_wing1_left cannot be broken now: flap1_wing1_left has not been seen to move");
  block("the aircraft is another one");
  sim_.frame();
  refused(broken(FakeAirframe::kLeft, "stuck"), ResultCode::kRefused,
          "aileron1_wing2_left cannot be broken now: the aircraft is another one");
  blocked_ = RequestResult{ResultCode::kNoLink, "X-Plane is back, but has not shown its flight yet"};
  sim_.frame();
  refused(broken(FakeAirframe::kLeft, "stuck"), ResultCode::kNoLink,
          "aileron1_wing2_left cannot be broken now: X-Plane is back, but has not shown its flight yet");
  EXPECT_TRUE(sim_.messages().empty());
}

TEST_F(FailureManagerTest, OneThingIsNotBrokenUnderTwoNames) {
  require(failed("engine_1"));
  refused(failed("rel_engfai0"), ResultCode::kRefused, "rel_engfai0 is broken already as engine_1: clear that first");
}

TEST_F(FailureManagerTest, NothingIsBrokenWithoutALink) {
  for (const LinkState state : {LinkState::kSearching, LinkState::kStale, LinkState::kLost}) {
    setLink(state);
    refused(failed("engine_1"), ResultCode::kNoLink, "X-Plane is not connected");
  }
}

TEST_F(FailureManagerTest, TimeThatIsNotKnownIsNoTrigger) {
  FailureManager fresh(
      &sim_, &overrides_, &surfaces_, 2.0, [](const FailureSnapshot&) {},
      [](const std::string&, const std::string&, bool) {});
  fresh.onLink(sim_.status());
  const RequestResult result = fresh.set(triggered("engine_1", FailureTrigger::kAtSimTime, 1.0), kWho);
  EXPECT_EQ(result.code, ResultCode::kNoLink);
  EXPECT_EQ(result.text, "X-Plane has not shown its time yet");
}

// ------------------------------------------------------------------------------------------------ clear()

TEST_F(FailureManagerTest, ClearRepairsAllOfTheBridges) {
  require(failed("engine_1"));
  require(failed("pitot_1"));
  const auto done = clear();
  EXPECT_EQ(done.result.code, ResultCode::kOk);
  EXPECT_EQ(done.result.text, "repaired");
  EXPECT_EQ(done.cleared, (Names{"engine_1", "pitot_1"}));
  EXPECT_EQ(sim_.value(kEngine), 0.0F);
  EXPECT_EQ(sim_.value(kPitot), 0.0F);
  overrides_.confirmReleases(1.0);
  EXPECT_FALSE(isInJournal(kEngine));
  const auto again = clear();
  EXPECT_EQ(again.result.text, "nothing was broken");
  EXPECT_TRUE(again.cleared.empty());
}

TEST_F(FailureManagerTest, ClearByNameLeavesTheOthers) {
  require(failed("engine_1"));
  require(failed("pitot_1"));
  requireClear({"pitot_1"});
  EXPECT_EQ(labelNames(), Names{"engine_1"});
  EXPECT_EQ(sim_.value(kEngine), 6.0F);
}

TEST_F(FailureManagerTest, ClearRefusesWhatIsNotBroken) {
  auto done = clear({"engine_2"});
  EXPECT_EQ(done.result.code, ResultCode::kRefused);
  EXPECT_EQ(done.result.text, "\"engine_2\" is not broken: expected nothing, all is well");
  require(failed("engine_1"));
  done = clear({"engine_1", "engine_2"});
  EXPECT_EQ(done.result.text, "\"engine_2\" is not broken: expected engine_1");
  EXPECT_EQ(sim_.value(kEngine), 6.0F) << "nothing is done by half";
}

TEST_F(FailureManagerTest, RepairThatIsNotShownTimesOut) {
  require(failed("engine_1"));
  sim_.setReadOnly(kEngine);
  const auto done = clear();
  EXPECT_EQ(done.result.code, ResultCode::kTimeout);
  EXPECT_EQ(done.result.text, "X-Plane still shows " + kEngine);
}

TEST_F(FailureManagerTest, RepairWithoutALinkSaysSo) {
  require(failed("engine_1"));
  setLink(LinkState::kLost);
  const auto done = clear();
  EXPECT_EQ(done.result.code, ResultCode::kNoLink);
  EXPECT_EQ(done.cleared, Names{"engine_1"});
  EXPECT_TRUE(overrides_.releasesPending()) << "it is repaired when X-Plane comes back";
}

// ------------------------------------------------------------------------------------------------ publishing

TEST_F(FailureManagerTest, SnapshotIsPublishedOnEveryChangeAndOnceASecond) {
  sim_.run(3.0);
  EXPECT_EQ(published_.size(), 3U);
  published_.clear();
  sim_.set(kPitot, 6.0F);
  sim_.run(1.1);
  EXPECT_TRUE(std::any_of(published_.begin(), published_.end(),
                          [](const FailureSnapshot& snapshot) { return snapshot.labels.size() == 1; }));
}

TEST_F(FailureManagerTest, LaterVersionsFailuresAreWatchedOnceItIsKnown) {
  sim_.setVersion(core::kXPlane12);
  sim_.setAll(core::simulatorFailures(core::kXPlane12), 0.0F);
  failures_.onLink(sim_.status());
  sim_.set(kLock, 6.0F);
  sim_.run(1.1);
  EXPECT_EQ(labelNames(), Names{"rel_fcon_ailn_1_lft_lock"});
}

}  // namespace
}  // namespace xplane_bridge
