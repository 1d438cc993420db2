#include "xplane_bridge/nodes/tx/lockstep_services.hpp"

#include <gtest/gtest.h>

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "actuation/actuation_rig.hpp"

namespace xplane_bridge {
namespace {

/// A paused X-Plane that does not wait for answers, and follows a pause command `late` frames after it.
class FreeStepTest : public testing::Test, protected ActuationRig {
 protected:
  FreeStepTest() {
    setPaused(true);
    sim_.on_message = [this](const core::FakeSimulator::Message& message) {
      if (message.path == "sim/operation/pause_toggle") {
        if (*sim_.status().paused) {
          if (resumes_) setPaused(false);
        } else {
          frames_to_pause_ = late_;
        }
      }
    };
    sim_.on_frame = [this] {
      if (frames_to_pause_ > 0 && --frames_to_pause_ == 0) setPaused(true);
    };
  }
  LockstepStep::Response step(std::uint32_t frames) {
    LockstepStep::Request request;
    request.frames = frames;
    LockstepStep::Response response;
    services_.step(request, &response);
    return response;
  }
  /// As another thread of the node calls while a step waits.
  void callInFrame(int frame, const std::function<void()>& call) {
    sim_.on_frame = [this, frame, call, obey = sim_.on_frame, seen = std::make_shared<int>(0)] {
      obey();
      if (++*seen == frame) call();
    };
  }

