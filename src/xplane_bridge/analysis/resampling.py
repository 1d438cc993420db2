"""One time base for signals of different rates: linear, across a wrap, along the shortest rotation, or held.

Nothing is ever interpolated across a gap or an epoch: `bags.segments` cuts a recording there, and every function here
works inside the segments it is given.
"""

from __future__ import annotations

import numpy as np


def time_base(time: np.ndarray, parts: list[slice], rate: float) -> np.ndarray:
    """Make a uniform time base inside each segment.

    Args:
        time: int64 [ns], shape (n,).
        parts: From `bags.segments`.
        rate: [1/s]

    Returns:
        int64 [ns]: multiples of the period counted from the first sample of the recording, those inside a segment.

    Raises:
        ValueError: The rate is not positive.
    """
    if not rate > 0:
        msg = f"rate must be positive, got {rate}"
        raise ValueError(msg)
    out = []
    for part in parts:
        first, last = int(time[part][0]), int(time[part][-1])
        start = int(time[0])
        # Counted in multiples, not accumulated, so that the base does not drift over hours.
        low = int(np.ceil((first - start) * rate / 1e9 - 1e-9))
        high = int(np.floor((last - start) * rate / 1e9 + 1e-9))
        out.append(start + np.round(np.arange(low, high + 1) * (1e9 / rate)).astype(np.int64))
    return np.concatenate(out) if out else np.empty(0, dtype=np.int64)


def held(base: np.ndarray, time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Give at each instant of `base` [ns] the newest sample not after it.

    Before the first sample there is nothing: NaN for floating point values, else None (in an object array).
    """
    index = np.searchsorted(time, base, side="right") - 1
    early = index < 0
    if not early.any():
        return values[index]
    if np.issubdtype(values.dtype, np.floating):
        out = np.full((len(base), *values.shape[1:]), np.nan, dtype=values.dtype)
    else:
        out = np.full((len(base), *values.shape[1:]), None, dtype=object)
    out[~early] = values[index[~early]]
    return out


def interpolated(
    base: np.ndarray, time: np.ndarray, values: np.ndarray, parts: list[slice], wrap: float = 0.0, low: float = 0.0
) -> np.ndarray:
    """Interpolate linearly inside the segments.

    Args:
        base: int64 [ns], shape (m,).
        time: int64 [ns], shape (n,).
        values: Floating point, shape (n,) or (n, k).
        parts: From `bags.segments`.
        wrap: Period of an angle (360), or 0: the short way round is taken.
        low: Lower end of the wrapped range.

    Returns:
        Shape (m,) or (m, k), float64; NaN outside every segment.
    """
    flat = values.reshape(len(values), -1).astype(np.float64)
    out = np.full((len(base), flat.shape[1]), np.nan)
    for part in parts:
        inside = (base >= time[part][0]) & (base <= time[part][-1])
        origin = time[part][0]  # differences keep nanoseconds exact in float64
        x, known = (base[inside] - origin).astype(np.float64), (time[part] - origin).astype(np.float64)
        for k in range(flat.shape[1]):
            column = flat[part, k]
            if wrap:
                column = _unwrapped(column, wrap)
            result = np.interp(x, known, column)
            out[inside, k] = (result - low) % wrap + low if wrap else result
    return out.reshape((len(base), *values.shape[1:]))


def rotated(base: np.ndarray, time: np.ndarray, quaternions: np.ndarray, parts: list[slice]) -> np.ndarray:
    """Interpolate rotations along the shortest arc (slerp) inside the segments.

    Args:
        base: int64 [ns], shape (m,).
        time: int64 [ns], shape (n,).
        quaternions: x, y, z, w, shape (n, 4); normalised here.
        parts: From `bags.segments`.

    Returns:
        Unit quaternions x, y, z, w, shape (m, 4); NaN outside every segment.
    """
    out = np.full((len(base), 4), np.nan)
    unit = quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)
    for part in parts:
        known = time[part]
        inside = np.flatnonzero((base >= known[0]) & (base <= known[-1]))
        left = np.clip(np.searchsorted(known, base[inside], side="right") - 1, 0, max(len(known) - 2, 0))
        right = np.minimum(left + 1, len(known) - 1)
        span = np.maximum(known[right] - known[left], 1)
        share = ((base[inside] - known[left]) / span)[:, None]
        a, b = unit[part][left], unit[part][right]
        dot = np.sum(a * b, axis=1, keepdims=True)
        b = np.where(dot < 0, -b, b)
        angle = np.arccos(np.clip(np.abs(dot), 0.0, 1.0))
        small = angle < 1e-6
        sine = np.where(small, 1.0, np.sin(angle))
        wa = np.where(small, 1 - share, np.sin((1 - share) * angle) / sine)
        wb = np.where(small, share, np.sin(share * angle) / sine)
        mixed = wa * a + wb * b
        out[inside] = mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
    return out


def _unwrapped(values: np.ndarray, period: float) -> np.ndarray:
    # np.unwrap knows a period since numpy 1.21 only; NaN must not spread to what follows it.
    good = np.isfinite(values)
    out = values.copy()
    out[good] = np.unwrap(values[good] * (2 * np.pi / period)) * (period / (2 * np.pi))
    return out
