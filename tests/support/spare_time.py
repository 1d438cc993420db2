"""Further tests side by side, as long as the machine has processor time to spare.

Node tests wait for simulated time most of theirs. How many of them keep two processors busy depends on the machine and
on what runs beside them; more than that, and some answer later than they should.
"""

from __future__ import annotations

import fcntl
import os
import time
from pathlib import Path
from typing import Tuple

#: A further test begins when the processors were busy no longer than this share of so long a time [s].
BUSY, LOOK_S = 0.8, 0.5
#: On a machine that other work keeps busy all the time, it begins nevertheless [s].
PATIENCE_S = 300.0
#: Is locked by the process that looks.
TURN = Path(__file__)
_STATISTICS = Path("/proc/stat")


def is_further(worker: str) -> bool:
    """Whether a process of pytest-xdist comes behind those that always run tests, one more than there are processors.

    Args:
        worker: Its name: "gw0" and so on.
    """
    return int(worker[2:]) > len(os.sched_getaffinity(0))


def wait_for_spare_time() -> None:
    """Waits until the processors are idle enough for one more test.

    Processes look one after the other, so that each sees what the one before has begun.
    """
    end = time.monotonic() + PATIENCE_S
    with TURN.open("rb") as turn:
        fcntl.flock(turn, fcntl.LOCK_EX)
        while time.monotonic() < end and _busy_share(LOOK_S) > BUSY:
            pass


def _busy_share(seconds: float) -> float:
    """Of all processors, of so long from now [s]."""
    idle, total = _ticks()
    time.sleep(seconds)
    idle_now, total_now = _ticks()
    return 1.0 - (idle_now - idle) / max(total_now - total, 1)


def _ticks() -> Tuple[int, int]:
    """Idle time and all time of all processors since the start."""
    # user, nice, system, idle, waiting for a disk, ... (man 5 proc)
    ticks = [int(word) for word in _STATISTICS.read_text(encoding="ascii").split("\n", 1)[0].split()[1:9]]
    return ticks[3] + ticks[4], sum(ticks)
