"""Recordings over a clock that goes back, or over a restart of rx_node: time and epochs are made to go on.

With `publish_clock` a stamp is X-Plane's running time, which begins anew with X-Plane. Stamps of two flights would lie
among each other, and so would receive times of a recorder that goes by the simulator's time. Both are moved as they are
read, so that whatever sorts or joins by them has one time that only goes on.

A host's clock that is set back does the same within one flight. It was that clock where stamps or receive times of
flight states fall, in the order in which they were recorded, while simulated time and the count of frames go on: behind
a restart of X-Plane both begin anew. Where these also fall within a second, states lie in the order of their receive
times (`rosbag compress`), those from before and behind the step among each other: nothing is moved.

Time goes on by the simulated time between the two states. A recorder's times fall at once and rx_node's stamps up to a
second later, each is moved from there on; stamps of nodes that follow the clock sooner or later than rx_node are off by
the step for that second. A step of less than half a second that the recorder's clock did not make, because it is
another computer's, is not looked for: that takes a pass over every recording.

An rx_node counts its epochs from 0. Where it was started anew in a recording, those that it counts are raised as they
are read, so that an epoch and a simulator time are of one frame.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, Dict, Iterable, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from xplane_bridge.bags.chunks import BagFile
from xplane_bridge.bags.once import warn_once
from xplane_bridge.bags.segments import DEFAULT_MAX_GAP, rounding

#: Where frames do not go on, by less only messages that overtook each other go back: they are sorted.
_FALL_NS = 10**9
#: Stamps that are so close to the time of receipt are left as they are unless that was moved.
_NEAR_NS = _FALL_NS // 2
#: Between what was received before and after a restart, where the recorder's clock does not say how long it took.
_PAUSE_NS = 10**9
#: Around a clock's step or a restart, in which nothing else may fall.
_AROUND_NS = 10**9
#: Between the last state in a file and the first one in the next of the same recording: of simulated time, and frames.
_NEXT_FILE_S, _NEXT_FILE_FRAMES = 2.0, 1000
#: Without states for longer, rx_node may have been started anew.
_INTERRUPTED_NS = round(DEFAULT_MAX_GAP * 1e9)
#: What `States` are made of beside the time of receipt, in their order; simulated time as received, since the unwrapped
#: one may go back by a rounding error where the epoch is raised.
STATE_COLUMNS = {
    "header.stamp": np.int64,
    "epoch": np.uint32,
    "sim_time": np.float64,
    "frame_count": np.uint32,
}
#: Why stamps go back.
_RESTARTED = "stamps go back where X-Plane was restarted; what was recorded behind that is read with stamps %s s later"
_SET_BACK = (
    "the host's clock was set back in flight; what was recorded behind that is read with stamps %s s later; let the "
    "clock be slewed, not stepped, while flights are recorded"
)


class States(NamedTuple):
    """What shows a restart or a clock set back, of flight states as recorded; each of shape (n,)."""

    time: np.ndarray  #: int64 [ns] of receipt
    stamp: np.ndarray  #: int64 [ns]
    epoch: np.ndarray
    sim_time: np.ndarray  #: [s]
    frame: np.ndarray  #: their number since the link came up

    @classmethod
    def of(cls, pieces: Iterable[Tuple[np.ndarray, Mapping[str, np.ndarray]]]) -> States:
        """Joins receive times and `STATE_COLUMNS`; what old definitions lack is 0."""
        rows = [[np.empty(0, np.int64), *(np.empty(0, kind) for kind in STATE_COLUMNS.values())]]
        for time, found in pieces:
            rows.append(
                [
                    time,
                    *(found.get(name, np.zeros(len(time), kind)) for name, kind in STATE_COLUMNS.items()),
                ]
            )
        return cls(*(np.concatenate(columns) for columns in zip(*rows)))

    def rows(self, rows: np.ndarray) -> States:
        """Give some, in this order."""
        return States(*(column[rows] for column in self))

    def raised(self) -> np.ndarray:
        """Give for each but the first whether its epoch is higher than that of the one before."""
        raised: np.ndarray = self.epoch[1:] > self.epoch[:-1]
        return raised

    def counted_anew(self) -> np.ndarray:
        """Give for each but the first whether rx_node was started anew before it, and counts epochs from 0 again."""
        anew: np.ndarray = (~self.goes_on() | (self.epoch[1:] < self.epoch[:-1])) & ~self.raised()
        return anew

    def goes_on(self) -> np.ndarray:
        """Give for each but the first whether X-Plane and rx_node went on from the one before it."""
        fallen: np.ndarray = (self.sim_time[1:] < self.sim_time[:-1]) | (self.frame[1:] < self.frame[:-1])
        return ~fallen

    def in_order(self) -> np.ndarray:
        """Give for each but the first whether around it, itself left out, X-Plane and rx_node went on."""
        elapsed = np.cumsum(np.maximum(np.diff(self.time, prepend=self.time[:1]), 0))
        fallen = np.cumsum(np.append(0, ~self.goes_on()))
        row = np.arange(1, len(elapsed))  # two before and two behind it in any case
        first = np.minimum(np.searchsorted(elapsed, elapsed[:-1] - _AROUND_NS), np.maximum(row - 2, 0))
        end = np.searchsorted(elapsed, elapsed[1:] + _AROUND_NS, side="right")
        last = np.maximum(end - 1, np.minimum(row + 1, len(row)))
        alone: np.ndarray = fallen[last] - fallen[first] == np.diff(fallen)
        return alone

    def set_back(self, time: np.ndarray) -> np.ndarray:
        """Give the rows at which the host's clock, read at these times [ns], was set back."""
        fell = np.diff(time) < -1e9 * rounding(self.sim_time[1:])
        return np.flatnonzero(fell & self.goes_on() & self.in_order()) + 1

    def began_anew(self) -> np.ndarray:
        """Give the rows at which stamps begin anew with X-Plane."""
        rows = falls(self.stamp)
        begin: np.ndarray = rows[(~self.goes_on() & self.in_order())[rows - 1]]
        return begin

    def in_next_file(self) -> np.ndarray:
        """Give for each but the first whether it can follow the one before it in the next file of a recording."""
        passed, frames = np.diff(self.sim_time), np.diff(self.frame.astype(np.int64))
        follows: np.ndarray = (passed < _NEXT_FILE_S) & (frames < _NEXT_FILE_FRAMES)
        return follows

    def simulated(self, rows: np.ndarray) -> np.ndarray:
        """Give the simulated time [ns] since the state before each of these rows."""
        passed: np.ndarray = np.rint((self.sim_time[rows] - self.sim_time[rows - 1]) * 1e9).astype(np.int64)
        return passed


