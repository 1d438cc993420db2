"""What the pilots see: gauges of pilot and copilot, with what failed behind them."""

from __future__ import annotations

import math
from functools import partial
from typing import Callable

from xplane_bridge.emulator.datarefs.aircraft_systems import Instruments
from xplane_bridge.emulator.datarefs.sources import Sources
from xplane_bridge.emulator.datarefs.tables.base import Table
from xplane_bridge.emulator.flight import earth
from xplane_bridge.emulator.flight.frame import BETA_SIGN, M_TO_FT, MPS_TO_KT, Frame

_GAUGES = "sim/cockpit2/gauges/indicators/"
_CLOCK = "sim/cockpit2/clock_timer/"
#: Farthest that a radio altimeter shows [ft].
_RADIO_RANGE_FT = 2500.0
#: The turn indicators' marks of a standard turn, 3 degrees a second, and their stops [deg].
_STANDARD_TURN_MARK_DEG, _TURN_STOP_DEG = 15.0, 30.0


def define(t: Table, sim: Sources) -> None:
    """Defines this subject's datarefs."""
    _panel(t, "pilot", lambda: sim.instruments)
    _panel(t, "copilot", lambda: sim.copilot_instruments)
    for number in (1, 2):
        t.value(f"{_GAUGES}suction_{number}_ratio", partial(_suction, sim=sim, system=number))
    t.value(_GAUGES + "compass_heading_deg_mag", lambda f: f.mag_psi)
    left = 1.0 if "slip-sign" not in sim.otherwise else -1.0
    t.value(_GAUGES + "slip_deg", lambda f: left * slip_deg(f))
    beta_sign = -BETA_SIGN if "beta-sign" in sim.otherwise else BETA_SIGN
    t.value(_GAUGES + "sideslip_degrees", lambda f: beta_sign * math.degrees(f.m.beta_rad))
    t.value(_GAUGES + "ground_track_mag_pilot", lambda f: earth.wrap_degrees(f.hpath - f.declination))
    t.value("sim/cockpit2/temperature/outside_air_temp_degc", lambda f: f.m.temperature_k - 273.15)
    clock = sim.clocks
    for name, seconds in (
        ("zulu_time", lambda _: clock.zulu),
        ("local_time", lambda f: clock.local(f.m.longitude_deg)),
        ("elapsed_time", lambda _: clock.flight),
    ):
        t.value(f"{_CLOCK}{name}_hours", partial(lambda of, f: int(of(f) // 3600.0), seconds))
        t.value(f"{_CLOCK}{name}_minutes", partial(lambda of, f: int(of(f) // 60.0 % 60.0), seconds))
        t.value(f"{_CLOCK}{name}_seconds", partial(lambda of, f: int(of(f) % 60.0), seconds))


def _panel(t: Table, seat: str, of: Callable[[], Instruments]) -> None:
    t.value(f"{_GAUGES}altitude_ft_{seat}", lambda _: of().altitude_ft)
    t.value(f"{_GAUGES}airspeed_kts_{seat}", lambda _: of().airspeed_kt)
    t.value(f"{_GAUGES}calibrated_airspeed_kts_{seat}", lambda f: f.m.calibrated_airspeed_mps * MPS_TO_KT)
    t.value(f"{_GAUGES}true_airspeed_kts_{seat}", lambda f: f.m.true_airspeed_mps * MPS_TO_KT)
    t.value(f"{_GAUGES}mach_{seat}", lambda f: f.m.mach)
    t.value(f"{_GAUGES}vvi_fpm_{seat}", lambda _: of().vertical_speed_fpm)
    t.value(f"{_GAUGES}pitch_vacuum_deg_{seat}", lambda _: of().pitch_deg)
    t.value(f"{_GAUGES}roll_vacuum_deg_{seat}", lambda _: of().roll_deg)
    t.value(f"{_GAUGES}heading_vacuum_deg_mag_{seat}", lambda _: of().heading_deg)
    for kind in ("electric", "AHARS"):
        t.value(f"{_GAUGES}pitch_{kind}_deg_{seat}", lambda f: f.true_theta)
        t.value(f"{_GAUGES}roll_{kind}_deg_{seat}", lambda f: f.true_phi)
        t.value(f"{_GAUGES}heading_{kind}_deg_mag_{seat}", lambda f: f.mag_psi)
    t.value(f"{_GAUGES}turn_rate_heading_deg_{seat}", lambda _: _turn_needle(of()))
    t.value(f"{_GAUGES}turn_rate_roll_deg_{seat}", lambda _: _turn_needle(of()))
    t.value(f"{_GAUGES}radio_altimeter_height_ft_{seat}", lambda f: min(f.height * M_TO_FT, _RADIO_RANGE_FT))
    t.setting(f"sim/cockpit2/gauges/actuators/barometer_setting_in_hg_{seat}", 29.92)


def _turn_needle(instruments: Instruments) -> float:
    """Deflection of the turn indicator [deg]."""
    needle = instruments.turn_rate_deg_s / 3.0 * _STANDARD_TURN_MARK_DEG
    return min(max(needle, -_TURN_STOP_DEG), _TURN_STOP_DEG)


def _suction(f: Frame, sim: Sources, system: int) -> float:
    """A pump on each engine."""
    failed = sim.failed("rel_vacuum" if system == 1 else "rel_vacuum2")
    running = system <= len(f.m.engines) and f.m.engines[system - 1].running
    return float(running and not failed)


def slip_deg(f: Frame) -> float:
    """The ball, left + [? slip-sign]: against the side force, as instruments of X-Plane that move it by this value."""
    return math.degrees(math.atan2(f.m.specific_force_y_mps2, max(-f.m.specific_force_z_mps2, 1.0)))
