"""Punctuality on a busy machine."""

from __future__ import annotations

import contextlib
import gc
import logging
import os
import time
from typing import Iterator

_LOG = logging.getLogger(__name__)

#: Lowest real-time priority: above all normal processes, below everything else that asked for it.
_PRIORITY = 1
#: Of a processor's time a thread may use so much at it; more is borne until it amounts to so long [s].
_SHARE, _PATIENCE_S = 0.8, 0.5
#: Frames between two collections of cyclic garbage, which nothing in a frame should make.
_COLLECT_EVERY = 3600


class RealTimePriority:
    """Makes the thread that creates it, not its children, punctual, for as long as it leaves time to other programs.

    One that wants a processor for itself would keep the programs waiting that it is there for: then it is given back. A
    system that does not grant it is no error.

    Args:
        wanted: Whether to ask for it.
    """

    def __init__(self, wanted: bool) -> None:
        self._held = wanted and _schedule("SCHED_FIFO", _PRIORITY)
        self._looked_at, self._used_s = time.monotonic(), time.thread_time()
        self._too_much_s = 0.0

    def watch(self) -> None:
        """To be called by the thread once a frame."""
        if not self._held:
            return
        now, used_s = time.monotonic(), time.thread_time()
        more_s = (used_s - self._used_s) - _SHARE * (now - self._looked_at)
        self._looked_at, self._used_s = now, used_s
        self._too_much_s = max(0.0, self._too_much_s + more_s)
        if self._too_much_s > _PATIENCE_S:
            self._held = False
            _schedule("SCHED_OTHER", 0)
            _LOG.warning(
                "frames take more than %.0f %% of a processor: real-time priority is given back, so that other "
                "programs run; a lower --fps leaves time to them",
                100.0 * _SHARE,
            )


def _schedule(policy: str, priority: int) -> bool:
    """Whether the system grants it to the calling thread."""
    try:
        os.sched_setscheduler(0, getattr(os, policy) | os.SCHED_RESET_ON_FORK, os.sched_param(priority))
    except (AttributeError, OSError) as error:
        _LOG.debug("no %s: %s", policy, error)
        return False
    return True


@contextlib.contextmanager
def collected_by_hand() -> Iterator[None]:
    """Meanwhile cyclic garbage is collected by `collect_seldom` alone, among what is made meanwhile."""
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
        gc.unfreeze()


def collect_seldom(frame: int) -> None:
    """To be called once a frame, with its number, where nothing waits for it."""
    if frame % _COLLECT_EVERY == 0:
        gc.collect()
