"""Radios and navigation: frequencies as they are set, needles as the stations of `radio_navigation` move them."""

from __future__ import annotations

from functools import partial
from typing import Callable, Dict, List, Sequence, Tuple

from xplane_bridge.emulator.datarefs import radio_navigation as radio
from xplane_bridge.emulator.datarefs.sources import Sources
from xplane_bridge.emulator.datarefs.tables.base import Number, Table
from xplane_bridge.emulator.flight.frame import MPS_TO_KT, Frame

_ACTUATORS = "sim/cockpit2/radios/actuators/"
_INDICATORS = "sim/cockpit2/radios/indicators/"
_OLD = "sim/cockpit/radios/"
_Value = Callable[[radio.Reading], Number]
#: Characters of an identifier that are sent; X-Plane's texts are longer.
_ID_LENGTH = 8


def define(t: Table, sim: Sources) -> None:
    """Defines this subject's datarefs."""
    readings = _Readings(t, sim)
    for number, (com, nav) in enumerate(((12190, radio.VOR_KHZ // 10), (12280, radio.ILS_KHZ // 10)), 1):
        _com(t, number, com)
        _nav(t, number, nav, readings)
    _dme(t, readings)
    for number in (1, 2):
        adf = f"{_ACTUATORS}adf{number}_"
        t.setting(adf + "frequency_hz", radio.NDB_KHZ)
        t.setting(adf + "standby_frequency_hz", 400)
        t.value(f"{_INDICATORS}adf{number}_relative_bearing_deg", partial(readings.adf, number=number))
    for index, name in enumerate(("outer", "middle", "inner")):
        t.value(f"{_INDICATORS}{name}_marker_lit", partial(readings.marker, index=index))
    _gps(t, readings)
    _hsi(t, readings)
    t.setting(_OLD + "transponder_code", 1200)
    t.setting(_OLD + "transponder_mode", 2)
    t.alias(_ACTUATORS + "transponder_code", _OLD + "transponder_code")
    t.alias(_ACTUATORS + "transponder_mode", _OLD + "transponder_mode")


class _Readings:
    """What the receivers show in a frame, worked out once for it."""

    def __init__(self, t: Table, sim: Sources) -> None:
        self._store, self._sim = t.store, sim
        self._of: Tuple[int, int] = (-1, -1)
        self._found: Dict[str, radio.Reading] = {}
        self._receivers = radio.Receivers(sim.failed, self._powered)
        self.field = radio.Aerodrome.at(sim.home)

    def nav(self, f: Frame, number: int) -> radio.Reading:
        """Receiver 1 or 2."""

        def read() -> radio.Reading:
            frequency = 10.0 * self._store.get(f"{_OLD}nav{number}_freq_hz")
            obs = self._store.get(f"{_ACTUATORS}nav{number}_obs_deg_mag_pilot")
            return self._receivers.nav(number, frequency, obs, f, self.field)

        return self._once(f, f"nav{number}", read)

    def dme(self, f: Frame) -> radio.Reading:
        """The DME receiver of its own."""
        frequency = 10.0 * self._store.get(_ACTUATORS + "dme_frequency_hz")
        return self._once(f, "dme", lambda: self._receivers.dme(frequency, f, self.field))

    def gps(self, f: Frame) -> radio.Reading:
        """The GPS."""
        return self._once(f, "gps", lambda: self._receivers.gps(f, self.field))

    def selected(self, f: Frame) -> radio.Reading:
        """What the HSI shows."""
        source = int(self._store.get(_ACTUATORS + "HSI_source_select_pilot"))
        return self.gps(f) if source == 2 else self.nav(f, 2 if source == 1 else 1)

    def adf(self, f: Frame, number: int) -> float:
        """Relative bearing that ADF 1 or 2 points to."""
        frequency = self._store.get(f"{_ACTUATORS}adf{number}_frequency_hz")
        return self._receivers.relative_bearing_deg(number, frequency, f, self.field)

    def marker(self, f: Frame, index: int) -> bool:
        """Whether a marker's lamp is lit."""
        return self._receivers.marker(index, f, self.field)

    def _powered(self) -> bool:
        avionics = self._store.get("sim/cockpit2/switches/avionics_power_on") != 0.0
        return avionics and self._sim.electrics.bus_volts[0] > 0.0

    def _once(self, f: Frame, name: str, read: Callable[[], radio.Reading]) -> radio.Reading:
        of = (f.clocks.frame, id(f.m))
        if of != self._of:
            self._of = of
            self._found.clear()
        if name not in self._found:
            self._found[name] = read()
        return self._found[name]


def _com(t: Table, number: int, frequency: int) -> None:
    """The old names count in 10 kHz, those for channels of 8.33 kHz in kHz; both are the same knob."""
    for name, old, value in (("", "", frequency), ("standby_", "stdby_", frequency + 100)):
        coarse = f"{_OLD}com{number}_{old}freq_hz"
        fine = f"{_ACTUATORS}com{number}_{name}frequency_hz_833"
        t.setting(coarse, value)
        t.setting(fine, 10 * value)
        t.alias(f"{_ACTUATORS}com{number}_{name}frequency_hz", coarse)
        for path in (coarse, f"{_ACTUATORS}com{number}_{name}frequency_hz"):
            t.store.on_write(path, partial(lambda other, _, new: t.store.set(other, 10.0 * new), fine))
        t.store.on_write(fine, partial(lambda other, _, new: t.store.set(other, float(int(new) // 10)), coarse))


def _nav(t: Table, number: int, frequency: int, readings: _Readings) -> None:
    for name, old, setting in (("", "", frequency), ("standby_", "stdby_", frequency + 100)):
        t.setting(f"{_OLD}nav{number}_{old}freq_hz", setting)
        t.alias(f"{_ACTUATORS}nav{number}_{name}frequency_hz", f"{_OLD}nav{number}_{old}freq_hz")
    t.setting(f"{_ACTUATORS}nav{number}_obs_deg_mag_pilot")
    nav = f"{_INDICATORS}nav{number}_"
    t.array(nav + "nav_id", lambda f: _characters(readings.nav(f, number).identifier))
    for name, value in (
        ("bearing_deg_mag", lambda r: r.bearing_deg),
        ("hdef_dots_pilot", lambda r: r.deviation_dots),
        ("flag_from_to_pilot", lambda r: r.to_from),
        ("vdef_dots_pilot", lambda r: r.glideslope_dots),
        ("flag_glideslope", lambda r: r.glideslope_expected and r.glideslope_flag),
        ("flag_glideslope_mech", lambda r: r.glideslope_flag),
        ("has_dme", lambda r: r.has_dme),
        *_DISTANCES,
    ):
        t.value(nav + name, _shown(value, lambda f: readings.nav(f, number)))


def _shown(value: _Value, reading: Callable[[Frame], radio.Reading]) -> Callable[[Frame], Number]:
    return lambda f: value(reading(f))


_DISTANCES: Sequence[Tuple[str, _Value]] = (
    ("dme_distance_nm", lambda r: r.distance_m / radio.METERS_PER_NM),
    ("dme_speed_kts", lambda r: r.speed_mps * MPS_TO_KT),
    ("dme_time_min", lambda r: r.time_s / 60.0),
)


def _dme(t: Table, readings: _Readings) -> None:
    t.setting(_ACTUATORS + "dme_frequency_hz", radio.VOR_KHZ // 10)
    for name, value in _DISTANCES:
        t.value(f"{_INDICATORS}dme_{name}", _shown(value, readings.dme))


def _gps(t: Table, readings: _Readings) -> None:
    t.array(_INDICATORS + "gps_nav_id", lambda f: _characters(readings.gps(f).identifier))
    for name, value in (
        ("bearing_deg_mag", lambda r: r.bearing_deg),
        ("hdef_dots_pilot", lambda r: r.deviation_dots),
        *_DISTANCES,
    ):
        t.value(f"{_INDICATORS}gps_{name}", _shown(value, readings.gps))
    t.value(_OLD + "gps_course_degtm", lambda f: readings.gps(f).course_deg)


def _hsi(t: Table, readings: _Readings) -> None:
    t.setting(_ACTUATORS + "HSI_source_select_pilot")
    t.setting(_ACTUATORS + "hsi_obs_deg_mag_pilot")
    t.value(_INDICATORS + "hsi_bearing_deg_mag_pilot", lambda f: readings.selected(f).bearing_deg)
    t.value(_INDICATORS + "hsi_hdef_dots_pilot", lambda f: readings.selected(f).deviation_dots)


def _characters(identifier: str) -> List[int]:
    """The identifier's codes and zeros behind them."""
    return list(identifier.encode("ascii").ljust(_ID_LENGTH, b"\0"))
