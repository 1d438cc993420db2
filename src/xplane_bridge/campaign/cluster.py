"""Flies a campaign's chunks on Dask: a cluster of this machine's processes, or any that runs."""

from __future__ import annotations

import asyncio
import logging
import os
import tempfile
import threading
import time
from contextlib import contextmanager
from typing import Any, Dict, Iterator, List, Optional, Sequence, Tuple

from xplane_bridge.campaign.definition import Campaign, parse_campaign
from xplane_bridge.campaign.distributions import CampaignError
from xplane_bridge.campaign.fingerprint import CPU, Fingerprint, differences, fingerprint
from xplane_bridge.campaign.rows import Row, dead_row, fly_rows
from xplane_bridge.dask_scheduler import connected, watched

#: How often a task may lose its worker and be flown again.
_SECOND_CHANCES = 1
_FIRST_WORKER_S = 30.0
#: A local cluster without any worker for so long gets new ones: Dask starts a worker that dies again, but on a busy
#: machine gives up one that dies while it starts, and its flights would wait for ever.
_EMPTY_S, _LOOK_S = 30.0, 1.0
#: What Dask runs in each worker of a local cluster as it starts: Ctrl-C in a terminal is for the parent alone. It is no
#: module, which would import all: a first flight could then end its worker before Dask has noted that the worker runs.
_WORKERS_START = """
import signal


def dask_setup(worker):
    signal.signal(signal.SIGINT, signal.SIG_IGN)
"""


class Cluster:
    """An executor of `runner.CampaignFolder.fly`.

    Attributes:
        replacements: How often all workers were replaced until now.
    """

    def __init__(self, client: Any) -> None:
        self.replacements = 0
        self._client = client
        self._address = str(client.scheduler.address)
        self._flies: Optional[Campaign] = None
        self._flies_with: Fingerprint = {}

    def fingerprint(self, campaign: Campaign) -> Fingerprint:
        """What all workers fly with: what is here, but for the kind of CPU, which is the workers'.

        Raises:
            CampaignError: There is no worker, or one that flies with something else.
            SchedulerError: The scheduler has gone.
        """
        with watched(self._client):
            try:
                self._client.wait_for_workers(1, timeout=_FIRST_WORKER_S)
            except asyncio.TimeoutError:
                raise CampaignError(
                    f"the Dask scheduler at {self._address} has no workers; start some with `dask worker "
                    f"{self._address} --nthreads 1`, then start the same command again"
                ) from None
            found = self._client.run(_own_fingerprint, campaign.document, on_error="return")
        wanted = fingerprint(campaign)
        for worker, has in sorted(found.items()):
            if isinstance(has, Exception):
                raise CampaignError(
                    f"worker {worker} cannot fly this campaign ({type(has).__name__}: {has}); install there the "
                    "xplane_bridge, and the controller, that are here, or end it; then start the same command again"
                )
            wanted = {**wanted, CPU: found[min(found)][CPU]}
            _refuse_another(worker, has, wanted)
        self._flies, self._flies_with = campaign, wanted
        return wanted

    def __call__(self, campaign: Campaign, chunks: Sequence[Tuple[int, int]]) -> Iterator[List[Row]]:
        """Flies the chunks in any order.

        A chunk that loses its worker twice is flown once more, alone and flight by flight, so that it is certain which
        flight ends its worker: that one becomes a row too.

        Raises:
            CampaignError: A worker, perhaps one that came later, flies with something else.
            SchedulerError: The scheduler has gone.
        """
        if self._flies != campaign:
            self.fingerprint(campaign)
        with watched(self._client):
            yield from self._fly(campaign, chunks)

    def _fly(self, campaign: Campaign, chunks: Sequence[Tuple[int, int]]) -> Iterator[List[Row]]:
        from distributed import KilledWorker
        from distributed import as_completed as completed

        futures = {self._submit(campaign, *chunk): chunk for chunk in chunks}
        suspects = []
        for future in completed(list(futures)):
            try:
                yield future.result()
            except KilledWorker:
                suspects.append(futures[future])
            future.release()
        for first, count in sorted(suspects):
            rows: List[Row] = []
            for flight in range(first, first + count):
                rows += self._fly_alone(campaign, flight)
            yield rows

    def _fly_alone(self, campaign: Campaign, flight: int) -> List[Row]:
        """Once more where all workers were replaced meanwhile: that takes the worker of a sound flight, too."""
        from distributed import KilledWorker

        for last in (False, True):
            before = self.replacements
            try:
                rows: List[Row] = self._submit(campaign, flight, 1).result()
                return rows
            except KilledWorker:
                if last or self.replacements == before:
                    break
        return [dead_row(campaign, flight)]

    def worker_pids(self) -> List[int]:
        """Process ids of the workers of a local cluster."""
        return sorted(self._client.run(os.getpid).values())

    def _submit(self, campaign: Campaign, first: int, count: int) -> Any:
        return self._client.submit(_fly_chunk, campaign.document, self._flies_with, first, count, pure=False)


