"""Delays measured from recorded motion: pictures against attitude, surfaces against commands.

Both compare a signal that is late by an unknown, constant time with the one it follows. Arrays in, results out.
"""

from __future__ import annotations

from typing import NamedTuple, Optional, Sequence

import numpy as np

from xplane_bridge.errors import XplaneBridgeError

#: Half width of the 95 % interval beyond which no delay is given [s].
MAX_HALF_WIDTH_S = 0.005
#: Length of the pieces that the bootstrap draws [s]: longer than the motion's memory.
BLOCK_S = 2.0
#: Share of the late signal's increments that the fit must explain, as a correlation.
MIN_CORRELATION = 0.5
#: A gain farther from 1 than this says that the pictures do not show the recorded motion.
GAIN_RANGE = (0.6, 1.4)
_DRAWS = 300
_COARSE_S = 0.004
_STEPS = 8
_HUBER = 1.5
_MIN_SAMPLES = 60


class LatencyError(XplaneBridgeError):
    """The recording does not determine the delay; the text says why and what to record instead."""


class TooFewSamplesError(LatencyError):
    """The recording holds too little motion that is known on both sides."""


class Motion(NamedTuple):
    """Increments of the late signal between pairs of samples."""

    begin: np.ndarray  #: [s] stamp of the first sample of each pair
    end: np.ndarray  #: [s] stamp of the second
    increment: np.ndarray  #: change between them


class Delay(NamedTuple):
    """Result of a fit. The late signal at t is ``gain`` times the leading one at t - ``delay``."""

    delay: float  #: [s]
    sigma: float  #: [s] standard deviation, by block bootstrap
    low: float  #: [s] 95 % interval
    high: float  #: [s]
    gain: float  #: [-] late signal over leading signal
    drift: float  #: [unit of the signal / s] slow change of the late signal that the leading one does not have
    correlation: float  #: [-] of the late increments with the fitted ones
    samples: int
    searched: np.ndarray  #: [s] delays tried
    cost: np.ndarray  #: [-] robust cost at each, least = 1


def fit_delay(
    late: Motion,
    lead_time: np.ndarray,
    lead: np.ndarray,
    search: tuple[float, float] = (-0.1, 0.4),
    seed: int = 0,
    gaps: Sequence[tuple[float, float]] = (),
) -> Delay:
    """Find the delay of a signal that follows another one.

    Args:
        late: Increments of the late signal.
        lead_time: [s] stamps of the leading signal, increasing.
        lead: The leading signal, in the late one's unit.
        search: [s] shortest and longest delay looked for.
        seed: Of the bootstrap.
        gaps: [s] begin and end of stretches in which the leading signal is not known: what may lie there is left out.

    Raises:
        TooFewSamplesError: The recording is too short, or most of it was left out.
    """
    inside = (late.begin - search[1] > lead_time[0]) & (late.end - search[0] < lead_time[-1])
    for last, first in gaps:
        inside &= (late.end - search[0] <= last) | (late.begin - search[1] >= first)
    begin, end, increment = late.begin[inside], late.end[inside], late.increment[inside]
    if len(begin) < _MIN_SAMPLES:
        msg = f"{len(begin)} usable samples of motion; expected {_MIN_SAMPLES} or more: record at least 30 s of flight"
        raise TooFewSamplesError(msg)
    length = end - begin

    def rise(delay: float) -> np.ndarray:
        risen: np.ndarray = np.interp(end - delay, lead_time, lead) - np.interp(begin - delay, lead_time, lead)
        return risen

    def solve(delay: float) -> tuple[float, np.ndarray, np.ndarray]:
        return _robust(np.column_stack((rise(delay), length)), increment)

    coarse = np.arange(search[0], search[1] + 0.5 * _COARSE_S, _COARSE_S)
    cost = np.array([solve(delay)[0] for delay in coarse])
    delay = float(coarse[int(np.argmin(cost))])

    def linearised(delay: float) -> np.ndarray:
        slope = (rise(delay + 0.5 * _COARSE_S) - rise(delay - 0.5 * _COARSE_S)) / _COARSE_S
        return np.column_stack((rise(delay), slope, length))

    for _ in range(_STEPS):
        _, (gain, shifted, _), weights = _robust(linearised(delay), increment)
        if gain == 0.0:
            break
        delay += float(np.clip(shifted / gain, -_COARSE_S, _COARSE_S))
    _, (gain, drift), weights = solve(delay)
    correlation = _correlation(gain * rise(delay) + drift * length, increment, weights)
    matrix = linearised(delay)
    sigma, low, high = _bootstrap(matrix, increment, weights, begin, delay, np.random.default_rng(seed))
    relative = cost / max(float(cost.min()), 1e-300)
    return Delay(delay, sigma, low, high, float(gain), float(drift), correlation, len(begin), coarse, relative)


