"""Identity, electrics, hydraulics, switches, autopilot, annunciators, network and version."""

from __future__ import annotations

from functools import partial
from typing import Iterable, List

from xplane_bridge.emulator.datarefs.autopilot import LATERAL, VERTICAL, captured_mode
from xplane_bridge.emulator.datarefs.sources import Sources
from xplane_bridge.emulator.datarefs.tables.base import Table
from xplane_bridge.emulator.flight.frame import Frame

_ELECTRICAL = "sim/cockpit2/electrical/"
_SWITCHES = "sim/cockpit2/switches/"
_AUTOPILOT = "sim/cockpit2/autopilot/"
_ANNUNCIATORS = "sim/cockpit2/annunciators/"
#: Annunciators with an element for each engine, in the order of row 115.
BY_ENGINE = (
    "fuel_pressure_low",
    "oil_pressure_low",
    "oil_temperature_high",
    "inverter_off",
    "generator_off",
    "chip_detected",
    "engine_fires",
)


def define(t: Table, sim: Sources) -> None:
    """Defines this subject's datarefs."""
    _version_and_network(t, sim)
    _identity(t)
    _electrical(t, sim)
    _hydraulics(t, sim)
    _autopilot(t, sim)
    _annunciators(t, sim)


def _version_and_network(t: Table, sim: Sources) -> None:
    t.setting("sim/version/xplane_internal_version", sim.internal_version)
    t.setting("sim/version/sim_build_string")
    dataout = "sim/network/dataout/"
    for name in ("data_to_internet", "data_to_disk", "data_to_graph", "data_to_screen"):
        t.setting(dataout + name)
    t.setting(dataout + "network_data_rate", sim.initial_data_rate)
    t.setting(dataout + "is_external_visual")
    t.setting(dataout + "multiplayer_ip")
    t.setting("sim/operation/misc/debug_network")
    t.setting("sim/graphics/settings/rendering_res", 3)


def _identity(t: Table) -> None:
    view = "sim/aircraft/view/"
    t.setting(view + "acf_ICAO")
    t.setting(view + "acf_descrip")
    t.setting(view + "acf_author")
    t.setting(view + "acf_tailnum")
    t.setting(view + "acf_ui_name")
    t.setting(view + "acf_relative_path")
    t.setting(view + "acf_livery_path")
    t.setting(view + "acf_livery_index")
    t.value(view + "acf_Vne", lambda f: f.info.never_exceed_mps * 3600.0 / 1852.0)
    t.value(view + "acf_Vs", lambda f: f.info.stall_mps * 3600.0 / 1852.0)
    t.value(view + "acf_peZ", lambda f: -f.info.eye_forward_m)
    t.value(view + "acf_peY", lambda f: -f.info.eye_down_m)
    t.setting(view + "acf_peX", 0.0)


def _electrical(t: Table, sim: Sources) -> None:
    e = _ELECTRICAL
    t.setting(e + "battery_on")
    t.setting(e + "generator_on")
    t.setting(e + "inverter_on")
    t.setting(e + "cross_tie")
    t.array(e + "bus_volts", lambda _: sim.electrics.bus_volts)
    t.array(e + "bus_load_amps", lambda _: sim.electrics.bus_amps)
    t.array(e + "battery_voltage_actual_volts", lambda _: sim.electrics.battery_volts)
    t.array(e + "battery_voltage_indicated_volts", lambda _: sim.electrics.battery_volts)
    t.array(e + "battery_amps", lambda _: sim.electrics.battery_amps)
    t.array(e + "generator_amps", lambda _: sim.electrics.generator_amps)
    for name in ("APU_generator_on", "APU_starter_switch", "APU_running"):
        t.setting(e + name)
    t.setting(e + "APU_generator_amps")
    t.setting(e + "APU_N1_percent")
    for name in (
        "avionics_power_on",
        "navigation_lights_on",
        "beacon_on",
        "strobe_lights_on",
        "landing_lights_on",
        "taxi_light_on",
    ):
        t.setting(_SWITCHES + name)


def _hydraulics(t: Table, sim: Sources) -> None:
    for number in (1, 2):
        t.value(
            f"sim/cockpit2/hydraulics/indicators/hydraulic_pressure_{number}",
            partial(lambda system, _: sim.hydraulic_pressure_psi(system), number),
        )
        t.setting(f"sim/cockpit2/hydraulics/indicators/hydraulic_fluid_ratio_{number}", 1.0)
    t.setting("sim/cockpit2/hydraulics/actuators/electric_hydraulic_pump_on")
    t.setting("sim/cockpit2/hydraulics/actuators/engine_pump", 1)


