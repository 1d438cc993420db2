"""Latched labels as stretches of time: modes, failures, excitations, link states."""

from __future__ import annotations

from typing import Iterable, NamedTuple, Sequence

import numpy as np

from xplane_bridge.constants import FlightMode, words

_MODES = words(FlightMode)


class Episode(NamedTuple):
    """A stretch of time with a label."""

    start: int  #: [ns]
    end: int  #: [ns]
    label: str


def from_values(time: np.ndarray, labels: Sequence[str], end: int) -> list[Episode]:
    """Join equal neighbours of a latched value into episodes; an empty label is none.

    Args:
        time: int64 [ns] of each message, non-decreasing.
        labels: One a message.
        end: [ns] where the recording ends.
    """
    out: list[Episode] = []
    for k, label in enumerate(labels):
        start = int(time[k])
        stop = int(time[k + 1]) if k + 1 < len(time) else max(end, start)
        if not label:
            continue
        if out and out[-1].label == label and out[-1].end == start:
            out[-1] = out[-1]._replace(end=stop)
        else:
            out.append(Episode(start, stop, label))
    return out


def within(stretches: Iterable[Episode], start: int, end: int) -> list[Episode]:
    """What of them lies in a stretch of time: a latched message is as old as what it says, and the recording is not.

    Args:
        stretches: Of which those outside are left out.
        start: [ns]
        end: [ns]
    """
    cut = [Episode(max(e.start, start), min(e.end, end), e.label) for e in stretches]
    return [e for e in cut if e.end > e.start]


def who_flew(time: np.ndarray, modes: Iterable[int], failsafes: Iterable[bool], end: int) -> list[Episode]:
    """Give the stretches flown by ``manual``, ``auto`` or, while their source was silent, ``failsafe``.

    Args:
        time: int64 [ns] of each message of control/mode, non-decreasing.
        modes: Of each: `constants.FlightMode`.
        failsafes: Of each: whether the failsafe flies.
        end: [ns] where the recording ends.
    """
    labels = ["failsafe" if safe else _MODES.get(int(mode), "") for mode, safe in zip(modes, failsafes)]
    return from_values(time, labels, end)


def from_sets(time: np.ndarray, sets: Sequence[Sequence[str]], end: int) -> list[Episode]:
    """Turn lists of what is active (failures) into one episode for each, from its first to its last message."""
    out: list[Episode] = []
    running: dict[str, int] = {}
    for k, active in enumerate(sets):
        now = int(time[k])
        for label in list(running):
            if label not in active:
                out.append(Episode(running.pop(label), now, label))
        for label in active:
            running.setdefault(label, now)
    out += [Episode(start, max(end, start), label) for label, start in running.items()]
    return sorted(out)