  int late_ = 1;
  int frames_to_pause_ = 0;
  bool resumes_ = true;
  bool ending_ = false;
  LockstepServices services_{nullptr, actuation_.get(), &sim_, [this] { return ending_; }, "tx_node/lockstep"};
};

TEST_F(FreeStepTest, FliesPausesAndSaysHowManyFramesThatWere) {
  const std::uint64_t before = actuation_->framesFlown();
  late_ = 3;
  const LockstepStep::Response response = step(5);
  EXPECT_TRUE(response.success) << response.result.message;
  EXPECT_EQ(response.result.code, ServiceResult::OK);
  EXPECT_EQ(sim_.status().paused, true);
  EXPECT_GT(response.flown, 5U) << "X-Plane pauses some frames late";
  EXPECT_EQ(response.flown, actuation_->framesFlown() - before);
  EXPECT_EQ(response.sim_time, actuation_->simTime());
}

TEST_F(FreeStepTest, NoFrameIsFlownForNone) {
  const LockstepStep::Response response = step(0);
  EXPECT_TRUE(response.success) << response.result.message;
  EXPECT_EQ(response.flown, 0U);
  EXPECT_EQ(sim_.status().paused, true);
}

TEST_F(FreeStepTest, SaysThatXPlaneDoesNotResume) {
  resumes_ = false;
  const LockstepStep::Response response = step(5);
  EXPECT_FALSE(response.success);
  EXPECT_EQ(response.result.code, ServiceResult::NO_LINK);
  EXPECT_EQ(response.result.message, "X-Plane did not follow in time");
  EXPECT_EQ(response.flown, 0U);
}

TEST_F(FreeStepTest, SaysThatNoFrameComesAndPausesAllTheSame) {
  sim_.on_frame = [this] { sim_.set("sim/time/total_running_time_sec", 100.0F); };  // its time stands, unpaused
  late_ = 1;
  const LockstepStep::Response response = step(5);
  EXPECT_FALSE(response.success);
  EXPECT_EQ(response.result.message, "no frame comes");
  EXPECT_EQ(sim_.commands().size(), 2U) << "resumed, and paused again";
}

TEST_F(FreeStepTest, IsRefusedWhileAResetRuns) {
  setPaused(false);
  sim_.set(kFlightTime, 0.0F);  // waited for, so that X-Plane's frames go on, on the thread of the jobs
  sim_.frame();
  sim_.breakJournal();  // which ends the reset before it pauses X-Plane
  bool asked = false;
  LockstepStep::Response response;
  sim_.on_frame = [&] {
    sim_.set(kFlightTime, sim_.value(kFlightTime) + 0.02F);
    if (!std::exchange(asked, true)) response = step(5);
  };
  core::FlightStart start;
  start.latitude_deg = 47.0;
  actuation_->jobs().reset(start, 1, "test");
  while (actuation_->jobs().busy()) std::this_thread::yield();
  EXPECT_FALSE(response.success);
  EXPECT_EQ(response.result.code, ServiceResult::REFUSED);
  EXPECT_EQ(response.result.message, "reset_flight runs: wait for its event");
  EXPECT_TRUE(sim_.commands().empty());
}

TEST_F(FreeStepTest, EndsWithTheNodeAndLeavesXPlaneFlying) {
  sim_.on_frame = [this] { ending_ = true; };
  const LockstepStep::Response response = step(1000000);
  EXPECT_LT(response.flown, 1000000U);
  EXPECT_FALSE(response.success);
  EXPECT_EQ(response.result.code, ServiceResult::NO_LINK);
  EXPECT_EQ(response.result.message, "tx_node ends");
  EXPECT_EQ(sim_.commands().size(), 1U) << "resumed, and not paused by a node that is not there to end it";
}

TEST_F(FreeStepTest, HoldEndsIt) {
  callInFrame(3, [this] { EXPECT_EQ(services_.setRunning(false), ""); });
  const double began = sim_.time();
  const LockstepStep::Response response = step(1000000);
  EXPECT_TRUE(response.success) << response.result.message;
  EXPECT_EQ(response.result.code, ServiceResult::OK);
  EXPECT_GE(response.flown, 3U);
  EXPECT_LT(response.flown, 20U);
  EXPECT_LT(sim_.time() - began, 1.0) << "it does not wait for frames of a paused X-Plane";
  EXPECT_EQ(sim_.status().paused, true);
  EXPECT_EQ(sim_.commands().size(), 2U) << "resumed, and paused once";
}

TEST_F(FreeStepTest, RunEndsItAndIsNotPausedAfterwards) {
  callInFrame(3, [this] { EXPECT_EQ(services_.setRunning(true), ""); });
  const LockstepStep::Response response = step(1000000);
  EXPECT_FALSE(response.success);
  EXPECT_EQ(response.result.code, ServiceResult::REFUSED);
  EXPECT_EQ(response.result.message, "another lockstep/step or lockstep/run has taken its place");
  EXPECT_LT(response.flown, 20U);
  EXPECT_EQ(sim_.status().paused, false);
}

TEST_F(FreeStepTest, AnotherStepTakesItsPlace) {
  LockstepStep::Response another;
  callInFrame(3, [&] { another = step(5); });
  const LockstepStep::Response response = step(1000000);
  EXPECT_TRUE(another.success) << another.result.message;
  EXPECT_GE(another.flown, 5U);
  EXPECT_FALSE(response.success);
  EXPECT_EQ(response.result.code, ServiceResult::REFUSED);
  EXPECT_EQ(sim_.status().paused, true);
}

TEST_F(FreeStepTest, RunsAndHolds) {
  EXPECT_EQ(services_.setRunning(true), "");
  EXPECT_EQ(sim_.status().paused, false);
  EXPECT_EQ(services_.setRunning(false), "");
  EXPECT_EQ(sim_.status().paused, true);
  EXPECT_EQ(eventsOf(core::EventKind::kPause).back().who, "tx_node/lockstep");
}

/// A simulator in lock-step, on a thread of its own as the link's, and a participant that answers each frame at once.
class LockstepStepTest : public testing::Test, protected ActuationRig {
 protected:
  LockstepStepTest() : flight_([this] { fly(); }) {}
  ~LockstepStepTest() override {
    end();
    flight_.join();
  }
  void end() {
    const std::lock_guard<std::mutex> lock(mutex_);
    ended_ = true;
    woken_.notify_all();
  }
  bool ended() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return ended_;
  }
  void wake() {
    const std::lock_guard<std::mutex> lock(mutex_);
    asked_ = true;
    woken_.notify_all();
  }
  void fly() {
    answer(0);
    while (true) {
      if (lockstep_.ready() && !ended()) {
        number_ > 0 ? lockstep_.close() : lockstep_.leaveFrameZero();
        ++number_;
        core::LockstepFrame frame;
        frame.number = number_;
        lockstep_.open(frame, stamp(number_));
        answer(number_);
        continue;
      }
      std::unique_lock<std::mutex> lock(mutex_);
      woken_.wait(lock, [this] { return asked_ || ended_; });
      asked_ = false;
      if (ended_) return;
    }
  }
  void answer(std::uint32_t frame) {
    lockstep_.takeDone("/rx_node", stamp(frame), frame == 0 ? kLockstepFrame0 : "");
    if (frame > 0) lockstep_.takeDone("/player", stamp(frame), "");
  }
  static ros::Time stamp(std::uint32_t frame) { return {1000U + frame, 0U}; }
  static LockstepOptions options() {
    LockstepOptions out;
    out.participants = {"player"};
    out.hold = true;
    return out;
  }
  LockstepStep::Response step(std::uint32_t frames) {
    LockstepStep::Request request;
    request.frames = frames;
    LockstepStep::Response response;
    services_.step(request, &response);
    return response;
  }
  /// A long step, during which another thread of the node calls.
  LockstepStep::Response stepUntil(const std::function<void()>& call) {
    LockstepStep::Response response;
    std::thread waiting([&] { response = step(1000000); });
    while (lockstep_.frame() < 2) std::this_thread::yield();
    call();
    waiting.join();
    return response;
  }

