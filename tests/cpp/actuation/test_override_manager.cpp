#include "override_manager/fixture.hpp"

namespace xplane_bridge {
namespace {

TEST_F(OverrideManagerTest, WhatWasShownBeforeAReleaseSaysNothingOfTheNextTime) {
  manager_.setRequired({kJoystick});
  letSixAnswersPass();
  manager_.setRequired({});
  sim_.setReadOnly(kJoystick);
  manager_.setRequired({kJoystick});
  letSixAnswersPass();
  EXPECT_TRUE(manager_.releasedByOthers().empty()) << "it has not been shown as set since";
}

// ------------------------------------------------------------------------------------------------ DATA rows

TEST_F(OverrideManagerTest, RowIsInTheJournalAndGetsItsSlotsBack) {
  const auto rowsSent = [this] {
    std::vector<std::int32_t> out;
    for (const auto& message : sim_.messages()) {
      if (message.label != "DATA") continue;
      out.push_back(core::loadLittleEndian<std::int32_t>(message.body.data()));
      for (std::size_t i = 0; i < 8; ++i) {
        EXPECT_EQ(core::loadLittleEndian<float>(message.body.data() + 4 + 4 * i), -999.0F);
      }
    }
    return out;
  };
  const auto entries = [this] { return sim_.journal()->entries(); };
  manager_.setRequired({"DATA row 8"});
  EXPECT_TRUE(sim_.messages().empty()) << "it goes out with the command";
  ASSERT_EQ(entries().size(), 1U);
  EXPECT_EQ(entries()[0].id, "override:DATA row 8");
  ASSERT_EQ(entries()[0].undo.size(), 1U);
  EXPECT_EQ(std::get<core::UndoData>(entries()[0].undo[0]).row.index, 8);
  EXPECT_TRUE(sim_.subscribed().empty()) << "X-Plane does not show who holds it";
  manager_.refresh();
  letSixAnswersPass();
  EXPECT_TRUE(manager_.releasedByOthers().empty());
  EXPECT_TRUE(sim_.messages().empty());
  manager_.setRequired({});
  EXPECT_EQ(rowsSent(), std::vector<std::int32_t>{8});
  manager_.confirmReleases(1.0);
  EXPECT_EQ(rowsSent(), (std::vector<std::int32_t>{8, 8})) << "a datagram may be lost";
  EXPECT_TRUE(entries().empty());
  manager_.setRequired({"DATA row 13"});
  EXPECT_TRUE(manager_.releaseAll(1.0));
  EXPECT_EQ(rowsSent(), (std::vector<std::int32_t>{8, 8, 13}));
  EXPECT_TRUE(entries().empty());
}

// ------------------------------------------------------------------------------------------------ setRequired()

TEST_F(OverrideManagerTest, RequiredOverridesAreSetOnce) {
  manager_.setRequired({kJoystick, kThrottles});
  EXPECT_EQ(sim_.value(kJoystick), 1.0F);
  EXPECT_EQ(sim_.value(kThrottles), 1.0F);
  EXPECT_EQ(manager_.active(), (Names{kJoystick, kThrottles}));
  EXPECT_EQ(reports_, (Reports{{"set override_joystick, override_throttles", true}}));
  manager_.setRequired({kThrottles, kJoystick});
  EXPECT_EQ(sim_.writes(), (Writes{{kJoystick, 1.0F}, {kThrottles, 1.0F}}));
  EXPECT_EQ(reports_.size(), 1U);
}

TEST_F(OverrideManagerTest, JournalComesBeforeTheWrite) {
  Names before_write;
  sim_.on_message = [&](const core::FakeSimulator::Message&) { before_write = inJournal(); };
  manager_.setRequired({kJoystick});
  EXPECT_EQ(before_write, Names{kJoystick});
}

TEST_F(OverrideManagerTest, WhatIsHeldOnIsNotSaidToBeGivenBack) {
  manager_.acquire(OverrideHolder::kRequest, kJoystick);  // by set_dataref
  manager_.setRequired({kJoystick, kThrottles});
  manager_.setRequired({});
  EXPECT_EQ(sim_.value(kJoystick), 1.0F);
  EXPECT_EQ(reports_.back().first, "gave back override_throttles");
}

TEST_F(OverrideManagerTest, WhatIsNotRequiredAnyMoreIsGivenBack) {
  manager_.setRequired({kJoystick, kThrottles});
  manager_.setRequired({kThrottles});
  EXPECT_EQ(sim_.value(kJoystick), 0.0F);
  EXPECT_EQ(sim_.value(kThrottles), 1.0F);
  EXPECT_EQ(manager_.active(), Names{kThrottles});
  EXPECT_EQ(reports_.back(), (std::pair<std::string, bool>{"gave back override_joystick", true}));
  EXPECT_TRUE(manager_.releasesPending());
  EXPECT_EQ(inJournal(), (Names{kJoystick, kThrottles})) << "until X-Plane has shown the release";
  manager_.confirmReleases(1.0);
  EXPECT_FALSE(manager_.releasesPending());
  EXPECT_EQ(inJournal(), Names{kThrottles});
}

TEST_F(OverrideManagerTest, NothingIsSetWithoutAJournal) {
  sim_.forgetPeer();
  manager_.setRequired({kJoystick});
  EXPECT_FALSE(manager_.acquire(OverrideHolder::kRequest, kThrottles));
  EXPECT_TRUE(manager_.active().empty());
  EXPECT_TRUE(sim_.messages().empty());
  EXPECT_TRUE(reports_.empty());
}

TEST_F(OverrideManagerTest, NothingIsSetThatCannotBeWrittenDown) {
  sim_.breakJournal();
  EXPECT_THROW(manager_.setRequired({kJoystick}), core::JournalError);
  EXPECT_THROW(manager_.acquire(OverrideHolder::kRequest, kThrottles), core::JournalError);
  EXPECT_TRUE(sim_.messages().empty());
  EXPECT_TRUE(manager_.active().empty());
  sim_.breakJournal(false);
  manager_.setRequired({kJoystick});
  EXPECT_EQ(sim_.value(kJoystick), 1.0F);
}

TEST_F(OverrideManagerTest, OneThatCannotBeWrittenDownKeepsNoOtherFromBeingSet) {
  manager_.setRequired({kThrottles});
  sim_.journalOfAnother(true).record(std::string("override:") + kFailure, kOverridePurpose,
                                     {core::UndoDref{kFailure, 0.0F}});
  EXPECT_THROW(manager_.setRequired({kFailure, kJoystick}), core::JournalTakenError);
  EXPECT_EQ(manager_.active(), Names{kJoystick}) << "the throttles need no journal to be given back";
  EXPECT_EQ(sim_.value(kThrottles), 0.0F);
  EXPECT_EQ(sim_.value(kFailure), 0.0F);
  EXPECT_EQ(sim_.subscribed(), std::multiset<std::string>{kJoystick});
  EXPECT_EQ(reports_, (Reports{{"set override_throttles", true},
                               {"set override_joystick", true},
                               {"gave back override_throttles", true}}));
  EXPECT_THROW(manager_.acquire(OverrideHolder::kTraffic, Names{kThrottles, kFailure, kJoystick}),
               core::JournalTakenError);
  EXPECT_EQ(manager_.active(), (Names{kJoystick, kThrottles}));
  EXPECT_EQ(sim_.value(kThrottles), 1.0F);
  manager_.setRequired({});
  EXPECT_EQ(manager_.active(), (Names{kJoystick, kThrottles})) << "acquired";
}

TEST_F(OverrideManagerTest, SeveralAreWrittenDownBeforeTheFirstIsSent) {
  std::vector<std::size_t> noted;
  sim_.on_message = [&](const auto&) { noted.push_back(sim_.journal()->entries().size()); };
  manager_.setRequired({kJoystick, kThrottles});
  EXPECT_EQ(noted, (std::vector<std::size_t>{2, 2}));
}

// ---------------------------------------------------------------------------------------- acquire() and release()

TEST_F(OverrideManagerTest, AcquiredIsIndependentOfWhatIsRequired) {
  EXPECT_TRUE(manager_.acquire(OverrideHolder::kRequest, kJoystick));
  manager_.setRequired({kJoystick});
  manager_.setRequired({});
  EXPECT_EQ(sim_.value(kJoystick), 1.0F);
  EXPECT_FALSE(manager_.releasesPending());
  manager_.release(OverrideHolder::kRequest, kJoystick);
  EXPECT_EQ(sim_.value(kJoystick), 0.0F);
  EXPECT_TRUE(manager_.releasesPending());
  EXPECT_EQ(sim_.writes(), (Writes{{kJoystick, 1.0F}, {kJoystick, 0.0F}}));
}

TEST_F(OverrideManagerTest, RequiredOutlivesItsAcquirer) {
  manager_.setRequired({kJoystick});
  EXPECT_TRUE(manager_.acquire(OverrideHolder::kRequest, kJoystick));
  manager_.release(OverrideHolder::kRequest, kJoystick);
  EXPECT_EQ(sim_.value(kJoystick), 1.0F);
  EXPECT_EQ(manager_.active(), Names{kJoystick});
}

TEST_F(OverrideManagerTest, WhatTwoHoldIsGivenBackByTheLast) {
  using Holders = std::set<OverrideHolder>;
  EXPECT_TRUE(manager_.acquire(OverrideHolder::kRequest, kJoystick));
  manager_.acquire(OverrideHolder::kTraffic, Names{kJoystick});
  manager_.setRequired({kJoystick});
  EXPECT_EQ(manager_.holders(kJoystick),
            (Holders{OverrideHolder::kControls, OverrideHolder::kTraffic, OverrideHolder::kRequest}));
  manager_.setRequired({});
  manager_.release(OverrideHolder::kTraffic, kJoystick);
  manager_.release(OverrideHolder::kTraffic, kJoystick);  // holds it no more
  EXPECT_EQ(manager_.holders(kJoystick), Holders{OverrideHolder::kRequest});
  EXPECT_EQ(sim_.value(kJoystick), 1.0F);
  EXPECT_FALSE(manager_.releasesPending());
  manager_.release(OverrideHolder::kRequest, kJoystick);
  EXPECT_TRUE(manager_.holders(kJoystick).empty());
  EXPECT_EQ(sim_.value(kJoystick), 0.0F);
}

TEST_F(OverrideManagerTest, ReleasingWhatWasNotAcquiredDoesNothing) {
  manager_.release(OverrideHolder::kRequest, kJoystick);
  manager_.setRequired({kThrottles});
  manager_.release(OverrideHolder::kRequest, kThrottles);
  EXPECT_EQ(sim_.writes(), (Writes{{kThrottles, 1.0F}}));
}

TEST_F(OverrideManagerTest, EachIsGivenBackInItsOwnWay) {
  sim_.set(kThrottle12, -2.0F);
  EXPECT_TRUE(manager_.acquire(OverrideHolder::kRequest, kThrottle12, 0.5F));
  EXPECT_TRUE(manager_.acquire(OverrideHolder::kFailures, kFailure, 6.0F, false));
  EXPECT_EQ(sim_.value(kThrottle12), 0.5F);
  manager_.release(OverrideHolder::kRequest, kThrottle12);
  manager_.release(OverrideHolder::kFailures, kFailure);
  EXPECT_EQ(sim_.value(kThrottle12), -2.0F) << "X-Plane 11's own 'not overridden'";
  EXPECT_EQ(sim_.value(kFailure), 0.0F);
  manager_.confirmReleases(1.0);
  EXPECT_TRUE(inJournal().empty());
}

TEST_F(OverrideManagerTest, AcquiredAnewItTakesTheNewValue) {
  EXPECT_TRUE(manager_.acquire(OverrideHolder::kFailures, kFailure, 6.0F));
  EXPECT_TRUE(manager_.acquire(OverrideHolder::kFailures, kFailure, 1.0F));
  EXPECT_EQ(sim_.value(kFailure), 1.0F);
  sim_.set(kFailure, 0.0F);
  manager_.refresh();
  EXPECT_EQ(sim_.value(kFailure), 1.0F);
}

}  // namespace
}  // namespace xplane_bridge
