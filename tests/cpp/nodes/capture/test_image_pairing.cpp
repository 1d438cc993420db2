#include "xplane_bridge/nodes/capture/image_pairing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <boost/make_shared.hpp>

#include "xplane_bridge/nodes/capture/picture_clock.hpp"
#include "xplane_bridge/vision/server_clock.hpp"

namespace xplane_bridge {
namespace {

constexpr double kFps = 60.0;
constexpr double kDelay = 0.05;                        // [s] from a frame to its display: three frames
constexpr std::int64_t kStart = 1700000000'000000000;  // [ns] what a right clock shows at the start
constexpr double kSimStart = 1000.0;                   // [s] float32 steps there by 0.06 ms

std::int64_t ns(double seconds) { return static_cast<std::int64_t>(std::llround(seconds * 1e9)); }

/// A clock that is wrong: shows start + offset + (1 + drift) t.
struct HostClock {
  double offset = 0.0;  ///< [s]
  double drift = 0.0;   ///< 1e-4 = 100 ppm fast
  std::int64_t at(double t) const { return kStart + ns(offset + (1.0 + drift) * t); }
};

struct Case {
  const char* name;
  HostClock capture;    ///< of the machine with the pictures, relative to the one that X-Plane keeps time with
  HostClock rx;         ///< of the machine whose rx_node stamps the states
  double jitter;        ///< [s] mean of the exponential part of every datagram's delay
  double state_jitter;  ///< [s] the same, of the states' way to the capture host
  double swap_jitter;   ///< [s] 1 sigma
};

/// Frames of a simulator, the states that another machine makes of them, and the pictures that show them.
/// @param shown_after [s] from a frame to its display, in truth
std::map<std::uint32_t, FrameState> fly(const Case& clocks, double seconds, double display_delay,
                                        double shown_after = kDelay) {
  std::map<std::uint32_t, FrameState> answers;  // by the number of the frame shown
  ImagePairing pairing(display_delay, 0.2,
                       [&answers](const FrameState& answer) { answers[answer.image_count] = answer; });
  std::mt19937 random(11);
  std::exponential_distribution<double> extra(1.0);
  std::normal_distribution<double> swap(0.0, clocks.swap_jitter);
  std::vector<std::pair<std::int64_t, std::function<void(std::int64_t)>>> events;  // by the capture host's clock
  double last_arrival = 0.0, last_state = 0.0;
  for (std::uint32_t k = 0; k < static_cast<std::uint32_t>(seconds * kFps); ++k) {
    const double t = k / kFps;
    core::SimStatus status;
    status.sim_time = static_cast<float>(kSimStart + t);
    last_arrival = std::max(last_arrival, t + 1e-4 + clocks.jitter * extra(random));
    core::FrameCamera camera;  // moves a metre a frame
    camera.pose.emplace();
    camera.pose->sim_time = static_cast<double>(status.sim_time);
    camera.pose->pose.position.x() = k;
    camera.pose->sure = true;
    events.emplace_back(clocks.capture.at(last_arrival), [&pairing, status, camera](std::int64_t now) {
      pairing.addCamera(now, camera.pose->sim_time, camera);
      pairing.addFrame(status, static_cast<float>(1.0 / kFps), now);
    });
    const auto state = boost::make_shared<FlightState>();
    state->sim_time = static_cast<float>(kSimStart + t);
    state->header.stamp.fromNSec(static_cast<std::uint64_t>(clocks.rx.at(t)));
    last_state = std::max(last_state, t + 3e-4 + clocks.state_jitter * extra(random));
    events.emplace_back(clocks.capture.at(last_state),
                        [&pairing, state](std::int64_t now) { pairing.addState(state, now); });
    FrameState picture;
    picture.image_count = k;
    picture.camera_pose_source = FrameState::POSE_MEASURED;
    const std::int64_t shown = clocks.capture.at(t + shown_after + swap(random));
    events.emplace_back(
        shown, [&pairing, picture, shown](std::int64_t now) { pairing.addPicture(picture, shown, now + ns(0.001)); });
    events.emplace_back(clocks.capture.at(t + 0.5 / kFps), [&pairing](std::int64_t now) { pairing.flush(now); });
  }
  std::stable_sort(events.begin(), events.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [now, event] : events) event(now);
  return answers;
}

class TwoClocks : public ::testing::TestWithParam<Case> {};

/// By hand: the picture of frame k appears kDelay after it, so its state is the one with sim_time 1000 + k / 60,
/// whatever the clocks show. In two minutes 100 ppm are 12 ms, 0.7 of a frame; 200 ppm between the machines 1.4 frames.
TEST_P(TwoClocks, EveryPictureGetsTheStateOfItsFrame) {
  const Case& clocks = GetParam();
  const auto answers = fly(clocks, 120.0, kDelay);
  int judged = 0;
  double worst_uncertainty = 0.0;
  for (const auto& [k, answer] : answers) {
    if (k < 60) continue;  // the first second: the clock is being learnt
    ++judged;
    ASSERT_EQ(answer.quality & (FrameState::QUALITY_STATE_MISSING | FrameState::QUALITY_INTERPOLATED |
                                FrameState::QUALITY_OFF_FRAME | FrameState::QUALITY_CLOCK_UNSURE),
              0U)
        << "frame " << k;
    ASSERT_FLOAT_EQ(answer.state.sim_time, static_cast<float>(kSimStart + k / kFps)) << "frame " << k;
    ASSERT_NEAR(answer.frame_sim_time, kSimStart + k / kFps, 1e-4);
    ASSERT_NEAR(answer.sim_time_error, 0.0, 1e-4);
    ASSERT_EQ(answer.body_to_camera.translation.x, k);
    ASSERT_EQ(answer.quality & FrameState::QUALITY_POSE_UNSURE, 0U);
    // The state keeps the stamp of the machine that made it.
    ASSERT_EQ(static_cast<std::int64_t>(answer.state.header.stamp.toNSec()), clocks.rx.at(k / kFps));
    worst_uncertainty = std::max(worst_uncertainty, answer.clock_uncertainty);
  }
  EXPECT_GE(judged, 7200 - 60 - 15);  // the last pictures of the flight find no end of it
  EXPECT_LT(worst_uncertainty, 0.25 / kFps);
}

INSTANTIATE_TEST_SUITE_P(
    Clocks, TwoClocks,
    ::testing::Values(Case{"one machine", {}, {}, 1e-4, 1e-4, 1e-3},
                      Case{"rx seconds behind", {}, {-3.7, 0.0}, 2e-4, 5e-4, 1e-3},
                      Case{"rx an hour ahead and fast", {}, {3600.0, 1e-4}, 2e-4, 5e-4, 1e-3},
                      Case{"capture fast", {2.5, 1e-4}, {}, 3e-4, 5e-4, 1e-3},
                      Case{"capture slow, rx fast", {-8.0, -1e-4}, {5.0, 1e-4}, 3e-4, 2e-3, 1e-3},
                      Case{"capture fast, rx slow, a poor network", {1.0, 1e-4}, {-1.0, -1e-4}, 1e-3, 4e-3, 1e-3}),
    [](const auto& instance) {
      std::string name = instance.param.name;
      name.erase(std::remove_if(name.begin(), name.end(), [](char c) { return c == ' ' || c == ','; }), name.end());
      return name;
    });

/// A delay that is wrong by one frame pairs every picture with the frame beside it: nothing here is right by itself.
TEST(ImagePairing, DelayWrongByOneFrameIsOneFrameOff) {
  const auto answers = fly({"", {0.0, 1e-4}, {9.0, -1e-4}, 2e-4, 5e-4, 5e-4}, 20.0, kDelay + 1.0 / kFps);
  int judged = 0;
  for (const auto& [k, answer] : answers) {
    if (k < 60) continue;
    ++judged;
    ASSERT_FLOAT_EQ(answer.state.sim_time, static_cast<float>(kSimStart + (k - 1) / kFps)) << "frame " << k;
    ASSERT_EQ(answer.body_to_camera.translation.x, k - 1);
  }
  EXPECT_GT(judged, 1100);
}

/// A calibration may find that pictures appear before the datagrams of their frames come: they wait for these.
TEST(ImagePairing, PicturesMayComeBeforeTheirFrames) {
  constexpr double kEarly = -0.02;
  const auto answers = fly({"", {}, {}, 1e-4, 1e-4, 5e-4}, 20.0, kEarly, kEarly);
  int judged = 0;
  for (const auto& [k, answer] : answers) {
    if (k < 60) continue;
    ++judged;
    ASSERT_EQ(answer.quality & (FrameState::QUALITY_STATE_MISSING | FrameState::QUALITY_OFF_FRAME |
                                FrameState::QUALITY_DELAY_ASSUMED | FrameState::QUALITY_POSE_UNSURE),
              0U)
        << "frame " << k;
    ASSERT_FLOAT_EQ(answer.state.sim_time, static_cast<float>(kSimStart + k / kFps)) << "frame " << k;
    ASSERT_EQ(answer.body_to_camera.translation.x, k);
    ASSERT_EQ(answer.display_delay, kEarly);
  }
  EXPECT_GT(judged, 1100);
}

/// X-Plane stutters: frame 600 lasts 90 ms but simulates 50 ms, frame 602 the same. By hand, sim time after frame 602
/// is 2 x (50 - 16.7) ms more than 1000 + k / 60, and host time 2 x (90 - 16.7) ms.
TEST(ImagePairing, StuttersDoNotShiftThePairing) {
  std::map<std::uint32_t, FrameState> answers;
  ImagePairing pairing(kDelay, 0.2, [&answers](const FrameState& answer) { answers[answer.image_count] = answer; });
  std::vector<std::pair<double, std::function<void(std::int64_t)>>> events;
  std::map<std::uint32_t, float> sim_times;
  double host = 0.0, sim = kSimStart;
  for (std::uint32_t k = 0; k < 900; ++k) {
    const bool stutter = k == 600 || k == 602;
    host += stutter ? 0.09 : 1.0 / kFps;
    const auto period = static_cast<float>(stutter ? 0.05 : 1.0 / kFps);
    sim += static_cast<double>(period);
    sim_times[k] = static_cast<float>(sim);
    core::SimStatus status;
    status.sim_time = sim_times[k];
    events.emplace_back(host + 1e-4,
                        [&pairing, status, period](std::int64_t now) { pairing.addFrame(status, period, now); });
    const auto state = boost::make_shared<FlightState>();
    state->sim_time = sim_times[k];
    state->header.stamp.fromNSec(static_cast<std::uint64_t>(kStart + ns(host)));
    events.emplace_back(host + 5e-4, [&pairing, state](std::int64_t now) { pairing.addState(state, now); });
    FrameState picture;
    picture.image_count = k;
    const std::int64_t shown = kStart + ns(host + kDelay);
    events.emplace_back(host + kDelay + 1e-3,
                        [&pairing, picture, shown](std::int64_t now) { pairing.addPicture(picture, shown, now); });
  }
  std::stable_sort(events.begin(), events.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [time, event] : events) event(kStart + ns(time));
  ASSERT_GE(answers.size(), 890U);
  for (const auto& [k, answer] : answers) {
    if (k < 60) continue;
    EXPECT_EQ(answer.state.sim_time, sim_times[k]) << "frame " << k;
  }
}

/// At the start pictures come before the states and the clock do; they wait for both, and are right.
TEST(ImagePairing, TheFirstPicturesWaitForTheirStates) {
  std::map<std::uint32_t, FrameState> answers;
  ImagePairing pairing(kDelay, 0.2, [&answers](const FrameState& answer) { answers[answer.image_count] = answer; });
  std::vector<FlightState::ConstPtr> states;
  const double late = 1.5;  // [s] the states' connection
  for (std::uint32_t k = 0; k < 300; ++k) {
    const double t = k / kFps;
    core::SimStatus status;
    status.sim_time = static_cast<float>(kSimStart + t);
    pairing.addFrame(status, static_cast<float>(1.0 / kFps), kStart + ns(t));
    const auto state = boost::make_shared<FlightState>();
    state->sim_time = status.sim_time;
    state->header.stamp.fromNSec(static_cast<std::uint64_t>(kStart + ns(t)));
    states.push_back(state);
    if (t >= late) {
      for (const FlightState::ConstPtr& waiting : states) pairing.addState(waiting, kStart + ns(t));
      states.clear();
    }
    if (k < 3) continue;
    FrameState picture;
    picture.image_count = k - 3;
    pairing.addPicture(picture, kStart + ns(t), kStart + ns(t));
    ASSERT_TRUE(t >= late || answers.empty()) << "at " << t << " s";
  }
  ASSERT_GT(answers.size(), 250U);
  for (const auto& [k, answer] : answers) {
    if (k < 30) continue;  // the clock is being learnt
    ASSERT_EQ(answer.quality & FrameState::QUALITY_STATE_MISSING, 0U) << "frame " << k;
    ASSERT_EQ(answer.state.sim_time, static_cast<float>(kSimStart + k / kFps)) << "frame " << k;
  }
}

/// Where no state ever comes they go out without one, two seconds after the first at the latest.
TEST(ImagePairing, TheFirstPicturesDoNotWaitForEver) {
  int answered = 0;
  ImagePairing pairing(kDelay, 0.2, [&answered](const FrameState& answer) {
    ++answered;
    EXPECT_NE(answer.quality & FrameState::QUALITY_STATE_MISSING, 0U);
  });
  for (int k = 0; k < 10; ++k) pairing.addPicture(FrameState(), kStart, kStart + ns(0.1 * k));
  pairing.flush(kStart + ns(1.99));
  EXPECT_EQ(answered, 0);
  pairing.flush(kStart + ns(2.0));
  EXPECT_EQ(answered, 10);
  pairing.addPicture(FrameState(), kStart, kStart + ns(3.0));
  pairing.flush(kStart + ns(3.2));
  EXPECT_EQ(answered, 11);
}

/// A picture from before all frames waits to its end, and those behind it have states and poses of their frames still.
TEST(ImagePairing, OnePictureThatWaitsForLongCostsTheOthersNothing) {
  std::map<std::uint32_t, FrameState> answers;
  ImagePairing pairing(kDelay, 10.0, [&answers](const FrameState& answer) { answers[answer.image_count] = answer; });
  for (std::uint32_t k = 0; k < 900; ++k) {
    const std::int64_t now = kStart + ns(k / kFps);
    if (k >= 30) {
      core::SimStatus status;
      status.sim_time = static_cast<float>(kSimStart + k / kFps);
      core::FrameCamera camera;
      camera.pose.emplace().sim_time = static_cast<double>(status.sim_time);
      camera.pose->sure = true;
      pairing.addCamera(now, camera.pose->sim_time, camera);
      pairing.addFrame(status, static_cast<float>(1.0 / kFps), now);
      const auto state = boost::make_shared<FlightState>();
      state->sim_time = status.sim_time;
      pairing.addState(state, now);
    }
    FrameState picture;
    picture.image_count = k - 3;
    picture.camera_pose_source = FrameState::POSE_MEASURED;
    if (k >= 3) pairing.addPicture(picture, now, now);
  }
  ASSERT_GT(answers.size(), 890U);
  EXPECT_NE(answers.at(0).quality & FrameState::QUALITY_STATE_MISSING, 0U);
  for (const auto& [k, answer] : answers) {
    if (k < 60) continue;  // the clock is being learnt
    ASSERT_EQ(answer.quality & (FrameState::QUALITY_STATE_MISSING | FrameState::QUALITY_POSE_UNSURE), 0U) << k;
    ASSERT_EQ(answer.state.sim_time, static_cast<float>(kSimStart + k / kFps)) << "frame " << k;
  }
}

/// A sender's pictures name their frames: no frame was ever heard here, and the stamps are nonsense.
TEST(ImagePairing, AKeyNeedsNoClock) {
  std::map<std::uint32_t, FrameState> answers;
  ImagePairing pairing(kDelay, 0.2, [&answers](const FrameState& answer) { answers[answer.image_count] = answer; });
  std::mt19937 random(7);
  for (std::uint32_t k = 0; k < 200; ++k) {
    const auto state = boost::make_shared<FlightState>();
    state->sim_time = static_cast<float>(kSimStart + k / kFps);
    state->header.stamp.fromNSec(static_cast<std::uint64_t>(kStart + ns(k / kFps)));
    pairing.addState(state, kStart + ns(k / kFps));
    if (k < 20) continue;
    FrameState picture;  // of a frame up to 15 frames ago
    picture.image_count = k;
    const std::uint32_t shown = k - static_cast<std::uint32_t>(random() % 16);
    const std::int64_t shown_ns = kStart + ns(static_cast<double>(random() % 1000));
    picture.display_delay = 0.06;
    picture.quality = shown % 2 == 0 ? 0U : static_cast<std::uint32_t>(FrameState::QUALITY_BORDERLINE);
    const auto key = static_cast<float>(kSimStart + shown / kFps);
    pairing.addPicture(picture, shown_ns, kStart + ns(k / kFps), key);
    ASSERT_EQ(answers.count(k), 1U) << "picture " << k << " waits for something";
    EXPECT_EQ(answers[k].state.sim_time, key);
    EXPECT_EQ(answers[k].frame_sim_time, static_cast<double>(key));
    EXPECT_EQ(answers[k].quality, picture.quality);
    EXPECT_EQ(answers[k].display_delay, 0.06);
  }
}

/// X-Plane's view widens by a degree a frame. Of a picture whose frame was not heard, the one before counts, by the
/// picture's own delay: three frames where this node's parameter is none. It is no more than a guess.
TEST(ImagePairing, TheCameraOfAFrameThatWasNotHeardGoesByThePicturesOwnDelay) {
  ImagePairing pairing(0.0, 0.2, [](const FrameState&) {});
  constexpr int kLost = 20;
  const auto key = [](int k) { return static_cast<float>(kSimStart + k / kFps); };
  for (int k = 0; k < 40; ++k) {
    if (k == kLost) continue;
    core::FrameCamera camera;
    camera.frustum.horizontal_deg = k < kLost ? 60.0 : 80.0;
    camera.frustum.known = true;
    pairing.addCamera(kStart + ns(k / kFps), static_cast<double>(key(k)), camera);
  }
  const std::int64_t shown = kStart + ns((kLost - 0.1) / kFps + kDelay);
  const auto lost = pairing.cameraOf(shown, key(kLost), kDelay);
  ASSERT_TRUE(lost.has_value());
  EXPECT_EQ(lost->frustum.horizontal_deg, 60.0);
  EXPECT_FALSE(lost->frustum.known);
  // Also where its neighbours agree: theirs is not its own.
  EXPECT_FALSE(pairing.cameraOf(kStart + ns(10 / kFps + kDelay), key(100), kDelay)->frustum.known);
  const auto heard = pairing.cameraOf(shown, key(kLost + 1), kDelay);
  EXPECT_EQ(heard->frustum.horizontal_deg, 80.0);
  EXPECT_TRUE(heard->frustum.known);
  // Without a key this node's own delay counts.
  EXPECT_EQ(pairing.cameraOf(shown, {}, kDelay)->frustum.horizontal_deg, 80.0);
}

/// With `publish_clock` states are stamped with simulator time, which says nothing of the host's; pictures get theirs.
TEST(ImagePairing, StampsOfTheSimulatorAreNotTakenForTheHosts) {
  std::map<std::uint32_t, FrameState> answers;
  ImagePairing pairing(
      kDelay, 0.2, [&answers](const FrameState& answer) { answers[answer.image_count] = answer; },
      ImagePairing::Stamps::kSimulator);
  EXPECT_FALSE(pairing.simTime(kStart).has_value()) << "nothing was heard yet";
  core::SimStatus status;
  for (std::uint32_t k = 0; k < 300; ++k) {
    const double t = k / kFps;
    status.sim_time = static_cast<float>(kSimStart + t);
    pairing.addFrame(status, static_cast<float>(1.0 / kFps), kStart + ns(t));
    const auto state = boost::make_shared<FlightState>();
    state->sim_time = status.sim_time;
    state->header.stamp.fromNSec(static_cast<std::uint64_t>(ns(kSimStart + t)));
    pairing.addState(state, kStart + ns(t + 5e-4));
    FrameState picture;
    picture.image_count = k;
    pairing.addPicture(picture, kStart + ns(t + kDelay), kStart + ns(t + kDelay));
    pairing.flush(kStart + ns(t + kDelay));
  }
  pairing.flush(kStart + ns(10.0));
  for (std::uint32_t k = 60; k < 290; ++k) {
    EXPECT_EQ(answers[k].state.sim_time, static_cast<float>(kSimStart + k / kFps)) << "frame " << k;
  }
  EXPECT_NEAR(*pairing.simTime(kStart + ns(4.0)), kSimStart + 4.0, 2e-3);
  status.paused = true;
  pairing.addFrame(status, static_cast<float>(1.0 / kFps), kStart + ns(5.0));
  EXPECT_NEAR(*pairing.simTime(kStart + ns(7.0)), status.sim_time, 1e-3) << "it stands";
  pairing.forgetClock();
  EXPECT_FALSE(pairing.simTime(kStart + ns(8.0)).has_value());
}

/// X-Plane is paused for 3 s after 5 s and placed elsewhere 0.17 s later, the pictures go on. `max_wait` [s] is shorter
/// or longer than the clock takes to be fitted again; the first frames of the pause are heard `late` [s].
struct PauseCase {
  double max_wait;
  double late;
};
class Pause : public ::testing::TestWithParam<PauseCase> {};

TEST_P(Pause, PairsNoPictureWithAnotherFrame) {
  constexpr std::uint32_t kPaused = 300, kPlaced = 310, kResumed = 480, kEnd = 700;
  std::map<std::uint32_t, FrameState> answers;
  std::map<std::uint32_t, float> truth;
  ImagePairing pairing(kDelay, GetParam().max_wait,
                       [&answers](const auto& answer) { answers[answer.image_count] = answer; });
  std::vector<std::pair<double, std::function<void(std::int64_t)>>> events;
  for (std::uint32_t k = 0; k < kEnd; ++k) {
    const double t = k / kFps;
    const std::uint32_t flown = std::min(k, kPaused - 1) + (k < kResumed ? 0 : k - kResumed + 1);
    core::SimStatus status;
    status.sim_time = static_cast<float>(kSimStart + flown / kFps);
    status.paused = k >= kPaused && k < kResumed;
    truth[k] = static_cast<float>(status.sim_time);
    const double late = k >= kPaused && k < kPaused + 2 ? GetParam().late : 0.0;
    events.emplace_back(t + 1e-4 + late, [&pairing, status](std::int64_t now) {
      pairing.addFrame(status, static_cast<float>(1.0 / kFps), now);
    });
    const auto state = boost::make_shared<FlightState>();
    state->sim_time = truth[k];
    state->paused = status.paused;
    state->position_epoch = k >= kPlaced ? 1 : 0;
    state->header.stamp.fromNSec(static_cast<std::uint64_t>(kStart + ns(t)));
    events.emplace_back(t + 3e-4, [&pairing, state](std::int64_t now) { pairing.addState(state, now); });
    FrameState picture;
    picture.image_count = k;
    events.emplace_back(t + kDelay, [&pairing, picture](std::int64_t now) { pairing.addPicture(picture, now, now); });
    events.emplace_back(t + 0.5 / kFps, [&pairing](std::int64_t now) { pairing.flush(now); });
  }
  std::stable_sort(events.begin(), events.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [when, event] : events) event(kStart + ns(when));
  pairing.flush(kStart + ns(kEnd / kFps + 1.0));
  ASSERT_EQ(answers.size(), kEnd);
  constexpr std::uint32_t kRefitted = kResumed + 30;  // until then stamps alone pair, and say so
  for (std::uint32_t k = 60; k < kEnd; ++k) {
    SCOPED_TRACE("picture of frame " + std::to_string(k));
    const bool paused = k >= kPaused && k < kResumed;
    const bool edge = k >= kPaused && k < kPaused + 2;  // where the pause began is not known better than it was heard
    if (!edge) {
      EXPECT_EQ((answers[k].quality & FrameState::QUALITY_PAUSED) != 0, paused);
      EXPECT_EQ(answers[k].state.paused, paused);
    }
    if (k >= kResumed && k < kRefitted) continue;
    EXPECT_EQ(answers[k].state.sim_time, truth[k]);
    if (!edge && (k >= kPlaced || k + 4 < kPlaced)) {  // between, the newest state is of later than the picture
      EXPECT_EQ(answers[k].state.position_epoch, k >= kPlaced ? 1U : 0U);
    }
    if (k < kPaused - 1) {
      EXPECT_EQ(answers[k].frame_sim_time, truth[k]);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Waits, Pause,
                         ::testing::Values(PauseCase{0.2, 0.0}, PauseCase{0.5, 0.0}, PauseCase{2.0, 0.0},
                                           PauseCase{0.2, 0.03}, PauseCase{2.0, 0.03}));

/// The wall clock is set after 20 s, while a frame's datagram lies between the kernel's stamp and us. Frames come by
/// the kernel's stamps, pictures by those of an X server, which like all of the host's steady clock knows nothing of
/// it.
class SetWallClock : public ::testing::TestWithParam<double> {};

TEST_P(SetWallClock, PairsNoPictureWithAnotherFrame) {
  constexpr double kSetAt = 20.0 + 2e-4;
  constexpr std::int64_t kBoot = 5000'000000000;  // [ns] the steady clock at the start
  double time = 0.0;
  const auto wall = [step = GetParam()](double t) { return kStart + ns(t) + (t >= kSetAt ? ns(step) : 0); };
  PictureClock clock({[&time] { return kBoot + ns(time); }, [&time, wall] { return wall(time); }});
  std::map<std::uint32_t, FrameState> answers;
  ImagePairing pairing(kDelay, 0.2, [&answers](const FrameState& answer) { answers[answer.image_count] = answer; });
  vision::ServerClock server_clock;
  std::vector<std::pair<double, std::function<void()>>> events;
  for (std::uint32_t k = 0; k < 2400; ++k) {
    const double t = k / kFps;
    core::SimStatus status;
    status.sim_time = static_cast<float>(kSimStart + t);
    const std::int64_t kernel_stamp = wall(t + 1e-4);
    events.emplace_back(t + 4e-4, [&pairing, &clock, status, kernel_stamp] {
      pairing.addFrame(status, static_cast<float>(1.0 / kFps), clock.received(kernel_stamp));
    });
    const auto state = boost::make_shared<FlightState>();
    state->sim_time = status.sim_time;
    state->header.stamp.fromNSec(static_cast<std::uint64_t>(wall(t)));
    events.emplace_back(t + 6e-4, [&pairing, &clock, state] {
      pairing.addState(state, clock.now(), clock.fromWall(static_cast<std::int64_t>(state->header.stamp.toNSec())));
    });
    FrameState picture;
    picture.image_count = k;
    const auto server_ms = static_cast<std::uint32_t>((t + kDelay) * 1e3);
    events.emplace_back(t + kDelay + (k % 7 == 0 ? 0.02 : 3e-4), [&pairing, &clock, &server_clock, picture, server_ms] {
      clock.follow();
      pairing.addPicture(picture, server_clock.toHost(server_ms, clock.now()), clock.now());
    });
  }
  std::stable_sort(events.begin(), events.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [when, event] : events) {
    time = when;
    event();
    if (when > 10.0 && when < kSetAt) {
      ASSERT_EQ(clock.toWall(clock.now()), wall(when));
    }
  }
  EXPECT_EQ(clock.toWall(clock.now()), wall(time)) << "what is published follows";
  int judged = 0;
  for (const auto& [k, answer] : answers) {
    if (k < 60) continue;  // the clock is being learnt
    ++judged;
    ASSERT_EQ(answer.state.sim_time, static_cast<float>(kSimStart + k / kFps)) << "frame " << k;
    ASSERT_EQ(answer.quality & (FrameState::QUALITY_STATE_MISSING | FrameState::QUALITY_INTERPOLATED |
                                FrameState::QUALITY_OFF_FRAME | FrameState::QUALITY_CLOCK_UNSURE),
              0U)
        << "frame " << k;
  }
  EXPECT_GT(judged, 2300);
}

INSTANTIATE_TEST_SUITE_P(Steps, SetWallClock, ::testing::Values(0.03, 0.3, 4.0, -0.3));  // [s]

}  // namespace
}  // namespace xplane_bridge
