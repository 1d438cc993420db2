"""Simulated time of flight states, and which of them are frames of their own."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Frames(NamedTuple):
    """Flight states as frames; of shape (n,)."""

    elapsed: np.ndarray  #: [s] simulated since the first state; it stands where an epoch begins, and in a pause
    first: np.ndarray  #: whether it is the first state of its frame: X-Plane repeats the last one while it is paused


def frames_of(epoch: np.ndarray, sim_time: np.ndarray) -> Frames:
    """Separates frames from repetitions: a state of the same epoch at the same simulated time shows the same frame.

    Args:
        epoch: Of FlightState.
        sim_time: Its `sim_time_unwrapped` [s].
    """
    same = np.diff(epoch) == 0
    steps = np.where(same, np.maximum(np.diff(sim_time), 0.0), 0.0)
    elapsed = np.concatenate(([0.0], np.cumsum(steps)))
    return Frames(elapsed, np.concatenate(([True], ~same | (steps > 0.0))))
