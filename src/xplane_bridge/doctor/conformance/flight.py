"""The flight of the card: placed anew, kept level and high, and put back at the end."""

from __future__ import annotations

import contextlib
import math
import time
from dataclasses import dataclass
from typing import Callable, Dict, Iterator, List, Optional, Tuple

from xplane_bridge import protocol
from xplane_bridge.doctor.conformance import names
from xplane_bridge.doctor.conformance.link import Sample, XPlane
from xplane_bridge.doctor.conformance.pilot import Pilot
from xplane_bridge.doctor.conformance.verdict import NotTestableError
from xplane_bridge.units import KNOT_MPS

#: Above the present ground [m]; below the second a question is broken off, below the third it never gets.
START_HEIGHT_M, LOW_M, LOWEST_M = 1500.0, 600.0, 300.0
#: The angle between the local level and the axes at the scenery's origin must show: so far from it [deg].
_FROM_ORIGIN_DEG, _AWAY_DEG = 0.12, 0.2
#: Speed by stall speed, and its limits [m/s].
_BY_STALL, _SPEED_MPS, _USUAL_MPS = 1.7, (30.0, 130.0), 60.0
#: A placement of which nothing is seen counts as ignored after [s]; while X-Plane loads it does not answer.
_SEEN_S, _LOAD_S = 4.0, 90.0
#: By then X-Plane has begun to load: what it sends afterwards is of the flight that it loaded [s].
_BEGINS_S = 0.5
_NEAR_DEG = 0.02
_NEAR_M = 300.0
_PAUSE_S = 1.0
_SITUATION = "Output/situations/xplane_doctor.sit"
_TAKE_WIND_S = 6.0
_EARTH_M_PER_DEG = 111320.0
_PLACE = (names.LATITUDE, names.LONGITUDE, names.ELEVATION)
_SHOWN = (*_PLACE, names.FLIGHT_TIME, names.TRUE_AIRSPEED, names.TRUE_HEADING, names.GROUND_SPEED)
_START = (
    *_PLACE,
    names.HEIGHT,
    names.TRUE_HEADING,
    names.TRUE_AIRSPEED,
    names.ON_GROUND,
    names.PAUSED,
    names.LATITUDE_OF_ORIGIN,
    names.LONGITUDE_OF_ORIGIN,
)


class TooLowError(NotTestableError):
    """The aircraft has got too low for the question."""


class NoFlightError(Exception):
    """The aircraft cannot be brought into the air; the text says why."""


@dataclass(frozen=True)
class Place:
    """Where the aircraft is put: degrees, metres MSL, true heading [deg], true airspeed [m/s]."""

    latitude_deg: float
    longitude_deg: float
    elevation_m: float
    heading_deg: float
    speed_mps: float

    def placement(self) -> protocol.Placement:
        """PREL, start type 6."""
        return protocol.Placement(
            6,
            latitude_deg=self.latitude_deg,
            longitude_deg=self.longitude_deg,
            elevation_m=self.elevation_m,
            heading_deg=self.heading_deg,
            speed_mps=self.speed_mps,
        )

    def pose(self) -> protocol.VehiclePose:
        """VEHS."""
        angles = (self.heading_deg, 0.0, 0.0)
        return protocol.VehiclePose("VEHS", 0, self.latitude_deg, self.longitude_deg, self.elevation_m, *angles)

    def is_near(self, shown: Sample) -> bool:
        """Whether X-Plane shows the aircraft there."""
        return (
            abs(shown[names.LATITUDE] - self.latitude_deg) < _NEAR_DEG
            and abs(shown[names.LONGITUDE] - self.longitude_deg) < _NEAR_DEG / math.cos(math.radians(self.latitude_deg))
            and abs(shown[names.ELEVATION] - self.elevation_m) < _NEAR_M
        )

    def north(self, metres: float) -> Place:
        """The place so far north of it."""
        return Place(
            self.latitude_deg + metres / _EARTH_M_PER_DEG,
            self.longitude_deg,
            self.elevation_m,
            self.heading_deg,
            self.speed_mps,
        )