class _Found(NamedTuple):
    """From when on [ns, receipt] what is behind restarts differs, and by how much: one more of these than of times."""

    since: np.ndarray
    by: np.ndarray

    def at(self, time: np.ndarray) -> np.ndarray:
        found: np.ndarray = self.by[np.searchsorted(self.since, time)]
        return found


class Restarts:
    """Makes the receive times, stamps and epochs of a flight's messages go on.

    Args:
        path: A bag of the flight, for the warnings.
        connections: Gives those of the flight state: file, number of the connection.
        states: Gives the states of one, in the order of the file.
    """

    def __init__(
        self,
        path: Path,
        connections: Callable[[], Sequence[Tuple[BagFile, int]]],
        states: Callable[[BagFile, int], States],
    ) -> None:
        self._path = path
        self._connections = connections
        self._states = states
        self._found: Optional[Tuple[_Found, _Found]] = None
        self._interrupted: Optional[bool] = None
        self._moved = False

    def let_receive_times_go_on(self, files: Sequence[BagFile]) -> None:
        """Move the receive times of all messages that were recorded after the recorder's clock went back.

        It did where those of the flight states go back, in the order in which they were written, and frames go on, or
        their epoch is raised or, in one file, counted anew: receive times of files in disorder go back, too. So frames
        that go on in another file must be the next ones.

        Args:
            files: In the order in which they were recorded.
        """
        connections = self._connections()
        if not connections:
            return
        numbers, places, times = [], [], []
        for file, id_ in connections:
            places.append(file.places(id_))
            times.append(file.times(id_))
            numbers.append(np.full(len(times[-1]), files.index(file)))
        number, place, time = (np.concatenate(columns) for columns in (numbers, places, times))
        order = np.lexsort((place, number))
        number, place, time = number[order], place[order], time[order]
        if (np.diff(time) >= 0).all():
            return
        states = self._recorded().rows(order)
        set_back, fallen, same = states.set_back(time), falls(time), np.diff(number) == 0
        set_back = set_back[(same | states.in_next_file())[set_back - 1]]
        restarted = states.raised() | (states.counted_anew() & same)
        passed = dict.fromkeys(fallen[restarted[fallen - 1]].tolist(), _PAUSE_NS)
        passed.update(zip(set_back.tolist(), states.simulated(set_back).tolist()))
        for k in sorted(passed, reverse=True):  # from the last: each moves all that follows
            first = place[k - 1] if number[k - 1] == number[k] else -1
            step = int(time[k - 1] - time[k]) + passed[k]
            files[number[k]].move(int(first), int(place[k]), int(time[k - 1] // 2 + time[k] // 2), step)
            for file in files[number[k] + 1 :]:
                file.move(-1, -1, 0, step)
        self._moved = bool(passed)

    def columns(self, time: np.ndarray, found: Dict[str, np.ndarray]) -> Dict[str, np.ndarray]:
        """Give columns of messages received at these times [ns]; the stamps of headers are moved where they must be."""
        names = [name for name in found if name == "header.stamp" or name.endswith(".header.stamp")]
        if not self._moved and all((np.abs(time - found[name]) < _NEAR_NS).all() for name in names):
            return found
        by = self._read()[0].at(time)
        return {**found, **{name: np.where(found[name] == 0, 0, found[name] + by) for name in names}}

    def epochs(self, time: np.ndarray, found: Dict[str, np.ndarray]) -> Dict[str, np.ndarray]:
        """Give columns of rx_node's messages, or of what holds its states; epochs are counted on over its restarts."""
        names = [name for name in found if name == "epoch" or name.endswith(".epoch")]
        if not names or not self._is_interrupted():
            return found
        by = self._read()[1].at(time)
        return {**found, **{name: (found[name] + by).astype(found[name].dtype) for name in names}}

    def _is_interrupted(self) -> bool:
        """Whether rx_node can have been started anew: states are missing. By the index, which is read anyway."""
        if self._interrupted is None:
            times = [file.times(id_) for file, id_ in self._connections()]
            received = np.sort(np.concatenate([np.empty(0, np.int64), *times]))
            self._interrupted = bool((np.diff(received) > _INTERRUPTED_NS).any())
        return self._interrupted

    def message(self, time: int, message: Any) -> None:
        """Move the stamp of one message's header."""
        stamp = getattr(getattr(message, "header", None), "stamp", None)
        if stamp is not None:
            recorded = {"header.stamp": np.array([stamp.sec * 1_000_000_000 + stamp.nanosec])}
            (moved,) = self.columns(np.array([time]), recorded)["header.stamp"].tolist()
            stamp.sec, stamp.nanosec = divmod(moved, 1_000_000_000)

    def _read(self) -> Tuple[_Found, _Found]:
        """Find by how much stamps [ns] and epochs behind restarts are raised."""
        if self._found is None:
            states = self._recorded()
            states = states.rows(np.argsort(states.time, kind="stable"))
            stamps = self._stamps(states)
            self._found = stamps, _epochs(states._replace(stamp=states.stamp + stamps.at(states.time)))
        return self._found

    def _recorded(self) -> States:
        """All states, connection by connection."""
        read = [self._states(file, id_) for file, id_ in self._connections()]
        return States(*(np.concatenate(columns) for columns in zip(States.of(()), *read)))

    def _stamps(self, states: States) -> _Found:
        time, stamp = states.time, states.stamp
        set_back = states.set_back(stamp)
        new = np.union1d(states.began_anew(), set_back)
        by_clock = np.isin(new, set_back)
        received = time[new] - time[new - 1]
        passed = np.where(by_clock, states.simulated(new), received)
        by = np.append(0, np.cumsum(stamp[new - 1] - stamp[new] + passed))
        for why, rows in ((_RESTARTED, ~by_clock), (_SET_BACK, by_clock)):
            if rows.any():
                seconds = ", ".join(f"{each:.3f}" for each in (by[1:][rows] / 1e9).tolist())
                warn_once(f"{self._path}: {why % seconds}")
        return _Found(time[new - 1] + received // 2, by)


def _epochs(states: States) -> _Found:
    """Find where rx_node was started anew; where stamps lie among each other the host's clock was set back instead."""
    time, stamp = states.time, states.stamp
    behind = np.maximum.accumulate(stamp)[:-1] < np.minimum.accumulate(stamp[::-1])[::-1][1:]
    passed = np.diff(time)
    new = np.flatnonzero(states.counted_anew() & (passed > _INTERRUPTED_NS) & behind) + 1
    counted = [int(run.max()) + 1 for run in np.split(states.epoch, new)[:-1]]
    return _Found(time[new - 1] + passed[new - 1] // 2, np.cumsum([0, *counted]))


def falls(time: np.ndarray) -> np.ndarray:
    """Give the rows at which a clock begins anew; two values before and two behind must say so."""
    if len(time) < 4:
        return np.empty(0, dtype=int)
    before, behind = np.minimum(time[:-3], time[1:-2]), np.maximum(time[2:-1], time[3:])
    return np.flatnonzero(behind < before - _FALL_NS) + 2
