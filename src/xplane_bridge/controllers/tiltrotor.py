"""Loops of the emulator's tiltrotor, which keeps its attitude by itself, and a flight made of them."""

from __future__ import annotations

from typing import Callable, Dict, Optional

from xplane_bridge.controllers.geometry import Field, Pace, Place, clip, turn_to
from xplane_bridge.controllers.state import State

AIRCRAFT = "tiltrotor"
Command = Dict[str, float]
#: What full stick banks and pitches it [deg].
_FULL_ROLL_DEG, _FULL_PITCH_DEG = 45.0, 25.0
#: Levers that carry it: upright, and on the wing; thrust vector upright.
HOVER, CRUISE, UPRIGHT = 0.77, 0.68, 0.9


class Loops:
    """Speed and height by thrust, nacelles and attitude; which of them does what follows the nacelles."""

    def __init__(self) -> None:
        self._sum_up = self._sum_ahead = self._sum_right = 0.0

    @staticmethod
    def nacelles(speed: float, ahead: float) -> float:
        """Thrust vector for a speed that is wanted, not further forward than the speed that is there allows [m/s]."""
        wing = clip((min(speed, ahead + 18.0) - 12.0) / 50.0, 0.0, 1.0)
        return UPRIGHT * (1.0 - wing * wing)

    def velocity(self, state: State, dt: float, field: Field, speed: float, right: float, height: float) -> Command:
        """Flies ahead and to the right over ground [m/s], at a height above the start [m]."""
        present = field.velocity(state)
        vector = self.nacelles(speed, present.ahead)
        upright = clip((vector - 0.2) / 0.5, 0.0, 1.0)
        up, climb = height - (state.altitude_msl - field.altitude), state.vertical_speed
        off = speed - present.ahead
        if not state.on_ground:
            if abs(up) < 6.0:  # on the way to another height nothing may wind up
                self._sum_up = clip(self._sum_up + clip(up, -3.0, 3.0) * dt, -30.0, 30.0)
            self._sum_ahead = clip(self._sum_ahead + clip(off, -3.0, 3.0) * dt, -30.0, 30.0)
            self._sum_right = clip(self._sum_right + clip(right - present.right, -3.0, 3.0) * dt, -10.0, 10.0)
        rise = clip(0.5 * up, -2.0, 2.0)
        lift = HOVER + 0.12 * (rise - climb) + 0.015 * self._sum_up
        pull = CRUISE + 0.02 * off + 0.002 * self._sum_ahead
        nose_hover = clip(-2.0 * off - 0.15 * self._sum_ahead, -8.0, 12.0)
        nose_wing = 5.0 + clip(1.2 * up - 2.0 * climb + 0.3 * self._sum_up, -10.0, 10.0)
        turn = turn_to(field.heading_deg, state.heading_true_deg)
        bank = 2.5 * (right - present.right) + 0.4 * self._sum_right if upright > 0.5 else 1.0 * turn
        return {
            "roll": clip(bank, -15.0, 15.0) / _FULL_ROLL_DEG,
            "pitch": clip((upright * nose_hover + (1.0 - upright) * nose_wing) / _FULL_PITCH_DEG, -1.0, 1.0),
            "yaw": clip(0.035 * turn, -1.0, 1.0) if upright > 0.5 else 0.0,
            "throttle": clip(upright * lift + (1.0 - upright) * pull, 0.0, 1.0),
            "thrust_vector": vector,
            "gear": 1.0 if upright > 0.9 else 0.0,
        }  # fmt: skip

    def position(self, state: State, dt: float, field: Field, there: Place, height: float) -> Command:
        """Hovers over a place."""
        way = field.place(state).to(there)
        return self.velocity(
            state, dt, field, clip(0.4 * way.ahead, -3.0, 3.0), clip(0.4 * way.right, -3.0, 3.0), height
        )


class OutAndBack:
    """Vertical take-off, hover, conversion, cruise, conversion back, hover, vertical landing further on.

    Args:
        height: Above the start [m].
        cruise: Over ground [m/s].
        cruise_s: How long at that speed [s].
    """

    def __init__(self, height: float = 60.0, cruise: float = 85.0, cruise_s: float = 20.0) -> None:
        self._height, self._cruise, self._cruise_s = height, cruise, cruise_s
        self.restart()

    def restart(self) -> None:
        """The next state is the first one."""
        self.phase: Optional[Callable[[State, float], Command]] = None

    def fly(self, state: State) -> Command:
        """Fields of ControlCommand for a FlightState."""
        if self.phase is None:
            self._field, self._loops, self._pace = Field(state), Loops(), Pace()
            self._speed, self._time, self._there = 0.0, 0.0, Place(0.0, 0.0)
            self.phase = self.up
        return {"parking_brake": 0.0, **self.phase(state, self._pace.step(state))}

    def up(self, state: State, dt: float) -> Command:
        """Up, and five seconds of hover."""
        low = self._height - (state.altitude_msl - self._field.altitude)
        self._time = self._time + dt if abs(low) < 2.0 else 0.0
        if self._time > 5.0:
            self.phase, self._time = self.out, 0.0
        return self._loops.position(state, dt, self._field, self._there, self._height)

    def out(self, state: State, dt: float) -> Command:
        """Faster by 3 m/s a second, then cruise."""
        self._speed = min(self._speed + 3.0 * dt, self._cruise)
        if self._speed >= self._cruise:
            self._time += dt
        if self._time > self._cruise_s:
            self.phase = self.back
        return self._loops.velocity(state, dt, self._field, self._speed, 0.0, self._height)

    def back(self, state: State, dt: float) -> Command:
        """Slower by 2 m/s a second, until it hovers."""
        self._speed = max(self._speed - 2.0 * dt, 0.0)
        if self._speed <= 0.0 and state.ground_speed < 1.0:
            self._there, self._time = self._field.place(state), 0.0
            self.phase = self.hover
        return self._loops.velocity(state, dt, self._field, self._speed, 0.0, self._height)

    def hover(self, state: State, dt: float) -> Command:
        """Ten seconds over the place where it came to rest."""
        self._time += dt
        if self._time > 10.0:
            self.phase, self._sinking = self.down, self._height
        return self._loops.position(state, dt, self._field, self._there, self._height)

    def down(self, state: State, dt: float) -> Command:
        """Sinks, the last metres slowly, until it stands."""
        height = state.altitude_msl - self._field.altitude
        if state.on_ground:
            self.phase = self.standing
        self._sinking = max(self._sinking - (1.5 if height > 8.0 else 0.5) * dt, height - 4.0)
        return self._loops.position(state, dt, self._field, self._there, self._sinking)

    def standing(self, state: State, dt: float) -> Command:
        """Levers idle."""
        del state, dt
        return {"roll": 0.0, "pitch": 0.0, "yaw": 0.0, "throttle": 0.0, "thrust_vector": UPRIGHT, "gear": 1.0}
