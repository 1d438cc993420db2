#include "xplane_bridge/core/failures/failure_names.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <utility>

namespace xplane_bridge::core {
namespace {

bool has(std::int32_t version, const std::string& leaf) {
  return hasFailure(SimulatorVersion{version}, "sim/operation/failures/" + leaf);
}

// Numbers of rel_* in Laminar's lists of 11.40, 12.00, 12.08 and 12.10 (March 2026).
TEST(FailureNames, AreAllOfTheVersionsListOnce) {
  const std::pair<std::int32_t, std::size_t> versions[] = {
      {114000, 546}, {115501, 546}, {120000, 751}, {120800, 768}, {122015, 786}};
  for (const auto& [number, count] : versions) {
    const auto names = simulatorFailures(SimulatorVersion{number});
    EXPECT_EQ(names.size(), count) << number;
    EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), count) << number;
    EXPECT_TRUE(has(number, "rel_engfai7"));
    EXPECT_FALSE(has(number, "rel_engfai8"));
    EXPECT_TRUE(has(number, "rel_esys6"));
    EXPECT_TRUE(has(number, "rel_pitot2"));
    EXPECT_TRUE(has(number, "rel_invert0"));
    // These are in no list.
    for (const char* made_up : {"rel_antskd", "rel_inver0", "rel_beacon", "rel_wshld", "rel_fueltr0", "rel_pitlck0"}) {
      EXPECT_FALSE(has(number, made_up)) << made_up;
    }
  }
  EXPECT_EQ(simulatorFailures(SimulatorVersion{105100}), simulatorFailures(SimulatorVersion{114000}));
  EXPECT_TRUE(has(0, "rel_engfai0")) << "every version has it";
  EXPECT_FALSE(has(0, "rel_fcon_ailn_1_lft_lock")) << "the version is unknown";
}

TEST(FailureNames, ComeAndGoWithinAVersion) {
  EXPECT_TRUE(has(119999, "rel_fc_ail_L"));
  EXPECT_FALSE(has(120000, "rel_fc_ail_L"));
  EXPECT_FALSE(has(120799, "rel_fc_ail_L"));
  EXPECT_TRUE(has(120800, "rel_fc_ail_L"));
  EXPECT_FALSE(has(119999, "rel_fcon_ailn_1_lft_lock"));
  EXPECT_TRUE(has(120000, "rel_fcon_ailn_1_lft_lock"));
  EXPECT_TRUE(has(120000, "rel_fcon_rudd_2_ctr_gone"));
  EXPECT_TRUE(has(120000, "rel_fcon_yawb_x_rgt_mxdn"));
  EXPECT_FALSE(has(120000, "rel_prpsep0"));
  EXPECT_TRUE(has(120800, "rel_prpsep0"));
}

TEST(FailureNames, NameWhatKeepsSurfacesFromFollowing) {
  for (const char* name : {"rel_conlock", "rel_fcon_elev_1_lft_lock", "sim/operation/failures/rel_fc_ail_L",
                           "rel_ail_L_jam", "rel_trim_elv", "rel_elv_trim_run", "rel_flap_act", "rel_L_flp_off"}) {
    EXPECT_TRUE(touchesSurfaces(name)) << name;
  }
  for (const char* name : {"rel_engfai0", "rel_esys", "rel_pitot", "rel_fcap", "aileron1_wing2_left"}) {
    EXPECT_FALSE(touchesSurfaces(name)) << name;
  }
}

}  // namespace
}  // namespace xplane_bridge::core
