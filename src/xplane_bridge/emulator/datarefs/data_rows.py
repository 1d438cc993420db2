"""The rows of the Data Output table, as datarefs times factors.

A row is eight slots; a slot is None (unused, -999 on the wire), a number, or a source with a factor. `DataRows.values`
gives all 139 rows of a frame in one numpy operation; `DataRows.packet` cuts the selected ones out of it.
"""

from __future__ import annotations

import math
from typing import Dict, FrozenSet, List, Optional, Sequence, Tuple, Union

import numpy as np

from xplane_bridge.emulator.datarefs.store import DatarefStore
from xplane_bridge.emulator.datarefs.tables.controls import WINGS
from xplane_bridge.emulator.datarefs.tables.systems import BY_ENGINE
from xplane_bridge.emulator.datarefs.traffic import PLANE
from xplane_bridge.emulator.flight.frame import M_TO_FT, MPS_TO_FPM, MPS_TO_KT, MPS_TO_MPH
from xplane_bridge.protocol import FIFTH_BYTE, ROW_COUNT, SLOTS_PER_ROW, UNUSED_SLOT

N_TO_LB = 1.0 / 4.4482216152605
NM_TO_FTLB = 0.7375621492772656
W_TO_HP = 1.0 / 745.6998715822702
KGPS_TO_PPH = 3600.0 / 0.45359237
KG_TO_LB = 1.0 / 0.45359237
RAD_S_TO_RPM = 30.0 / math.pi

#: (dataref path, factor), a bare path, a constant, or None for an unused slot.
Source = Union[Tuple[str, float], str, float, None]

_P = "sim/flightmodel/position/"
_F = "sim/flightmodel/forces/"
_C = "sim/cockpit2/controls/"
_E = "sim/flightmodel/engine/"
_EL = "sim/cockpit2/electrical/"
_S = "sim/cockpit2/switches/"
_A = "sim/cockpit2/annunciators/"
_AP = "sim/cockpit2/autopilot/"
_ICE = "sim/cockpit2/ice/ice_"
_CABIN = "sim/cockpit2/pressurization/"
_ACT = "sim/cockpit2/engine/actuators/"


def _each(name: str, factor: float = 1.0, count: int = SLOTS_PER_ROW) -> List[Source]:
    return [(f"{name}[{i}]", factor) for i in range(count)]


def _wings(leaf: str) -> List[Source]:
    return [f"sim/flightmodel/controls/{wing}_{leaf}def" for wing in WINGS]


def _others(leaf: str, factor: float = 1.0) -> List[Source]:
    return [(PLANE.format(number) + leaf, factor) for number in range(1, SLOTS_PER_ROW)]


