"""A Dask cluster that runs: its scheduler is reached, and that it has gone is said in a line."""

from __future__ import annotations

import logging
from concurrent.futures import CancelledError
from contextlib import contextmanager
from typing import Any, Iterator

from xplane_bridge.errors import XplaneBridgeError

MISSING = "dask.distributed is not installed (pip install 'dask[distributed]')"


class SchedulerError(XplaneBridgeError):
    """There is no Dask scheduler, or no dask.distributed to reach it with."""


def available() -> bool:
    """Whether dask.distributed is installed."""
    try:
        import distributed  # noqa: F401
    except ImportError:
        return False
    return True


@contextmanager
def connected(address: str) -> Iterator[Any]:
    """A `distributed.Client` of the cluster.

    Raises:
        SchedulerError: dask.distributed is not installed, or nothing answers there.
    """
    if not available():
        raise SchedulerError(f"--scheduler: {MISSING}")
    from distributed import Client

    # Of a scheduler that ends, tracebacks: what the user needs to know is the error's line.
    for logger in ("distributed", "distributed.client", "asyncio"):
        logging.getLogger(logger).setLevel(logging.CRITICAL)
    try:
        client = Client(address, timeout="10s")
    except (OSError, ValueError) as error:
        raise SchedulerError(
            f"no Dask scheduler at {address} ({error}); start one with `dask scheduler`, and workers with `dask worker "
            f"{address} --nthreads 1`"
        ) from None
    with client:
        yield client


@contextmanager
def watched(client: Any) -> Iterator[None]:
    """Says in a line that the scheduler has gone: all that was asked of it is cancelled then.

    Raises:
        SchedulerError: It ended, or cannot be reached any more.
    """
    address = client.scheduler.address
    try:
        yield
    except (CancelledError, OSError):
        raise SchedulerError(
            f"the Dask scheduler at {address} ended, or cannot be reached any more; what is done is kept: start "
            "scheduler and workers, then start the same command again"
        ) from None