  std::mutex mutex_;
  std::condition_variable woken_;
  bool asked_ = false;
  bool ended_ = false;
  std::uint32_t number_ = 0;
  TxLockstep lockstep_{options(), core::hostClock(), stamp(0), [this] { wake(); }, [](const std::string&) {}};
  LockstepServices services_{&lockstep_, actuation_.get(), &sim_, [] { return false; }, "tx_node/lockstep"};
  std::thread flight_;  // last: it uses all of the above
};

TEST_F(LockstepStepTest, FliesExactlyWhatIsAskedFor) {
  EXPECT_EQ(step(3).flown, 3U);
  const LockstepStep::Response response = step(40);
  EXPECT_TRUE(response.success) << response.result.message;
  EXPECT_EQ(response.result.code, ServiceResult::OK);
  EXPECT_EQ(response.flown, 40U);
  EXPECT_EQ(lockstep_.frame(), 43U);
  EXPECT_EQ(step(0).flown, 0U);
  EXPECT_TRUE(sim_.commands().empty()) << "X-Plane's pause is not used";
}

TEST_F(LockstepStepTest, HoldsWhatRuns) {
  EXPECT_EQ(services_.setRunning(true), "");
  EXPECT_EQ(services_.setRunning(false), "");
  EXPECT_TRUE(step(0).success);
  const std::uint32_t held = lockstep_.frame();
  EXPECT_EQ(step(2).flown, 2U);
  EXPECT_EQ(lockstep_.frame(), held + 2U);
}

TEST_F(LockstepStepTest, RunEndsAStepThatWaits) {
  const LockstepStep::Response response = stepUntil([this] { EXPECT_EQ(services_.setRunning(true), ""); });
  EXPECT_FALSE(response.success);
  EXPECT_EQ(response.result.code, ServiceResult::REFUSED);
  EXPECT_EQ(response.result.message, "another lockstep/step or lockstep/run has taken its place");
}

TEST_F(LockstepStepTest, AnotherStepTakesThePlaceOfOneThatWaits) {
  LockstepStep::Response another;
  const LockstepStep::Response response = stepUntil([&] { another = step(5); });
  EXPECT_FALSE(response.success);
  EXPECT_EQ(response.result.code, ServiceResult::REFUSED);
  EXPECT_EQ(response.result.message, "another lockstep/step or lockstep/run has taken its place");
  EXPECT_GE(response.flown, 2U);
  EXPECT_LE(response.flown, lockstep_.frame());
  EXPECT_TRUE(another.success) << another.result.message;
  EXPECT_EQ(another.result.code, ServiceResult::OK);
}

TEST_F(LockstepStepTest, HoldEndsAStepThatWaits) {
  const LockstepStep::Response response = stepUntil([this] { EXPECT_EQ(services_.setRunning(false), ""); });
  EXPECT_TRUE(response.success) << response.result.message;
  EXPECT_LT(response.flown, 1000000U);
}

TEST_F(LockstepStepTest, SaysThatTheNodeEnds) {
  EXPECT_TRUE(step(1).success);
  end();
  lockstep_.stop();
  const LockstepStep::Response response = step(1);
  EXPECT_FALSE(response.success);
  EXPECT_EQ(response.result.code, ServiceResult::NO_LINK);
  EXPECT_EQ(response.result.message, "tx_node ends");
}

}  // namespace
}  // namespace xplane_bridge
