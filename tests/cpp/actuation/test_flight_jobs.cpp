#include "xplane_bridge/actuation/flight_jobs.hpp"

#include <gtest/gtest.h>

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
  struct Told {
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
    out.identities = [this] { return flight_.identities; };
    out.aircraft = [this] { return aircraft_(); };
    out.suspend_control = [this](const std::string& reason) {
      if (reason.empty()) return;
      movers_.push_back(jobs_.mover());
      at_it_.set_value();
      released_.wait();
    };
    out.pausing = [](const std::string&) {};
    return out;
  }
  /// The events, once there are so many.
  std::vector<Told> told(std::size_t count) {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [&] { return told_.size() >= count; });
    return told_;
  }

  core::FakeSimulator sim_{core::kXPlane12};
  core::FakeFlight flight_{&sim_};
  std::function<std::string()> aircraft_ = [] { return "OTHER"; };
  std::vector<std::string> movers_;  // while an aircraft is being loaded
  std::promise<void> at_it_;         // the loading of an aircraft has begun, and waits for
  std::promise<void> go_on_;
  std::shared_future<void> released_ = go_on_.get_future().share();
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Told> told_;
  FlightJobs jobs_{&sim_,
                   {2.0, 20.0},
                   hooks(),
                   [this](std::uint32_t number, const FlightChangeOutcome& outcome, const std::string& who) {
                     std::lock_guard<std::mutex> lock(mutex_);
                     told_.push_back({number, outcome.text, who, outcome.success});
                     changed_.notify_all();
                   }};
};

TEST_F(FlightJobsTest, JobsAreDoneInOrderEachWithItsNumber) {
  jobs_.saveSituation("Output/a.sit", 7, "node/save_state");
  jobs_.saveSituation("Output/b.sit", 9, "other");
  const auto events = told(2);
  EXPECT_EQ(events[0].number, 7U);
  EXPECT_EQ(events[0].who, "node/save_state");
  EXPECT_NE(events[0].text.find("Output/a.sit"), std::string::npos);
  EXPECT_TRUE(events[0].success);
  EXPECT_EQ(events[1].number, 9U);
  EXPECT_NE(events[1].text.find("Output/b.sit"), std::string::npos);
}

TEST_F(FlightJobsTest, WhoMovesTheAircraftIsKnownForAsLong) {
  EXPECT_EQ(jobs_.mover(), "");
  jobs_.loadAircraft(kPath, 0, 1, "node/load_aircraft");
  at_it_.get_future().wait();
  EXPECT_EQ(jobs_.mover(), "node/load_aircraft");
  go_on_.set_value();
  EXPECT_EQ(told(1)[0].text, std::string("loaded ") + kPath + ": OTHER");
  jobs_.saveSituation("Output/a.sit", 2, "node/save_state");
  told(2);
  EXPECT_EQ(jobs_.mover(), "") << "saving moves nothing";
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

TEST_F(FlightJobsTest, StopEndsTheOneAtItAndDropsTheOthers) {
  flight_.has_files = false;
  jobs_.loadAircraft(kPath, 0, 1, "node/load_aircraft");
  at_it_.get_future().wait();
  jobs_.saveSituation("Output/a.sit", 2, "node/save_state");
  std::thread stopping([this] { jobs_.stop(); });
  while (!jobs_.full()) std::this_thread::yield();  // until the stop has been asked for
  go_on_.set_value();
  stopping.join();
  ASSERT_EQ(told_.size(), 1U);
  EXPECT_FALSE(told_[0].success);
  EXPECT_NE(told_[0].text.find(" (tx_node ends)"), std::string::npos) << told_[0].text;
  jobs_.saveSituation("Output/b.sit", 3, "node/save_state");
  EXPECT_EQ(flight_.sent("SIMO"), 0U);
  go_on_ = std::promise<void>();
}

TEST_F(FlightJobsTest, ErrorEndsItsJobOnly) {
  aircraft_ = []() -> std::string { throw std::runtime_error("the disk is full"); };
  go_on_.set_value();
  jobs_.loadAircraft(kPath, 0, 1, "node/load_aircraft");
  jobs_.saveSituation("Output/a.sit", 2, "node/save_state");
  const auto events = told(2);
  EXPECT_EQ(events[0].text, "node/load_aircraft: the disk is full");
  EXPECT_FALSE(events[0].success);
  EXPECT_TRUE(events[1].success);
  go_on_ = std::promise<void>();
}

}  // namespace
}  // namespace xplane_bridge
