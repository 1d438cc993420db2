"""Benchmark of campaigns: what Dask's workers make of the flights that one process flies by itself."""

from __future__ import annotations

import contextlib
import os
import time
from pathlib import Path
from typing import ContextManager, List

from registry import Context, Measure, benchmark

from xplane_bridge.campaign import cluster
from xplane_bridge.campaign.definition import Campaign, load_campaign
from xplane_bridge.campaign.runner import CHUNK, CampaignFolder, Executor, in_process
from xplane_bridge.resources import config_file

_MANY = 10000  # flights of the budget
_FLIGHTS_PER_SECOND = 10  # of a measurement's length


def _flown(flights: int) -> Campaign:
    return load_campaign(config_file("campaigns", "stuck_aileron.yaml"), flights)


def _seconds(flights: int, workers: int, executor: ContextManager[Executor], folder: Path) -> float:
    """Wall time of a flight [s]; the first flights of each process, which read files and import, do not count."""
    with executor as fly:
        CampaignFolder(folder / "before").fly(_flown(min(flights, workers * CHUNK)), fly, lambda _: None)
        began = time.monotonic()
        CampaignFolder(folder / "measured").fly(_flown(flights), fly, lambda _: None)
        return (time.monotonic() - began) / flights


@benchmark
def campaign(context: Context) -> List[Measure]:
    """The shipped campaign, flights of a minute: in one process, and on Dask with a worker for each processor."""
    workers = os.cpu_count() or 1
    flights = max(workers, int(context.seconds * _FLIGHTS_PER_SECOND))
    alone = _seconds(flights, 1, contextlib.nullcontext(in_process), context.folder / "alone")
    together = _seconds(flights, workers, cluster.local_cluster(workers), context.folder / "together")
    return [
        Measure("flights of a minute, one process", 1.0 / alone, "/s"),
        Measure(f"the same on Dask, {workers} workers", 1.0 / together, "/s"),
        Measure("each worker / one process", alone / together / workers, "times", budget=0.85, at_least=True),
        Measure(f"{_MANY} flights at that rate", _MANY * together / 60.0, "min", budget=45.0),
    ]
