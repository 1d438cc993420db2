#include "xplane_bridge/core/wire/beacon_tracker.hpp"

#include <gtest/gtest.h>

#include "xplane_bridge/core/base/clock.hpp"

namespace xplane_bridge::core {
namespace {

constexpr std::int64_t kS = kNanosecondsPerSecond;
constexpr std::uint32_t kLan = 0xC0A80105U;     // 192.168.1.5
constexpr std::uint32_t kOther = 0xC0A80109U;   // 192.168.1.9
constexpr std::uint32_t kOurLan = 0xC0A80164U;  // 192.168.1.100: this computer

BeaconTracker makeTracker() {
  return BeaconTracker(2.5, 1.2, [](std::uint32_t address) { return address == kOurLan || (address >> 24) == 127; });
}

Beacon beacon(std::uint16_t port = 49000) {
  Beacon result;
  result.host = Beacon::Host::kXPlane;
  result.role = Beacon::Role::kMaster;
  result.version = 115501;
  result.port = port;
  result.computer_name = "sim";
  return result;
}

TEST(BeaconTracker, OneIsChosenAfterTheSettlingTime) {
  BeaconTracker tracker = makeTracker();
  EXPECT_FALSE(tracker.onlyOne(0).has_value());
  EXPECT_TRUE(tracker.heard(beacon(), kLan, 10 * kS));
  EXPECT_FALSE(tracker.onlyOne(11 * kS).has_value());
  tracker.heard(beacon(), kLan, 11 * kS);
  ASSERT_TRUE(tracker.onlyOne(11 * kS + 2 * kS / 10).has_value());
  EXPECT_EQ(tracker.onlyOne(12 * kS)->endpoint, (Endpoint{kLan, 49000}));
  EXPECT_EQ(tracker.onlyOne(12 * kS)->computer_name, "sim");
  EXPECT_EQ(toString(*tracker.onlyOne(12 * kS)), "sim (192.168.1.5:49000, version 115501)");
}

TEST(BeaconTracker, TwoAreListedNotChosen) {
  BeaconTracker tracker = makeTracker();
  Beacon other = beacon();
  other.computer_name = "sim-2";
  tracker.heard(beacon(), kLan, 0);
  tracker.heard(other, kOther, 0);
  EXPECT_EQ(tracker.sightings(2 * kS).size(), 2U);
  EXPECT_FALSE(tracker.onlyOne(2 * kS).has_value());
  tracker.heard(other, kOther, 2 * kS);
  EXPECT_EQ(tracker.sightings(3 * kS).size(), 1U) << "the first has been silent for longer than the timeout";
  EXPECT_EQ(tracker.onlyOne(3 * kS)->endpoint.address, kOther);
}

TEST(BeaconTracker, OwnComputerHeardUnderSeveralAddressesIsOne) {
  BeaconTracker tracker = makeTracker();
  tracker.heard(beacon(), kOurLan, 0);
  tracker.heard(beacon(), kLoopbackAddress, 0);
  ASSERT_EQ(tracker.sightings(kS).size(), 1U);
  EXPECT_EQ(tracker.sightings(kS)[0].endpoint.address, kOurLan);
  EXPECT_TRUE(tracker.at({kLoopbackAddress, 49000}, kS).has_value());
  EXPECT_FALSE(tracker.at({kLoopbackAddress, 49001}, kS).has_value());
  EXPECT_FALSE(tracker.at({kLan, 49000}, kS).has_value());
}

TEST(BeaconTracker, OneComputerHeardUnderTwoAddressesIsOne) {
  BeaconTracker tracker = makeTracker();
  tracker.heard(beacon(), kLan, 0);
  tracker.heard(beacon(), kOther, kS / 10);
  tracker.heard(beacon(), kLan, kS);
  tracker.heard(beacon(), kOther, kS + kS / 10);
  ASSERT_TRUE(tracker.onlyOne(2 * kS).has_value());
  EXPECT_EQ(tracker.onlyOne(2 * kS)->endpoint, (Endpoint{kLan, 49000})) << "as it was heard first";
  EXPECT_EQ(toString(tracker.sightings(2 * kS).at(0)),
            "sim (192.168.1.5:49000, version 115501, also heard from 192.168.1.9)");
  EXPECT_TRUE(tracker.at({kOther, 49000}, 2 * kS).has_value());
  EXPECT_EQ(tracker.lastHeard({kOther, 49000}), kS + kS / 10);
  // Another port, version or name is another X-Plane.
  tracker.heard(beacon(49010), kOther, 2 * kS);
  EXPECT_EQ(tracker.sightings(2 * kS).size(), 2U);
  Beacon newer = beacon();
  newer.version = 122015;
  tracker.heard(newer, 0xC0A80110U, 2 * kS);
  Beacon nameless = beacon();
  nameless.computer_name = "";
  tracker.heard(nameless, 0xC0A80111U, 2 * kS);
  tracker.heard(nameless, 0xC0A80112U, 2 * kS);
  EXPECT_EQ(tracker.sightings(2 * kS).size(), 5U);
}

TEST(BeaconTracker, ListensWhereItsBeaconComesFromOnceTheFirstAddressIsSilent) {
  BeaconTracker tracker = makeTracker();
  tracker.heard(beacon(), kLan, 0);
  tracker.heard(beacon(), kOther, kS);
  tracker.heard(beacon(), kOther, 2 * kS);
  EXPECT_EQ(tracker.at({kLan, 49000}, 2 * kS)->endpoint.address, kLan) << "two beacons may have been lost";
  EXPECT_EQ(tracker.lastHeard({kLan, 49000}), 0);
  tracker.heard(beacon(), kOther, 3 * kS);
  ASSERT_EQ(tracker.sightings(3 * kS).size(), 1U);
  EXPECT_EQ(toString(tracker.sightings(3 * kS)[0]), "sim (192.168.1.9:49000, version 115501)");
  EXPECT_EQ(tracker.at({kLan, 49000}, 3 * kS)->endpoint.address, kOther) << "it was known there";
  EXPECT_EQ(tracker.onlyOne(3 * kS)->endpoint.address, kOther);
  EXPECT_EQ(tracker.lastHeard({kLan, 49000}), 0);
  EXPECT_EQ(tracker.lastHeard({kOther, 49000}), 3 * kS);
  EXPECT_FALSE(tracker.onlyNewSince(kS, 3 * kS, kLan, "sim").has_value()) << "it has been there all along";
  // The first address comes back: no reason to leave the one that is heard.
  tracker.heard(beacon(), kLan, 4 * kS);
  EXPECT_EQ(toString(tracker.sightings(4 * kS).at(0)),
            "sim (192.168.1.9:49000, version 115501, also heard from 192.168.1.5)");
}

TEST(BeaconTracker, OwnComputerIsHeardUnderTheAddressThatIsLeft) {
  BeaconTracker tracker = makeTracker();
  tracker.heard(beacon(), kOurLan, 0);
  for (int k = 0; k < 4; ++k) {
    tracker.heard(beacon(), kLoopbackAddress, k * kS);
  }
  EXPECT_EQ(tracker.at({kOurLan, 49000}, 3 * kS)->endpoint.address, kLoopbackAddress);
  EXPECT_EQ(tracker.lastHeard({kOurLan, 49000}), 0);
}

TEST(BeaconTracker, OnlyMasterXPlanesCount) {
  BeaconTracker tracker = makeTracker();
  Beacon visual = beacon();
  visual.role = Beacon::Role::kExternalVisual;
  EXPECT_FALSE(tracker.heard(visual, kLan, 0));
  Beacon plane_maker = beacon();
  plane_maker.host = Beacon::Host::kPlaneMaker;
  EXPECT_FALSE(tracker.heard(plane_maker, kLan, 0));
  EXPECT_TRUE(tracker.sightings(0).empty());
}

TEST(BeaconTracker, NewSinceMeansBegunSince) {
  BeaconTracker tracker = makeTracker();
  const auto only = [&tracker](std::int64_t since_s, std::uint32_t address, const std::string& name) {
    return tracker.onlyNewSince(since_s * kS, 6 * kS, address, name);
  };
  Beacon other = beacon();
  other.computer_name = "sim-2";
  tracker.heard(beacon(), kLan, 0);
  tracker.heard(other, kOther, kS);
  tracker.heard(other, kOther, 5 * kS);
  EXPECT_FALSE(only(6, kOther, "sim-2").has_value());
  // kOther was away from 1 s to 5 s, longer than the timeout: it has begun anew.
  EXPECT_EQ(only(4, kOther, "")->endpoint.address, kOther);
  EXPECT_EQ(only(4, kLan, "sim-2")->endpoint.address, kOther) << "its address may change";
  EXPECT_FALSE(only(4, kLan, "sim").has_value()) << "another computer's";
  EXPECT_FALSE(only(4, kLan, "").has_value());
  tracker.heard(beacon(49001), kLan, 6 * kS);
  EXPECT_EQ(only(4, kLan, "sim")->endpoint, (Endpoint{kLan, 49001}));
  tracker.heard(beacon(49002), kLan, 6 * kS);
  EXPECT_FALSE(only(4, kLan, "sim").has_value()) << "two new ones: which?";
}

TEST(BeaconTracker, LastHeard) {
  BeaconTracker tracker = makeTracker();
  EXPECT_EQ(tracker.lastHeard({kLan, 49000}), 0);
  tracker.heard(beacon(), kLan, 3 * kS);
  EXPECT_EQ(tracker.lastHeard({kLan, 49000}), 3 * kS);
}

}  // namespace
}  // namespace xplane_bridge::core
