#include "xplane_bridge/actuation/flight_jobs.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <future>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "fake_flight.hpp"

namespace xplane_bridge {
namespace {

constexpr const char* kPath = "Aircraft/Other/other.acf";

/// The fake X-Plane is touched by the jobs' thread only, once there are jobs.
class FlightJobsTest : public testing::Test {
 protected:
  struct Outcome {
    std::uint32_t number;
    std::string text;
    std::string who;
    bool success;
  };

  FlightJobsTest() {
    sim_.on_frame = [this] { flight_.move(); };
  }
  ~FlightJobsTest() override {
    go_on_.set_value();
    jobs_.stop();
  }

  FlightChangeHooks hooks() {
    FlightChangeHooks out;
    out.watch = [this] { return flight_.watch(); };
    out.resets = [this] { return flight_.resets(); };
    out.placed = [] {};
    out.identities = [this] { return flight_.identities; };
    out.aircraft = [this] { return aircraft_(); };
    out.suspend_control = [this](const std::string& reason) {
      if (reason.empty()) return;
      callers_.push_back(jobs_.movingCaller());
      reset_seen_ = reset_seen_ || jobs_.resets();
      at_it_.set_value();
      released_.wait();
    };
    out.pausing = [this](const std::string&) { reset_seen_ = reset_seen_ || jobs_.resets(); };
    return out;
  }
  /// The events, once there are so many.
  std::vector<Outcome> outcomes(std::size_t count) {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [&] { return outcomes_.size() >= count; });
    return outcomes_;
  }

  core::FakeSimulator sim_{core::kXPlane12};
  core::FakeFlight flight_{&sim_};
  std::function<std::string()> aircraft_ = [] { return "OTHER"; };
  std::vector<std::string> callers_;     // while an aircraft is being loaded
  std::atomic<bool> reset_seen_{false};  // where X-Plane is paused, or an aircraft loaded
  std::promise<void> at_it_;             // the loading of an aircraft has begun, and waits for
  std::promise<void> go_on_;
  std::shared_future<void> released_ = go_on_.get_future().share();
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Outcome> outcomes_;
  FlightJobs jobs_{&sim_,
                   {2.0, 20.0},
                   hooks(),
                   [this](std::uint32_t number, const FlightChangeOutcome& outcome, const std::string& who) {
                     std::lock_guard<std::mutex> lock(mutex_);
                     outcomes_.push_back({number, outcome.text, who, outcome.success});
                     changed_.notify_all();
                   }};
};

TEST_F(FlightJobsTest, JobsAreDoneInOrderEachWithItsNumber) {
  jobs_.saveSituation("Output/a.sit", 7, "node/save_state");
  jobs_.saveSituation("Output/b.sit", 9, "other");
  const auto events = outcomes(2);
  EXPECT_EQ(events[0].number, 7U);
  EXPECT_EQ(events[0].who, "node/save_state");
  EXPECT_NE(events[0].text.find("Output/a.sit"), std::string::npos);
  EXPECT_TRUE(events[0].success);
  EXPECT_EQ(events[1].number, 9U);
  EXPECT_NE(events[1].text.find("Output/b.sit"), std::string::npos);
}

TEST_F(FlightJobsTest, WhoMovesTheAircraftIsKnownForAsLong) {
  EXPECT_EQ(jobs_.movingCaller(), "");
  jobs_.loadAircraft(kPath, 0, 1, "node/load_aircraft");
  at_it_.get_future().wait();
  EXPECT_EQ(jobs_.movingCaller(), "node/load_aircraft");
  EXPECT_FALSE(jobs_.placing()) << "X-Plane may not have it";
  jobs_.onEffect();
  EXPECT_TRUE(jobs_.placing());
  go_on_.set_value();
  EXPECT_EQ(outcomes(1)[0].text, std::string("loaded ") + kPath + ": OTHER");
  EXPECT_FALSE(reset_seen_) << "no load is a reset";
  jobs_.saveSituation("Output/a.sit", 2, "node/save_state");
  outcomes(2);
  EXPECT_EQ(jobs_.movingCaller(), "") << "saving moves nothing";
  EXPECT_FALSE(jobs_.placing());
  go_on_ = std::promise<void>();
}

TEST_F(FlightJobsTest, MoreThanEightAreTooMany) {
  jobs_.loadAircraft(kPath, 0, 1, "node/load_aircraft");
  at_it_.get_future().wait();
  for (std::uint32_t number = 2; number < 2 + FlightJobs::kMostWaiting; ++number) {
    EXPECT_FALSE(jobs_.full());
    jobs_.saveSituation("Output/a.sit", number, "node/save_state");
  }
  EXPECT_TRUE(jobs_.full());
}

TEST_F(FlightJobsTest, StopEndsTheOneAtItAndReportsTheOthers) {
  flight_.has_files = false;
  jobs_.loadAircraft(kPath, 0, 1, "node/load_aircraft");
  at_it_.get_future().wait();
  jobs_.saveSituation("Output/a.sit", 2, "node/save_state");
  std::thread stopping([this] { jobs_.stop(); });
  while (!jobs_.full()) std::this_thread::yield();  // until the stop has been asked for
  go_on_.set_value();
  stopping.join();
  jobs_.saveSituation("Output/b.sit", 3, "node/save_state");
  go_on_ = std::promise<void>();
  ASSERT_EQ(outcomes_.size(), 3U);
  EXPECT_FALSE(outcomes_[0].success);
  EXPECT_NE(outcomes_[0].text.find(" (tx_node ends)"), std::string::npos) << outcomes_[0].text;
  for (const std::size_t dropped : {1U, 2U}) {
    EXPECT_EQ(outcomes_[dropped].number, dropped + 1);
    EXPECT_EQ(outcomes_[dropped].text, "save_state: not begun, tx_node ends");
    EXPECT_EQ(outcomes_[dropped].who, "node/save_state");
    EXPECT_FALSE(outcomes_[dropped].success);
  }
  EXPECT_EQ(flight_.sent("SIMO"), 0U);
  EXPECT_FALSE(jobs_.busy());
}

TEST_F(FlightJobsTest, EachKindIsDoneAndSaysWhich) {
  go_on_.set_value();
  flight_.has_files = false;
  core::Weather weather;
  weather.visibility = 5000.0;
  core::TimeSetting time;
  time.zulu_time = 3600.0;
  core::Loading loading;
  loading.payload_mass = 100.0;
  jobs_.setWind({5.0, 270.0, 0.0}, 1, "a");
  jobs_.setLoading(loading, 2, "b");
  jobs_.setTime(time, 3, "c");
  jobs_.setWeather(weather, 4, "d");
  jobs_.loadSituation("Output/a.sit", 5, "e");
  // This X-Plane has neither weather nor clock nor scales, and not that file.
  const auto events = outcomes(5);
  const std::vector<std::string> kinds = {"set_wind", "set_loading", "set_time", "set_weather", "load_state"};
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    EXPECT_EQ(events[i].number, i + 1);
    EXPECT_EQ(events[i].text.find(kinds[i]), 0U) << events[i].text;
    EXPECT_FALSE(events[i].success);
  }
  go_on_ = std::promise<void>();
}

