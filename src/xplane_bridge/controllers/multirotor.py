"""Loops of the emulator's quadrotor, which keeps its attitude by itself, and a flight made of them."""

from __future__ import annotations

import math
from typing import Callable, Dict, Optional

from xplane_bridge.controllers.geometry import GRAVITY_MPS2, Field, Pace, Place, clip, turn_to
from xplane_bridge.controllers.state import State

AIRCRAFT = "multirotor"
Command = Dict[str, float]
#: What full stick tilts it [deg], and turns it [deg/s].
_FULL_TILT_DEG, _FULL_TURN_DPS = 30.0, 100.0
#: Lever that carries it at sea level; the height loop finds the rest.
HOVER = 0.39


class Loops:
    """Position -> velocity -> tilt -> stick; height -> climb -> throttle."""

    most_mps, most_climb_mps = 4.0, 2.0

    def __init__(self) -> None:
        self._sums = [0.0, 0.0, 0.0]  # of the errors of velocity: ahead, right, up [m]

    def attitude(self, state: State, roll_deg: float, pitch_deg: float, heading_deg: float) -> Command:
        """Stick for an attitude and a true heading: its own stabilisation does the rest."""
        turn = 1.5 * turn_to(heading_deg, state.heading_true_deg)
        return {
            "roll": clip(roll_deg / _FULL_TILT_DEG, -1.0, 1.0),
            "pitch": clip(pitch_deg / _FULL_TILT_DEG, -1.0, 1.0),
            "yaw": clip(turn / _FULL_TURN_DPS, -0.5, 0.5),
        }

    def velocity(self, state: State, dt: float, field: Field, wanted: Place, climb: float) -> Command:
        """Stick and throttle for a velocity over ground in the field's axes, its heading, and a climb [m/s]."""
        present = field.velocity(state)
        errors = (wanted.ahead - present.ahead, wanted.right - present.right, climb - state.vertical_speed)
        if not state.on_ground:
            self._sums = [clip(total + error * dt, -4.0, 4.0) for total, error in zip(self._sums, errors)]
        gains = ((2.2, 0.7), (2.2, 0.7), (3.0, 1.5))
        ahead, right, up = (p * error + i * total for (p, i), error, total in zip(gains, errors, self._sums))
        # The field's axes to the body's, which may be turned against them.
        off = math.radians(state.heading_true_deg - field.heading_deg)
        nose, wing = ahead * math.cos(off) + right * math.sin(off), right * math.cos(off) - ahead * math.sin(off)
        upright = max(math.cos(math.radians(state.roll_deg)) * math.cos(math.radians(state.pitch_deg)), 0.5)
        roll, pitch = (math.degrees(math.atan(acceleration / GRAVITY_MPS2)) for acceleration in (wing, -nose))
        command = self.attitude(state, clip(roll, -20.0, 20.0), clip(pitch, -20.0, 20.0), field.heading_deg)
        command["throttle"] = clip(HOVER * (1.0 + up / GRAVITY_MPS2) / upright, 0.05, 1.0)
        return command

    def position(self, state: State, dt: float, field: Field, there: Place, height: float) -> Command:
        """Stick and throttle that fly to a place and height above the start, and stay there."""
        way = field.place(state).to(there)
        slower = min(1.0, self.most_mps / max(0.8 * way.length, 1e-6))
        wanted = Place(0.8 * way.ahead * slower, 0.8 * way.right * slower)
        climb = clip(1.0 * (height - (state.altitude_msl - field.altitude)), -self.most_climb_mps, self.most_climb_mps)
        return self.velocity(state, dt, field, wanted, climb)


class Square:
    """Take-off, hover, a square, and a landing where it began.

    Args:
        height: Above the start [m].
        side: Of the square [m].
        wait: At each corner [s].
    """

    def __init__(self, height: float = 10.0, side: float = 20.0, wait: float = 3.0) -> None:
        self._height, self._wait = height, wait
        corners = ((0.0, 0.0), (side, 0.0), (side, side), (0.0, side), (0.0, 0.0))
        self._corners = [Place(*corner) for corner in corners]
        self.restart()

    def restart(self) -> None:
        """The next state is the first one."""
        self.phase: Optional[Callable[[State, float], Command]] = None

    def fly(self, state: State) -> Command:
        """Fields of ControlCommand for a FlightState."""
        if self.phase is None:
            self._field, self._loops, self._pace = Field(state), Loops(), Pace()
            self._left, self._there = list(self._corners), 0.0
            self.phase = self.around
        return self.phase(state, self._pace.step(state))

    def around(self, state: State, dt: float) -> Command:
        """To each corner, the first of which is above the start; there, a while."""
        off = self._field.place(state).to(self._left[0]).length
        low = self._height - (state.altitude_msl - self._field.altitude)
        self._there = self._there + dt if max(off, abs(low)) < 0.7 else 0.0
        if self._there > self._wait:
            self._there = 0.0
            if len(self._left) == 1:
                self.phase = self.down
            else:
                self._left.pop(0)
        return self._loops.position(state, dt, self._field, self._left[0], self._height)

    def down(self, state: State, dt: float) -> Command:
        """Sinks ever slower, over the same spot, until it stands."""
        if state.on_ground:
            self.phase = self.standing
        way = self._field.place(state).to(self._left[0])
        sink = clip(0.5 * (state.altitude_msl - self._field.altitude), 0.3, 1.0)
        wanted = Place(clip(0.8 * way.ahead, -1.0, 1.0), clip(0.8 * way.right, -1.0, 1.0))
        return self._loops.velocity(state, dt, self._field, wanted, -sink)

    def standing(self, state: State, dt: float) -> Command:
        """Motors idle."""
        del state, dt
        return {"roll": 0.0, "pitch": 0.0, "yaw": 0.0, "throttle": 0.0}
