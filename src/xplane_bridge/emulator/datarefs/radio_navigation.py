"""Radio navigation: the stations round the emulator's aerodrome, and what the aircraft's receivers make of them.

The aerodrome lies where `--aerodrome` says, else where flights start, its runway along their heading, as in the view.
It has a VOR/DME, an ILS with markers and a DME, a beacon (NDB), and is the GPS's destination. Declination is that of
the frame, X-Plane's sphere is the earth. How far a needle moves is the emulator's choice, of the usual kind: full scale
2.5 dots, which is 10 degrees for a VOR, 2.5 for a localizer, 0.7 for a glideslope (path below the aircraft +) and 5 NM
for the GPS.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Callable, List, Optional, Sequence

from xplane_bridge.emulator.flight import earth
from xplane_bridge.emulator.flight.flight_model import InitialState
from xplane_bridge.emulator.flight.frame import Frame, magnetic_declination
from xplane_bridge.units import EARTH_RADIUS_M

METERS_PER_NM = 1852.0
#: Of the runway [m].
HALF_RUNWAY_M = 900.0
#: Where the localizer stands beyond the runway's end, and the touch-down point behind its threshold [m].
LOCALIZER_BEYOND_M, TOUCHDOWN_M = 300.0, 300.0
#: Of the markers before the threshold [m]: outer, middle, inner.
MARKERS_M = (7200.0, 1050.0, 300.0)
GLIDE_PATH_DEG = 3.0
FULL_SCALE_DOTS = 2.5
VOR_DEG_PER_DOT, LOCALIZER_DEG_PER_DOT, GLIDESLOPE_DEG_PER_DOT, GPS_NM_PER_DOT = 4.0, 1.0, 0.28, 2.0
VOR_RANGE_M, ILS_RANGE_M, NDB_RANGE_M = 130.0 * METERS_PER_NM, 25.0 * METERS_PER_NM, 50.0 * METERS_PER_NM
LOCALIZER_SECTOR_DEG, GLIDESLOPE_SECTOR_DEG = 35.0, 8.0
#: A marker is heard within this part of the height above it, and at least this far [m].
MARKER_CONE, MARKER_LEAST_M = 0.4, 150.0
#: The VOR stands this far north of the runway's middle [deg].
VOR_NORTH_DEG = 0.1

VOR_KHZ, ILS_KHZ, NDB_KHZ = 110300, 111300, 375
VOR_ID, ILS_ID, NDB_ID, AERODROME_ID = "EMU", "IEMU", "EM", "XEMU"
NO_SIGNAL, TO, FROM = 0, 1, 2


@dataclass(frozen=True)
class Place:
    """A place on the ground."""

    latitude_deg: float
    longitude_deg: float
    elevation_m: float = 0.0


@dataclass(frozen=True)
class Station:
    """A transmitter.

    Attributes:
        course_deg: True course of a localizer; None: a VOR.
        touchdown: Where its glide path meets the ground; None: it has none.
        dme: Where its DME stands.
    """

    identifier: str
    frequency_khz: int
    place: Place
    range_m: float
    course_deg: Optional[float] = None
    touchdown: Optional[Place] = None
    dme: Optional[Place] = None


@dataclass
class Reading:
    """What one receiver shows. Bearings are magnetic."""

    identifier: str = ""
    bearing_deg: float = 0.0
    deviation_dots: float = 0.0
    to_from: int = NO_SIGNAL
    glideslope_dots: float = 0.0
    glideslope_flag: bool = True  #: none is received
    glideslope_expected: bool = False  #: it is an ILS that has one
    has_dme: bool = False
    distance_m: float = 0.0
    speed_mps: float = 0.0
    time_s: float = 0.0
    course_deg: float = 0.0


@dataclass
class Aerodrome:
    """The stations."""

    stations: List[Station] = field(default_factory=list)
    beacon: Place = Place(0.0, 0.0)
    middle: Place = Place(0.0, 0.0)
    heading_deg: float = 0.0
    markers: List[Place] = field(default_factory=list)

    @classmethod
    def at(cls, home: InitialState) -> Aerodrome:
        """The aerodrome of which a flight at `home` is over the runway's middle, along it."""
        middle = Place(home.latitude_deg, home.longitude_deg, home.terrain_elevation_m)
        heading = home.heading_deg

        def along(distance_m: float) -> Place:
            return offset(middle, heading, distance_m)

        vor = Place(middle.latitude_deg + VOR_NORTH_DEG, middle.longitude_deg, middle.elevation_m)
        touchdown = along(-HALF_RUNWAY_M + TOUCHDOWN_M)
        localizer = along(HALF_RUNWAY_M + LOCALIZER_BEYOND_M)
        return cls(
            [
                Station(VOR_ID, VOR_KHZ, vor, VOR_RANGE_M, dme=vor),
                Station(ILS_ID, ILS_KHZ, localizer, ILS_RANGE_M, heading, touchdown, dme=touchdown),
            ],
            middle,
            middle,
            heading,
            [along(-HALF_RUNWAY_M - distance) for distance in MARKERS_M],
        )


