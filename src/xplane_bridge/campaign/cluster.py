"""Flies a campaign's chunks on Dask: a cluster of this machine's processes, or any that runs."""

from __future__ import annotations

import logging
import os
import tempfile
from contextlib import contextmanager
from typing import Any, Iterator, List, Sequence, Tuple

from xplane_bridge.campaign.definition import Campaign
from xplane_bridge.campaign.distributions import CampaignError
from xplane_bridge.campaign.rows import Row, dead_row, fly_rows

#: How often a task may lose its worker and be flown again.
_SECOND_CHANCES = 1


def available() -> bool:
    """Whether dask.distributed is installed."""
    try:
        import distributed  # noqa: F401
    except ImportError:
        return False
    return True


class Cluster:
    """An executor of `runner.CampaignFolder.fly`."""

    def __init__(self, client: Any) -> None:
        self._client = client

    def __call__(self, campaign: Campaign, chunks: Sequence[Tuple[int, int]]) -> Iterator[List[Row]]:
        """Flies the chunks in any order.

        A chunk that loses its worker twice is flown once more, alone and flight by flight, so that it is certain which
        flight ends its worker: that one becomes a row too.
        """
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
                try:
                    rows += self._submit(campaign, flight, 1).result()
                except KilledWorker:
                    rows.append(dead_row(campaign, flight))
            yield rows

    def worker_pids(self) -> List[int]:
        """Process ids of the workers of a local cluster."""
        return sorted(self._client.run(os.getpid).values())

    def _submit(self, campaign: Campaign, first: int, count: int) -> Any:
        return self._client.submit(fly_rows, campaign.document, first, count, pure=False)


@contextmanager
def local_cluster(workers: int) -> Iterator[Cluster]:
    """Processes of this machine, one thread each: two flights in one process would only wait for each other."""
    import dask
    from distributed import Client, LocalCluster

    logging.getLogger("distributed").setLevel(logging.ERROR)
    settings = {"distributed.scheduler.allowed-failures": _SECOND_CHANCES, "distributed.worker.memory.terminate": False}
    with tempfile.TemporaryDirectory(prefix="run_campaign_") as scratch, dask.config.set(settings), LocalCluster(
        n_workers=workers,
        threads_per_worker=1,
        processes=True,
        dashboard_address=None,
        host="127.0.0.1",
        local_directory=scratch,
        silence_logs=logging.CRITICAL,
    ) as cluster, Client(cluster) as client:
        yield Cluster(client)


@contextmanager
def running_cluster(address: str) -> Iterator[Cluster]:
    """A Dask cluster whose workers have this package, with its compiled module.

    Raises:
        CampaignError: Nothing answers there.
    """
    from distributed import Client

    try:
        client = Client(address, timeout="10s")
    except (OSError, ValueError) as error:
        raise CampaignError(
            f"no Dask scheduler at {address} ({error}); start one with `dask scheduler` and workers with `dask worker "
            "--nthreads 1`"
        ) from None
    with client:
        yield Cluster(client)
