"""Scores a flight against the criteria of its scenario."""

from __future__ import annotations

from typing import Mapping, NamedTuple, Sequence

import numpy as np

from xplane_bridge.analysis.criteria import CAMERA, Criterion

#: Variables that wrap at 360 degrees, and the lowest value of each.
_WRAPPING = {"roll": -180.0, "heading": 0.0}
_TURN = 360.0
#: A flight may end this much before a window does: its last state is one of before that moment [s].
_BEFORE_END_S = 0.1
#: Windows are that much wider, so that it does not hang on the last bit of a time whether a sample lies in them [s].
_EDGE_S = 5e-4
#: Share of the samples a measure looks at that must be known: what X-Plane has not sent is unknown.
_LEAST_KNOWN = 0.5
#: What `final` looks at [s].
_FINAL_S = 1.0


class Score(NamedTuple):
    """What one criterion measured."""

    name: str
    measure: str
    value: float  #: NaN when it could not be measured, infinite for a settling that never came
    passed: bool
    text: str  #: bounds, and why it could not be measured


def score(
    criteria: Sequence[Criterion],
    time: np.ndarray,
    values: Mapping[str, np.ndarray],
    labels: Mapping[str, float],
    camera: Mapping[str, float],
) -> list[Score]:
    """Measure every criterion.

    Args:
        criteria: Of the scenario.
        time: Scenario time [s] of each sample, shape (n,), increasing; each a frame of its own (`frames_of`).
        values: Variable to samples, shape (n,), in the units of scenarios; NaN where it is not known.
        labels: Event label to the scenario time [s] at which it first happened.
        camera: ``paired`` and ``perfect`` shares; empty without camera.

    Returns:
        A score each. One that cannot be measured has not passed.
    """
    return [_score(criterion, time, values, labels, camera) for criterion in criteria]


def _score(
    criterion: Criterion,
    time: np.ndarray,
    values: Mapping[str, np.ndarray],
    labels: Mapping[str, float],
    camera: Mapping[str, float],
) -> Score:
    if criterion.measure in CAMERA:
        if criterion.measure not in camera:
            return _unmeasured(criterion, "no images were recorded")
        return _judged(criterion, float(camera[criterion.measure]))
    for label in criterion.labels:
        if label not in labels:
            return _unmeasured(criterion, f"the event {label!r} never happened")
    start = labels[criterion.start] if isinstance(criterion.start, str) else criterion.start
    if criterion.end is None:
        end = float(time[-1]) if len(time) else start
    else:
        end = labels[criterion.end] if isinstance(criterion.end, str) else criterion.end
        ended = float(time[-1]) if len(time) else 0.0
        if end - ended > _tolerance(time):
            return _unmeasured(criterion, f"the flight ended at {ended:g} s, before {end:g} s")
    inside = (time >= start - _EDGE_S) & (time <= end + _EDGE_S)
    window, samples = time[inside], values[criterion.variable][inside]
    known = np.isfinite(samples)
    if np.count_nonzero(known) < 2:
        return _unmeasured(criterion, f"no samples between {start:g} s and {end:g} s")
    problem = _unknown(criterion, window, known)
    if problem:
        return _unmeasured(criterion, problem)
    return _judged(criterion, _measure(criterion, window, samples))


def _unknown(criterion: Criterion, time: np.ndarray, known: np.ndarray) -> str:
    """Why what is known of a window does not do for a measure; empty when it does."""
    moments, tolerance = time[known], _tolerance(time)
    name = criterion.variable
    if criterion.measure == "overshoot" and moments[0] - time[0] > tolerance:
        return f"{name} is known from {moments[0]:g} s; expected it where the window begins, at {time[0]:g} s"
    if criterion.measure in ("settling", "final") and time[-1] - moments[-1] > tolerance:
        return f"{name} is known until {moments[-1]:g} s; expected it where the window ends, at {time[-1]:g} s"
    if criterion.measure == "final":
        last = _last_second(time)
        time, known = time[last], known[last]
    share = float(np.mean(known))
    if share < _LEAST_KNOWN:
        return (
            f"{name} is known in {100.0 * share:.0f} % of the samples between {time[0]:g} s and "
            f"{time[-1]:g} s; expected {100.0 * _LEAST_KNOWN:.0f} % or more"
        )
    return ""