def offset(place: Place, bearing_deg: float, distance_m: float) -> Place:
    """The place at a distance on a great circle."""
    angle = distance_m / EARTH_RADIUS_M
    latitude, bearing = math.radians(place.latitude_deg), math.radians(bearing_deg)
    sine = math.sin(latitude) * math.cos(angle) + math.cos(latitude) * math.sin(angle) * math.cos(bearing)
    east = math.sin(bearing) * math.sin(angle) * math.cos(latitude)
    longitude = place.longitude_deg + math.degrees(math.atan2(east, math.cos(angle) - math.sin(latitude) * sine))
    return Place(math.degrees(math.asin(sine)), earth.wrap_half_turn(longitude), place.elevation_m)


def distance_m(a: Place, b: Place) -> float:
    """Distance on the sphere, at sea level."""
    lat_a, lat_b = math.radians(a.latitude_deg), math.radians(b.latitude_deg)
    half = (
        math.sin((lat_b - lat_a) / 2.0) ** 2
        + math.cos(lat_a) * math.cos(lat_b) * math.sin(math.radians(b.longitude_deg - a.longitude_deg) / 2.0) ** 2
    )
    return 2.0 * EARTH_RADIUS_M * math.asin(min(1.0, math.sqrt(half)))


def bearing_deg(a: Place, b: Place) -> float:
    """True bearing of b, seen from a."""
    return earth.bearing_degrees(a.latitude_deg, a.longitude_deg, b.latitude_deg, b.longitude_deg)


def _needle(dots: float) -> float:
    return min(max(dots, -FULL_SCALE_DOTS), FULL_SCALE_DOTS)