class Flight:
    """The flight that the questions are asked in.

    Attributes:
        xplane: The simulator.
        before: How X-Plane was before the card.
        place: Where the card begins.
    """

    def __init__(self, xplane: XPlane) -> None:
        self.xplane = xplane
        self.before = xplane.read(*_START)
        self.place = self._start_place()
        self._pilot: Optional[Pilot] = None
        self._stack = contextlib.ExitStack()
        self._saved = False
        self._paused = bool(self.before[names.PAUSED])  # as last asked for

    @property
    def pilot(self) -> Pilot:
        """Who holds the stick."""
        if self._pilot is None:
            raise NotTestableError("the aircraft does not fly")
        return self._pilot

    def _start_place(self) -> Place:
        now = self.before
        latitude, longitude = now[names.LATITUDE], now[names.LONGITUDE]
        off = latitude - now[names.LATITUDE_OF_ORIGIN]
        if max(abs(off), abs(longitude - now[names.LONGITUDE_OF_ORIGIN])) < _FROM_ORIGIN_DEG:
            latitude = now[names.LATITUDE_OF_ORIGIN] + math.copysign(_AWAY_DEG, off)
        ground = now[names.ELEVATION] - now[names.HEIGHT]
        stall = self.xplane.try_read([names.STALL_SPEED_KT], 0.5).get(names.STALL_SPEED_KT, 0.0)
        low, high = _SPEED_MPS
        speed = min(max(_BY_STALL * stall * KNOT_MPS, low), high) if stall > 0.0 else _USUAL_MPS
        return Place(latitude, longitude, ground + START_HEIGHT_M, now[names.TRUE_HEADING], speed)

    # --- beginning and end ----------------------------------------------------------------------------------------

    def begin(self) -> None:
        """Saves the flight, puts the aircraft into the air and takes the stick."""
        self.pause(False)
        self.xplane.send(protocol.Situation(protocol.Situation.SAVE, _SITUATION))
        self._saved = True
        self.put(self.place)
        self._stack.enter_context(self.xplane.changed(dict.fromkeys(names.STICK_OVERRIDES, 1.0)))
        self._pilot = Pilot(self.xplane, self.place.speed_mps, LOW_M)

    def ready(self) -> None:
        """Before a question: flying, high enough, level."""
        self.pause(False)
        self.pilot.level()
        height = self.xplane.read(names.HEIGHT)[names.HEIGHT]
        if height < LOW_M + 200.0 or self.pilot.too_low.is_set():
            self.put(self.place)
            self.pilot.too_low.clear()

    def end(self) -> List[str]:
        """Puts everything back that it can; says what could not be."""
        left = []
        for what, step in (("stick", self._let_go), ("flight", self._put_back), ("pause", self._put_back_pause)):
            try:
                left.append(step())
            except Exception as error:  # the rest is put back all the same
                left.append(f"{what}: {error}")
        return [each for each in left if each]

    def _let_go(self) -> str:
        if self._pilot is not None:
            self._pilot.end()
        self._stack.close()  # what X-Plane does not show stays in the journal
        return ""

    def _put_back(self) -> str:
        if not self._saved:
            return ""
        was = self.before
        on_ground = bool(was[names.ON_GROUND])
        speed = 0.0 if on_ground else was[names.TRUE_AIRSPEED]
        heading = was[names.TRUE_HEADING]
        there = Place(was[names.LATITUDE], was[names.LONGITUDE], was[names.ELEVATION], heading, speed)
        self.xplane.send(protocol.Situation(protocol.Situation.LOAD, _SITUATION))
        time.sleep(_BEGINS_S)
        if self._loaded(there.is_near):
            return ""
        with contextlib.suppress(NoFlightError, NotTestableError):
            self.put(there)
            return ""
        return "the aircraft is not back where it was: load your flight again"

    def _put_back_pause(self) -> str:
        paused = bool(self.before[names.PAUSED])
        if self.pause(paused, _SEEN_S):
            return ""
        return f"X-Plane does not show that it {'is paused' if paused else 'runs'}, as it did before: look at it"

    # --- placing --------------------------------------------------------------------------------------------------

    def shown(self, place: Place, patience_s: float) -> Optional[Sample]:
        """X-Plane's first sample there, or None."""
        return self.xplane.wait_for(_SHOWN, place.is_near, patience_s)

    def _loaded(self, condition: Callable[[Sample], bool]) -> Optional[Sample]:
        """The first sample of which the condition is true, after whatever X-Plane loads; None where there is none."""
        seen = self.xplane.wait_for(_SHOWN, condition, _SEEN_S)
        if seen is None:
            loads = not self.xplane.try_read([names.FLIGHT_TIME], 0.5)
            seen = self.xplane.wait_for(_SHOWN, condition, _LOAD_S if loads else 0.5)
        return seen

    def begin_at(self, place: Place) -> Optional[Sample]:
        """PREL, once; the first sample of the flight there, or None where nothing of it is seen."""
        time_before = self.xplane.read(names.FLIGHT_TIME)[names.FLIGHT_TIME]
        self.xplane.send(place.placement())
        return self._loaded(lambda sample: place.is_near(sample) and sample[names.FLIGHT_TIME] < time_before)

    def move_to(self, place: Place) -> Optional[Sample]:
        """VEHS, twice, as the elevation is wrong the first time; the first sample there, or None."""
        for _ in range(2):
            self.xplane.send(place.pose())
        return self.shown(place, 2.0)

    def put(self, place: Place) -> None:
        """Puts the aircraft there by whatever X-Plane follows.

        Raises:
            NoFlightError: It follows nothing, or the place is below the ground.
        """
        if self.begin_at(place) is None and not (self.xplane.is_12 and self.move_to(place)):
            self._write_place(place)
            if self.shown(place, 2.0) is None:
                raise NoFlightError("X-Plane follows neither PREL nor VEHS nor local coordinates")
        height = self.xplane.read(names.HEIGHT)[names.HEIGHT]
        if height < LOWEST_M and place is self.place:  # mountains, where the ground was not known
            self.place = Place(
                place.latitude_deg,
                place.longitude_deg,
                place.elevation_m + START_HEIGHT_M - height,
                place.heading_deg,
                place.speed_mps,
            )
            self.put(self.place)

    def _write_place(self, place: Place) -> None:
        """By local coordinates, for small distances from where the aircraft is."""
        now = self.xplane.read(*_PLACE, *names.LOCAL_PLACE)
        east = (place.longitude_deg - now[names.LONGITUDE]) * math.cos(math.radians(place.latitude_deg))
        north = place.latitude_deg - now[names.LATITUDE]
        moved = (
            now[names.LOCAL_PLACE[0]] + east * _EARTH_M_PER_DEG,
            now[names.LOCAL_PLACE[1]] + place.elevation_m - now[names.ELEVATION],
            now[names.LOCAL_PLACE[2]] - north * _EARTH_M_PER_DEG,
        )
        heading = math.radians(place.heading_deg)
        velocity = (place.speed_mps * math.sin(heading), 0.0, -place.speed_mps * math.cos(heading))
        attitude = (math.cos(heading / 2.0), 0.0, 0.0, math.sin(heading / 2.0))
        pairs = zip((*names.LOCAL_PLACE, *names.LOCAL_VELOCITY, *names.QUATERNION), (*moved, *velocity, *attitude))
        for path, value in pairs:
            self.xplane.write(path, value)

    # --- pause ----------------------------------------------------------------------------------------------------

    def pause(self, paused: bool, patience_s: float = _PAUSE_S) -> bool:
        """Pauses or resumes by one toggle; returns whether X-Plane says in time [s] that it follows."""
        now = self.xplane.try_read([names.PAUSED], patience_s).get(names.PAUSED)
        # A silent one is as it was: it loads, or is paused and sends nothing then.
        is_paused = self._paused if now is None else bool(now)
        if is_paused != paused:
            self.xplane.send(protocol.CommandRequest(names.PAUSE_TOGGLE))
        self._paused = paused
        return self.xplane.wait_for([names.PAUSED], lambda s: bool(s[names.PAUSED]) == paused, patience_s) is not None

    @contextlib.contextmanager
    def paused(self) -> Iterator[bool]:
        """Paused meanwhile; gives whether X-Plane shows it."""
        try:
            yield self.pause(True)
        finally:
            self.pause(False)

    # --- watching -------------------------------------------------------------------------------------------------

    def fly(
        self, paths: Tuple[str, ...], duration_s: float, each: Optional[Callable[[Sample], None]] = None
    ) -> List[Sample]:
        """Samples of every frame while the pilot flies on; TooLowError where that leads too low."""
        samples = self.xplane.watch(paths, duration_s, each)
        self._check_height()
        return samples

    def wait(self, duration_s: float) -> None:
        """Lets the pilot fly on [s]."""
        time.sleep(duration_s)
        self._check_height()

    def _check_height(self) -> None:
        if self._pilot is not None and self._pilot.too_low.is_set():
            raise TooLowError(f"the aircraft came below {LOW_M:.0f} m above ground")

    # --- wind -----------------------------------------------------------------------------------------------------

    @property
    def wind_now(self) -> Tuple[str, ...]:
        """Where this version shows the air's velocity at the aircraft."""
        return names.REGION_WIND_NOW if self.xplane.version >= names.FIRST_WITH_REGIONS else names.OLD_WIND_NOW

    @contextlib.contextmanager
    def wind(self, from_deg: float, speed_mps: float) -> Iterator[Tuple[float, float, float]]:
        """Asks for a wind; gives the air's velocity then [m/s], east, up, south. The weather is put back."""
        if self.xplane.version >= names.FIRST_WITH_REGIONS:
            writes: Dict[str, float] = dict(names.REGION_MODE)
            writes.update(dict.fromkeys(names.REGION_FROM, from_deg))
            writes.update(dict.fromkeys(names.REGION_SPEED, speed_mps))
        else:
            writes = {} if self.xplane.is_12 else {names.OLD_REAL_WEATHER: 0.0}
            writes.update(dict.fromkeys(names.OLD_WIND_FROM, from_deg))
            writes.update(dict.fromkeys(names.OLD_WIND_SPEED, speed_mps / KNOT_MPS))

        def blows(sample: Sample) -> bool:
            return abs(math.hypot(*(sample[path] for path in self.wind_now)) - speed_mps) < 0.1 * speed_mps

        with self.xplane.changed(writes):
            shown = self.xplane.wait_for(self.wind_now, blows, _TAKE_WIND_S)
            values = shown.values if shown is not None else self.xplane.read(*self.wind_now)
            yield tuple(values[path] for path in self.wind_now)  # type: ignore[misc]
