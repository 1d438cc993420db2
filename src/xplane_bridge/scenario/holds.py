"""A simple autopilot for scripted flights of a fixed wing: roll, pitch, heading, climb, altitude and speed holds.

Meant to fly a demonstration, not to be studied: attitude loops with rate damping and an integrator on pitch, outer
loops that give attitude targets. Output is stick and throttle as a pilot would move them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Dict, Optional

_MOST_INTEGRAL = 0.6  # of the pitch hold: stick


@dataclass(frozen=True)
class HoldGains:
    """Gains; stick per degree, degrees per second of rate, and so on. A scenario's `gains` overrides single ones."""

    roll: float = 0.035  #: stick per degree of roll error
    roll_rate: float = 0.012  #: stick per degree/s
    pitch: float = 0.03  #: stick per degree of pitch error
    pitch_rate: float = 0.015  #: stick per degree/s
    pitch_integral: float = 0.015  #: stick per degree and second
    heading: float = 1.2  #: degrees of roll per degree of heading error
    max_roll: float = 30.0  #: [deg] of the heading hold
    climb: float = 1.2  #: degrees of pitch per m/s of climb error
    climb_integral: float = 0.3  #: degrees of pitch per m/s and second
    altitude: float = 0.2  #: m/s of climb per metre of error
    max_climb: float = 5.0  #: [m/s] of the altitude hold
    speed: float = 0.03  #: throttle per m/s
    speed_integral: float = 0.006  #: throttle per m/s and second
    turn_compensation: float = 1.0  #: degrees of pitch in a turn, times (1/cos(roll) - 1) * 10
    yaw: float = 0.02  #: pedals per degree/s of yaw-rate error


@dataclass
class Targets:
    """What to hold; None is flown by the stick of the scenario.

    Of roll and heading, and of pitch, climb and altitude, one counts: heading before roll, altitude before climb before
    pitch.
    """

    roll: Optional[float] = None
    pitch: Optional[float] = None
    heading: Optional[float] = None
    climb: Optional[float] = None
    altitude: Optional[float] = None
    speed: Optional[float] = None
    yaw_rate: Optional[float] = None

    def update(self, changes: Dict[str, Optional[float]]) -> None:
        """Takes over new targets; one of a group replaces the others of its group."""
        for group in (("roll", "heading"), ("pitch", "climb", "altitude")):
            if any(changes.get(key) is not None for key in group):
                for key in group:
                    setattr(self, key, None)
        for key, value in changes.items():
            setattr(self, key, value)

    def any(self) -> bool:
        """Whether anything is to be held."""
        return any(value is not None for value in vars(self).values())


class HoldAutopilot:
    """Flies `Targets`. Stateful: integrators, which start from the stick in use so that taking over is smooth.

    What is not known (NaN) gives a stick of NaN for as long as that lasts, and no longer.
    """

    def __init__(self, gains: HoldGains) -> None:
        self._g = gains
        self._pitch_integral: Optional[float] = None
        self._climb_integral: Optional[float] = None
        self._throttle_integral: Optional[float] = None

    def let_go(self) -> None:
        """As for targets of which none holds anything."""
        self._climb_integral = self._pitch_integral = self._throttle_integral = None

    def roll(self, targets: Targets, roll_deg: float, roll_rate_dps: float, heading_deg: float) -> Optional[float]:
        """Stick, right +; None if nothing is to be held."""
        if targets.heading is not None:
            error = math.remainder(targets.heading - heading_deg, 360.0)
            wanted = _clip(self._g.heading * error, -self._g.max_roll, self._g.max_roll)
        elif targets.roll is not None:
            wanted = targets.roll
        else:
            return None
        error = math.remainder(wanted - roll_deg, 360.0)
        return _clip(self._g.roll * error - self._g.roll_rate * roll_rate_dps, -1.0, 1.0)

    def pitch(
        self,
        targets: Targets,
        dt: float,
        pitch_deg: float,
        pitch_rate_dps: float,
        roll_deg: float,
        climb: float,
        altitude: float,
        present: float,
    ) -> Optional[float]:
        """Stick, nose up +, where it is `present` before; None if nothing is to be held."""
        g = self._g
        wanted_climb = targets.climb
        if targets.altitude is not None:
            wanted_climb = _clip(g.altitude * (targets.altitude - altitude), -g.max_climb, g.max_climb)
        if wanted_climb is not None:
            error = wanted_climb - climb
            if self._climb_integral is None:
                if not math.isfinite(pitch_deg):
                    return math.nan
                self._climb_integral = pitch_deg
            self._climb_integral = _integrate(self._climb_integral, g.climb_integral * error * dt, -20.0, 20.0)
            wanted = _clip(self._climb_integral + g.climb * error, -20.0, 20.0)
        elif targets.pitch is not None:
            self._climb_integral = None
            wanted = targets.pitch
        else:
            self._climb_integral = self._pitch_integral = None
            return None
        lean = 1.0 / max(math.cos(math.radians(roll_deg)), 0.3) - 1.0
        wanted += g.turn_compensation * 10.0 * lean if wanted_climb is not None else 0.0
        error = wanted - pitch_deg
        if self._pitch_integral is None:
            self._pitch_integral = _clip(present, -_MOST_INTEGRAL, _MOST_INTEGRAL)
        self._pitch_integral = _integrate(
            self._pitch_integral, g.pitch_integral * error * dt, -_MOST_INTEGRAL, _MOST_INTEGRAL
        )
        return _clip(g.pitch * error - g.pitch_rate * pitch_rate_dps + self._pitch_integral, -1.0, 1.0)

    def yaw(self, targets: Targets, yaw_rate_dps: float) -> Optional[float]:
        """Pedals, nose right +; None if nothing is to be held."""
        if targets.yaw_rate is None:
            return None
        return _clip(self._g.yaw * (targets.yaw_rate - yaw_rate_dps), -1.0, 1.0)

    def throttle(self, targets: Targets, dt: float, speed: float, present: float) -> Optional[float]:
        """Lever 0..1; None if no speed is to be held."""
        if targets.speed is None:
            self._throttle_integral = None
            return None
        if self._throttle_integral is None:
            self._throttle_integral = present
        error = targets.speed - speed
        self._throttle_integral = _integrate(self._throttle_integral, self._g.speed_integral * error * dt, 0.0, 1.0)
        return _clip(self._throttle_integral + self._g.speed * error, 0.0, 1.0)


def _clip(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)


def _integrate(integral: float, step: float, low: float, high: float) -> float:
    return _clip(integral + step, low, high) if math.isfinite(step) else integral
