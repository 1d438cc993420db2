"""X-Plane's "artificial stability" for hovering aircraft: stick to attitude and yaw rate, to the moments a mixer can make."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Sequence


@dataclass(frozen=True)
class StabilisationSpec:
    """Gains. ``rate`` and ``integral`` are mixer command per rad/s (and per rad), for roll, pitch, yaw."""

    maximum_tilt_rad: float
    maximum_yaw_rate_rad_s: float
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
        self,
        dt: float,
        stick: Sequence[float],
        attitude_rad: Sequence[float],
        rates: Sequence[float],
        authority: float = 1.0,
    ) -> list[float]:
        """Roll, pitch, yaw commands for the mixer.

        Args:
            dt: [s].
            stick: roll, pitch, yaw, -1..1.
            attitude_rad: roll, pitch.
            rates: p, q, r [rad/s].
            authority: share of the gains to use (a tiltrotor's rotors lose their hold as its nacelles come down).
        """
        spec = self.spec
        sine, cosine = math.sin(attitude_rad[0]), math.cos(attitude_rad[0])
        roll_error = stick[0] * spec.maximum_tilt_rad - attitude_rad[0]
        pitch_error = stick[1] * spec.maximum_tilt_rad - attitude_rad[1]
        if abs(roll_error) > math.pi:
            roll_error -= math.copysign(2.0 * math.pi, roll_error)
        top = spec.maximum_rate_rad_s
        roll_rate = min(max(spec.attitude * roll_error, -top), top)
        pitch_rate = min(max(spec.attitude * pitch_error, -top), top)
        yaw_rate = stick[2] * spec.maximum_yaw_rate_rad_s
        # Euler rates to body rates.
        wanted = (
            roll_rate - yaw_rate * math.sin(attitude_rad[1]),
            pitch_rate * cosine + yaw_rate * sine * math.cos(attitude_rad[1]),
            -pitch_rate * sine + yaw_rate * cosine * math.cos(attitude_rad[1]),
        )
        commands = []
        for axis in range(3):
            error = wanted[axis] - rates[axis]
            limit = spec.limit[axis]
            command = authority * spec.rate[axis] * error + self.integrals[axis]
            if abs(command) < limit or command * error < 0.0:
                integral = self.integrals[axis] + authority * spec.integral[axis] * error * dt
                self.integrals[axis] = min(max(integral, -limit), limit)
            commands.append(min(max(command, -limit), limit))
        return commands
