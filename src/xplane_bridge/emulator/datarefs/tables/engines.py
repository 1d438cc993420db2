"""Engines, propellers, fuel flow and their levers."""

from __future__ import annotations

import math
from typing import Callable, List, Sequence, Union

import numpy as np

from xplane_bridge.emulator.datarefs.sources import Sources
from xplane_bridge.emulator.datarefs.store import DatarefStore
from xplane_bridge.emulator.datarefs.tables.base import Table
from xplane_bridge.emulator.flight.flight_model import EngineState
from xplane_bridge.emulator.flight.frame import PA_TO_INHG, PA_TO_PSI, Frame

_ENGINE = "sim/flightmodel/engine/"
_GAUGE = "sim/aircraft/engine/acf_"
_INDICATORS = "sim/cockpit2/engine/indicators/"
_ACTUATORS = "sim/cockpit2/engine/actuators/"
RPM_TO_RAD_S = math.pi / 30.0
#: Of ENGN_propmode.
NORMAL, REVERSE = 1.0, 3.0
#: Value of ENGN_thro_override that gives the engines back to their levers.
THROTTLE_RELEASED = -2.0
_FUEL_PRESSURE_PSI = 24.0
#: Switches of each engine, and where they stand when a flight begins.
_SWITCHES = (
    (_ENGINE + "ENGN_propmode", NORMAL),
    (_ACTUATORS + "fuel_pump_on", 1.0),
    (_ACTUATORS + "igniter_on", 1.0),
    (_ACTUATORS + "ignition_on", 3.0),
    (_ACTUATORS + "ignition_key", 3.0),
)


def each(source: Callable[[EngineState], float]) -> Callable[[Frame], List[float]]:
    """Makes an array source from a source for one engine."""
    return lambda f: [source(engine) for engine in f.m.engines]


def set_first(store: DatarefStore, name: str, values: Union[float, Sequence[float]], count: int) -> None:
    """Sets the first elements, those that the aircraft has; the others are 0."""
    store.set(name, 0.0)
    store.values[store.dataref(name).slots[:count]] = values


def reset_switches(store: DatarefStore, engines: int) -> None:
    """Puts the switches of the engines where they stand when a flight begins."""
    for name, value in _SWITCHES:
        set_first(store, name, value, engines)


