"""Differences between flights: of signals over matched time, and of measures, each with a 95 % interval."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Mapping, NamedTuple, Sequence

import numpy as np

from xplane_bridge.analysis.intervals import Interval

#: Columns of FlightState that are compared: column to name, unit, factor, period of an angle (0: it does not wrap).
SIGNALS: dict[str, tuple[str, str, float, float]] = {
    "roll_deg": ("roll", "deg", 1.0, 360.0),
    "pitch_deg": ("pitch", "deg", 1.0, 0.0),
    "heading_true_deg": ("true heading", "deg", 1.0, 360.0),
    "altitude_msl": ("altitude MSL", "m", 1.0, 0.0),
    "vertical_speed": ("vertical speed", "m/s", 1.0, 0.0),
    "true_airspeed": ("true airspeed", "m/s", 1.0, 0.0),
    "alpha_deg": ("angle of attack", "deg", 1.0, 0.0),
    "beta_deg": ("sideslip", "deg", 1.0, 0.0),
    "angular_velocity.x": ("roll rate", "deg/s", math.degrees(1.0), 0.0),
    "angular_velocity.y": ("pitch rate", "deg/s", math.degrees(1.0), 0.0),
    "angular_velocity.z": ("yaw rate", "deg/s", math.degrees(1.0), 0.0),
    "load_factor_normal": ("normal load factor", "g", 1.0, 0.0),
}
_UNKNOWN = Interval(math.nan, math.nan)
#: How often as long as its memory a block is.
_MEMORIES = 5
#: Times that differ by no more are one instant [s].
_SAME_S = 1e-9
#: Independent stretches that an interval needs.
_FEWEST_BLOCKS = 6


@dataclass
class Matched:
    """One flight on the time axis of the comparison.

    Attributes:
        name: As the tables call it.
        variant: What it is a repetition of; flights of one variant are taken together.
        time: [s] since what the flights are matched by, shape (n,), increasing: each simulated frame once.
            It stands at a reset: the last frame before that and the first one behind it have the same time.
        values: Samples by column of `SIGNALS`, in SI and degrees.
        parts: Segments of `time`: nothing is interpolated between them.
        scores: What the scenario's criteria have measured, by name.
    """

    name: str
    variant: str
    time: np.ndarray
    values: Mapping[str, np.ndarray]
    parts: Sequence[slice]
    scores: Mapping[str, float] = field(default_factory=dict)


class Difference(NamedTuple):
    """How one signal of a flight differs from the reference, over the time both have."""

    signal: str
    unit: str
    mean: float  #: of flight - reference
    interval: Interval  #: of `mean`, 95 %; NaN where the flight is too short for one
    rms: float
    largest: float  #: largest absolute difference
    at: float  #: [s] when that was


def signal_differences(reference: Matched, flight: Matched) -> list[Difference]:
    """Compare every signal that both have, at the times of the reference."""
    out = []
    for column, (name, unit, factor, _) in SIGNALS.items():
        if column not in reference.values or column not in flight.values:
            continue
        time, delta = difference(reference, flight, column)
        if not len(delta):
            continue
        delta = delta * factor
        worst = int(np.argmax(np.abs(delta)))
        out.append(
            Difference(
                name,
                unit,
                float(np.mean(delta)),
                mean_interval(delta),
                float(np.sqrt(np.mean(delta**2))),
                float(abs(delta[worst])),
                float(time[worst]),
            )
        )
    return out


def difference(reference: Matched, flight: Matched, column: str) -> tuple[np.ndarray, np.ndarray]:
    """Give flight - reference of one signal, the short way round where it is an angle.

    Returns:
        Time [s] and difference at the reference's samples, where both are known.
    """
    period = SIGNALS[column][3]
    own = _at(reference.time, flight, column, period)
    delta = own - np.asarray(reference.values[column], dtype=float)
    if period:
        delta = (delta + period / 2.0) % period - period / 2.0
    good = np.isfinite(delta)
    return reference.time[good], delta[good]


def _at(time: np.ndarray, flight: Matched, column: str, period: float) -> np.ndarray:
    out = np.full(len(time), np.nan)
    values = np.asarray(flight.values[column], dtype=float)
    rank, own_rank = _rank(time), _rank(flight.time)
    for part in flight.parts:
        good = np.isfinite(values[part])
        if not good.any():
            continue
        known, samples = flight.time[part][good], values[part][good]
        if period:
            samples = np.unwrap(samples * (2.0 * math.pi / period)) * (period / (2.0 * math.pi))
        # A part that begins with a reset leaves the instant's earlier samples to the parts before it.
        begun = (time > known[0] + _SAME_S) | ((time >= known[0] - _SAME_S) & (rank >= own_rank[part][good][0]))
        inside = begun & (time <= known[-1] + _SAME_S)
        out[inside] = np.interp(time[inside], known, samples)
    return out


def _rank(time: np.ndarray) -> np.ndarray:
    """How many samples of the same instant are before each."""
    number = np.arange(len(time))
    begins = np.append(True, np.diff(time) > _SAME_S)[: len(time)]
    rank: np.ndarray = number - np.maximum.accumulate(np.where(begins, number, 0))
    return rank


def mean_interval(samples: np.ndarray) -> Interval:
    """The 95 % interval of the mean of a signal whose samples follow from each other, by the means of blocks of it.

    A block is five times as long as the lag at which its autocorrelation falls below 1/e. What neighbouring blocks have
    in common still, up to a fifth of the variance, is that of a memory that fades exponentially. NaN where there are
    fewer than six such blocks.
    """
    if len(samples) and np.ptp(samples) == 0.0:
        return Interval(float(samples[0]), float(samples[0]))
    block, step = _memory(samples)
    count = len(samples) // block
    if count < _FEWEST_BLOCKS:
        return _UNKNOWN
    means = samples[: count * block].reshape(count, block).mean(axis=1)
    shared = 2.0 * step * (1.0 - step**block) / (block * (1.0 - step**2))
    variance = float(means.var(ddof=1)) / (count * (1.0 - shared))
    return _student(float(samples.mean()), variance, count - 1)


def _student(mean: float, variance: float, freedom: float) -> Interval:
    """Of 95 %; the variance is that of the mean."""
    from scipy.stats import t

    half = float(t.ppf(0.975, freedom)) * math.sqrt(variance)
    return Interval(mean - half, mean + half)


def _memory(samples: np.ndarray) -> tuple[int, float]:
    """How long a block is, and how much a sample has of the one before."""
    n = len(samples)
    centred = samples - samples.mean() if n else samples
    power = float(centred @ centred) if n else 0.0
    if n < 2 or power == 0.0:
        return max(n, 1), 0.0
    spectrum = np.fft.rfft(centred, 2 * n)
    correlation = np.fft.irfft(spectrum * spectrum.conj())[:n] / power
    below = np.flatnonzero(correlation < 1.0 / math.e)
    step = min(max(float(correlation[1]), 0.0), 1.0 - 1.0 / n)
    return (_MEMORIES * int(below[0]) if len(below) else n), step


class ScoreDifference(NamedTuple):
    """How a criterion's measure differs between two variants."""

    name: str
    reference: float  #: mean of the reference's flights; infinite where one of them never settles
    other: float  #: mean of the other's, likewise
    difference: float  #: infinite or NaN where flights never settle
    interval: Interval  #: of `difference`, 95 % (Welch's); NaN: one flight only, or one that never settles
    never: tuple[int, int] = (0, 0)  #: flights of both that never settle
    flights: tuple[int, int] = (1, 1)