class Receivers:
    """The aircraft's receivers. `failed` returns failure datarefs by leaf, `powered` whether the avionics live."""

    def __init__(self, failed: Callable[[str], bool], powered: Callable[[], bool]) -> None:
        self._failed, self._powered = failed, powered

    def nav(self, number: int, frequency_khz: float, obs_deg: float, frame: Frame, field_: Aerodrome) -> Reading:
        """Receiver 1 or 2, tuned so, its course selector at `obs_deg`."""
        here = _here(frame)
        station = _heard(field_.stations, frequency_khz, here)
        if station is None or not self._works(f"rel_nav{number}"):
            return Reading()
        reading = Reading(station.identifier)
        bearing = bearing_deg(here, station.place)
        reading.bearing_deg = earth.wrap_degrees(bearing - frame.declination)
        if station.course_deg is None:
            self._vor(reading, station, obs_deg, here)
        else:
            self._localizer(reading, station, bearing, here)
        if station.dme is not None:
            self._dme(reading, station.dme, frame, here)
        return reading

    def dme(self, frequency_khz: float, frame: Frame, field_: Aerodrome) -> Reading:
        """The DME receiver of its own."""
        here = _here(frame)
        station = _heard(field_.stations, frequency_khz, here)
        reading = Reading()
        if station is not None and station.dme is not None:
            self._dme(reading, station.dme, frame, here)
        return reading

    def relative_bearing_deg(self, number: int, frequency_khz: float, frame: Frame, field_: Aerodrome) -> float:
        """What ADF 1 or 2 points to: -180 to 180, right +; 90 where it hears nothing, as parked needles do."""
        here = _here(frame)
        heard = round(frequency_khz) == NDB_KHZ and distance_m(here, field_.beacon) <= NDB_RANGE_M
        if not heard or not self._works(f"rel_adf{number}"):
            return 90.0
        return earth.wrap_half_turn(bearing_deg(here, field_.beacon) - frame.true_psi)

    def gps(self, frame: Frame, field_: Aerodrome) -> Reading:
        """The way to the aerodrome, its runway's line as the course."""
        if not self._works("rel_gps"):
            return Reading()
        here, middle = _here(frame), field_.middle
        bearing, distance = bearing_deg(here, middle), distance_m(here, middle)
        reading = Reading(AERODROME_ID, earth.wrap_degrees(bearing - frame.declination), distance_m=distance)
        reading.course_deg = earth.wrap_degrees(field_.heading_deg - frame.declination)
        aside = distance * math.sin(math.radians(bearing - field_.heading_deg))
        reading.deviation_dots = _needle(aside / METERS_PER_NM / GPS_NM_PER_DOT)
        reading.to_from = TO if abs(earth.wrap_half_turn(bearing - field_.heading_deg)) < 90.0 else FROM
        _closing(reading, frame, bearing)
        return reading

    def marker(self, index: int, frame: Frame, field_: Aerodrome) -> bool:
        """Whether the lamp of the outer (0), middle (1) or inner (2) marker is lit."""
        if not self._works("rel_marker"):
            return False
        place = field_.markers[index]
        height = max(frame.m.altitude_m - place.elevation_m, 0.0)
        return distance_m(_here(frame), place) < max(MARKER_CONE * height, MARKER_LEAST_M)

    def _works(self, leaf: str) -> bool:
        return self._powered() and not self._failed(leaf)

    @staticmethod
    def _vor(reading: Reading, station: Station, obs_deg: float, here: Place) -> None:
        declination = magnetic_declination(station.place.latitude_deg, station.place.longitude_deg)
        radial = bearing_deg(station.place, here) - declination
        outbound = earth.wrap_half_turn(radial - obs_deg)
        reading.to_from = FROM if abs(outbound) <= 90.0 else TO
        # right of the line that leads away: the line is to the left; on the way in, the other side
        aside = -outbound if reading.to_from == FROM else earth.wrap_half_turn(outbound + 180.0)
        reading.deviation_dots = _needle(aside / VOR_DEG_PER_DOT)
        reading.course_deg = obs_deg

    def _localizer(self, reading: Reading, station: Station, bearing: float, here: Place) -> None:
        assert station.course_deg is not None
        aside = earth.wrap_half_turn(bearing - station.course_deg)
        if abs(aside) > LOCALIZER_SECTOR_DEG:
            return
        reading.to_from = TO
        reading.deviation_dots = _needle(aside / LOCALIZER_DEG_PER_DOT)
        touchdown = station.touchdown
        reading.glideslope_expected = touchdown is not None
        if touchdown is None or abs(aside) > GLIDESLOPE_SECTOR_DEG or not self._works("rel_gls"):
            return
        ground = distance_m(here, touchdown)
        before = abs(earth.wrap_half_turn(bearing_deg(here, touchdown) - station.course_deg)) < 90.0
        if not before or ground > ILS_RANGE_M:
            return
        angle = math.degrees(math.atan2(here.elevation_m - touchdown.elevation_m, max(ground, 1.0)))
        reading.glideslope_flag = False
        reading.glideslope_dots = _needle((angle - GLIDE_PATH_DEG) / GLIDESLOPE_DEG_PER_DOT)

    def _dme(self, reading: Reading, place: Place, frame: Frame, here: Place) -> None:
        if not self._works("rel_dme"):
            return
        reading.has_dme = True
        reading.distance_m = math.hypot(distance_m(here, place), here.elevation_m - place.elevation_m)
        _closing(reading, frame, bearing_deg(here, place))


def _here(frame: Frame) -> Place:
    return Place(frame.m.latitude_deg, frame.m.longitude_deg, frame.m.altitude_m)


def _heard(stations: Sequence[Station], frequency_khz: float, here: Place) -> Optional[Station]:
    for station in stations:
        if round(frequency_khz) == station.frequency_khz and distance_m(here, station.place) <= station.range_m:
            return station
    return None


def _closing(reading: Reading, frame: Frame, true_bearing_deg: float) -> None:
    """Speed along the line to the station, and how long the way takes at it."""
    bearing = math.radians(true_bearing_deg)
    reading.speed_mps = abs(frame.m.v_north_mps * math.cos(bearing) + frame.m.v_east_mps * math.sin(bearing))
    reading.time_s = reading.distance_m / reading.speed_mps if reading.speed_mps > 1.0 else 0.0
