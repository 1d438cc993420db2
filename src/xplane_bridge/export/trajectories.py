"""Flights as trajectories that SLAM evaluation tools read: TUM and EuRoC files of the odometry (map, ENU/FLU)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Optional

import numpy as np

from xplane_bridge.analysis.resampling import interpolated, rotated, time_base
from xplane_bridge.bags import FLIGHT_STATE
from xplane_bridge.bags.segments import DEFAULT_MAX_GAP, segments
from xplane_bridge.export.flight import breaks, odometry_of

if TYPE_CHECKING:
    from pathlib import Path

    from xplane_bridge.bags import Bags

_POSITION = [f"pose.pose.position.{axis}" for axis in "xyz"]
_ORIENTATION = [f"pose.pose.orientation.{axis}" for axis in "xyzw"]


def trajectory(bags: Bags, rate: Optional[float] = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Read the trajectory of a flight.

    Args:
        bags: Open bags of one flight.
        rate: [1/s] of a uniform time base, without gaps, resets and jumps; None: the samples as they are.

    Returns:
        Stamps (int64 [ns], shape (n,)), positions (ENU in `map` [m], (n, 3)), orientations (x, y, z, w, (n, 4)).

    Raises:
        BagError: No odometry in the bag.
    """
    table = bags.read(odometry_of(bags), ["header.stamp", *_POSITION, *_ORIENTATION])
    order = np.argsort(table.stamp, kind="stable")
    stamp = table.stamp[order]
    position = np.stack([table[name][order] for name in _POSITION], axis=1)
    orientation = np.stack([table[name][order] for name in _ORIENTATION], axis=1)
    # Also where nothing is interpolated: a warning says where the clock was set back.
    parts = segments(stamp, _breaks(bags, stamp), DEFAULT_MAX_GAP)
    if rate is None:
        return stamp, position, orientation
    base = time_base(stamp, parts, rate)
    return base, interpolated(base, stamp, position, parts), rotated(base, stamp, orientation, parts)


def _breaks(bags: Bags, stamp: np.ndarray) -> Optional[np.ndarray]:
    """Count the breaks of the flight states up to each stamp [ns]; None without states."""
    topic = bags.topic_of_type(FLIGHT_STATE)
    if topic is None or not bags.topics[topic].count:
        return None
    state = bags.read(topic, ["header.stamp", "epoch", "position_epoch", "sim_time_unwrapped"]).by_stamp()
    edges = state.stamp[1:][np.diff(breaks(bags, state)) > 0]
    return np.searchsorted(edges, stamp, side="right")


def write_tum(path: Path, stamp: np.ndarray, position: np.ndarray, orientation: np.ndarray) -> None:
    """Write ``timestamp[s] x y z qx qy qz qw``, one line a pose."""
    with path.open("w", encoding="ascii", newline="\n") as file:
        for t, p, q in zip(stamp, position, orientation):
            seconds = f"{t // 1_000_000_000}.{t % 1_000_000_000:09d}"
            file.write(seconds + "".join(f" {value:.9f}" for value in (*p, *q)) + "\n")


def write_euroc(path: Path, stamp: np.ndarray, position: np.ndarray, orientation: np.ndarray) -> None:
    """Write EuRoC's ground truth: ``timestamp[ns], p_x, p_y, p_z, q_w, q_x, q_y, q_z``."""
    with path.open("w", encoding="ascii", newline="\n") as file:
        file.write("#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n")
        for t, p, q in zip(stamp, position, orientation):
            values = (*p, q[3], q[0], q[1], q[2])
            file.write(f"{t}" + "".join(f",{value:.9f}" for value in values) + "\n")