def score_differences(reference: Sequence[Matched], others: Sequence[Matched]) -> list[ScoreDifference]:
    """Compare criteria between the flights of two variants; those that were measured in all flights of both."""
    out = []
    for name in reference[0].scores if reference else ():
        sides = [[flight.scores.get(name, math.nan) for flight in side] for side in (reference, others)]
        if any(not side or np.isnan(side).any() for side in sides):
            continue
        a, b = (float(np.mean(side)) for side in sides)
        never = (int(np.isinf(sides[0]).sum()), int(np.isinf(sides[1]).sum()))
        interval = _UNKNOWN if any(never) else welch(*map(np.asarray, sides))
        out.append(ScoreDifference(name, a, b, b - a, interval, never, (len(sides[0]), len(sides[1]))))
    return out


def welch(a: np.ndarray, b: np.ndarray) -> Interval:
    """The 95 % interval of mean(b) - mean(a) of two samples that need not vary alike; NaN for a single value."""
    if len(a) < 2 or len(b) < 2:
        return _UNKNOWN
    middle = float(np.mean(b) - np.mean(a))
    parts = [float(np.var(side, ddof=1)) / len(side) for side in (a, b)]
    variance = sum(parts)
    if variance == 0.0:
        return Interval(middle, middle)
    freedom = variance**2 / sum(part**2 / (len(side) - 1) for part, side in zip(parts, (a, b)))
    return _student(middle, variance, freedom)