def define(t: Table, sim: Sources) -> None:
    """Defines this subject's datarefs."""
    t.value("sim/aircraft/engine/acf_num_engines", lambda f: f.info.engine_count)
    t.value("sim/aircraft/engine/acf_RSC_redline_eng", lambda f: f.info.maximum_rpm * RPM_TO_RAD_S)
    t.value("sim/aircraft/controls/acf_RSC_redline_prp", lambda f: f.info.maximum_rpm * RPM_TO_RAD_S)
    t.value("sim/aircraft/engine/acf_pmax", lambda f: f.info.maximum_power_w)
    t.value("sim/aircraft/engine/acf_throtmax_FWD", lambda f: f.info.max_throttle)
    t.value("sim/aircraft/engine/acf_throtmax_REV", lambda f: -f.info.min_throttle)
    # levers
    t.setting(_ACTUATORS + "throttle_ratio")
    t.alias(_ENGINE + "ENGN_thro", _ACTUATORS + "throttle_ratio")
    t.setting(_ENGINE + "ENGN_propmode")
    # throttle_ratio is 0..1 also in reverse, which the propeller's mode says; this one is below 0 then
    if "reverse-lever" in sim.otherwise:
        t.setting(_ACTUATORS + "throttle_jet_rev_ratio")
    else:
        lever = t.store.dataref(_ACTUATORS + "throttle_ratio").slots
        mode = t.store.dataref(_ENGINE + "ENGN_propmode").slots
        count = min(len(lever), len(mode))
        both = np.concatenate((lever[:count], mode[:count]))

        def with_sign(_: Frame) -> List[float]:
            read: List[float] = t.store.values[both].tolist()
            return [-ratio if of == REVERSE else ratio for ratio, of in zip(read[:count], read[count:])]

        t.array(_ACTUATORS + "throttle_jet_rev_ratio", with_sign)
    for name in ("throttle_ratio_all", "throttle_jet_rev_ratio_all"):
        t.setting(_ACTUATORS + name)
    t.setting(_ACTUATORS + "mixture_ratio")
    t.alias(_ENGINE + "ENGN_mixt", _ACTUATORS + "mixture_ratio")
    t.setting(_ACTUATORS + "mixture_ratio_all")
    t.setting(_ACTUATORS + "prop_ratio")
    t.setting(_ACTUATORS + "prop_ratio_all")
    t.array(
        _ENGINE + "ENGN_prop",
        lambda f: [
            lever * f.info.maximum_rpm * RPM_TO_RAD_S for lever in sim.controls.propeller[: f.info.engine_count]
        ],
    )
    t.alias(_ACTUATORS + "prop_rotation_speed_rad_sec", _ENGINE + "ENGN_prop")
    t.array(_ENGINE + "ENGN_thro_use", each(lambda e: e.throttle))
    t.setting(_ENGINE + "ENGN_thro_override", THROTTLE_RELEASED)
    t.setting(_ENGINE + "ENGN_heat")
    t.setting(_ENGINE + "ENGN_cowl")
    for name in ("fuel_pump_on", "igniter_on", "ignition_on", "ignition_key"):
        t.setting(_ACTUATORS + name)
    t.setting(_ACTUATORS + "starter_hit")
    t.setting(_ACTUATORS + "idle_speed")
    t.setting(_ACTUATORS + "fadec_on")
    for name in ("carb_heat_ratio", "cowl_flap_ratio"):
        t.setting(_ACTUATORS + name)
    for gauge in ("ITT", "EGT", "CHT", "oilT"):
        t.setting(f"{_GAUGE}{gauge}_is_C", 1)
    # what the engines do
    t.array(_ENGINE + "ENGN_running", each(lambda e: e.running))
    for name, source in (
        ("ENGN_tacrad", lambda e: e.rpm * RPM_TO_RAD_S),
        ("POINT_tacrad", lambda e: e.prop_rpm * RPM_TO_RAD_S),
        ("POINT_thrust", lambda e: e.thrust_n),
        ("POINT_pitch_deg", lambda e: e.blade_pitch_deg),
        ("POINT_driv_TRQ", lambda e: e.torque_nm),
        ("ENGN_TRQ", lambda e: e.torque_nm),
        ("ENGN_power", lambda e: e.power_w),
        ("ENGN_FF_", lambda e: e.fuel_flow_kg_s),
        ("ENGN_MPR", lambda e: e.manifold_pressure_pa * PA_TO_INHG),
        ("ENGN_EGT_c", lambda e: _shown(e.exhaust_gas_temperature_k, sim, "EGT")),
        ("ENGN_ITT_c", lambda e: _shown(e.exhaust_gas_temperature_k, sim, "ITT")),
        ("ENGN_CHT_c", lambda e: _shown(e.cylinder_head_temperature_k, sim, "CHT")),
        ("ENGN_oil_temp_c", lambda e: _shown(e.oil_temperature_k, sim, "oilT")),
        ("ENGN_oil_press_psi", lambda e: e.oil_pressure_pa * PA_TO_PSI),
        ("ENGN_N1_", lambda e: e.n1_percent if sim.model.info.turbines else _speed_percent(e, sim)),
        ("ENGN_N2_", lambda e: e.n2_percent if sim.model.info.turbines else _speed_percent(e, sim)),
        ("ENGN_EPR", lambda _: 1.0),
        ("ENGN_EGT", lambda e: _celsius(e.exhaust_gas_temperature_k) / 900.0),
        ("ENGN_ITT", lambda e: _celsius(e.exhaust_gas_temperature_k) / 900.0),
        ("ENGN_CHT", lambda e: _celsius(e.cylinder_head_temperature_k) / 260.0),
        ("ENGN_oil_temp", lambda e: _celsius(e.oil_temperature_k) / 120.0),
        ("ENGN_oil_press", lambda e: e.oil_pressure_pa / 6e5),
    ):
        t.array(_ENGINE + name, each(source))
    for name, target in (
        ("N1_percent", "ENGN_N1_"),
        ("N2_percent", "ENGN_N2_"),
        ("MPR_in_hg", "ENGN_MPR"),
        ("EPR_ratio", "ENGN_EPR"),
        ("torque_n_mtr", "ENGN_TRQ"),
        ("fuel_flow_kg_sec", "ENGN_FF_"),
        ("ITT_deg_C", "ENGN_ITT_c"),
        ("EGT_deg_C", "ENGN_EGT_c"),
        ("CHT_deg_C", "ENGN_CHT_c"),
        ("oil_pressure_psi", "ENGN_oil_press_psi"),
        ("oil_temperature_deg_C", "ENGN_oil_temp_c"),
        ("power_watts", "ENGN_power"),
        ("thrust_n", "POINT_thrust"),
    ):
        t.alias(_INDICATORS + name, _ENGINE + target)
    t.array(_INDICATORS + "engine_speed_rpm", each(lambda e: e.rpm))
    t.array(_INDICATORS + "prop_speed_rpm", each(lambda e: e.prop_rpm))
    t.array(_INDICATORS + "fuel_pressure_psi", each(lambda e: _FUEL_PRESSURE_PSI if e.running else 0.0))
    t.setting(_INDICATORS + "carburetor_temperature_C", 15.0)
    engines2 = "sim/flightmodel2/engines/"
    t.array(engines2 + "nacelle_vertical_angle_deg", each(lambda e: e.nacelle_deg))
    t.alias(engines2 + "starter_is_running", _ACTUATORS + "starter_hit")
    t.array(engines2 + "engine_is_burning_fuel", each(lambda e: e.running))
    t.array(engines2 + "engine_rotation_speed_rad_sec", each(lambda e: e.rpm * RPM_TO_RAD_S))
    t.array(engines2 + "prop_rotation_speed_rad_sec", each(lambda e: e.prop_rpm * RPM_TO_RAD_S))
    t.array(engines2 + "prop_pitch_deg", each(lambda e: e.blade_pitch_deg))
    t.array(engines2 + "throttle_used_ratio", each(lambda e: e.throttle))


def _speed_percent(engine: EngineState, sim: Sources) -> float:
    return engine.rpm * 100.0 / max(sim.model.info.maximum_rpm, 1.0)


def _shown(kelvin: float, sim: Sources, gauge: str) -> float:
    """What the aircraft's gauge shows: degrees Celsius, or Fahrenheit where its file says so."""
    celsius = _celsius(kelvin)
    return celsius if sim.store.get(f"{_GAUGE}{gauge}_is_C") else celsius * 1.8 + 32.0


def _celsius(kelvin: float) -> float:
    """Degrees Celsius; 0 stays 0 (an engine without such a temperature)."""
    return kelvin - 273.15 if kelvin > 0.0 else 0.0
