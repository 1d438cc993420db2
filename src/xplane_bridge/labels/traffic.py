"""Other aircraft at the times of pictures: from the states recorded of them, interpolated to each picture's frame.

Times are the simulator's own, by which a picture's frame and the states of other aircraft are matched exactly.
"""

from __future__ import annotations

import math
from itertools import groupby
from typing import Dict, Iterable, Iterator, List, NamedTuple, Optional

import numpy as np

from xplane_bridge.bags import Bags, Table
from xplane_bridge.labels.things import Other
from xplane_bridge.units import EARTH_RADIUS_M

_TRAFFIC = "xplane_bridge/TrafficState"
#: Two states farther apart [s] say nothing of the time between them.
_LONGEST_GAP_S = 2.0
#: Faster than this between two states [m/s], an aircraft was placed anew, not flown.
_FASTEST_MPS = 400.0
#: Taken for how an aircraft speeds up or turns [m/s^2] where the states before and after do not say it.
_ACCELERATION = 10.0
#: From the reference point, which is recorded, to the middle of what is seen [m].
_MIDDLE_SIGMA_M = 1.0


#: Latitude, longitude [deg], altitude [m] of each aircraft of a state, by its number; None: not known.
_Listed = Dict[int, Optional[List[float]]]


class _Places(NamedTuple):
    """Where one aircraft was: rows of time [s], latitude, longitude [deg], altitude [m], without interruption."""

    rows: np.ndarray

    def at(self, time: float) -> Optional[tuple[np.ndarray, float]]:
        """Latitude, longitude, altitude and how well they are known [m]; None where it was placed anew meanwhile."""
        times = self.rows[:, 0]
        after = int(np.clip(np.searchsorted(times, time, side="left"), 1, len(times) - 1))
        before, dt = after - 1, float(times[after] - times[after - 1])
        steps = self._metres(max(before - 1, 0), min(after + 2, len(times)))
        own = before - max(before - 1, 0)
        if float(np.linalg.norm(steps[own])) > _FASTEST_MPS * dt:
            return None
        share = (time - float(times[before])) / dt
        turn = (self.rows[after, 1:] - self.rows[before, 1:]) * share
        turn[1] = _half_turn(float(self.rows[after, 2] - self.rows[before, 2])) * share
        return self.rows[before, 1:] + turn, self._bend(before, steps, own) * dt * dt / 8.0

    def _bend(self, before: int, steps: np.ndarray, own: int) -> float:
        """The largest change of velocity around a step [m/s^2]."""
        spans = np.diff(self.rows[max(before - 1, 0) : before + 3, 0])
        velocities = steps / spans[:, np.newaxis]
        bends = [
            float(np.linalg.norm(velocities[k] - velocities[own])) / (0.5 * (spans[k] + spans[own]))
            for k in (own - 1, own + 1)
            if 0 <= k < len(velocities) and float(np.linalg.norm(velocities[k])) <= _FASTEST_MPS
        ]
        return max(bends, default=_ACCELERATION)

    def _metres(self, begin: int, end: int) -> np.ndarray:
        """North, east, down [m] from each of some places to the next."""
        rows = self.rows[begin:end]
        north = np.radians(np.diff(rows[:, 1])) * EARTH_RADIUS_M
        turn = (np.diff(rows[:, 2]) + 180.0) % 360.0 - 180.0
        east = np.radians(turn) * EARTH_RADIUS_M * np.cos(np.radians(rows[:-1, 1]))
        return np.stack((north, east, -np.diff(rows[:, 3])), axis=1)