def require_usable(result: Delay, what: str, gain_range: Optional[tuple[float, float]] = GAIN_RANGE) -> None:
    """Refuse a result that the recording does not support.

    Args:
        result: Of `fit_delay`.
        what: The late signal, for the message.
        gain_range: What the gain must lie in; None: anything.

    Raises:
        LatencyError: The motion is too small, the delay too long, or the signals do not belong together.
    """
    if not result.correlation >= MIN_CORRELATION:
        msg = (
            f"{what}: the two signals do not move together (correlation {result.correlation:.2f}, expected "
            f"{MIN_CORRELATION} or more): wrong topic, frozen picture, or no motion"
        )
        raise LatencyError(msg)
    shortest, longest = result.searched[0], result.searched[-1]
    if not shortest <= result.delay <= longest:
        msg = (
            f"{what}: the delay lies outside {1e3 * shortest:.0f} .. {1e3 * longest:.0f} ms, where it is looked for: "
            "the clocks of the two signals differ, or they are of different flights"
        )
        raise LatencyError(msg)
    if 2.0 * result.sigma > MAX_HALF_WIDTH_S:
        msg = (
            f"{what}: the motion is too small to measure the delay: {1e3 * result.delay:.1f} ms +- "
            f"{2e3 * result.sigma:.1f} ms (2 sigma), expected +- {1e3 * MAX_HALF_WIDTH_S:.0f} ms or less. Fly 60 s of "
            "roll doublets or multisines (inject_excitation); about 14 deg/s^2 rms of roll acceleration is needed"
        )
        raise LatencyError(msg)
    if gain_range is not None and not gain_range[0] <= result.gain <= gain_range[1]:
        msg = (
            f"{what}: the late signal is {result.gain:.2f} times the leading one, expected about 1: wrong view, or "
            "something else than the flight is shown"
        )
        raise LatencyError(msg)


def view_axis(quaternion: np.ndarray) -> np.ndarray:
    """Line of sight of an optical frame in body axes (forward, right, down).

    Args:
        quaternion: (w, x, y, z), from the optical frame to base_link (forward, left, up).
    """
    w, x, y, z = quaternion
    forward_left_up = np.array((2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)))
    return forward_left_up * (1.0, -1.0, -1.0)


def accumulated_rotation(time: np.ndarray, rates: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Angle turned about a body axis [rad] since the first sample.

    Args:
        time: [s], increasing.
        rates: (n, 3) body rates p, q, r [rad/s].
        axis: (3,) unit vector, forward-right-down.
    """
    about = rates @ axis
    steps = 0.5 * (about[1:] + about[:-1]) * np.diff(time)
    return np.concatenate(((0.0,), np.cumsum(steps)))


def value_motion(time: np.ndarray, value: np.ndarray, step: int = 1) -> Motion:
    """Increments of a sampled signal between each sample and the one so many samples behind."""
    return Motion(time[:-step], time[step:], value[step:] - value[:-step])


def _robust(matrix: np.ndarray, wanted: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Huber fit: mean cost, coefficients, weights."""
    weights = np.ones(len(wanted))
    coefficients = np.zeros(matrix.shape[1])
    for _ in range(6):
        root = np.sqrt(weights)[:, np.newaxis]
        coefficients = np.linalg.lstsq(matrix * root, wanted * root[:, 0], rcond=None)[0]
        residual = np.abs(wanted - matrix @ coefficients)
        scale = _HUBER * 1.4826 * max(float(np.median(residual)), 1e-12)
        weights = np.minimum(1.0, scale / np.maximum(residual, 1e-300))
    # Bounded, so that a few wrong pictures do not decide: squares inside, straight outside, of one common scale.
    spread = 1.4826 * max(float(np.median(np.abs(wanted - np.median(wanted)))), 1e-12)
    scaled = residual / spread
    cost = np.where(scaled < 1.0, scaled**2, 2.0 * scaled - 1.0)
    return float(cost.mean()), coefficients, weights


def _correlation(a: np.ndarray, b: np.ndarray, weights: np.ndarray) -> float:
    a = a - np.average(a, weights=weights)
    b = b - np.average(b, weights=weights)
    scale = np.sqrt((weights * a * a).sum() * (weights * b * b).sum())
    return float((weights * a * b).sum() / scale) if scale > 0.0 else 0.0


def _bootstrap(
    matrix: np.ndarray,
    wanted: np.ndarray,
    weights: np.ndarray,
    time: np.ndarray,
    delay: float,
    random: np.random.Generator,
) -> tuple[float, float, float]:
    """Standard deviation and 95 % interval of the delay over redrawn blocks of time."""
    # Without those that are empty: a pause of 20 s would else leave some draws next to nothing.
    block = np.unique(((time - time[0]) / BLOCK_S).astype(int), return_inverse=True)[1]
    count = int(block.max()) + 1
    weighted = matrix * weights[:, np.newaxis]
    normal = np.zeros((count, 3, 3))
    right = np.zeros((count, 3))
    np.add.at(normal, block, np.einsum("ni,nj->nij", weighted, matrix))
    np.add.at(right, block, weighted * wanted[:, np.newaxis])
    drawn = []
    for _ in range(_DRAWS):
        times = np.bincount(random.integers(0, count, count), minlength=count)
        a, b = np.tensordot(times, normal, 1), times @ right
        if np.linalg.cond(a) > 1e14:
            continue
        gain, shifted, _ = np.linalg.solve(a, b)
        if gain != 0.0:
            drawn.append(shifted / gain)  # d(rise)/d(delay) is the slope: the share of it in the data is the shift
    if len(drawn) < _DRAWS // 2:
        return float("inf"), -float("inf"), float("inf")
    low, high = np.percentile(drawn, (2.5, 97.5))
    return float(np.std(drawn)), delay + float(low), delay + float(high)
