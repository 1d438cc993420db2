"""Finds the controls and attitude of steady flight: Newton's method on the model's own accelerations."""

from __future__ import annotations

from typing import Callable, Sequence

import numpy as np

from xplane_bridge.emulator.flight.flight_model import TrimError


def newton(
    residual: Callable[[np.ndarray], Sequence[float]],
    start: Sequence[float],
    steps: Sequence[float],
    limits: Sequence[Sequence[float]],
    tolerance: float = 1e-7,
    iterations: int = 40,
    what: str = "trim",
) -> np.ndarray:
    """Solves ``residual(x) = 0`` with as many equations as unknowns.

    Args:
        residual: the equations.
        start: first guess.
        steps: differences for the derivatives, about 0.01 of each unknown's range.
        limits: (lowest, highest) per unknown.
        tolerance: largest residual that counts as none.
        iterations: at most.
        what: for the message.

    Raises:
        TrimError: no solution within the limits.
    """
    x = np.array(start, dtype=float)
    low, high = np.array(limits, dtype=float).T
    value = np.array(residual(x), dtype=float)
    for _ in range(iterations):
        if np.max(np.abs(value)) < tolerance:
            return x
        jacobian = np.empty((len(value), len(x)))
        for i, step in enumerate(steps):
            moved = x.copy()
            moved[i] += step
            jacobian[:, i] = (np.array(residual(moved), dtype=float) - value) / step
        change = np.linalg.lstsq(jacobian, -value, rcond=None)[0]
        scale = 1.0
        for _ in range(6):
            candidate = np.clip(x + scale * change, low, high)
            candidate_value = np.array(residual(candidate), dtype=float)
            if np.linalg.norm(candidate_value) < np.linalg.norm(value):
                break
            scale *= 0.5
        x, value = candidate, candidate_value
    if np.max(np.abs(value)) < 1e3 * tolerance:
        return x
    raise TrimError(
        f"{what}: no steady flight found; choose another speed, height or weight "
        f"(the best try leaves accelerations of {', '.join(f'{v:.3g}' for v in value)})"
    )
