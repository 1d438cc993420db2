"""Odometry against itself, frame by frame in simulator time: does its position move as its twist says?

By the host's stamps an aircraft moves more slowly than it flies where the simulator is slower than real time.
"""

from __future__ import annotations

from typing import Mapping, NamedTuple

import numpy as np


class Odometry(NamedTuple):
    """Messages whose frame is known; all are of shape (n,) or (n, 3)."""

    sim_time: np.ndarray  #: [s] of the frame; restarts with each epoch
    position: np.ndarray  #: `map` [m]
    velocity: np.ndarray  #: the twist turned into `map` [m/s]
    parts: list[slice]  #: stretches in which simulator time only rises


def of_frames(
    stamp: np.ndarray,
    columns: Mapping[str, np.ndarray],
    state_stamp: np.ndarray,
    sim_time: np.ndarray,
    parts: list[slice],
) -> Odometry:
    """Give the messages that have a flight state of the same stamp, each frame once.

    The recorder does not begin both topics at once, so the first messages of one may lack the other. A paused simulator
    repeats its frame.

    Args:
        stamp: Of the odometry, int64 [ns].
        columns: Of nav_msgs/Odometry.
        state_stamp: Of the flight states, in order, int64 [ns].
        sim_time: `sim_time_unwrapped` of the flight states [s].
        parts: Segments of the flight states.
    """
    state = np.minimum(np.searchsorted(state_stamp, stamp), len(state_stamp) - 1)
    rows = np.flatnonzero(state_stamp[state] == stamp)
    state = state[rows]
    time, used, found = sim_time[state], [np.empty(0, dtype=int)], []
    for first, last in ((np.searchsorted(state, part.start), np.searchsorted(state, part.stop)) for part in parts):
        latest = np.fmax.accumulate(time[first:last])
        later = first + np.flatnonzero(np.diff(latest, prepend=-np.inf) > 0)
        start = sum(map(len, used))
        used.append(later)
        found.append(slice(start, start + len(later)))
    kept = np.concatenate(used)
    rows = rows[kept]
    position, twist = (
        np.column_stack([columns[f"{name}.{axis}"][rows] for axis in "xyz"])
        for name in ("pose.pose.position", "twist.twist.linear")
    )
    quaternion = np.column_stack([columns[f"pose.pose.orientation.{axis}"][rows] for axis in "xyzw"])
    return Odometry(time[kept], position, _rotated(quaternion, twist), found)


def differences(odometry: Odometry, window: float = 1.0) -> np.ndarray:
    """Position differenced over `window` [s], less the mean twist, from each message on: [m/s], shape (k, 3)."""
    out = [np.empty((0, 3))]
    for part in odometry.parts:
        time, position, velocity = odometry.sim_time[part], odometry.position[part], odometry.velocity[part]
        # The integral of the velocity, by the trapezoidal rule, from the first message to each.
        way = np.cumsum((velocity[1:] + velocity[:-1]) / 2 * np.diff(time)[:, None], axis=0)
        way = np.concatenate([np.zeros((1, 3)), way])[: len(time)]
        ends = np.searchsorted(time, time + window * (1.0 - 1e-9))
        starts = np.flatnonzero(ends < len(time))
        ends = ends[starts]
        whole = time[ends] - time[starts] < 1.1 * window  # a gap within the window: not a second any more
        starts, ends = starts[whole], ends[whole]
        span = (time[ends] - time[starts])[:, None]
        out.append(((position[ends] - position[starts]) - (way[ends] - way[starts])) / span)
    return np.concatenate(out)


def _rotated(quaternion: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Vectors turned by quaternions (x, y, z, w), row by row."""
    axis, w = quaternion[:, :3], quaternion[:, 3:]
    twice = 2.0 * np.cross(axis, vector)
    turned: np.ndarray = vector + w * twice + np.cross(axis, twice)
    return turned
