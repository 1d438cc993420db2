"""A position controller for the emulator's quadrotor, for tests: what a user's controller would do."""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

from xplane_bridge.units import EARTH_RADIUS_M

_GRAVITY = 9.81
#: What full stick tilts the stabilised quadrotor [deg].
_FULL_TILT_DEG = 30.0


class Motion(NamedTuple):
    """What it looks at; the emulator's own state has the same names."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float
    v_north_mps: float
    v_east_mps: float
    v_down_mps: float
    roll_rad: float
    pitch_rad: float
    heading_rad: float


class Sticks(NamedTuple):
    """What it commands: ratios, right, nose up and up positive."""

    roll: float
    pitch: float
    yaw: float
    throttle: float


def _limited(value: float, low: float, high: float) -> float:
    return max(min(value, high), low)


class PositionLoop:
    """Position and velocity to stick and throttle: holds a place and a heading.

    Args:
        there: the place to hold.
        hover_throttle: ratio that carries the weight.
        heading_rad: true heading to hold.
    """

    def __init__(self, there: Motion, hover_throttle: float, heading_rad: float) -> None:
        self._there = Motion(*(getattr(there, name) for name in Motion._fields))
        self._hover = hover_throttle
        self._heading = heading_rad
        self._sums = [0.0, 0.0, 0.0]

    def climb(self, metres: float) -> None:
        """Moves the place up, and forgets what the old height had taught."""
        self._there = self._there._replace(altitude_m=self._there.altitude_m + metres)
        self._sums[2] = 0.0

    def error(self, motion: Motion) -> Tuple[float, float, float]:
        """How far the place is to the north, to the east and above [m]."""
        there = self._there
        north = math.radians(there.latitude_deg - motion.latitude_deg) * EARTH_RADIUS_M
        east = math.radians(there.longitude_deg - motion.longitude_deg) * EARTH_RADIUS_M
        return north, east * math.cos(math.radians(there.latitude_deg)), there.altitude_m - motion.altitude_m

    def distance(self, motion: Motion) -> float:
        """How far the place is [m]."""
        return math.sqrt(sum(error * error for error in self.error(motion)))

    def step(self, motion: Motion, seconds: float) -> Sticks:
        """The sticks for a motion, `seconds` after the last one."""
        north, east, up = self.error(motion)
        self._sums = [total + error * seconds for total, error in zip(self._sums, (north, east, up))]
        north_acceleration = 1.6 * north - 2.2 * motion.v_north_mps + 0.5 * self._sums[0]
        east_acceleration = 1.6 * east - 2.2 * motion.v_east_mps + 0.5 * self._sums[1]
        up_acceleration = 3.0 * up + 3.0 * motion.v_down_mps + 1.0 * self._sums[2]
        sine, cosine = math.sin(motion.heading_rad), math.cos(motion.heading_rad)
        ahead = north_acceleration * cosine + east_acceleration * sine
        right = -north_acceleration * sine + east_acceleration * cosine
        upright = max(math.cos(motion.roll_rad) * math.cos(motion.pitch_rad), 0.5)
        off_heading = math.remainder(self._heading - motion.heading_rad, 2 * math.pi)
        return Sticks(
            roll=_limited(math.degrees(right / _GRAVITY) / _FULL_TILT_DEG, -1.0, 1.0),
            pitch=_limited(-math.degrees(ahead / _GRAVITY) / _FULL_TILT_DEG, -1.0, 1.0),
            yaw=_limited(1.5 * off_heading, -1.0, 1.0),
            throttle=_limited(self._hover * (1.0 + up_acceleration / _GRAVITY) / upright, 0.05, 1.0),
        )
