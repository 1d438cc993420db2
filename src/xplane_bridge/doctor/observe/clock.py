"""Watches the system's clock: does it step, is it synchronised."""

from __future__ import annotations

import contextlib
import ctypes
import sys
import threading
import time
from dataclasses import dataclass
from typing import Callable, Optional

_PERIOD_S = 0.05
#: Between both clocks' readings no more than this may pass, or the process was interrupted between them.
_PRECISE_NS = 200_000
#: Return value of adjtimex(): nothing synchronises the clock.
_TIME_ERROR = 5


@dataclass(frozen=True)
class ClockWatch:
    """What was seen.

    Attributes:
        step_s: The largest step of the system's clock against the steady one [s], forward positive.
        watched_s: How long it was watched [s].
        synchronised: Whether something (chrony, ntpd) keeps the clock right; None where the system does not say.
    """

    step_s: float = 0.0
    watched_s: float = 0.0
    synchronised: Optional[bool] = None


class ClockWatcher:
    """Watches from ``with`` to its end; `result` is valid afterwards.

    Args:
        system_ns: The system's clock [ns].
        steady_ns: The one that never steps [ns].
    """

    def __init__(
        self, system_ns: Callable[[], int] = time.time_ns, steady_ns: Callable[[], int] = time.monotonic_ns
    ) -> None:
        self._system_ns = system_ns
        self._steady_ns = steady_ns
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._step_ns = 0
        self._last_ns: Optional[int] = None
        self.result = ClockWatch()

    def __enter__(self) -> ClockWatcher:
        self._begin_ns = self._steady_ns()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join()
        self.look()
        watched_s = (self._steady_ns() - self._begin_ns) * 1e-9
        self.result = ClockWatch(self._step_ns * 1e-9, watched_s, is_synchronised())

    def look(self) -> None:
        """Compares the clocks once."""
        before = self._steady_ns()
        system = self._system_ns()
        after = self._steady_ns()
        if after - before > _PRECISE_NS:
            return
        difference = system - before
        if self._last_ns is not None and abs(difference - self._last_ns) > abs(self._step_ns):
            self._step_ns = difference - self._last_ns
        self._last_ns = difference

    def _run(self) -> None:
        while not self._end.is_set():
            self.look()
            self._end.wait(_PERIOD_S)


def is_synchronised() -> Optional[bool]:
    """Whether the system's clock is kept right by something; None where the system does not say."""
    if not sys.platform.startswith("linux"):
        return None
    with contextlib.suppress(OSError, AttributeError):
        state = ctypes.create_string_buffer(512)  # struct timex, larger than on any machine; all zero: only asks
        answer = ctypes.CDLL(None).adjtimex(state)
        return None if answer < 0 else answer != _TIME_ERROR
    return None
