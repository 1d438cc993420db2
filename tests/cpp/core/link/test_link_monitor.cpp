#include "xplane_bridge/core/link/link_monitor.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace xplane_bridge::core {
namespace {

constexpr std::int64_t kMs = kNanosecondsPerMillisecond;

LinkMonitorOptions options() { return {0.4, 10.0, 2.5}; }

TEST(LinkMonitor, SearchesUntilTheFirstAnswer) {
  LinkMonitor monitor(options());
  EXPECT_EQ(monitor.update(1'000'000 * kMs), LinkState::kSearching);
  EXPECT_TRUE(std::isnan(monitor.silence(0)));
  EXPECT_EQ(monitor.epoch(), 0U);
  EXPECT_FALSE(monitor.alive());
  monitor.heard(1'000'100 * kMs);
  EXPECT_EQ(monitor.state(), LinkState::kConnected);
  EXPECT_EQ(monitor.epoch(), 1U);
  EXPECT_TRUE(monitor.alive());
}

TEST(LinkMonitor, ThresholdsAreExact) {
  LinkMonitor monitor(options());
  monitor.heard(0);
  EXPECT_EQ(monitor.update(400 * kMs), LinkState::kConnected);
  EXPECT_EQ(monitor.update(401 * kMs), LinkState::kStale);
  EXPECT_EQ(monitor.update(10'000 * kMs), LinkState::kStale);
  EXPECT_EQ(monitor.update(10'001 * kMs), LinkState::kLost);
  EXPECT_NEAR(monitor.silence(10'001 * kMs), 10.001, 1e-9);
}

TEST(LinkMonitor, BeaconGoneMakesSilenceALoss) {
  LinkMonitor monitor(options());
  monitor.heard(0);
  monitor.beaconHeard(0);
  EXPECT_EQ(monitor.update(2'500 * kMs), LinkState::kStale);
  EXPECT_EQ(monitor.update(2'501 * kMs), LinkState::kLost);
  monitor.beaconHeard(2'600 * kMs);
  EXPECT_EQ(monitor.update(2'700 * kMs), LinkState::kLost) << "announcing itself is not answering";
  monitor.heard(2'800 * kMs);
  EXPECT_EQ(monitor.state(), LinkState::kConnected);
  EXPECT_EQ(monitor.epoch(), 2U);
}

TEST(LinkMonitor, BeaconKeepsSilenceStale) {
  LinkMonitor monitor(options());
  monitor.heard(0);
  for (std::int64_t t = 0; t <= 9'000; t += 1'000) {
    monitor.beaconHeard(t * kMs);
    monitor.update(t * kMs);
  }
  EXPECT_EQ(monitor.update(9'900 * kMs), LinkState::kStale);
  monitor.heard(9'950 * kMs);
  EXPECT_EQ(monitor.epoch(), 1U) << "a gap is no new link";
}

TEST(LinkMonitor, BeaconGoneWithAnswersIsNoLoss) {
  LinkMonitor monitor(options());
  monitor.beaconHeard(0);
  monitor.heard(60'000 * kMs);
  EXPECT_EQ(monitor.update(60'100 * kMs), LinkState::kConnected);
  EXPECT_TRUE(monitor.beaconGone(60'100 * kMs));
}

TEST(LinkMonitor, LongSilenceDuringAStallStillIsALoss) {
  LinkMonitor monitor(options());
  monitor.heard(0);
  monitor.heard(20'000 * kMs);
  EXPECT_EQ(monitor.epoch(), 2U);
}

TEST(LinkMonitor, PauseIsAliveAndEndsWithThePause) {
  LinkMonitor monitor(options());
  monitor.heard(0);
  monitor.setPaused(true);
  EXPECT_EQ(monitor.update(10 * kMs), LinkState::kPaused);
  EXPECT_TRUE(monitor.alive());
  monitor.setPaused(false);
  EXPECT_EQ(monitor.update(20 * kMs), LinkState::kConnected);
  EXPECT_EQ(monitor.epoch(), 1U);
}

TEST(LinkMonitor, SimulatorTimeBackIsARestart) {
  LinkMonitor monitor(options());
  monitor.heard(0);
  monitor.setSimTime(500.0F);
  monitor.setSimTime(499.5F);  // a datagram overtaken by another
  EXPECT_EQ(monitor.epoch(), 1U);
  monitor.setSimTime(500.1F);
  monitor.setSimTime(2.0F);
  EXPECT_EQ(monitor.epoch(), 2U);
  monitor.setSimTime(2.1F);
  EXPECT_EQ(monitor.epoch(), 2U);
}

TEST(LinkMonitor, LossAndRestartTogetherAreOneEpoch) {
  LinkMonitor monitor(options());
  monitor.heard(0);
  monitor.setSimTime(500.0F);
  monitor.heard(30'000 * kMs);
  monitor.setSimTime(2.0F);
  EXPECT_EQ(monitor.epoch(), 2U);
}

TEST(LinkMonitor, AnotherXPlaneIsANewLink) {
  LinkMonitor monitor(options());
  monitor.newPeer();
  EXPECT_EQ(monitor.update(0), LinkState::kSearching) << "none has answered yet";
  monitor.heard(0);
  monitor.beaconHeard(0);
  monitor.setPaused(true);
  monitor.newPeer();
  EXPECT_EQ(monitor.update(10 * kMs), LinkState::kLost);
  EXPECT_FALSE(monitor.beaconGone(60'000 * kMs)) << "the old one's beacon does not count";
  monitor.heard(20 * kMs);
  EXPECT_EQ(monitor.state(), LinkState::kConnected) << "nor does its pause";
  EXPECT_EQ(monitor.epoch(), 2U);
}

TEST(LinkState, Names) {
  EXPECT_STREQ(toString(LinkState::kSearching), "SEARCHING");
  EXPECT_STREQ(toString(LinkState::kConnected), "CONNECTED");
  EXPECT_STREQ(toString(LinkState::kPaused), "PAUSED");
  EXPECT_STREQ(toString(LinkState::kStale), "STALE");
  EXPECT_STREQ(toString(LinkState::kLost), "LOST");
}

}  // namespace
}  // namespace xplane_bridge::core
