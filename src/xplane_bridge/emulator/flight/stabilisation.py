"""X-Plane's "artificial stability": attitude and rate of turn to the roll, pitch and yaw that a mixer can make."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Sequence


@dataclass(frozen=True)
class StabilisationSpec:
    """Gains. ``rate`` and ``integral`` are mixer command per rad/s (and per rad), for roll, pitch, yaw."""

    attitude: float  #: rad/s of wanted rate per rad of attitude error
    maximum_rate_rad_s: float
    rate: tuple[float, float, float]
    integral: tuple[float, float, float]
    limit: tuple[float, float, float]  #: of the command, each axis


class Stabilisation:
    """Attitude loop around a rate loop with integral; the integral stops while its command is at the limit."""

    __slots__ = ("integrals", "spec")

    def __init__(self, spec: StabilisationSpec) -> None:
        self.spec = spec
        self.integrals = [0.0, 0.0, 0.0]

    def step(
        self, dt: float, wanted: Sequence[float], attitude_rad: Sequence[float], rates: Sequence[float]
    ) -> list[float]:
        """Roll, pitch, yaw commands for the mixer.

        Args:
            dt: [s].
            wanted: roll [rad], pitch [rad], rate of turn [rad/s].
            attitude_rad: roll, pitch.
            rates: p, q, r [rad/s].
        """
        spec = self.spec
        sine, cosine = math.sin(attitude_rad[0]), math.cos(attitude_rad[0])
        roll_error = math.remainder(wanted[0] - attitude_rad[0], 2.0 * math.pi)
        top = spec.maximum_rate_rad_s
        roll_rate = min(max(spec.attitude * roll_error, -top), top)
        pitch_rate = min(max(spec.attitude * (wanted[1] - attitude_rad[1]), -top), top)
        # Euler rates to body rates.
        level = math.cos(attitude_rad[1]) * wanted[2]
        body = (
            roll_rate - wanted[2] * math.sin(attitude_rad[1]),
            pitch_rate * cosine + level * sine,
            -pitch_rate * sine + level * cosine,
        )
        commands = []
        for axis in range(3):
            error = body[axis] - rates[axis]
            limit = spec.limit[axis]
            command = spec.rate[axis] * error + self.integrals[axis]
            if abs(command) < limit or command * error < 0.0:
                integral = self.integrals[axis] + spec.integral[axis] * error * dt
                self.integrals[axis] = min(max(integral, -limit), limit)
            commands.append(min(max(command, -limit), limit))
        return commands
