"""`sim/operation/failures/rel_*`: the names of X-Plane 11.40 and 12 as Laminar's published lists have them."""

from __future__ import annotations

from typing import List

from xplane_bridge.emulator.datarefs.sources import Sources
from xplane_bridge.emulator.datarefs.tables.base import INT, Table

PREFIX = "sim/operation/failures/"

_ENGINE_STEMS = (
    "engfai engfir engfla engsep seize_ comsta hotsta ignitr startr magLFT magRGT genera "
    "fuepmp ele_fuepmp fuelfl fueltr oilpmp chipde govnr_ fadec_ prpfin prpcrs prpsep pshaft revers revdep "
    "revloc aftbur "
    "airres pitlck"
)
_BOTH = (
    # flight controls
    "conlock stbaug servo_rudd servo_ailn servo_elev servo_thro otto auto_runaway auto_servos "
    "trim_rud trim_ail trim_elv rud_trim_run ail_trim_run elv_trim_run fc_slt flap_act fc_L_flp fc_R_flp "
    "L_flp_off R_flp_off "
    "fc_thr throt_lo throt_hi "
    # hydraulics, gear, brakes
    "hydpmp hydpmp2 hydpmp3 hydpmp4 hydpmp5 hydpmp6 hydpmp7 hydpmp8 hydpmp_ele hydleak hydleak2 "
    "gear_ind gear_act lagear1 lagear2 lagear3 lagear4 lagear5 collapse1 collapse2 collapse3 collapse4 "
    "collapse5 "
    "tire1 tire2 tire3 tire4 tire5 lbrakes rbrakes antskd "
    # structure
    "wing1L wing1R wing2L wing2R wing3L wing3R wing4L wing4R hstbL hstbR vstb1 vstb2 "
    # instruments and sensors
    "pitot pitot2 static static2 static1_err static2_err ss_asi ss_ahz ss_alt ss_tsi ss_dgy ss_vvi cop_asi "
    "cop_ahz cop_alt "
    "cop_tsi cop_dgy cop_vvi AOA stall_warn gear_warning adc_comp g_asi g_oat g_fuel gps gps2 efis_1 efis_2 "
    "g_arthorz g_alt "
    "g_vvi g_magmtr vacuum vacuum2 elec_gyr elec_gyr2 g_pfd g_mfd g_gia1 g_gia2 g_gea "
    # electrics and lights
    "esys esys2 esys3 esys4 esys5 esys6 batter0 batter1 batter2 batter3 batter4 batter5 batter6 batter7 "
    "inver0 inver1 xpndr apu apu_fire lites_nav lites_strobe lites_taxi lites_land lites_ins clights beacon "
    "navcom1 navcom2 com1 com2 nav1 nav2 adf1 adf2 dme marker loc gls gp "
    # others
    "feather trotor fuelcap bird_strike smoke_cpit depres_slow depres_fast wshld"
)
_ONLY_11 = "fc_rud_L fc_rud_R fc_ail_L fc_ail_R fc_elv_U fc_elv_D"
_ONLY_12 = (
    "ail_L_jam ail_R_jam elv_L_jam elv_R_jam rud_L_jam rud_R_jam ail_L1 ail_L2 ail_R1 ail_R2 elv_U1 elv_U2 "
    "elv_D1 elv_D2 "
    "rud_L1 rud_L2 rud_R1 rud_R2 ail_L ail_R elv_U elv_D rud_L rud_R"
)
#: X-Plane 12's failures of single surfaces: what and which sides they come in, and what can happen to them.
SURFACE_SETS = {
    "ailn": ("1 2", "lft rgt"),
    "elev": ("1 2", "lft rgt"),
    "rudd": ("1 2", "ctr"),
    "rspo": ("1 2", "lft rgt"),
    "yawb": ("x", "lft rgt"),
    "sbrk": ("1 2", "lft rgt"),
    "flap": ("1 2", "lft rgt"),
}
SURFACE_EVENTS = ("lock", "mxdn", "mxup", "cntr", "gone")


def names(version: int) -> List[str]:
    """Leaves of all failure datarefs of a version."""
    leaves = [f"rel_{leaf}" for leaf in _BOTH.split()]
    leaves += [f"rel_{stem}{number}" for stem in _ENGINE_STEMS.split() for number in range(8)]
    if version < 12:
        return leaves + [f"rel_{leaf}" for leaf in _ONLY_11.split()]
    leaves += [f"rel_{leaf}" for leaf in _ONLY_12.split()]
    for kind, (numbers, sides) in SURFACE_SETS.items():
        for number in numbers.split():
            for side in sides.split():
                leaves += [f"rel_fcon_{kind}_{number}_{side}_{event}" for event in SURFACE_EVENTS]
    return leaves


def define(t: Table, sim: Sources) -> None:
    """Defines this subject's datarefs."""
    for leaf in names(t.version):
        t.setting(PREFIX + leaf, 0, INT)
        t.store.on_write(PREFIX + leaf, lambda _index, _value: sim.failures_changed())
