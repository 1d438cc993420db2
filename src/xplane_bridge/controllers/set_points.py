"""Set-points of a position or velocity, followed by the quadrotor's loops."""

from __future__ import annotations

from typing import Optional, Tuple

from xplane_bridge.controllers.geometry import Field, Pace
from xplane_bridge.controllers.multirotor import AIRCRAFT as AIRCRAFT
from xplane_bridge.controllers.multirotor import Command, Loops
from xplane_bridge.controllers.state import MappedState

#: A set-point is followed for so long; repeat it to hold it longer, as for other autopilots [s].
HOLDS_S = 0.5


class SetPoints:
    """Flies to the set-point given last; commands nothing once that is old.

    East, north and up [m] from the origin of `map`, or as a velocity over ground [m/s]; headings are true [deg].
    """

    def __init__(self) -> None:
        self._wanted: Optional[Tuple[bool, Tuple[float, float, float], float]] = None
        self._pace, self._age = Pace(), 0.0
        self._heading: Optional[float] = None  # what a velocity's turn goes on from, while one is followed
        self.restart()

    def restart(self) -> None:
        """Another source flies."""
        self._loops = Loops()
        self._heading = None

    def position(self, east: float, north: float, up: float, heading_deg: float) -> None:
        """To a place, with the nose to a heading."""
        self._wanted, self._age = (True, (east, north, up), heading_deg), 0.0

    def velocity(self, east: float, north: float, up: float, turn_deg_s: float) -> None:
        """With a velocity, turning to the right."""
        self._wanted, self._age = (False, (east, north, up), turn_deg_s), 0.0

    def fly(self, state: MappedState) -> Command:
        """Fields of ControlCommand for a FlightState; none without a set-point."""
        dt = self._pace.step(state)
        self._age += dt
        if self._wanted is None or self._age > HOLDS_S:
            self._heading = None  # what flies meanwhile may turn the nose
            return {}
        is_place, (east, north, up), turning = self._wanted
        here = Field(state)
        if is_place:
            self._heading = None
            here.heading_deg = turning
            there = here.seen(north - state.position_north, east - state.position_east)
            return self._loops.position(state, dt, here, there, up + state.position_down)
        if self._heading is None:
            self._heading = here.heading_deg
        self._heading = here.heading_deg = self._heading + turning * dt
        return self._loops.velocity(state, dt, here, here.seen(north, east), up)
