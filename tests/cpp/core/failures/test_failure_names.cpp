#include "xplane_bridge/core/failures/failure_names.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace xplane_bridge::core {
namespace {

bool has(SimulatorVersion version, const std::string& leaf) {
  const auto& names = simulatorFailures(version);
  return std::find(names.begin(), names.end(), "sim/operation/failures/" + leaf) != names.end();
}

TEST(FailureNames, ListEachVersionsOnce) {
  for (const auto version : {kXPlane11, kXPlane12}) {
    const auto& names = simulatorFailures(version);
    EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), names.size());
    EXPECT_TRUE(has(version, "rel_engfai7"));
    EXPECT_FALSE(has(version, "rel_engfai8"));
    EXPECT_TRUE(has(version, "rel_esys6"));
    EXPECT_TRUE(has(version, "rel_pitot2"));
  }
  EXPECT_TRUE(has(kXPlane11, "rel_fc_ail_L"));
  EXPECT_FALSE(has(kXPlane11, "rel_fcon_ailn_1_lft_lock"));
  EXPECT_FALSE(has(kXPlane12, "rel_fc_ail_L"));
  EXPECT_TRUE(has(kXPlane12, "rel_fcon_rudd_2_ctr_gone"));
  EXPECT_TRUE(has(kXPlane12, "rel_fcon_yawb_x_rgt_mxdn"));
}

TEST(FailureNames, TellWhatKeepsSurfacesFromFollowing) {
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
