#include "xplane_bridge/core/simulator/simulator_settings.hpp"

#include <gtest/gtest.h>

namespace xplane_bridge::core {
namespace {

TEST(SimulatorSettings, PausesByCommand) {
  EXPECT_STREQ(pauseCommand(true, SimulatorVersion{121000}), "sim/operation/pause_on");
  EXPECT_STREQ(pauseCommand(false, SimulatorVersion{122015}), "sim/operation/pause_off");
  // Older versions have only this one.
  for (const std::int32_t number : {0, 114000, 115501, 120000, 120999}) {
    EXPECT_STREQ(pauseCommand(true, SimulatorVersion{number}), "sim/operation/pause_toggle") << number;
    EXPECT_STREQ(pauseCommand(false, SimulatorVersion{number}), "sim/operation/pause_toggle") << number;
  }
}

TEST(SimulatorSettings, SeveralValuesGoToTheElementsThatFollow) {
  using List = std::vector<std::string>;
  EXPECT_EQ(consecutiveElements("sim/a", 1), List{"sim/a"});
  EXPECT_EQ(consecutiveElements("sim/a[2]", 1), List{"sim/a[2]"});
  EXPECT_EQ(consecutiveElements("sim/a", 2), (List{"sim/a[0]", "sim/a[1]"}));
  EXPECT_EQ(consecutiveElements("sim/a[3]", 2), (List{"sim/a[3]", "sim/a[4]"}));
  EXPECT_THROW(consecutiveElements("nonsense", 1), std::invalid_argument);
  EXPECT_THROW(consecutiveElements("sim/a[0:3]", 1), std::invalid_argument);
}

}  // namespace
}  // namespace xplane_bridge::core