class RecordedTraffic:
    """The other aircraft of a flight.

    Args:
        bags: Open.
        span: Diameter of the ball that stands for each [m]; X-Plane does not show their size.

    Raises:
        BagError: The bags cannot be read.
    """

    def __init__(self, bags: Bags, span: float) -> None:
        self._span = span
        self._times: dict[int, np.ndarray] = {}  #: of the states, by epoch; twice where they changed in a pause
        self._numbers: dict[int, list[frozenset[int]]] = {}  #: who was there, at each of these
        self._places: dict[tuple[int, int], list[_Places]] = {}  #: by epoch and number
        topic = bags.topic_of_type(_TRAFFIC)
        #: Whether the bags say anything of other aircraft.
        self.recorded = topic is not None and bags.topics[topic].count > 0
        if topic is not None and self.recorded:
            self._read(bags, topic)

    def at(self, epoch: int, time: float) -> Optional[list[Other]]:
        """The other aircraft at a frame, by their number; None where it is not known which there were, or where.

        Args:
            epoch: Of the frame.
            time: Its simulator time [s].
        """
        times = self._times.get(epoch, np.empty(0))
        after, later = (int(np.searchsorted(times, time, side=side)) for side in ("left", "right"))
        if later - after > 1:
            return None  # one came, went or was placed anew in a pause
        exact = later > after
        before = after if exact else after - 1
        if before < 0 or after >= len(times) or times[after] - times[before] > _LONGEST_GAP_S:
            return None
        there = self._numbers[epoch][before]
        if there != self._numbers[epoch][after]:
            return None  # one came or went
        others = []
        for number in sorted(there):
            found = self._place(epoch, number, time)
            if found is None:
                return None
            place, sigma = found
            latitude, longitude, altitude = place.tolist()
            sigma = math.hypot(_MIDDLE_SIGMA_M, sigma)
            others.append(Other(str(number), latitude, _half_turn(longitude), altitude, sigma, self._span))
        return others

    def _place(self, epoch: int, number: int, time: float) -> Optional[tuple[np.ndarray, float]]:
        for places in self._places.get((epoch, number), []):
            if places.rows[0, 0] <= time <= places.rows[-1, 0]:
                if len(places.rows) == 1:
                    return places.rows[0, 1:], 0.0
                return places.at(time)
        return None

    def _read(self, bags: Bags, topic: str) -> None:
        states = bags.read(topic, ["sim_time", "epoch", "number", "latitude", "longitude", "altitude_msl"])
        epochs, moments = states["epoch"].astype(int), states["sim_time"].astype(float)
        for epoch in sorted(set(epochs.tolist())):
            here = np.nonzero(epochs == epoch)[0]
            rows = here[np.argsort(moments[here], kind="stable")]
            kept: list[tuple[float, _Listed]] = []
            for time, alike in groupby(rows.tolist(), key=moments.__getitem__):
                first, *others = (_listed(states, row) for row in alike)
                kept.append((float(time), first))
                # In a pause, time stands: up to it the first state counts, from it on the last one.
                if any(other != first for other in others):
                    kept.append((float(time), others[-1]))
            self._times[epoch] = np.array([time for time, _ in kept])
            self._numbers[epoch] = [frozenset(listed) for _, listed in kept]
            for number in sorted(frozenset().union(*self._numbers[epoch])):
                runs = _runs([(time, listed.get(number)) for time, listed in kept])
                self._places[epoch, number] = [_Places(np.array(run)) for run in runs]


def _listed(states: Table, row: int) -> _Listed:
    columns = (states[name][row] for name in ("number", "latitude", "longitude", "altitude_msl"))
    places = {int(number): [float(value) for value in place] for number, *place in zip(*columns)}
    return {number: place if all(map(math.isfinite, place)) else None for number, place in places.items()}


def _runs(places: Iterable[tuple[float, Optional[list[float]]]]) -> Iterator[list[list[float]]]:
    """Stretches of time in which an aircraft was there and was not placed anew in a pause."""
    run: list[list[float]] = []
    for time, place in places:
        row = None if place is None else [time, *place]
        if run and row == run[-1]:
            continue  # another one was placed anew
        if run and (row is None or run[-1][0] == time):
            yield run
            run = []
        if row is not None:
            run.append(row)
    if run:
        yield run


def _half_turn(degrees: float) -> float:
    return (degrees + 180.0) % 360.0 - 180.0