TEST_F(FlightJobsTest, FlightIsPlacedByAJobToo) {
  core::FlightStart start;
  start.latitude_deg = core::FakeFlight::kLatitude;
  start.longitude_deg = core::FakeFlight::kLongitude;
  start.altitude_msl = 800.0;
  start.true_airspeed = 60.0;
  go_on_.set_value();
  at_it_ = std::promise<void>();
  jobs_.reset(start, 3, "node/reset_flight");
  const auto events = outcomes(1);
  EXPECT_EQ(events[0].number, 3U);
  EXPECT_TRUE(events[0].success) << events[0].text;
  EXPECT_GT(flight_.sent("VEHS"), 0U);
  EXPECT_TRUE(reset_seen_);
  go_on_ = std::promise<void>();
}

TEST_F(FlightJobsTest, RefusesWhereXPlaneCannot) {
  EXPECT_FALSE(jobs_.refusal());
  sim_.setVersion({105000});
  ASSERT_TRUE(jobs_.refusal());
  EXPECT_EQ(jobs_.refusal()->code, core::ResultCode::kNotSupported);
  EXPECT_NE(jobs_.refusal()->text.find("105000"), std::string::npos) << jobs_.refusal()->text;
  sim_.setVersion({});
  EXPECT_EQ(jobs_.refusal()->code, core::ResultCode::kNoLink) << "it has not reported its version yet";
  sim_.setVersion(core::kXPlane12);
  sim_.setState(core::LinkState::kLost);
  EXPECT_EQ(jobs_.refusal()->code, core::ResultCode::kNoLink);
}

TEST_F(FlightJobsTest, RefusesWhileTooManyWait) {
  jobs_.loadAircraft(kPath, 0, 1, "node/load_aircraft");
  at_it_.get_future().wait();
  for (std::uint32_t number = 2; number < 2 + FlightJobs::kMostWaiting; ++number) {
    jobs_.saveSituation("Output/a.sit", number, "node/save_state");
  }
  ASSERT_TRUE(jobs_.refusal());
  EXPECT_EQ(jobs_.refusal()->code, core::ResultCode::kRefused);
}

TEST_F(FlightJobsTest, ErrorEndsItsJobOnly) {
  aircraft_ = []() -> std::string { throw std::runtime_error("the disk is full"); };
  go_on_.set_value();
  jobs_.loadAircraft(kPath, 0, 1, "node/load_aircraft");
  jobs_.saveSituation("Output/a.sit", 2, "node/save_state");
  const auto events = outcomes(2);
  EXPECT_EQ(events[0].text, "node/load_aircraft: the disk is full");
  EXPECT_FALSE(events[0].success);
  EXPECT_TRUE(events[1].success);
  go_on_ = std::promise<void>();
}

}  // namespace
}  // namespace xplane_bridge