def layout(is_12: bool, otherwise: FrozenSet[str] = frozenset()) -> Dict[int, Sequence[Source]]:
    """Slots by row index; rows that are left out are eight zeros (systems the emulator does not have).

    Args:
        is_12: X-Plane 12, not 11.
        otherwise: Of `otherwise.IDS`: rows that are not as the bridge assumes.
    """
    true = "" if "row17-axes" in otherwise else "true_"
    corner = "row20" in otherwise
    hours = "row1-hours" not in otherwise
    bits = [f"_emulator/{name}_bits" if "row115-bits" not in otherwise else f"{_A}{name}[0]" for name in BY_ENGINE]
    deg = 180.0 / math.pi
    rates: Sequence[Source] = (
        ((_P + "Prad", deg), (_P + "Qrad", deg), (_P + "Rrad", deg))
        if is_12 != ("row16" in otherwise)
        else (_P + "Qrad", _P + "Prad", _P + "Rrad")
    )
    true_airspeed, ground_speed, keas = _P + "true_airspeed", _P + "groundspeed", "_emulator/keas"
    kcas = _P + "indicated_airspeed"
    return {
        0: (
            "_emulator/frame_rate",
            "_emulator/simulated_rate",
            None,
            "sim/operation/misc/frame_rate_period",
            "_emulator/cpu_time",
            0.001,
            "sim/time/ground_speed",
            "sim/time/sim_speed",
        ),
        1: (
            "sim/time/total_running_time_sec",
            f"sim/time/total_{'flight' if 'row1-clock' in otherwise else 'running'}_time_sec",
            "sim/time/total_flight_time_sec",
            "sim/time/timer_elapsed_time_sec",
            None,
            "_emulator/zulu_hours" if hours else "sim/time/zulu_time_sec",
            "_emulator/local_hours" if hours else "sim/time/local_time_sec",
            ("sim/time/hobbs_time", 1.0 / 3600.0),  # the row's is in hours, the dataref in seconds
        ),
        2: (0.0, 0.0, 250000.0),
        3: (
            kcas,
            keas,
            (true_airspeed, MPS_TO_KT),
            (ground_speed, MPS_TO_KT),
            None,
            (kcas, MPS_TO_MPH / MPS_TO_KT),
            (true_airspeed, MPS_TO_MPH),
            (ground_speed, MPS_TO_MPH),
        ),
        4: (
            "sim/flightmodel/misc/machno",
            None,
            _P + "vh_ind_fpm",
            _P + "vh_ind_fpm2",
            _F + "g_nrml",
            # the row's axial sign is the opposite of the dataref's
            (_F + "g_axil", 1.0 if "axial-sign" in otherwise else -1.0),
            (_F + "g_side", -1.0 if "side-sign" in otherwise else 1.0),
            None,
        ),
        5: (
            "sim/weather/barometer_sealevel_inhg",
            "sim/weather/temperature_sealevel_c",
            None,
            ("_emulator/wind_speed_mps", MPS_TO_KT),
            "_emulator/wind_from_deg",
            "_emulator/turbulence",
            0.0,
            0.0,
        ),
        6: (
            "sim/weather/barometer_current_inhg",
            "sim/weather/temperature_ambient_c",
            "_emulator/temperature_le_c",
            "_emulator/density_ratio",
            ("sim/weather/speed_sound_ms", MPS_TO_KT),
            "sim/flightmodel/misc/Qstatic",
            None,
            ("sim/physics/g_sealevel", M_TO_FT),
        ),
        7: ("sim/cockpit2/gauges/actuators/barometer_setting_in_hg_pilot", 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0),
        8: ("sim/joystick/yoke_pitch_ratio", "sim/joystick/yoke_roll_ratio", "sim/joystick/yoke_heading_ratio"),
        9: (_C + "thrust_vector_ratio", _C + "wingsweep_ratio", _C + "incidence_ratio", _C + "dihedral_ratio", 0.0),
        10: (
            "sim/joystick/artstab_pitch_ratio",
            "sim/joystick/artstab_roll_ratio",
            "sim/joystick/artstab_heading_ratio",
        ),
        11: (
            _C + "total_pitch_ratio",
            _C + "total_roll_ratio",
            _C + "total_heading_ratio",
            None,
            "sim/flightmodel2/gear/tire_steer_actual_deg[0]",
        ),
        12: (0.0, 0.0, 0.0, "sim/flightmodel2/controls/thrust_vector_ratio", 0.0, 0.0, 0.0, 0.0),
        13: (
            _C + "elevator_trim",
            _C + "aileron_trim",
            _C + "rudder_trim",
            _C + "flap_ratio",
            "sim/flightmodel2/controls/flap1_deploy_ratio",
            "sim/flightmodel2/controls/slat1_deploy_ratio",
            _C + "speedbrake_ratio",
            "sim/flightmodel2/controls/speedbrake_ratio",
        ),
        14: (
            _C + "gear_handle_down",
            _C + "parking_brake_ratio",
            _C + "left_brake_ratio",
            _C + "right_brake_ratio",
            _C + "parking_brake_ratio",
        ),
        15: ((_F + "M_total", NM_TO_FTLB), (_F + "L_total", NM_TO_FTLB), (_F + "N_total", NM_TO_FTLB)),
        16: rates,
        17: (_P + true + "theta", _P + true + "phi", _P + true + "psi", _P + "mag_psi"),
        18: (
            _P + "alpha",
            _P + "beta",
            _P + "hpath",
            _P + "vpath",
            None,
            None,
            None,
            "sim/flightmodel/misc/slip",
        ),
        19: ("sim/cockpit2/gauges/indicators/compass_heading_deg_mag", _P + "magnetic_variation"),
        20: (
            _P + "latitude",
            _P + "longitude",
            (_P + "elevation", M_TO_FT),
            (_P + "y_agl", M_TO_FT),
            "_emulator/terrain_ft" if corner else "sim/flightmodel/failures/onground_any",
            "sim/cockpit2/gauges/indicators/altitude_ft_pilot",
            "_emulator/corner_latitude" if corner else _P + "lat_ref",
            "_emulator/corner_longitude" if corner else _P + "lon_ref",
        ),
        21: (
            _P + "local_x",
            _P + "local_y",
            _P + "local_z",
            _P + "local_vx",
            _P + "local_vy",
            _P + "local_vz",
            ("_emulator/distance_m", M_TO_FT),
            ("_emulator/distance_m", 1.0 / 1852.0),
        ),
        22: (_P + "latitude", *_others("lat")),
        23: (_P + "longitude", *_others("lon")),
        24: ((_P + "elevation", M_TO_FT), *_others("el", M_TO_FT)),
        25: _each(_ACT + "throttle_ratio"),
        26: _each(_E + "ENGN_thro_use"),
        27: _each(_E + "ENGN_propmode"),
        # [? row28-unit] rpm or ratio by aircraft
        28: _each(_ACT + "prop_ratio") if "row28-unit" in otherwise else _each(_E + "ENGN_prop", RAD_S_TO_RPM),
        29: _each(_E + "ENGN_mixt"),
        30: _each(_ACT + "carb_heat_ratio"),
        31: _each(_ACT + "cowl_flap_ratio"),
        32: _each(_ACT + "ignition_key"),
        34: _each(_E + "ENGN_power", W_TO_HP),
        35: _each(_E + "POINT_thrust", N_TO_LB),
        36: _each(_E + "ENGN_TRQ", NM_TO_FTLB),
        37: _each(_E + "ENGN_tacrad", RAD_S_TO_RPM),
        38: _each(_E + "POINT_tacrad", RAD_S_TO_RPM),
        39: _each(_E + "POINT_pitch_deg"),
        41: _each(_E + "ENGN_N1_"),
        42: _each(_E + "ENGN_N2_"),
        43: _each(_E + "ENGN_MPR"),
        44: _each(_E + "ENGN_EPR"),
        45: _each(_E + "ENGN_FF_", KGPS_TO_PPH),
        46: _each(_E + "ENGN_ITT_c"),
        47: _each(_E + "ENGN_EGT_c"),
        48: _each(_E + "ENGN_CHT_c"),
        49: _each(_E + "ENGN_oil_press_psi"),
        50: _each(_E + "ENGN_oil_temp_c"),
        51: _each("sim/cockpit2/engine/indicators/fuel_pressure_psi"),
        52: _each(_EL + "generator_amps"),
        53: _each(_EL + "battery_amps"),
        54: _each(_EL + "battery_voltage_actual_volts"),
        55: _each(_ACT + "fuel_pump_on"),
        56: _each(_ACT + "idle_speed"),
        57: _each(_EL + "battery_on"),
        58: _each(_EL + "generator_on"),
        59: (*_each(_EL + "inverter_on", count=2), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        60: _each(_ACT + "fadec_on"),
        61: _each(_ACT + "igniter_on"),
        62: _each("sim/flightmodel/weight/m_fuel", KG_TO_LB),
        63: (
            ("sim/aircraft/weight/acf_m_empty", KG_TO_LB),
            ("sim/flightmodel/weight/m_fixed", KG_TO_LB),
            ("sim/flightmodel/weight/m_fuel_total", KG_TO_LB),
            ("sim/flightmodel/weight/m_jettison", KG_TO_LB),
            ("sim/flightmodel/weight/m_total", KG_TO_LB),
            ("sim/aircraft/weight/acf_m_max", KG_TO_LB),
            None,
            ("sim/flightmodel/misc/cgz_ref_to_default", M_TO_FT),
        ),
        64: (
            (_F + "lift_path_axis", N_TO_LB),
            (_F + "drag_path_axis", N_TO_LB),
            (_F + "side_path_axis", N_TO_LB),
            (_F + "L_aero", NM_TO_FTLB),
            (_F + "M_aero", NM_TO_FTLB),
            (_F + "N_aero", NM_TO_FTLB),
        ),
        65: (0.0, 0.0, 0.0),
        66: _each("_emulator/gear_force_n", N_TO_LB),
        67: _each("sim/flightmodel2/gear/deploy_ratio"),
        70: _wings("ail1"),
        71: _wings("ail2"),
        72: _wings("spo1"),
        73: _wings("spo2"),
        74: [f"sim/flightmodel/controls/hstab{half}_elv{n}def" for n in (1, 2) for half in (1, 2)],
        75: [f"sim/flightmodel/controls/vstab{fin}_rud{n}def" for n in (1, 2) for fin in (1, 2)],
        76: _wings("yawb"),
        78: _each("sim/flightmodel2/engines/nacelle_vertical_angle_deg"),
        106: tuple(
            _S + name
            for name in (
                "avionics_power_on",
                "navigation_lights_on",
                "beacon_on",
                "strobe_lights_on",
                "landing_lights_on",
                "taxi_light_on",
            )
        ),
        108: (
            0.0,
            _AP + "flight_director_mode",
            _AP + "flight_director_pitch_deg",
            _AP + "flight_director_roll_deg",
            None,
            0.0,
            0.0,
        ),
        109: (
            0.0,
            0.0,
            0.0,
            _ICE + "window_heat_on",
            _ICE + "pitot_heat_on_pilot",
            _ICE + "pitot_heat_on_copilot",
            0.0,
            0.0,
        ),
        113: tuple(
            _A + name
            for name in (
                "master_caution",
                "master_warning",
                "master_accept",
                "autopilot_disconnect",
                "low_vacuum",
                "low_voltage",
                "fuel_quantity",
                "hydraulic_pressure",
            )
        ),
        114: (
            _A + "yaw_damper",
            _A + "speedbrake",
            _A + "GPWS",
            _A + "ice",
            _A + "pitot_heat",
            _A + "cabin_altitude_12500",
            0.0,
            0.0,
        ),
        115: (*bits, _A + "igniter_on[0]"),
        116: (
            _AP + "nav_status",
            "_emulator/altitude_hold_on" if "row116-modes" in otherwise else _AP + "altitude_hold_status",
            _AP + "approach_status",
            _AP + "vnav_status",
            0.0,
            0.0,
            _AP + "glideslope_status",
            0.0,
        ),
        117: (
            _AP + "autothrottle_enabled",
            _AP + "heading_mode",
            _AP + "altitude_mode",
            None,
            _AP + "backcourse_status",
            _AP + "approach_status",
            None,
            0.0,
        ),
        118: (
            _AP + "airspeed_dial_kts_mach",
            _AP + "heading_dial_deg_mag_pilot",
            _AP + "vvi_dial_fpm",
            _AP + "altitude_dial_ft",
            _AP + "altitude_vnav_ft",
            _AP + "altitude_hold_ft",
            _AP + "sync_hold_roll_deg",
            _AP + "sync_hold_pitch_deg",
        ),
        120: (
            _CABIN + "actuators/cabin_altitude_ft",
            _CABIN + "actuators/cabin_vvi_fpm",
            _CABIN + "indicators/cabin_altitude_ft",
            _CABIN + "indicators/cabin_vvi_fpm",
            0.0,
            _CABIN + "indicators/pressure_diffential_psi",
            _CABIN + "actuators/dump_all_on",
            _CABIN + "actuators/bleed_air_mode",
        ),
        121: (_EL + "APU_running", _EL + "APU_N1_percent", 0.0, 0.0, 0.0, _EL + "APU_generator_amps", 0.0, 0.0),
        123: (
            1.0,
            1.0,
            "sim/cockpit2/hydraulics/actuators/electric_hydraulic_pump_on",
            0.0,
            "sim/cockpit2/hydraulics/indicators/hydraulic_fluid_ratio_1",
            "sim/cockpit2/hydraulics/indicators/hydraulic_fluid_ratio_2",
            "sim/cockpit2/hydraulics/indicators/hydraulic_pressure_1",
            "sim/cockpit2/hydraulics/indicators/hydraulic_pressure_2",
        ),
        124: (
            _EL + "bus_volts[0]",
            _EL + "bus_volts[1]",
            _EL + "bus_load_amps[0]",
            _EL + "bus_load_amps[1]",
            0.0,
            0.0,
            0.0,
            0.0,
        ),
        127: (0.0, 0.0, 0.0, 0.0, 0.0, _A + "gear_unsafe", _A + "stall_warning", None),
        130: (
            _P + "longitude",
            _P + "latitude",
            _P + "elevation",
            "sim/graphics/view/view_heading",
            "sim/graphics/view/view_pitch",
            "sim/graphics/view/view_roll",
            None,
            0.0,
        ),
        132: ((ground_speed, MPS_TO_KT), (_P + "vh_ind", MPS_TO_FPM), None, 0.0),
        134: _each("sim/flightmodel2/gear/tire_steer_actual_deg"),
        135: (_P + "local_ax", _P + "local_ay", _P + "local_az", _P + "Prad", _P + "Qrad", _P + "Rrad"),
        137: (0.0,) * 6,
        138: [f"sim/joystick/servo_{axis}_ratio" for axis in ("pitch", "roll", "heading")],
    }


class DataRows:
    """Builds DATA datagrams from the store's present values."""

    def __init__(self, store: DatarefStore, is_12: bool, otherwise: FrozenSet[str] = frozenset()) -> None:
        shape = (ROW_COUNT, SLOTS_PER_ROW)
        self._store = store
        self._sources = np.zeros(shape, dtype=int)
        self._factors = np.zeros(shape)
        self._constants = np.zeros(shape)
        for row, slots in layout(is_12, otherwise).items():
            for slot in range(SLOTS_PER_ROW):
                self._define(row, slot, slots[slot] if slot < len(slots) else None)
        self._selected: Optional[np.ndarray] = None
        self._packet = np.zeros(0, dtype=[("row", "<i4"), ("slots", "<f4", SLOTS_PER_ROW)])

    def values(self) -> np.ndarray:
        """All rows, shape (139, 8), in wire units."""
        self._store.watch(self._sources.ravel())
        return self._store.values[self._sources] * self._factors + self._constants

    def of(self, rows: np.ndarray) -> np.ndarray:
        """Some rows by their indices, shape (number of rows, 8), in wire units."""
        index = self._sources[rows]
        self._store.watch(index.ravel())
        values: np.ndarray = self._store.values[index] * self._factors[rows] + self._constants[rows]
        return values

    def packet(self, selected: np.ndarray) -> bytes:
        """The datagram with the selected rows (indices, ascending); empty if none is."""
        if len(selected) == 0:
            return b""
        if self._selected is None or not np.array_equal(selected, self._selected):
            self._selected = selected.copy()
            self._packet = np.zeros(len(selected), dtype=self._packet.dtype)
            self._packet["row"] = selected
            self._store.watch(self._sources[selected].ravel())
        index = self._sources[selected]
        self._packet["slots"] = self._store.values[index] * self._factors[selected] + self._constants[selected]
        return b"DATA" + bytes([FIFTH_BYTE[b"DATA"]]) + self._packet.tobytes()

    def _define(self, row: int, slot: int, source: Source) -> None:
        if source is None:
            self._constants[row, slot] = UNUSED_SLOT
        elif isinstance(source, (int, float)):
            self._constants[row, slot] = source
        else:
            path, factor = (source, 1.0) if isinstance(source, str) else source
            name, _, index = path.partition("[")
            element = int(index.rstrip("]")) if index else 0
            self._sources[row, slot] = self._store.locate(name, element)
            self._factors[row, slot] = factor
