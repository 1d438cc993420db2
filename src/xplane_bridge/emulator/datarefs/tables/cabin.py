"""Switches against ice, the fuel selectors, cabin pressure and oxygen: the aircraft's cabins are not pressurised."""

from __future__ import annotations

from xplane_bridge.emulator.datarefs.sources import Sources
from xplane_bridge.emulator.datarefs.tables.base import Table
from xplane_bridge.emulator.flight.frame import M_TO_FT, MPS_TO_FPM, Frame, indicated_altitude_m

_ICE = "sim/cockpit2/ice/ice_"
_CABIN = "sim/cockpit2/pressurization/"
_OXYGEN = "sim/cockpit2/oxygen/"
_STANDARD_PRESSURE_PA = 101325.0
_ALL_TANKS = 4


def define(t: Table, sim: Sources) -> None:
    """Defines this subject's datarefs."""
    del sim
    for name in (
        *(f"{what}_heat_on_{seat}" for what in ("pitot", "static") for seat in ("pilot", "copilot")),
        "AOA_heat_on",
        "AOA_heat_on_copilot",
        "window_heat_on",
        *(f"{what}_{side}_on" for side in ("left", "right") for what in ("surfce_heat", "surface_boot", "surface_tks")),
        *(f"surface_hot_bleed_air_{side}_on" for side in ("left", "right")),
        "detect_on",
        "tks_fluid_liter",
        "inlet_heat_on_per_engine",
        "prop_heat_on_per_engine",
    ):
        t.setting(_ICE + name)
    fuel = "sim/cockpit2/fuel/fuel_tank_"
    for name in ("selector", "selector_left", "selector_right"):
        t.setting(fuel + name, _ALL_TANKS)
    for name in ("transfer_from", "transfer_to", "pump_on"):
        t.setting(fuel + name)
    for name in ("cabin_altitude_ft", "cabin_vvi_fpm", "dump_all_on", "bleed_air_mode"):
        t.setting(f"{_CABIN}actuators/{name}")
    t.value(_CABIN + "indicators/cabin_altitude_ft", _pressure_altitude_ft)
    t.value(_CABIN + "indicators/cabin_vvi_fpm", lambda f: -f.m.v_down_mps * MPS_TO_FPM)
    t.value(_CABIN + "indicators/pressure_diffential_psi", lambda _: 0.0)
    t.setting(_OXYGEN + "actuators/o2_valve_on")
    for name in ("o2_bottle_pressure_psi", "o2_bottle_rem_liter"):
        t.setting(f"{_OXYGEN}indicators/{name}")
    t.value(_OXYGEN + "indicators/pilot_felt_altitude_ft", _pressure_altitude_ft)


def _pressure_altitude_ft(f: Frame) -> float:
    return indicated_altitude_m(f.m.pressure_pa, _STANDARD_PRESSURE_PA) * M_TO_FT
