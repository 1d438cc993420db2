"""Further tests side by side, as long as the machine has processor time to spare.

Node tests wait for simulated time most of theirs. How many of them keep two processors busy depends on the machine and
on what runs beside them; more than that, and some answer later than they should.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import time
from pathlib import Path
from typing import Iterator, Tuple

#: A further test begins when the processors were busy no longer than this share of so long a time [s].
BUSY, LOOK_S = 0.8, 0.5
#: Is locked by the process that looks.
TURN = Path(__file__)
#: A byte of it is locked by each test that runs, up to as many as always run. (Closing a file ends all such locks of
#: the process on it: not that one.)
PLACES = Path(__file__).with_name("scheduling.py")
_STATISTICS = Path("/proc/stat")


def _always() -> int:
    """How many processes always run tests."""
    return len(os.sched_getaffinity(0)) + 1


def is_further(worker: str) -> bool:
    """Whether a process of pytest-xdist comes behind those that always run tests, one more than there are processors.

    Args:
        worker: Its name: "gw0" and so on.
    """
    return int(worker[2:]) >= _always()


@contextlib.contextmanager
def running(worker: str) -> Iterator[None]:
    """Runs a test in the block, which begins when the machine has a place for it.

    On a machine that is busy, however long, so many run side by side as there are processes that do not wait.

    Args:
        worker: Name of the process that runs it.
    """
    with PLACES.open("rb+") as places:
        if is_further(worker):
            _wait(places.fileno())
        else:
            _take_place(places.fileno())
        yield  # the place is free with the end of the file


def _wait(places: int) -> None:
    """Until a place is free or the processors are idle enough for one more test.

    Processes look one after the other, so that each sees what the one before has begun.
    """
    with TURN.open("rb") as turn:
        fcntl.flock(turn, fcntl.LOCK_EX)
        while not _take_place(places) and _busy_share(LOOK_S) > BUSY:
            pass


def _take_place(places: int) -> bool:
    """Whether there was one."""
    for place in range(_always()):
        with contextlib.suppress(BlockingIOError):
            fcntl.lockf(places, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, place)
            return True
    return False


def _busy_share(seconds: float) -> float:
    """Of this process's processors, of so long from now [s]."""
    idle, total = _ticks()
    time.sleep(seconds)
    idle_now, total_now = _ticks()
    return 1.0 - (idle_now - idle) / max(total_now - total, 1)


def _ticks() -> Tuple[int, int]:
    """Idle time and all time of these processors since the start."""
    ours = {f"cpu{number}" for number in os.sched_getaffinity(0)}
    idle = total = 0
    for name, *words in map(str.split, _STATISTICS.read_text(encoding="ascii").splitlines()):
        if name in ours:
            # user, nice, system, idle, waiting for a disk, ... (man 5 proc)
            ticks = [int(word) for word in words[:8]]
            idle, total = idle + ticks[3] + ticks[4], total + sum(ticks)
    return idle, total
