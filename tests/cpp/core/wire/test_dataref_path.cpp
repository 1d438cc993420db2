#include "xplane_bridge/core/wire/dataref_path.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace xplane_bridge::core {
namespace {

using Names = std::vector<std::string>;

TEST(DatarefPath, PlainNamesAndElementsStandForThemselves) {
  EXPECT_EQ(datarefElements("sim/time/paused"), Names{"sim/time/paused"});
  EXPECT_EQ(datarefElements("sim/a/b[12]"), Names{"sim/a/b[12]"});
}

TEST(DatarefPath, RangesExcludeTheirEnd) {
  EXPECT_EQ(datarefElements("sim/a/b[2:5]"), (Names{"sim/a/b[2]", "sim/a/b[3]", "sim/a/b[4]"}));
}

TEST(DatarefPath, RefusesWhatXPlaneWouldSilentlyIgnore) {
  for (const char* bad : {"", "paused", "sim/a b", "sim/a[", "sim/a[x]", "sim/a[-1]", "sim/a[3:3]", "sim/a[5:2]",
                          "sim/a[0:5000]", "sim/a[1][2]", "sim/a]0[", "sim/\xC3\xA9"}) {
    EXPECT_THROW(datarefElements(bad), std::invalid_argument) << bad;
  }
  EXPECT_THROW(datarefElements("sim/" + std::string(396, 'a')), std::invalid_argument);
  EXPECT_NO_THROW(datarefElements("sim/" + std::string(395, 'a')));
  EXPECT_THROW(datarefElements("sim/" + std::string(392, 'a') + "[9:11]"), std::invalid_argument);
}

}  // namespace
}  // namespace xplane_bridge::core
