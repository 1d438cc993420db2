#include "xplane_bridge/nodes/base/ros_time.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace xplane_bridge {
namespace {

TEST(RosTime, IsExactToTheNanosecond) {
  // Through seconds in a double it would end in ...456716.
  const ros::Time stamp = toRosTime(1'700'000'000'123'456'789);
  EXPECT_EQ(stamp.sec, 1'700'000'000U);
  EXPECT_EQ(stamp.nsec, 123'456'789U);
  EXPECT_EQ(toRosTime(999'999'999).nsec, 999'999'999U);
  EXPECT_EQ(toRosTime(1'000'000'000), ros::Time(1, 0));
}

TEST(RosTime, IsZeroBeforeTheEpoch) {
  EXPECT_TRUE(toRosTime(0).isZero());
  EXPECT_TRUE(toRosTime(-1).isZero());
}

TEST(RosTime, EndsInTheYear2106) {
  EXPECT_EQ(toRosTime(4'294'967'295'000'000'000).sec, 4'294'967'295U);
  EXPECT_THROW(toRosTime(4'294'967'296'000'000'000), std::runtime_error);
}

}  // namespace
}  // namespace xplane_bridge
