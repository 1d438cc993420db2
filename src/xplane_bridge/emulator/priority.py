"""Punctuality on a busy machine."""

from __future__ import annotations

import logging
import os

_LOG = logging.getLogger(__name__)

#: Lowest real-time priority: above all normal processes, below everything else that asked for it.
_PRIORITY = 1


def take_realtime_priority() -> None:
    """Makes the calling thread, not its children, punctual; a system that does not grant it is no error.

    For threads that use little processor time, so that no other thread is kept waiting.
    """
    try:
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, policy, os.sched_param(_PRIORITY))
    except (AttributeError, OSError) as error:
        _LOG.debug("no real-time priority: %s", error)
