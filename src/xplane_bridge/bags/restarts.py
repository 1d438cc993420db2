"""Recordings over a restart of X-Plane whose stamps are simulator time, so that they go back: time is made to go on.

With `publish_clock` a stamp is X-Plane's running time, which begins anew with X-Plane. Stamps of two flights would lie
among each other, and so would receive times of a recorder that goes by the simulator's time. Both are moved as they are
read, so that whatever sorts or joins by them has one time that only goes on.
"""

from __future__ import annotations

import functools
import logging
from pathlib import Path
from typing import Any, Callable, Dict, Iterable, Optional, Sequence, Tuple

import numpy as np

from xplane_bridge.bags.chunks import BagFile

_LOG = logging.getLogger(__name__)
#: A clock that goes back by less was set, or messages overtook each other: they are sorted.
_FALL_NS = 10**9
#: Stamps that are so close to the time of receipt cannot have gone back unless that did.
_NEAR_NS = _FALL_NS // 2
#: Between what was received before and after a restart, where the recorder's clock does not say how long it took.
_PAUSE_NS = 10**9


class Restarts:
    """Makes the stamps of a flight's messages go on as their receive times do.

    Args:
        path: A bag of the flight, for the warning.
        states: Gives receive times and stamps of the flight states, in pieces; asked when stamps are not host time.
    """

    def __init__(self, path: Path, states: Callable[[], Iterable[Tuple[np.ndarray, np.ndarray]]]) -> None:
        self._path = path
        self._states = states
        self._since: Optional[np.ndarray] = None
        self._by = np.zeros(1, np.int64)

    def columns(self, time: np.ndarray, found: Dict[str, np.ndarray]) -> Dict[str, np.ndarray]:
        """Give columns of messages received at these times [ns]; the stamps of headers are moved where they must be."""
        names = [name for name in found if name == "header.stamp" or name.endswith(".header.stamp")]
        if all((np.abs(time - found[name]) < _NEAR_NS).all() for name in names):
            return found
        if self._since is None:
            self._since = self._read()
        by = self._by[np.searchsorted(self._since, time)]
        return {**found, **{name: np.where(found[name] == 0, 0, found[name] + by) for name in names}}

    def message(self, time: int, message: Any) -> None:
        """Move the stamp of one message's header."""
        stamp = getattr(getattr(message, "header", None), "stamp", None)
        if stamp is not None:
            recorded = {"header.stamp": np.array([stamp.sec * 1_000_000_000 + stamp.nanosec])}
            (moved,) = self.columns(np.array([time]), recorded)["header.stamp"].tolist()
            stamp.sec, stamp.nanosec = divmod(moved, 1_000_000_000)

    def _read(self) -> np.ndarray:
        """Find the receive times [ns] behind which messages are of the flight after a restart."""
        pieces = [(np.empty(0, np.int64), np.empty(0, np.int64)), *self._states()]
        time, stamp = (np.concatenate(columns) for columns in zip(*pieces))
        order = np.argsort(time, kind="stable")
        time, stamp = time[order], stamp[order]
        new = falls(stamp)
        passed = time[new] - time[new - 1]
        self._by = np.concatenate([self._by, np.cumsum(stamp[new - 1] - stamp[new] + passed)])
        if len(new):
            _say(self._path, tuple((self._by[1:] / 1e9).tolist()))
        since: np.ndarray = time[new - 1] + passed // 2
        return since


@functools.lru_cache(maxsize=None)
def _say(path: Path, by: Tuple[float, ...]) -> None:
    """Once for a flight, on stderr unless the program has set up logging."""
    _LOG.warning(
        "%s: stamps go back where X-Plane was restarted; what was recorded behind that is read with stamps %s s later",
        path,
        ", ".join(f"{seconds:.3f}" for seconds in by),
    )


def falls(time: np.ndarray) -> np.ndarray:
    """Give the rows at which a clock begins anew; two values before and two behind must say so."""
    if len(time) < 4:
        return np.empty(0, dtype=int)
    before, behind = np.minimum(time[:-3], time[1:-2]), np.maximum(time[2:-1], time[3:])
    return np.flatnonzero(behind < before - _FALL_NS) + 2


def let_receive_times_go_on(
    states: Sequence[Tuple[BagFile, int]], epochs: Callable[[BagFile, int], np.ndarray], files: Sequence[BagFile]
) -> None:
    """Move the receive times of all messages that were recorded after the recorder's clock went back.

    It did where those of the flight states go back, in the order in which they were written, and their epoch is raised:
    receive times of files in disorder go back, too.

    Args:
        states: The connections of the flight state: file, number of the connection.
        epochs: Gives the epochs of one, in the order of its receive times.
        files: In the order in which they were recorded.
    """
    numbers, places, times = [], [], []
    for file, id_ in states:
        places.append(file.places(id_))
        times.append(file.times(id_))
        numbers.append(np.full(len(times[-1]), files.index(file)))
    number, place, time = (np.concatenate(columns) for columns in (numbers, places, times))
    order = np.lexsort((place, number))
    number, place, time = number[order], place[order], time[order]
    new = falls(time)
    if not len(new):
        return
    epoch = np.concatenate([epochs(file, id_) for file, id_ in states]).astype(np.int64)[order]
    for k in new[epoch[new] > epoch[new - 1]][::-1].tolist():  # from the last: each moves all that follows
        first = place[k - 1] if number[k - 1] == number[k] else -1
        step = int(time[k - 1] - time[k]) + _PAUSE_NS
        files[number[k]].move(int(first), int(place[k]), int(time[k - 1] // 2 + time[k] // 2), step)
        for file in files[number[k] + 1 :]:
            file.move(-1, -1, 0, step)
