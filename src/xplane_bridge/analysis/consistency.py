"""Does the recorded flight obey physics? Finds swapped axes, degrees taken for radians, wrong signs.

The same four relations that the bridge's live monitor watches, over a whole recording, plus odometry against itself.
"""

from __future__ import annotations

from typing import Iterator, Mapping, NamedTuple

import numpy as np

from xplane_bridge.analysis.odometry import Odometry, differences

GRAVITY = 9.80665  #: [m/s^2]
#: Largest difference, per axis, of odom's differenced position from its mean twist that is still noise [m/s].
ODOMETRY_LIMIT_MPS = 0.02
_PIECE = 16384  # samples


class Check(NamedTuple):
    """One relation between recorded quantities."""

    name: str
    unit: str
    error: float  #: median absolute difference of the two sides, of the worst axis
    scale: float  #: typical size (root mean square) of the observed side
    limit: float  #: largest error that is still noise
    samples: int

    @property
    def ok(self) -> bool:
        """Whether the relation holds; true when there is nothing to compare."""
        return self.samples == 0 or self.error <= self.limit


def check_flight(columns: Mapping[str, np.ndarray], parts: list[slice]) -> list[Check]:
    """Check the columns of FlightState against each other, in simulator time.

    Args:
        columns: Of FlightState.
        parts: Segments of the samples; nothing is differenced across their edges.
    """
    use = _neighbours(columns, parts)
    dt = _sim_steps(columns, use)
    return [
        _rates(columns, use, dt),
        _force(columns, use, dt),
        _airspeed(columns),
        _climb(columns, use, dt),
    ]


def check_odometry(odometry: Odometry) -> Check:
    """Check that the odometry's position moves as its twist says, over steps of 1 s of simulator time."""
    errors = differences(odometry)
    return _check("odometry: position against twist", "m/s", [errors], odometry.velocity, ODOMETRY_LIMIT_MPS)


def _neighbours(columns: Mapping[str, np.ndarray], parts: list[slice]) -> np.ndarray:
    """Give the indices k whose successor k + 1 is of the same segment and a later frame."""
    pairs = [np.arange(part.start, part.stop - 1) for part in parts if part.stop - part.start > 1]
    index = np.concatenate(pairs) if pairs else np.empty(0, dtype=int)
    sim = columns["sim_time_unwrapped"]
    later: np.ndarray = index[sim[index + 1] > sim[index]]
    return later


def _sim_steps(columns: Mapping[str, np.ndarray], use: np.ndarray) -> np.ndarray:
    sim = columns["sim_time_unwrapped"]
    steps: np.ndarray = sim[use + 1] - sim[use]
    return steps


def _pieces(use: np.ndarray) -> Iterator[np.ndarray]:
    """Cut indices into pieces: a matrix a sample, of a long flight, does not fit into memory several times."""
    return (use[first : first + _PIECE] for first in range(0, len(use), _PIECE))


def _quaternions(columns: Mapping[str, np.ndarray]) -> np.ndarray:
    return np.stack([columns[f"orientation.{axis}"] for axis in "xyzw"], axis=1)


def _vector(columns: Mapping[str, np.ndarray], name: str) -> np.ndarray:
    return np.stack([columns[f"{name}.{axis}"] for axis in "xyz"], axis=1)


def _matrix(quaternions: np.ndarray) -> np.ndarray:
    """Give R_ned_frd of every sample, shape (n, 3, 3), from the recorded quaternions (x, y, z, w)."""
    x, y, z, w = quaternions.T
    return np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], axis=1),
            np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], axis=1),
            np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1),
        ],
        axis=1,
    )


def _rates(columns: Mapping[str, np.ndarray], use: np.ndarray, dt: np.ndarray) -> Check:
    quaternions = _quaternions(columns)
    turned = [np.empty((0, 3))]
    for k in _pieces(use):
        step = np.einsum("nji,njk->nik", _matrix(quaternions[k]), _matrix(quaternions[k + 1]))
        skew = [step[:, 2, 1] - step[:, 1, 2], step[:, 0, 2] - step[:, 2, 0], step[:, 1, 0] - step[:, 0, 1]]
        turned.append(np.stack(skew, axis=1))
    seen = np.concatenate(turned) / 2 / dt[:, None]
    said = _vector(columns, "angular_velocity")
    mean = (said[use] + said[use + 1]) / 2
    return _check("attitude against p, q, r", "rad/s", [seen - mean], seen, 0.02, share=0.05)


def _force(columns: Mapping[str, np.ndarray], use: np.ndarray, dt: np.ndarray) -> Check:
    velocity = _vector(columns, "velocity_ned")
    acceleration = (velocity[use + 1] - velocity[use]) / dt[:, None]
    quaternions, force = _quaternions(columns), _vector(columns, "specific_force")
    turned = [np.einsum("nij,nj->ni", _matrix(quaternions[k]), force[k]) for k in _pieces(np.arange(len(force)))]
    felt = np.concatenate([np.empty((0, 3)), *turned])
    mean = (felt[use] + felt[use + 1]) / 2 + np.array([0.0, 0.0, GRAVITY])
    return _check("specific force against dv/dt", "m/s^2", [acceleration - mean], acceleration, 0.3, share=0.1)


def _airspeed(columns: Mapping[str, np.ndarray]) -> Check:
    air = np.linalg.norm(_vector(columns, "velocity_ned") - _vector(columns, "wind_ned"), axis=1)
    said = columns["true_airspeed"].astype(np.float64)
    return _check("|velocity - wind| against true airspeed", "m/s", [air - said], air, 0.5)


def _climb(columns: Mapping[str, np.ndarray], use: np.ndarray, dt: np.ndarray) -> Check:
    height = columns["altitude_msl"]
    seen = (height[use + 1] - height[use]) / dt
    down = columns["velocity_ned.z"]
    return _check("climb against -v_down", "m/s", [seen + (down[use] + down[use + 1]) / 2], seen, 0.3)


def _check(
    name: str, unit: str, errors: list[np.ndarray], quantity: np.ndarray, limit: float, share: float = 0.0
) -> Check:
    """Make a check of the worst axis; the limit is at least `share` of the size of `quantity`, the observed side."""
    rows = np.concatenate([e if e.ndim > 1 else e[:, None] for e in errors]) if errors else np.empty((0, 1))
    rows = np.abs(rows[np.isfinite(rows).all(axis=1)])
    finite = quantity[np.isfinite(quantity)]
    scale = float(np.sqrt(np.mean(finite**2))) if finite.size else 0.0
    error = float(np.median(rows, axis=0).max()) if len(rows) else float("nan")
    return Check(name, unit, error, scale, max(limit, share * scale), len(rows))
