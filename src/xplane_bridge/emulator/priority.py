"""Punctuality on a busy machine."""

from __future__ import annotations

import contextlib
import gc
import logging
import os
from typing import Iterator

_LOG = logging.getLogger(__name__)

#: Lowest real-time priority: above all normal processes, below everything else that asked for it.
_PRIORITY = 1
#: Frames between two collections of cyclic garbage, which nothing in a frame should make.
_COLLECT_EVERY = 3600


def take_realtime_priority() -> None:
    """Makes the calling thread, not its children, punctual; a system that does not grant it is no error.

    For threads that use little processor time, so that no other thread is kept waiting.
    """
    try:
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, policy, os.sched_param(_PRIORITY))
    except (AttributeError, OSError) as error:
        _LOG.debug("no real-time priority: %s", error)


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