def _autopilot(t: Table, sim: Sources) -> None:
    """Dials and modes; `datarefs/autopilot.py` switches these, `emulator/servos.py` flies by them."""
    for name in (
        "flight_director_mode",
        "autothrottle_enabled",
        "autothrottle_on",
        "nav_status",
        "heading_status",
        "altitude_hold_status",
        "approach_status",
        "vnav_status",
        "vvi_status",
        "speed_status",
        "pitch_status",
        "roll_status",
        "glideslope_status",
        "backcourse_status",
        "altitude_hold_armed",
        "glideslope_armed",
    ):
        t.setting(_AUTOPILOT + name)
    t.value(_AUTOPILOT + "heading_mode", lambda _: captured_mode(sim.store, LATERAL))
    t.value(_AUTOPILOT + "altitude_mode", lambda _: captured_mode(sim.store, VERTICAL))
    t.setting(_AUTOPILOT + "autopilot_electric_master", 1.0)
    t.value(_AUTOPILOT + "servos_on", lambda _: sim.store.get(_AUTOPILOT + "flight_director_mode") == 2.0)
    for name in (
        "airspeed_dial_kts_mach",
        "airspeed_is_mach",
        "airspeed_dial_kts",
        "heading_dial_deg_mag_pilot",
        "heading_dial_deg_mag_copilot",
        "vvi_dial_fpm",
        "altitude_dial_ft",
        "altitude_vnav_ft",
        "altitude_hold_ft",
        "flight_director_pitch_deg",
        "flight_director_roll_deg",
        "sync_hold_pitch_deg",
        "sync_hold_roll_deg",
    ):
        t.setting(_AUTOPILOT + name)


def _annunciators(t: Table, sim: Sources) -> None:
    a = _ANNUNCIATORS
    t.value(a + "master_caution", lambda f: _master_caution(f, sim))
    t.value(a + "master_warning", lambda f: f.m.crashed or any(sim.failed(f"rel_engfir{i}") for i in range(8)))
    for name in ("master_accept", "autopilot_disconnect", "ice", "GPWS", "hydraulic_pressure"):
        t.setting(a + name)
    t.value(a + "low_vacuum", lambda f: not any(e.running for e in f.m.engines))
    t.value(a + "low_voltage", lambda _: sim.electrics.bus_volts[0] < 25.0)
    t.value(a + "fuel_quantity", lambda f: sum(f.m.fuel_kg) < 20.0 and len(f.m.fuel_kg) > 0)
    t.value(a + "yaw_damper", lambda _: sim.store.get(_SWITCHES + "yaw_damper_on"))
    t.value(a + "speedbrake", lambda f: f.m.speed_brake_ratio > 0.01)
    t.value(a + "pitot_heat", lambda _: not sim.store.get("sim/cockpit2/ice/ice_pitot_heat_on_pilot"))
    t.value(a + "cabin_altitude_12500", lambda f: f.m.altitude_m > 3810.0)
    t.value(a + "stall_warning", lambda f: f.m.stall_warning)
    t.value(a + "stall_warning_ratio", lambda f: f.m.stall_warning)
    t.value(a + "gear_unsafe", lambda f: any(0.01 < wheel.extended < 0.99 for wheel in f.m.gear))
    t.value(a + "gear_warning", lambda f: _gear_warning(f))
    for name in BY_ENGINE:
        t.value(f"_emulator/{name}_bits", partial(lambda lights, _: _bits(sim.store.array(a + lights)), name))
    t.value("_emulator/altitude_hold_on", lambda _: sim.store.get(_AUTOPILOT + "altitude_hold_status") > 0.0)
    t.array(a + "fuel_pressure_low", lambda f: [not e.running for e in f.m.engines])
    t.array(a + "oil_pressure_low", lambda f: [e.oil_pressure_pa < 1e5 for e in f.m.engines])
    t.array(a + "oil_temperature_high", lambda f: [e.oil_temperature_k > 395.0 for e in f.m.engines])
    t.array(a + "inverter_off", lambda _: 1.0 - sim.store.array(_ELECTRICAL + "inverter_on"))
    t.array(a + "generator_off", lambda _: sim.electrics.generator_off)
    t.array(a + "chip_detected", lambda _: _failed(sim, "rel_chipde"))
    t.array(a + "engine_fires", lambda _: _failed(sim, "rel_engfir"))
    t.setting(a + "igniter_on")


def _bits(values: Iterable[float]) -> int:
    return sum(1 << place for place, value in enumerate(values) if value)


def _failed(sim: Sources, stem: str) -> List[bool]:
    return [sim.failed(f"{stem}{i}") for i in range(sim.model.info.engine_count)]


def _gear_warning(f: Frame) -> bool:
    """Slow, low, and the wheels are up."""
    up = any(wheel.extended < 0.5 for wheel in f.m.gear)
    return up and f.height < 150.0 and f.m.calibrated_airspeed_mps < 1.5 * max(f.info.stall_mps, 1.0)


def _master_caution(f: Frame, sim: Sources) -> bool:
    engines = any(not engine.running for engine in f.m.engines)
    return engines or sim.electrics.bus_volts[0] < 25.0