def _own_fingerprint(document: Dict[str, Any]) -> Fingerprint:
    """Of a worker, in it."""
    return fingerprint(parse_campaign(document))


def _fly_chunk(document: Dict[str, Any], flies_with: Fingerprint, first: int, count: int) -> List[Row]:
    """What a worker runs; it may have come after all were asked what they fly with."""
    from distributed import get_worker

    worker = str(get_worker().address)
    try:
        _refuse_another(worker, _own_fingerprint(document), flies_with)
        return fly_rows(document, first, count)
    except OSError as error:  # of a file: one that came through would be taken for the scheduler's
        raise CampaignError(f"worker {worker}: {error}; give it that file, or end it") from None


def _refuse_another(worker: str, has: Fingerprint, wanted: Fingerprint) -> None:
    """Raises CampaignError where a worker's flights might be other bits than those of the others."""
    other = differences(has, wanted)
    if other:
        raise CampaignError(
            f"worker {worker} has another {other}, with which the same seed may give other bits; install there what "
            "is here and start it again, or end it; then start the same command again"
        )


@contextmanager
def local_cluster(workers: int) -> Iterator[Cluster]:
    """Processes of this machine, one thread each: two flights in one process would only wait for each other."""
    import dask
    from distributed import Client, LocalCluster

    # What ends a campaign is raised; a scheduler that is ended at work logs, as critical, all that it could not send.
    logging.getLogger("distributed").setLevel(logging.CRITICAL + 1)
    settings = {"distributed.scheduler.allowed-failures": _SECOND_CHANCES, "distributed.worker.memory.terminate": False}
    with tempfile.TemporaryDirectory(prefix="run_campaign_") as scratch, dask.config.set(settings), LocalCluster(
        n_workers=workers,
        threads_per_worker=1,
        processes=True,
        dashboard_address=None,
        host="127.0.0.1",
        local_directory=scratch,
        silence_logs=logging.CRITICAL,
        preload=[_WORKERS_START],
    ) as cluster, Client(cluster) as client:
        over, flies = threading.Event(), Cluster(client)
        arguments = (cluster, workers, over, flies)
        threading.Thread(target=_replenish, args=arguments, name="workers", daemon=True).start()
        try:
            yield flies
        finally:
            over.set()


def _replenish(cluster: Any, workers: int, over: threading.Event, flies: Cluster) -> None:
    """Starts all workers anew where none has been left for a while, which is longer each time: they may be slow."""
    seen, patience_s = time.monotonic(), _EMPTY_S
    while not over.wait(_LOOK_S):
        if cluster.scheduler.workers:
            seen, patience_s = time.monotonic(), _EMPTY_S
        elif time.monotonic() - seen > patience_s:
            flies.replacements += 1
            cluster.scale(0)
            cluster.scale(workers)
            seen, patience_s = time.monotonic(), 2.0 * patience_s


@contextmanager
def running_cluster(address: str) -> Iterator[Cluster]:
    """A Dask cluster whose workers have this package, with its compiled module.

    Raises:
        SchedulerError: Nothing answers there, or dask.distributed is not installed.
    """
    with connected(address) as client:
        yield Cluster(client)
