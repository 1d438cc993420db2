#include "xplane_bridge/core/failures/failure_names.hpp"

#include <algorithm>
#include <iterator>
#include <sstream>

#include "xplane_bridge/core/failures/failures.hpp"

namespace xplane_bridge::core {
namespace {

// Without "rel_". For each engine, 0..7:
constexpr const char* kOfEngines =
    "engfai engfir engfla engsep seize_ comsta hotsta ignitr startr magLFT magRGT genera fuepmp ele_fuepmp fuelfl "
    "fueltr oilpmp chipde govnr_ fadec_ prpfin prpcrs prpsep pshaft revers revdep revloc aftbur airres pitlck";
constexpr int kEngines = 8;
constexpr const char* kOfBoth =
    "conlock stbaug servo_rudd servo_ailn servo_elev servo_thro otto auto_runaway auto_servos trim_rud trim_ail "
    "trim_elv rud_trim_run ail_trim_run elv_trim_run fc_slt flap_act fc_L_flp fc_R_flp L_flp_off R_flp_off fc_thr "
    "throt_lo throt_hi hydpmp hydpmp2 hydpmp3 hydpmp4 hydpmp5 hydpmp6 hydpmp7 hydpmp8 hydpmp_ele hydleak hydleak2 "
    "gear_ind gear_act lagear1 lagear2 lagear3 lagear4 lagear5 collapse1 collapse2 collapse3 collapse4 collapse5 "
    "tire1 tire2 tire3 tire4 tire5 lbrakes rbrakes antskd wing1L wing1R wing2L wing2R wing3L wing3R wing4L wing4R "
    "hstbL hstbR vstb1 vstb2 pitot pitot2 static static2 static1_err static2_err ss_asi ss_ahz ss_alt ss_tsi ss_dgy "
    "ss_vvi cop_asi cop_ahz cop_alt cop_tsi cop_dgy cop_vvi AOA stall_warn gear_warning adc_comp g_asi g_oat g_fuel "
    "gps gps2 efis_1 efis_2 g_arthorz g_alt g_vvi g_magmtr vacuum vacuum2 elec_gyr elec_gyr2 g_pfd g_mfd g_gia1 "
    "g_gia2 g_gea esys esys2 esys3 esys4 esys5 esys6 batter0 batter1 batter2 batter3 batter4 batter5 batter6 batter7 "
    "inver0 inver1 xpndr apu apu_fire lites_nav lites_strobe lites_taxi lites_land lites_ins clights beacon navcom1 "
    "navcom2 com1 com2 nav1 nav2 adf1 adf2 dme marker loc gls gp feather trotor fuelcap bird_strike smoke_cpit "
    "depres_slow depres_fast wshld";
constexpr const char* kOf11 = "fc_rud_L fc_rud_R fc_ail_L fc_ail_R fc_elv_U fc_elv_D";
constexpr const char* kOf12 =
    "ail_L_jam ail_R_jam elv_L_jam elv_R_jam rud_L_jam rud_R_jam ail_L1 ail_L2 ail_R1 ail_R2 elv_U1 elv_U2 elv_D1 "
    "elv_D2 rud_L1 rud_L2 rud_R1 rud_R2 ail_L ail_R elv_U elv_D rud_L rud_R";
constexpr const char* kSurfaces12 =
    "ailn_1_lft ailn_1_rgt ailn_2_lft ailn_2_rgt elev_1_lft elev_1_rgt elev_2_lft elev_2_rgt rudd_1_ctr rudd_2_ctr "
    "rspo_1_lft rspo_1_rgt rspo_2_lft rspo_2_rgt yawb_x_lft yawb_x_rgt sbrk_1_lft sbrk_1_rgt sbrk_2_lft sbrk_2_rgt "
    "flap_1_lft flap_1_rgt flap_2_lft flap_2_rgt";
constexpr const char* kEvents12 = "lock mxdn mxup cntr gone";
// Beginnings of those that keep surfaces from following.
constexpr const char* kOfSurfaces[] = {"rel_conlock", "rel_fc_",   "rel_fcon_",    "rel_ail_",  "rel_elv_",
                                       "rel_rud_",    "rel_trim_", "rel_flap_act", "rel_L_flp", "rel_R_flp"};

std::vector<std::string> words(const char* text) {
  std::istringstream in(text);
  std::vector<std::string> out;
  for (std::string word; in >> word;) out.push_back(word);
  return out;
}

std::vector<std::string> makeNames(SimulatorVersion version) {
  std::vector<std::string> out;
  const auto add = [&out](const std::string& leaf) { out.push_back(failureDataref("rel_" + leaf)); };
  for (const std::string& leaf : words(kOfBoth)) add(leaf);
  for (const std::string& stem : words(kOfEngines)) {
    for (int engine = 0; engine < kEngines; ++engine) add(stem + std::to_string(engine));
  }
  if (!version.is12()) {
    for (const std::string& leaf : words(kOf11)) add(leaf);
    return out;
  }
  for (const std::string& leaf : words(kOf12)) add(leaf);
  for (const std::string& surface : words(kSurfaces12)) {
    const std::string fcon = "fcon_" + surface + "_";
    for (const std::string& event : words(kEvents12)) add(fcon + event);
  }
  return out;
}

}  // namespace

bool touchesSurfaces(const std::string& dataref) {
  const std::string name = failureName(dataref);
  return std::any_of(std::begin(kOfSurfaces), std::end(kOfSurfaces),
                     [&name](const char* beginning) { return name.rfind(beginning, 0) == 0; });
}

const std::vector<std::string>& simulatorFailures(SimulatorVersion version) {
  static const std::vector<std::string> names11 = makeNames(kXPlane11);
  static const std::vector<std::string> names12 = makeNames(kXPlane12);
  return version.is12() ? names12 : names11;
}

}  // namespace xplane_bridge::core
