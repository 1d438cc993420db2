#include "flight_changes/fixture.hpp"

namespace xplane_bridge {
namespace {

TEST_F(FlightChangesTest, PlacesByANewFlightWhileItIsPaused) {
  expectPlaced(place());
  EXPECT_EQ(flight_.messages, (Names{kToggle, "PREL", kToggle}));
  EXPECT_FALSE(flight_.paused()) << "as it was";
}

TEST_F(FlightChangesTest, PausedFlightStaysPaused) {
  flight_.setPaused(true);
  sim_.run(0.1);
  expectPlaced(place());
  EXPECT_EQ(flight_.messages, Names{"PREL"});
  EXPECT_TRUE(flight_.paused());
}

TEST_F(FlightChangesTest, ItsPauseIsInTheJournalWhileItLasts) {
  std::size_t while_paused = 0, before_pause = 0;
  const auto entries = [this] { return sim_.journal()->entries(); };
  const auto on_frame = sim_.on_frame;
  sim_.on_frame = [&] {
    on_frame();
    if (flight_.paused() && !entries().empty()) ++while_paused;
    if (flight_.messages.empty()) before_pause += entries().size();
  };
  expectPlaced(place());
  EXPECT_EQ(before_pause, 0U);
  EXPECT_GT(while_paused, 0U);
  EXPECT_TRUE(entries().empty());
}

/// So that the flight goes on where its message, an answer or the simulator fails for a while.
class FlightChangesResume : public FlightChangesTest {
 protected:
  void expectItGoesOn() {
    EXPECT_FALSE(flight_.paused());
    EXPECT_TRUE(sim_.journal()->entries().empty());
  }
};

TEST_F(FlightChangesResume, IsAskedForAgainWhereItIsLost) {
  int toggles = 0;
  const auto obey = sim_.on_message;
  sim_.on_message = [&](const core::FakeSimulator::Message& message) {
    if (message.label == "CMND" && ++toggles == 2) return;
    obey(message);
  };
  expectPlaced(place());
  EXPECT_EQ(toggles, 3);
  expectItGoesOn();
}

TEST_F(FlightChangesResume, IsAskedForAgainAfterASilence) {
  std::optional<double> from;
  const auto on_frame = sim_.on_frame;
  sim_.on_frame = [&] {
    if (!from && flight_.sent("PREL") == 1 && at("local_vx") == 70.0F) from = sim_.time();
    const bool silent = from && sim_.time() > *from + 0.01 && sim_.time() < *from + 1.5;
    const bool was_silent = sim_.status().state == LinkState::kStale;
    if (silent && !was_silent) sim_.setState(LinkState::kStale);
    if (silent) return;
    if (was_silent) sim_.setState(flight_.paused() ? LinkState::kPaused : LinkState::kConnected);
    on_frame();
  };
  expectPlaced(place());
  ASSERT_TRUE(from);
  expectItGoesOn();
}

TEST_F(FlightChangesResume, IsLeftToWhoReleasesLeftoversWhereXPlaneIsAway) {
  flight_.load_time = 45.0;  // longer than is waited for it, and for the pause's end
  const auto outcome = place();
  EXPECT_FALSE(outcome.success);
  EXPECT_NE(outcome.text.find("but X-Plane does not show that it goes on"), std::string::npos) << outcome.text;
  EXPECT_EQ(pauses_left_, 1);
  sim_.run(30.0);
  ASSERT_TRUE(flight_.paused());
  OverrideManager overrides(&sim_, [](const std::string&, bool) {});
  std::string problem;
  EXPECT_TRUE(giveBackLeftovers(&sim_, &overrides, 1.0, &problem)) << problem;
  expectItGoesOn();
}

TEST_F(FlightChangesResume, ThePauseOfTheLastOneIsNotTakenForTheUsers) {
  flight_.load_time = 45.0;
  EXPECT_FALSE(place().success);
  sim_.run(30.0);
  ASSERT_TRUE(flight_.paused());
  flight_.load_time = 0.0;
  const auto obey = sim_.on_message;
  sim_.on_message = [&](const core::FakeSimulator::Message& message) {
    if (message.label == "PREL") {
      EXPECT_EQ(sim_.journal()->entries().at(0).left, "") << "none lets it go on yet";
    }
    obey(message);
  };
  expectPlaced(place());
  expectItGoesOn();
}

TEST_F(FlightChangesTest, PauseOfTheUsersIsNotInTheJournal) {
  flight_.setPaused(true);
  sim_.run(0.1);
  std::size_t seen = 0;
  const auto on_frame = sim_.on_frame;
  sim_.on_frame = [&] {
    on_frame();
    seen += sim_.journal()->entries().size();
  };
  expectPlaced(place());
  EXPECT_EQ(seen, 0U);
}

TEST_F(FlightChangesTest, WhatThePauseIsForIsSaid) {
  std::vector<std::string> pausing;
  FlightChangeHooks own = hooks();
  own.pausing = [&pausing](const std::string& who) { pausing.push_back(who); };
  FlightChanges changes(&sim_, {2.0, 20.0}, own);
  changes.place(here(), "node/reset_flight");
  EXPECT_EQ(pausing, (Names{"node/reset_flight", "node/reset_flight", "", "node/reset_flight"}))
      << "the second one was so already";
}

TEST_F(FlightChangesTest, LoadingIsWaitedForAndNothingIsSentMeanwhile) {
  flight_.load_time = 8.0;
  const double begin = sim_.time();
  expectPlaced(place());
  EXPECT_GE(sim_.time() - begin, 8.0);
  EXPECT_EQ(flight_.sent("PREL"), 1U) << "each one begins the flight once more";
  sim_.run(2.0);
  EXPECT_EQ(flight_.beginnings, 1U);
  EXPECT_EQ(at("local_vx"), 70.0F);
}

TEST_F(FlightChangesTest, LostDatagramIsSentOnceMore) {
  flight_.lose_prel = 1;
  const double begin = sim_.time();
  expectPlaced(place());
  EXPECT_EQ(flight_.sent("PREL"), 2U);
  EXPECT_NEAR(sim_.time() - begin, 3.1, 0.3);
}

TEST_F(FlightChangesTest, ThirdOneIsNotSent) {
  flight_.ignores_prel = true;
  const double begin = sim_.time();
  expectFailure(place(), EventKind::kReset, " m away, its altitude is ");
  EXPECT_EQ(flight_.sent("PREL"), 2U);
  EXPECT_NEAR(sim_.time() - begin, 20.1, 0.5);
  EXPECT_FALSE(flight_.paused()) << "it flies on";
}

TEST_F(FlightChangesTest, PlaceNearbyIsNotTakenForTheNewOne) {
  flight_.put(500.0, 1000.0);  // it looks as if it had been placed
  flight_.lose_prel = 1;
  expectPlaced(place());
  EXPECT_EQ(flight_.sent("PREL"), 2U);
  EXPECT_EQ(flight_.beginnings, 1U);
}

TEST_F(FlightChangesTest, PlaceNearbyWithoutANewFlightIsAFailure) {
  flight_.put(500.0, 1000.0);
  flight_.ignores_prel = true;
  expectFailure(place(), EventKind::kReset, "the flight has not begun anew (it is paused)");
}

TEST_F(FlightChangesTest, FlightThatHasOnlyJustBegunIsLeftToRunUntilItsBeginningIsVisible) {
  flight_.put(50.0, 1000.0);  // too near to be seen by its place
  justBegun();
  const double begin = sim_.time();
  expectPlaced(place());
  EXPECT_NEAR(sim_.time() - begin, 0.5, 0.2);
}

TEST_F(FlightChangesTest, PausedFlightThatHasOnlyJustBegunIsBelievedAfterTheTimeOfOneAttempt) {
  flight_.put(50.0, 1000.0);
  flight_.setPaused(true);
  justBegun();
  const double begin = sim_.time();
  expectPlaced(place());
  EXPECT_NEAR(sim_.time() - begin, 3.1, 0.3);
}

TEST_F(FlightChangesTest, SilentXPlaneIsWaitedForBeforeAnythingIsSent) {
  sim_.setState(LinkState::kStale);
  bool silent = true;
  sim_.on_frame = [&] {
    if (sim_.time() > 5004.0) silent = false;
    if (!silent) {
      if (sim_.status().state == LinkState::kStale) sim_.setState(LinkState::kConnected);
      flight_.move();
    } else {
      EXPECT_EQ(flight_.sent("PREL"), 0U);
    }
  };
  place();
  EXPECT_EQ(flight_.sent("PREL"), 1U);
  EXPECT_EQ(at("local_x"), 0.0F);
}

TEST_F(FlightChangesTest, FlightThatBeginsRunningIsPausedForItsMotion) {
  flight_.resumes = true;
  expectPlaced(place());
  EXPECT_EQ(flight_.messages, (Names{kToggle, "PREL", kToggle, kToggle}));
  EXPECT_FALSE(flight_.paused());
}

TEST_F(FlightChangesTest, FlightThatBeginsPausedIsResumed) {
  flight_.pauses = true;
  expectPlaced(place());
  EXPECT_FALSE(flight_.paused());
}

TEST_F(FlightChangesTest, FlightThatBeginsRunningIsPausedAgainWhereItWasPaused) {
  flight_.setPaused(true);
  sim_.run(0.1);
  flight_.resumes = true;
  expectPlaced(place());
  EXPECT_TRUE(flight_.paused());
}

TEST_F(FlightChangesTest, PlaceIsTakenAlsoWhereXPlaneDoesNotPause) {
  flight_.ignores_pause = true;
  expectPlaced(place());
  EXPECT_EQ(pausing_, "") << "it did not come to that";
}

TEST_F(FlightChangesTest, AttitudeThatIsNotTakenIsReported) {
  sim_.setReadOnly(kPosition + "q[3]");
  const double begin = sim_.time();
  expectFailure(place(), EventKind::kReset, "did not place the aircraft: its attitude is 90 deg off");
  EXPECT_NEAR(sim_.time() - begin, 2.1, 0.3);
}

TEST_F(FlightChangesTest, PlaceThatIsNotShownIsReported) {
  FlightChanges changes(&sim_, {2.0, 20.0}, hooks());
  sim_.setState(LinkState::kLost);
  expectFailure(changes.place(here(), "node/reset_flight"), EventKind::kReset,
                "it does not show where it is (the link is LOST)");
  EXPECT_EQ(flight_.sent("PREL"), 0U);
}

TEST_F(FlightChangesTest, StopEndsItAndLetsTheFlightGoOn) {
  flight_.ignores_prel = true;
  pauseLater(0.1);
  after(1.0, [this] { changes_.stop(); });
  const double begin = sim_.time();
  EXPECT_FALSE(place().success);
  EXPECT_LT(sim_.time() - begin, 1.5);
  EXPECT_FALSE(flight_.paused());
  EXPECT_TRUE(sim_.journal()->entries().empty());
}

TEST_F(FlightChangesTest, StopBeforeItsPauseIsShownLetsTheFlightGoOnToo) {
  flight_.ignores_prel = true;
  pauseLater(0.5);
  after(0.1, [this] { changes_.stop(); });
  EXPECT_FALSE(place().success);
  sim_.run(1.0);
  EXPECT_EQ(sim_.commands(), (Names{kToggle, kToggle}));
  EXPECT_FALSE(flight_.paused());
  EXPECT_TRUE(sim_.journal()->entries().empty());
}

// ------------------------------------------------------------------------------------------------ placing, version 12

TEST_F(FlightChangesTest12, MovesAnAircraftThatFlies) {
  expectPlaced(place());
  EXPECT_EQ(flight_.messages, (Names{kToggle, "VEHS", "VEHS", kToggle}));
  EXPECT_EQ(flight_.beginnings, 0U) << "the flight goes on";
}

TEST_F(FlightChangesTest12, PlaceNearbyIsNotTakenForTheNewOne) {
  flight_.put(500.0, 1000.0);
  flight_.ignores_vehs = true;
  after(2.0, [this] { flight_.ignores_vehs = false; });
  expectPlaced(place());
  EXPECT_EQ(flight_.sent("VEHS"), 4U);
}

TEST_F(FlightChangesTest12, OneThatIsMovedByLittleIsSaidToBePlaced) {
  expectPlaced(place());
  EXPECT_EQ(placed_, 0) << "20 km are a reset anyway";
  flight_.put(50.0, 1000.0);
  sim_.run(0.1);
  bool paused = false;
  FlightChangeHooks own = hooks();
  own.placed = [&] {
    ++placed_;
    paused = flight_.paused();
  };
  FlightChanges changes(&sim_, {2.0, 20.0}, own);
  const unsigned resets = flight_.resets();
  expectPlaced(changes.place(here(), "node/reset_flight"));
  EXPECT_EQ(flight_.resets(), resets);
  EXPECT_EQ(placed_, 1);
  EXPECT_TRUE(paused) << "before anything flies on";
}

TEST_F(FlightChangesTest12, OneThatIsNotMovedIsNotPlaced) {
  flight_.put(50.0, 1000.0);
  flight_.ignores_vehs = flight_.ignores_prel = true;
  EXPECT_FALSE(place().success);
  EXPECT_EQ(placed_, 0);
}

TEST_F(FlightChangesTest12, BeginsANewFlightWhereMovingFailsTwice) {
  flight_.ignores_vehs = true;
  const double begin = sim_.time();
  expectPlaced(place());
  EXPECT_EQ(flight_.messages, (Names{kToggle, "VEHS", "VEHS", "VEHS", "VEHS", "PREL", kToggle}));
  EXPECT_NEAR(sim_.time() - begin, 6.1, 0.4);
}

TEST_F(FlightChangesTestWithoutVehs, BeginsANewFlightAtOnce) {
  flight_.ignores_vehs = true;
  expectPlaced(place());
  EXPECT_EQ(flight_.messages, (Names{kToggle, "PREL", kToggle}));
}

TEST_F(FlightChangesTest12, BeginsANewFlightAfterACrash) {
  flight_.crashed = true;
  expectPlaced(place());
  EXPECT_EQ(flight_.messages, (Names{kToggle, "PREL", kToggle}));
}

// ------------------------------------------------------------------------------------------------ wind

}  // namespace
}  // namespace xplane_bridge
