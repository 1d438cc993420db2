#include "xplane_bridge/core/control/missing_channels.hpp"

#include <gtest/gtest.h>

#include <map>

namespace xplane_bridge::core {
namespace {

std::vector<MissingChannel> missing(const std::map<std::string, DatarefValue>& shown) {
  std::vector<DatarefValue> values;
  for (const std::string& name : trimDatarefs()) {
    const auto found = shown.find(name.substr(name.rfind('/') + 1));
    values.push_back(found == shown.end() ? DatarefValue(0.0F) : found->second);
  }
  return missingTrims(values);
}

TEST(MissingChannels, AreTheTrimsThatMoveNothing) {
  const auto found = missing({{"acf_max_trim_elev", 0.3F}, {"acf_min_trim_ailn", 0.2F}});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].channel, Channel::kTrimYaw);
  EXPECT_EQ(found[0].why,
            "this aircraft has no rudder trim (sim/aircraft/controls/acf_max_trim_rudd, "
            "sim/aircraft/controls/acf_min_trim_rudd are 0)");
}

TEST(MissingChannels, AreAllWhereNothingTrims) { EXPECT_EQ(missing({}).size(), 3U); }

TEST(MissingChannels, AnElevatorTrimMayMoveTheStabiliser) {
  const auto found = missing({{"acf_hstb_trim_up", 4.0F}});
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].channel, Channel::kTrimRoll);
  EXPECT_EQ(found[1].channel, Channel::kTrimYaw);
}

TEST(MissingChannels, ASilentDatarefShowsNothing) {
  const auto found = missing({{"acf_max_trim_rudd", std::nullopt}});
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[1].channel, Channel::kTrimPitch);
}

}  // namespace
}  // namespace xplane_bridge::core