def _tolerance(time: np.ndarray) -> float:
    """How long a variable may be unknown as if it were not [s]."""
    return float(max([_BEFORE_END_S, *(2.0 * np.diff(time[-2:]))]))


def _last_second(time: np.ndarray) -> np.ndarray:
    last: np.ndarray = time >= time[-1] - _FINAL_S - _EDGE_S
    return last


def _measure(criterion: Criterion, time: np.ndarray, values: np.ndarray) -> float:
    """Of a window of which enough is known."""
    error = values - criterion.target
    if criterion.variable in _WRAPPING:
        error = (error + _TURN / 2.0) % _TURN - _TURN / 2.0
    if criterion.measure == "settling":
        return _settling(time, error, criterion.band)
    if criterion.measure == "final":
        time, values = time[_last_second(time)], values[_last_second(time)]
    error, values = error[np.isfinite(error)], values[np.isfinite(values)]
    if criterion.measure == "rms":
        return float(np.sqrt(np.mean(error**2)))
    if criterion.measure == "peak":
        return float(np.abs(error).max())
    if criterion.measure == "overshoot":
        return _overshoot(error, criterion.variable in _WRAPPING)
    if criterion.measure == "final":
        return _mean(criterion.variable, values)
    return float(values.min() if criterion.measure == "minimum" else values.max())


def _overshoot(error: np.ndarray, wraps: bool) -> float:
    """How far it goes beyond the target, seen from the side on which it begins."""
    if wraps:
        error = _continuous(error)
    if error[0] == 0.0:  # on the target: both sides lie beyond it
        return float(np.abs(error).max())
    beyond = -np.sign(error[0]) * error
    if wraps:  # who turns the other way round comes to the target from its other side, and goes beyond it there
        beyond = np.maximum(beyond, -_TURN - beyond)
    return max(0.0, float(beyond.max()))


def _continuous(angles: np.ndarray) -> np.ndarray:
    """Without the jumps by a turn of angles that wrap; the first one stays as it is."""
    turns = np.cumsum(np.round(np.diff(angles) / _TURN))
    return angles - _TURN * np.concatenate(([0.0], turns))


def _settling(time: np.ndarray, error: np.ndarray, band: float) -> float:
    """From when on it stays within the band: where it is not known for a while, it may have left it."""
    known = np.flatnonzero(np.isfinite(error))
    outside = np.flatnonzero(np.abs(error[known]) > band)
    if len(outside) and outside[-1] == len(known) - 1:
        return float("inf")
    begin = int(outside[-1]) + 1 if len(outside) else 0
    gaps = np.flatnonzero((np.diff(known) > 1) & (np.diff(time[known]) > _tolerance(time)))
    if len(gaps):
        begin = max(begin, int(gaps[-1]) + 1)
    seen = time[known[begin]] - time[0]
    return float(seen) if begin or seen > _tolerance(time) else 0.0


def _mean(variable: str, values: np.ndarray) -> float:
    """In the variable's own range, also where the values pass its end."""
    if variable not in _WRAPPING:
        return float(np.mean(values))
    lowest = _WRAPPING[variable]
    return float(lowest + (np.mean(_continuous(values)) - lowest) % _TURN)


def _judged(criterion: Criterion, value: float) -> Score:
    above = criterion.above is None or value > criterion.above
    below = criterion.below is None or value < criterion.below
    return Score(criterion.name, criterion.measure, value, above and below, _bounds(criterion))


def _unmeasured(criterion: Criterion, why: str) -> Score:
    return Score(criterion.name, criterion.measure, float("nan"), False, f"{_bounds(criterion)}; {why}")


def _bounds(criterion: Criterion) -> str:
    texts = []
    if criterion.above is not None:
        texts.append(f"above {criterion.above:g}")
    if criterion.below is not None:
        texts.append(f"below {criterion.below:g}")
    return ", ".join(texts)
