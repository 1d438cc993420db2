"""Dryden turbulence, seeded and restorable."""

from __future__ import annotations

import math
import random
from typing import Any, Optional

from xplane_bridge.units import FOOT_M

#: Air passes a hovering aircraft too: floor of the speed at which the gust field goes by [m/s].
MINIMUM_SPEED_MPS = 5.0


class DrydenTurbulence:
    """Gusts along, across and vertical to the path, MIL-F-8785C scales, as shaping filters of first and second order.

    Rotational gusts are not modelled.
    """

    def __init__(self, seed: int) -> None:
        self.intensity_mps = 0.0
        self._random = random.Random(seed)
        self._state = [0.0] * 5

    def start(self, intensity_mps: float, seed: Optional[int] = None) -> None:
        """Standard deviation of the vertical gust; 0 ends it. ``seed`` restarts the sequence."""
        self.intensity_mps = intensity_mps
        if seed is not None:
            self._random.seed(seed)
            self._state = [0.0] * 5
        if intensity_mps == 0.0:
            self._state = [0.0] * 5

    def step(self, dt: float, speed_mps: float, agl_m: float) -> tuple[float, float, float]:
        """Next gusts [m/s]: along the horizontal path, to its right, down. Exact for any ``dt`` at constant speed."""
        speed = max(speed_mps, MINIMUM_SPEED_MPS)
        height_ft = min(max(agl_m / FOOT_M, 10.0), 1000.0)
        shape = 0.177 + 0.000823 * height_ft
        scale_w = height_ft * FOOT_M
        scale_u = scale_w / shape**1.2
        sigma_w = self.intensity_mps
        sigma_u = sigma_w / shape**0.4
        gauss, s = self._random.gauss, self._state

        decay = math.exp(-speed * dt / scale_u)
        s[0] = decay * s[0] + sigma_u * math.sqrt(1.0 - decay * decay) * gauss(0.0, 1.0)
        along = s[0]
        # (1 + sqrt3 T s) / (1 + T s)^2 = sqrt3 / (1 + T s) + (1 - sqrt3) / (1 + T s)^2, driven by one noise. With
        # variance 1 behind the first lag the sum has 3 + sqrt3 (1 - sqrt3) + (1 - sqrt3)^2 / 2 = 2: the root below.
        root = math.sqrt(1.0 - decay * decay)
        s[1] = decay * s[1] + root * gauss(0.0, 1.0)
        s[2] = decay * s[2] + (1.0 - decay) * s[1]
        across = sigma_u * (1.7320508 * s[1] - 0.7320508 * s[2]) / 1.4142136
        decay = math.exp(-speed * dt / scale_w)
        root = math.sqrt(1.0 - decay * decay)
        s[3] = decay * s[3] + root * gauss(0.0, 1.0)
        s[4] = decay * s[4] + (1.0 - decay) * s[3]
        down = sigma_w * (1.7320508 * s[3] - 0.7320508 * s[4]) / 1.4142136
        return along, across, down

    def save(self) -> list[Any]:
        """What ``restore`` needs, the random generator included."""
        version, internal, gauss_next = self._random.getstate()
        return [self.intensity_mps, list(self._state), version, list(internal), gauss_next]

    def restore(self, saved: list[Any]) -> None:
        """Goes on from the state of ``save``."""
        self.intensity_mps, self._state = saved[0], list(saved[1])
        self._random.setstate((saved[2], tuple(saved[3]), saved[4]))
