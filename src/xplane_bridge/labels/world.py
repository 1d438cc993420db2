"""Places in space: on X-Plane's sphere, or on the flat ground that the emulator draws."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from xplane_bridge.labels.apt import Runway
from xplane_bridge.units import EARTH_RADIUS_M

#: Parts that a runway's sides are projected in.
SIDE_PARTS = 8


class World(Protocol):
    """Where places lie: in metres along any three axes at right angles."""

    def place(self, latitude: float, longitude: float, height: float) -> np.ndarray:
        """Position [m] of a place; height in m MSL."""

    def level(self, latitude: float, longitude: float) -> np.ndarray:
        """Rows: unit vectors north, east, down there."""

    def dip(self, height: float) -> float:
        """Angle [rad] of the horizon below the level, seen from a height [m MSL]."""

    def horizon(self, height: float) -> float:
        """How far away the horizon is [m], seen from a height over it [m]."""


class Sphere:
    """X-Plane's earth, in earth-centred axes."""

    def place(self, latitude: float, longitude: float, height: float) -> np.ndarray:
        """See `World`."""
        up: np.ndarray = -self.level(latitude, longitude)[2]
        return up * (EARTH_RADIUS_M + height)

    def level(self, latitude: float, longitude: float) -> np.ndarray:
        """See `World`."""
        lat, lon = math.radians(latitude), math.radians(longitude)
        north = (-math.sin(lat) * math.cos(lon), -math.sin(lat) * math.sin(lon), math.cos(lat))
        east = (-math.sin(lon), math.cos(lon), 0.0)
        down = (-math.cos(lat) * math.cos(lon), -math.cos(lat) * math.sin(lon), -math.sin(lat))
        return np.array((north, east, down))

    def dip(self, height: float) -> float:
        """See `World`."""
        return math.acos(EARTH_RADIUS_M / (EARTH_RADIUS_M + max(height, 0.0)))

    def horizon(self, height: float) -> float:
        """See `World`."""
        return EARTH_RADIUS_M * math.tan(self.dip(height))


class Flat:
    """The ground as a plane through a place, as the emulator draws it; north, east, down from there.

    Args:
        latitude: [deg] of the place.
        longitude: [deg]
    """

    def __init__(self, latitude: float, longitude: float) -> None:
        self._latitude, self._longitude = latitude, longitude

    def place(self, latitude: float, longitude: float, height: float) -> np.ndarray:
        """See `World`."""
        north = math.radians(latitude - self._latitude) * EARTH_RADIUS_M
        turn = (longitude - self._longitude + 180.0) % 360.0 - 180.0
        east = math.radians(turn) * EARTH_RADIUS_M * math.cos(math.radians(self._latitude))
        return np.array((north, east, -height))

    def level(self, latitude: float, longitude: float) -> np.ndarray:  # noqa: ARG002
        """See `World`."""
        return np.eye(3)

    def dip(self, height: float) -> float:  # noqa: ARG002
        """See `World`."""
        return 0.0

    def horizon(self, height: float) -> float:  # noqa: ARG002
        """See `World`."""
        return math.inf


class RunwayFrame:
    """A runway from one end to the other: places on it by metres along, from that end, and metres to the right.

    Args:
        runway: The runway.
        first: Which of its ends it begins at, 0 or 1.
    """

    def __init__(self, runway: Runway, first: int) -> None:
        self.near, self.far = runway.ends[first], runway.ends[1 - first]
        self.width = runway.width
        self._first = first
        sphere = Sphere()
        begin, end = (sphere.place(e.latitude, e.longitude, 0.0) / EARTH_RADIUS_M for e in (self.near, self.far))
        angle = math.atan2(float(np.linalg.norm(np.cross(begin, end))), float(begin @ end))
        self.length = angle * EARTH_RADIUS_M  #: [m] of the pavement, over the sphere
        self._begin = begin
        along = end - begin * float(begin @ end)
        self._along = along / np.linalg.norm(along)
        self._right = np.cross(self._along, self._begin)
        self.heading = math.atan2(*(float(axis @ self._along) for axis in (self._axes()[1], self._axes()[0])))  #: [rad]

    def geodetic(self, along: float, right: float) -> tuple[float, float]:
        """Latitude and longitude [deg]."""
        angle = along / EARTH_RADIUS_M
        up = math.cos(angle) * self._begin + math.sin(angle) * self._along + (right / EARTH_RADIUS_M) * self._right
        up = up / np.linalg.norm(up)
        return math.degrees(math.asin(float(up[2]))), math.degrees(math.atan2(float(up[1]), float(up[0])))

    def along_right(self, latitude: float, longitude: float) -> tuple[float, float]:
        """Metres along and to the right of a place on the sphere."""
        up = Sphere().place(latitude, longitude, 0.0) / EARTH_RADIUS_M
        along = math.atan2(float(up @ self._along), float(up @ self._begin)) * EARTH_RADIUS_M
        return along, math.asin(float(np.clip(up @ self._right, -1.0, 1.0))) * EARTH_RADIUS_M

    def from_first_end(self, along: float) -> float:
        """The same metres along, counted from the first end of the runway's row, whichever end this began at."""
        return along if self._first == 0 else self.length - along

    def _axes(self) -> np.ndarray:
        return Sphere().level(self.near.latitude, self.near.longitude)
