"""Integrated equation error: x(t) - x(0) = A int x + B int u + b t, by linear least squares. The start of every fit.

It needs neither a start of its own nor a derivative of measured signals; noise in the states biases it, which output
error then puts right.
"""

from __future__ import annotations

from typing import Sequence

import numpy as np


def equation_error(
    times: Sequence[np.ndarray], states: Sequence[np.ndarray], inputs: Sequence[np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Give A and B of several windows together, each with its own initial state and bias.

    Args:
        times: [s] for each window, shape (n,).
        states: For each window, shape (n, 4).
        inputs: For each window, shape (n, m).
    """
    count = states[0].shape[1]
    left, right = [], []
    for time, x, u in zip(times, states, inputs):
        known = _integral(time, np.hstack([x, u]))
        own = np.column_stack([np.ones(len(time)), time - time[0]])
        # What each window has of its own is taken out of both sides.
        basis, _ = np.linalg.qr(own)
        left.append(known - basis @ (basis.T @ known))
        right.append(x - basis @ (basis.T @ x))
    solution = np.linalg.lstsq(np.vstack(left), np.vstack(right), rcond=None)[0].T
    return solution[:, :count], solution[:, count:]


def _integral(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    steps = np.diff(time)[:, None] * (values[1:] + values[:-1]) / 2.0
    return np.vstack([np.zeros(values.shape[1]), np.cumsum(steps, axis=0)])
