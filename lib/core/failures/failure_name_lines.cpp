// Written from src/xplane_bridge/xplane_names/datarefs.txt by tests/support/simulator/failure_name_lines.py:
// do not edit.

#include "xplane_bridge/core/failures/failure_names.hpp"

namespace xplane_bridge::core {

// clang-format off
const std::vector<FailureNames>& failureNameTable() {
  static const std::vector<FailureNames> table = {
      {{0, 120000},
         "antice fc_ail_L fc_ail_R fc_elv_D fc_elv_U fc_rud_L fc_rud_R g_bat1 g_bat2 g_bus1 g_bus2 g_comrad1 "
         "g_comrad2 g_gen1 g_gen2 g_navrad1 g_navrad2 g_xpndr gen_avio ice_surf_boot pyl1a pyl1b pyl2a pyl2b pyl3a "
         "pyl3b pyl4a pyl4b pyl5a pyl5b pyl6a pyl6b pyl7a pyl7b pyl8a pyl8b"},
      {{0, VersionRange{}.end},
         "AOA APU_press CHT_ind_0 CHT_ind_1 EGT_ind_0 EGT_ind_1 EPRind0 EPRind1 FF_ind0 FF_ind1 HVAC ITTind0 "
         "ITTind1 L_flp_off MP_ind_0 MP_ind_1 N1_ind0 N1_ind1 N2_ind0 N2_ind1 RPM_ind_0 RPM_ind_1 R_flp_off "
         "TRQind0 TRQind1 adc_comp adf1 adf2 aftbur0 aftbur1 aftbur2 aftbur3 aftbur4 aftbur5 aftbur6 aftbur7 "
         "ail_trim_run airres0 airres1 airres2 airres3 airres4 airres5 airres6 airres7 apu apu_fire auto_runaway "
         "auto_servos bat0_hi bat0_lo bat1_hi bat1_lo batter0 batter1 batter2 batter3 batter4 batter5 batter6 "
         "batter7 bird_strike bleed_air_lft bleed_air_rgt brown_out chipde0 chipde1 chipde2 chipde3 chipde4 "
         "chipde5 chipde6 chipde7 clights clonoz0 clonoz1 clonoz2 clonoz3 clonoz4 clonoz5 clonoz6 clonoz7 "
         "collapse1 collapse10 collapse2 collapse3 collapse4 collapse5 collapse6 collapse7 collapse8 collapse9 "
         "com1 com2 comsta0 comsta1 comsta2 comsta3 comsta4 comsta5 comsta6 comsta7 conlock cop_ahz cop_alt "
         "cop_asi cop_dgy cop_tsi cop_vvi depres_fast depres_slow dme door_open efis_1 efis_2 ele_fuepmp0 "
         "ele_fuepmp1 ele_fuepmp2 ele_fuepmp3 ele_fuepmp4 ele_fuepmp5 ele_fuepmp6 ele_fuepmp7 elec_gyr elec_gyr2 "
         "elv_trim_run eng_lo0 eng_lo1 eng_lo2 eng_lo3 eng_lo4 eng_lo5 eng_lo6 eng_lo7 engfai0 engfai1 engfai2 "
         "engfai3 engfai4 engfai5 engfai6 engfai7 engfir0 engfir1 engfir2 engfir3 engfir4 engfir5 engfir6 engfir7 "
         "engfla0 engfla1 engfla2 engfla3 engfla4 engfla5 engfla6 engfla7 engsep0 engsep1 engsep2 engsep3 engsep4 "
         "engsep5 engsep6 engsep7 esys esys2 esys3 esys4 esys5 esys6 ex_power_on fadec_0 fadec_1 fadec_2 fadec_3 "
         "fadec_4 fadec_5 fadec_6 fadec_7 fc_L_flp fc_R_flp fc_slt fc_thr feather flap_act fp_ind_0 fp_ind_1 "
         "fuel_block0 fuel_block1 fuel_block2 fuel_block3 fuel_block4 fuel_block5 fuel_block6 fuel_block7 "
         "fuel_block8 fuel_type fuel_water fuelcap fuelfl0 fuelfl1 fuelfl2 fuelfl3 fuelfl4 fuelfl5 fuelfl6 fuelfl7 "
         "fuepmp0 fuepmp1 fuepmp2 fuepmp3 fuepmp4 fuepmp5 fuepmp6 fuepmp7 g430_gps1 g430_gps2 g430_rad1_tune "
         "g430_rad2_tune g_alt g_arthorz g_asi g_fuel g_gea g_gia1 g_gia2 g_magmtr g_mfd g_oat g_pfd g_pfd2 g_vvi "
         "gear_act gear_ind gear_warning gen0_hi gen0_lo gen1_hi gen1_lo gen_esys genera0 genera1 genera2 genera3 "
         "genera4 genera5 genera6 genera7 gls govnr_0 govnr_1 govnr_2 govnr_3 govnr_4 govnr_5 govnr_6 govnr_7 gp "
         "gps gps2 hotsta0 hotsta1 hotsta2 hotsta3 hotsta4 hotsta5 hotsta6 hotsta7 hstbL hstbR hunsta0 hunsta1 "
         "hunsta2 hunsta3 hunsta4 hunsta5 hunsta6 hunsta7 hydleak hydleak2 hydoverp hydoverp2 hydpmp hydpmp2 "
         "hydpmp3 hydpmp4 hydpmp5 hydpmp6 hydpmp7 hydpmp8 hydpmp_ele ice_AOA_heat ice_AOA_heat2 ice_alt_air1 "
         "ice_alt_air2 ice_brake_heat ice_detect ice_inlet_heat ice_inlet_heat2 ice_inlet_heat3 ice_inlet_heat4 "
         "ice_inlet_heat5 ice_inlet_heat6 ice_inlet_heat7 ice_inlet_heat8 ice_pitot_heat1 ice_pitot_heat2 "
         "ice_prop_heat ice_prop_heat2 ice_prop_heat3 ice_prop_heat4 ice_prop_heat5 ice_prop_heat6 ice_prop_heat7 "
         "ice_prop_heat8 ice_static_heat ice_static_heat2 ice_surf_heat ice_surf_heat2 ice_window_heat ignitr0 "
         "ignitr1 ignitr2 ignitr3 ignitr4 ignitr5 ignitr6 ignitr7 invert0 invert1 lagear1 lagear2 lagear3 lagear4 "
         "lagear5 lbrakes lites_beac lites_hud lites_ins lites_land lites_nav lites_strobe lites_taxi loc magLFT0 "
         "magLFT1 magLFT2 magLFT3 magLFT4 magLFT5 magLFT6 magLFT7 magRGT0 magRGT1 magRGT2 magRGT3 magRGT4 magRGT5 "
         "magRGT6 magRGT7 marker mwing1 mwing2 mwing3 mwing4 mwing5 mwing6 mwing7 mwing8 nav1 nav2 navcom1 navcom2 "
         "oilp_ind_0 oilp_ind_1 oilpmp0 oilpmp1 oilpmp2 oilpmp3 oilpmp4 oilpmp5 oilpmp6 oilpmp7 oilt_ind_0 "
         "oilt_ind_1 otto pass_o2_on pitot pitot2 prop_sync prpcrs0 prpcrs1 prpcrs2 prpcrs3 prpcrs4 prpcrs5 "
         "prpcrs6 prpcrs7 prpfin0 prpfin1 prpfin2 prpfin3 prpfin4 prpfin5 prpfin6 prpfin7 pshaft0 pshaft1 pshaft2 "
         "pshaft3 pshaft4 pshaft5 pshaft6 pshaft7 rbrakes revdep0 revdep1 revdep2 revdep3 revdep4 revdep5 revdep6 "
         "revdep7 revers0 revers1 revers2 revers3 revers4 revers5 revers6 revers7 revloc0 revloc1 revloc2 revloc3 "
         "revloc4 revloc5 revloc6 revloc7 rud_trim_run runITT0 runITT1 runITT2 runITT3 runITT4 runITT5 runITT6 "
         "runITT7 rwy_lites seize_0 seize_1 seize_2 seize_3 seize_4 seize_5 seize_6 seize_7 servo_ailn servo_elev "
         "servo_rudd servo_thro smoke_cpit ss_ahz ss_alt ss_asi ss_dgy ss_tsi ss_vvi stall_warn startr0 startr1 "
         "startr2 startr3 startr4 startr5 startr6 startr7 static static1_err static2 static2_err stbaug throt_hi "
         "throt_lo tire1 tire2 tire3 tire4 tire5 trim_ail trim_elv trim_rud trotor vacuum vacuum2 vasi vstb1 vstb2 "
         "wind_shear wing1L wing1R wing2L wing2R wing3L wing3R wing4L wing4R xpndr"},
      {{120000, VersionRange{}.end},
         "L_flp2_off R_flp2_off adc_comp_2 ail_L ail_L1 ail_L2 ail_L_jam ail_R ail_R1 ail_R2 ail_R_jam "
         "airbus_alternate airbus_direct autoslats avionics_fan bus0_other_bus bus1_other_bus bus2_other_bus "
         "bus3_other_bus bus4_other_bus bus5_other_bus cascade_prop_LA cascade_prop_LF cascade_prop_RA "
         "cascade_prop_RF cop_AOA cop_radalt dice_tks_pump_0 dice_tks_pump_1 elv_D elv_D1 elv_D2 elv_L_jam "
         "elv_R_jam elv_U elv_U1 elv_U2 fc_L_flp2 fc_R_flp2 fcon_ailn_1_lft_cntr fcon_ailn_1_lft_gone "
         "fcon_ailn_1_lft_lock fcon_ailn_1_lft_mxdn fcon_ailn_1_lft_mxup fcon_ailn_1_rgt_cntr fcon_ailn_1_rgt_gone "
         "fcon_ailn_1_rgt_lock fcon_ailn_1_rgt_mxdn fcon_ailn_1_rgt_mxup fcon_ailn_2_lft_cntr fcon_ailn_2_lft_gone "
         "fcon_ailn_2_lft_lock fcon_ailn_2_lft_mxdn fcon_ailn_2_lft_mxup fcon_ailn_2_rgt_cntr fcon_ailn_2_rgt_gone "
         "fcon_ailn_2_rgt_lock fcon_ailn_2_rgt_mxdn fcon_ailn_2_rgt_mxup fcon_elev_1_lft_cntr fcon_elev_1_lft_gone "
         "fcon_elev_1_lft_lock fcon_elev_1_lft_mxdn fcon_elev_1_lft_mxup fcon_elev_1_rgt_cntr fcon_elev_1_rgt_gone "
         "fcon_elev_1_rgt_lock fcon_elev_1_rgt_mxdn fcon_elev_1_rgt_mxup fcon_elev_2_lft_cntr fcon_elev_2_lft_gone "
         "fcon_elev_2_lft_lock fcon_elev_2_lft_mxdn fcon_elev_2_lft_mxup fcon_elev_2_rgt_cntr fcon_elev_2_rgt_gone "
         "fcon_elev_2_rgt_lock fcon_elev_2_rgt_mxdn fcon_elev_2_rgt_mxup fcon_flap_1_lft_gone fcon_flap_1_lft_lock "
         "fcon_flap_1_lft_mxdn fcon_flap_1_lft_mxup fcon_flap_1_rgt_gone fcon_flap_1_rgt_lock fcon_flap_1_rgt_mxdn "
         "fcon_flap_1_rgt_mxup fcon_flap_2_lft_gone fcon_flap_2_lft_lock fcon_flap_2_lft_mxdn fcon_flap_2_lft_mxup "
         "fcon_flap_2_rgt_gone fcon_flap_2_rgt_lock fcon_flap_2_rgt_mxdn fcon_flap_2_rgt_mxup fcon_rspo_1_lft_cntr "
         "fcon_rspo_1_lft_gone fcon_rspo_1_lft_lock fcon_rspo_1_lft_mxdn fcon_rspo_1_lft_mxup fcon_rspo_1_rgt_cntr "
         "fcon_rspo_1_rgt_gone fcon_rspo_1_rgt_lock fcon_rspo_1_rgt_mxdn fcon_rspo_1_rgt_mxup fcon_rspo_2_lft_cntr "
         "fcon_rspo_2_lft_gone fcon_rspo_2_lft_lock fcon_rspo_2_lft_mxdn fcon_rspo_2_lft_mxup fcon_rspo_2_rgt_cntr "
         "fcon_rspo_2_rgt_gone fcon_rspo_2_rgt_lock fcon_rspo_2_rgt_mxdn fcon_rspo_2_rgt_mxup fcon_rudd_1_ctr_cntr "
         "fcon_rudd_1_ctr_gone fcon_rudd_1_ctr_lock fcon_rudd_1_ctr_mxdn fcon_rudd_1_ctr_mxup fcon_rudd_2_ctr_cntr "
         "fcon_rudd_2_ctr_gone fcon_rudd_2_ctr_lock fcon_rudd_2_ctr_mxdn fcon_rudd_2_ctr_mxup fcon_sbrk_1_lft_gone "
         "fcon_sbrk_1_lft_lock fcon_sbrk_1_lft_mxdn fcon_sbrk_1_lft_mxup fcon_sbrk_1_rgt_gone fcon_sbrk_1_rgt_lock "
         "fcon_sbrk_1_rgt_mxdn fcon_sbrk_1_rgt_mxup fcon_sbrk_2_lft_gone fcon_sbrk_2_lft_lock fcon_sbrk_2_lft_mxdn "
         "fcon_sbrk_2_lft_mxup fcon_sbrk_2_rgt_gone fcon_sbrk_2_rgt_lock fcon_sbrk_2_rgt_mxdn fcon_sbrk_2_rgt_mxup "
         "fcon_yawb_x_lft_cntr fcon_yawb_x_lft_gone fcon_yawb_x_lft_lock fcon_yawb_x_lft_mxdn fcon_yawb_x_lft_mxup "
         "fcon_yawb_x_rgt_cntr fcon_yawb_x_rgt_gone fcon_yawb_x_rgt_lock fcon_yawb_x_rgt_mxdn fcon_yawb_x_rgt_mxup "
         "g_arthorz_2 hydleak3 hydoverp3 hydpmp_el2 hydpmp_el3 hydptu ice_pitot_heat_stby ice_static_heat_stby "
         "ice_window_heat_cop ice_window_heat_l_side ice_window_heat_r_side lagear_10 lagear_6 lagear_7 lagear_8 "
         "lagear_9 lo_press_fuepmp0 lo_press_fuepmp1 lo_press_fuepmp2 lo_press_fuepmp3 lo_press_fuepmp4 "
         "lo_press_fuepmp5 lo_press_fuepmp6 lo_press_fuepmp7 lower_IMU lower_battery mwing10 mwing11 mwing12 "
         "mwing13 mwing14 mwing15 mwing16 mwing17 mwing18 mwing19 mwing20 mwing21 mwing22 mwing23 mwing24 mwing25 "
         "mwing26 mwing27 mwing28 mwing29 mwing30 mwing31 mwing32 mwing33 mwing34 mwing35 mwing36 mwing9 "
         "pil_radalt pitot_stby rud_L rud_L1 rud_L2 rud_L_jam rud_R rud_R1 rud_R2 rud_R_jam stat_A0 stat_A1 "
         "stat_A2 stat_A3 stat_A4 stat_A5 stat_A6 stat_A7 stat_B0 stat_B1 stat_B2 stat_B3 stat_B4 stat_B5 stat_B6 "
         "stat_B7 static_stby static_stby_err tire_10 tire_6 tire_7 tire_8 tire_9 upper_IMU upper_battery "
         "vector_actuator"},
      {{120800, VersionRange{}.end},
         "airbus_alternate2 antice fc_ail_L fc_ail_R fc_elv_D fc_elv_U fc_rud_L fc_rud_R ice_surf_boot prpsep0 "
         "prpsep1 prpsep2 prpsep3 prpsep4 prpsep5 prpsep6 prpsep7"},
      {{121000, VersionRange{}.end},
         "bird_strike_eng1 bird_strike_eng2 clutch dice_AOA_heat3 flt_incursion fuel_leak ice_TAT_heat "
         "ice_TAT_heat2 ice_TAT_heat3 lrn1 lrn2 rwy_incursion_1 rwy_incursion_2 stby_AOA tat_2 tat_stby "
         "vacuum_stby wxr_radar"},
  };
  return table;
}
// clang-format on

}  // namespace xplane_bridge::core
