#include "fixture.hpp"

namespace xplane_bridge {
namespace {

TEST_F(FlightChangesTest12, AircraftIsLoadedWhileNothingIsFlown) {
  flight_.load_time = 5.0;
  after(2.0, [this] { EXPECT_EQ(suspensions_, Names{"another aircraft is being loaded"}); });
  expect(changes_.applyAircraft("Aircraft/Other/other.acf", 0), EventKind::kAircraft,
         "loaded Aircraft/Other/other.acf: HERE");
  EXPECT_EQ(suspensions_, (Names{"another aircraft is being loaded", ""}));
  EXPECT_EQ(flight_.messages, Names{"ACFN"});
}

TEST_F(FlightChangesTest12, SameAircraftIsLoadedAnew) {
  expect(changes_.applyAircraft(FakeFlight::kAircraftPath, 0), EventKind::kAircraft,
         std::string("loaded ") + FakeFlight::kAircraftPath + ": HERE");
  EXPECT_EQ(flight_.beginnings, 1U);
}

TEST_F(FlightChangesTest12, AircraftThatIsNotThereIsReported) {
  flight_.has_files = false;
  for (const std::string path : {"Aircraft/Other/other.acf", FakeFlight::kAircraftPath}) {
    const double begin = sim_.time();
    expectFailure(changes_.applyAircraft(path, 0), EventKind::kAircraft,
                  "load_aircraft " + path + ": X-Plane does not show it; is the path that of a file below its folder?");
    EXPECT_NEAR(sim_.time() - begin, 20.0, 0.5);
    EXPECT_EQ(suspensions_.back(), "") << "the present one is flown on";
  }
}

TEST_F(FlightChangesTest12, AircraftThatXPlaneDoesNotReportIsAFailure) {
  flight_.shows_aircraft = false;
  expectFailure(changes_.applyAircraft("Aircraft/Other/other.acf", 0), EventKind::kAircraft,
                "X-Plane has loaded it, but does not report which aircraft it is");
}

TEST_F(FlightChangesTest, Version11ShowsALoadedAircraftByANewFlight) {
  flight_.load_time = 2.0;
  const double begin = sim_.time();
  expect(changes_.applyAircraft("Aircraft/Other/other.acf", 0), EventKind::kAircraft,
         "loaded Aircraft/Other/other.acf: HERE");
  EXPECT_LT(sim_.time() - begin, 3.0);
  flight_.has_files = false;
  expectFailure(changes_.applyAircraft("Aircraft/Other/other.acf", 0), EventKind::kAircraft,
                "X-Plane does not show it");
}

TEST_F(FlightChangesTest, AircraftOfAFlightThatHasOnlyJustBegunIsSeenToLoad) {
  justBegun();
  expect(changes_.applyAircraft("Aircraft/Other/other.acf", 0), EventKind::kAircraft,
         "loaded Aircraft/Other/other.acf: HERE");
}

TEST_F(FlightChangesTest, AnotherAircraftIsSeenToBeLoaded) {
  flight_.setPaused(true);
  justBegun();
  after(1.0, [this] { flight_.aircraft = "OTHER"; });
  expect(changes_.applyAircraft("Aircraft/Other/other.acf", 0), EventKind::kAircraft,
         "loaded Aircraft/Other/other.acf: OTHER");
}

TEST_F(FlightChangesTest12, StopEndsTheWaitForAnAircraft) {
  flight_.has_files = false;
  after(1.0, [this] { changes_.stop(); });
  const double begin = sim_.time();
  EXPECT_FALSE(changes_.applyAircraft("Aircraft/Other/other.acf", 0).success);
  EXPECT_LT(sim_.time() - begin, 1.5);
  EXPECT_EQ(suspensions_.back(), "");
}

TEST_F(FlightChangesTest, NothingIsSentToAnXPlaneThatHasNotBeenFound) {
  sim_.forgetPeer();
  expectFailure(changes_.applyAircraft("Aircraft/Other/other.acf", 0), EventKind::kAircraft,
                "it could not be sent (the link is SEARCHING)");
  expectFailure(changes_.saveSituation("Output/a.sit"), EventKind::kSituation, "it could not be sent");
  expectFailure(changes_.applySituation("Output/a.sit"), EventKind::kSituation, "(the link is SEARCHING)");
}

// ------------------------------------------------------------------------------------------------ situations

TEST_F(FlightChangesTest, SavingASituationCannotBeSeen) {
  expect(changes_.saveSituation("Output/a.sit"), EventKind::kSituation,
         "asked X-Plane to save the situation as Output/a.sit; it does not show whether it did");
  EXPECT_EQ(flight_.beginnings, 0U);
}

TEST_F(FlightChangesTest, LoadedSituationBeginsAFlight) {
  expect(changes_.applySituation("Output/a.sit"), EventKind::kSituation, "the situation Output/a.sit is loaded");
  EXPECT_EQ(flight_.beginnings, 1U);
}

TEST_F(FlightChangesTest, SituationLoadedIntoAFlightThatHasOnlyJustBegunIsSeen) {
  justBegun();
  expect(changes_.applySituation("Output/a.sit"), EventKind::kSituation, "the situation Output/a.sit is loaded");
}

TEST_F(FlightChangesTest, SituationThatIsNotThereIsReported) {
  flight_.has_files = false;
  const double begin = sim_.time();
  expectFailure(changes_.applySituation("Output/a.sit"), EventKind::kSituation,
                "load_state Output/a.sit: the flight goes on as it was; is there such a file below X-Plane's folder?");
  EXPECT_NEAR(sim_.time() - begin, 20.0, 0.1);
}

}  // namespace
}  // namespace xplane_bridge
