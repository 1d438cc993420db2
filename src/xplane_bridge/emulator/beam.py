"""The line and the path that X-Plane's own autopilot tracks by radio: what its needles show, and how to fly by them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Optional

from xplane_bridge.emulator.datarefs import radio_navigation as radio
from xplane_bridge.emulator.datarefs.store import DatarefStore
from xplane_bridge.emulator.flight import earth
from xplane_bridge.emulator.flight.frame import Frame

_RADIOS = "sim/cockpit2/radios/"
#: Of a station without DME [m], and the least that is flown by: the needle swings over the station.
_UNKNOWN_M, _LEAST_M = 15000.0, 1000.0
#: The line is closed in on with this time constant, at most at this angle; the path with that one [s, deg].
_LINE_S, _INTERCEPT_DEG, _PATH_S = 15.0, 30.0, 6.0
#: Sink and climb on the path at most [m/s].
_MOST_SINK, _MOST_CLIMB = 8.0, 3.0


@dataclass(frozen=True)
class Beam:
    """What the selected receiver shows.

    Attributes:
        course_deg: Of its selector, magnetic.
        dots: The line's needle, line to the right +.
        aside_m: How far the line is to the right.
        path_dots: The path's needle, path below +; None: none is heard.
        above_m: How far the path is below.
    """

    course_deg: float
    dots: float
    aside_m: float
    path_dots: Optional[float] = None
    above_m: float = 0.0

    @classmethod
    def heard(cls, store: DatarefStore) -> Optional[Beam]:
        """By the HSI's source, NAV 1 or 2; None where that hears no station."""
        number = 2 if store.get(_RADIOS + "actuators/HSI_source_select_pilot") == 1.0 else 1

        def shown(name: str) -> float:
            return store.get(f"{_RADIOS}indicators/nav{number}_{name}")

        if shown("flag_from_to_pilot") == radio.NO_SIGNAL:
            return None
        distance = shown("dme_distance_nm") * radio.METERS_PER_NM if shown("has_dme") else _UNKNOWN_M
        distance = max(distance, _LEAST_M)
        localizer = 10.0 * store.get(f"{_RADIOS}actuators/nav{number}_frequency_hz") == radio.ILS_KHZ
        per_dot = radio.LOCALIZER_DEG_PER_DOT if localizer else radio.VOR_DEG_PER_DOT
        dots = shown("hdef_dots_pilot")
        course = store.get(f"{_RADIOS}actuators/nav{number}_obs_deg_mag_pilot")
        beam = cls(course, dots, distance * math.sin(math.radians(dots * per_dot)))
        if shown("flag_glideslope_mech"):
            return beam
        path = shown("vdef_dots_pilot")
        above = distance * math.tan(math.radians(path * radio.GLIDESLOPE_DEG_PER_DOT))
        return cls(course, dots, beam.aside_m, path, above)

    def heading_deg(self, frame: Frame) -> float:
        """The magnetic heading by which the track closes in on the line, whatever the wind."""
        m = frame.m
        speed = max(math.hypot(m.v_north_mps, m.v_east_mps), 1.0)
        angle = math.degrees(self.aside_m / (speed * _LINE_S))
        wanted = self.course_deg + min(max(angle, -_INTERCEPT_DEG), _INTERCEPT_DEG)
        track = math.degrees(math.atan2(m.v_east_mps, m.v_north_mps)) - frame.declination
        return earth.wrap_degrees(frame.mag_psi + earth.wrap_half_turn(wanted - track))

    def climb_mps(self, frame: Frame) -> float:
        """The climb by which the height closes in on the path."""
        speed = math.hypot(frame.m.v_north_mps, frame.m.v_east_mps)
        climb = -speed * math.tan(math.radians(radio.GLIDE_PATH_DEG)) - self.above_m / _PATH_S
        return min(max(climb, -_MOST_SINK), _MOST_CLIMB)
