"""What all controllers need: bounds, simulator time, places in metres, legs between them."""

from __future__ import annotations

import math
from typing import NamedTuple, Optional, Tuple

from xplane_bridge.controllers.state import State

#: X-Plane's planet is a sphere of this radius [m].
EARTH_RADIUS_M = 6378145.0
GRAVITY_MPS2 = 9.80665
#: Over a longer gap between two states integrators do not go on [s].
_LONGEST_STEP_S = 0.1


def clip(value: float, low: float, high: float) -> float:
    """The value, or the nearer bound."""
    return min(max(value, low), high)


def turn_to(wanted_deg: float, present_deg: float) -> float:
    """The shorter way round from one heading to another, right + [deg]."""
    return math.remainder(wanted_deg - present_deg, 360.0)


class Pace:
    """Simulator time between states."""

    def __init__(self) -> None:
        self._last: Optional[float] = None

    def step(self, state: State) -> float:
        """Since the last state [s]; 0 for the first."""
        last, self._last = self._last, state.sim_time_unwrapped
        return 0.0 if last is None else clip(self._last - last, 0.0, _LONGEST_STEP_S)


class Place(NamedTuple):
    """Where something is in a runway's axes [m]."""

    ahead: float
    right: float

    def to(self, other: Place) -> Place:
        """The way to another place."""
        return Place(other.ahead - self.ahead, other.right - self.right)

    @property
    def length(self) -> float:
        """From the origin [m]."""
        return math.hypot(self.ahead, self.right)


class Field:
    """Metres ahead and to the right of where a flight began, seen along its heading.

    Args:
        state: The first FlightState.
    """

    def __init__(self, state: State) -> None:
        self._latitude, self._longitude = state.latitude, state.longitude
        self._scale = math.cos(math.radians(state.latitude))
        self.heading_deg = float(state.heading_true_deg)
        self.altitude = float(state.altitude_msl)

    def place(self, state: State) -> Place:
        """Where the aircraft is."""
        north = math.radians(state.latitude - self._latitude) * EARTH_RADIUS_M
        east = math.radians(math.remainder(state.longitude - self._longitude, 360.0)) * EARTH_RADIUS_M * self._scale
        return self.seen(north, east)

    def velocity(self, state: State) -> Place:
        """Over the ground [m/s]."""
        return self.seen(state.velocity_ned.x, state.velocity_ned.y)

    def north_east(self, place: Place) -> Tuple[float, float]:
        """A direction in these axes, to the north and to the east."""
        sine, cosine = self._axes()
        return place.ahead * cosine - place.right * sine, place.ahead * sine + place.right * cosine

    def seen(self, north: float, east: float) -> Place:
        """A direction to the north and east, in these axes."""
        sine, cosine = self._axes()
        return Place(north * cosine + east * sine, east * cosine - north * sine)

    def _axes(self) -> Tuple[float, float]:
        heading = math.radians(self.heading_deg)
        return math.sin(heading), math.cos(heading)


class Leg:
    """A straight way in a field.

    Args:
        field: Where.
        start: Its beginning.
        end: Its end.
    """

    def __init__(self, field: Field, start: Place, end: Place) -> None:
        self.end = end
        self._start = start
        way = start.to(end)
        self.length = way.length
        self._unit = Place(way.ahead / self.length, way.right / self.length)
        self.course_deg = field.heading_deg + math.degrees(math.atan2(way.right, way.ahead))

    def along(self, place: Place) -> float:
        """How far on the way a place is [m]."""
        way = self._start.to(place)
        return way.ahead * self._unit.ahead + way.right * self._unit.right

    def across(self, place: Place) -> float:
        """How far to the right of the way a place is [m]."""
        way = self._start.to(place)
        return way.right * self._unit.ahead - way.ahead * self._unit.right
