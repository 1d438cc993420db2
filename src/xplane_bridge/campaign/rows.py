"""Flights as rows of a table: what a worker does."""

from __future__ import annotations

import os
import platform
import time
from functools import lru_cache
from typing import Any, Dict, List

from xplane_bridge.campaign.definition import Campaign, FlightPlan, parse_campaign
from xplane_bridge.campaign.distributions import CampaignError, Design
from xplane_bridge.campaign.flight import Flight, FlightResult
from xplane_bridge.campaign.threads import one_thread
from xplane_bridge.in_process.failures import NotFlownError
from xplane_bridge.scenario import ScenarioError

#: Outcomes of flights that did not come about.
REFUSED, ERROR, WORKER_DIED = "refused", "error", "worker died"
#: Columns that begin like this may differ between two runs of one campaign; all others are the same.
VARYING = ("wall_", "host_")

Row = Dict[str, Any]


def fly_rows(document: Dict[str, Any], first: int, count: int) -> List[Row]:
    """Flies the flights `first` to `first + count - 1` of a campaign; what every worker does."""
    one_thread()
    campaign = parse_campaign(document)
    design = campaign.design
    return [_fly_row(campaign, design, flight) for flight in range(first, first + count)]


def _fly_row(campaign: Campaign, design: Design, flight: int) -> Row:
    began = time.perf_counter()
    plan = campaign.plan(flight, design)
    try:
        result = Flight(plan).fly()
    except (CampaignError, NotFlownError, ScenarioError) as error:
        result = FlightResult(REFUSED, str(error))
    except Exception as error:  # a flight that was started is a row, whatever became of it
        result = FlightResult(ERROR, f"{type(error).__name__}: {error}")
    row = make_row(campaign, plan, result)
    row["wall_s"] = time.perf_counter() - began
    return row


def make_row(campaign: Campaign, plan: FlightPlan, result: FlightResult) -> Row:
    """A flight as a row; columns are the same for every flight of a campaign."""
    row: Row = {"flight": plan.flight, "seed": plan.seed}
    row.update({f"parameter_{name}": value for name, value in plan.parameters.items()})
    row.update(outcome=result.outcome, reason=result.reason, passed=result.passed, duration_s=result.duration)
    for name in campaign.criteria:
        row[f"value_{name}"] = result.values.get(name, float("nan"))
        row[f"met_{name}"] = result.met.get(name, False)
    row.update(sha256=result.sha256, wall_s=0.0, host_name=platform.node(), host_cpu=cpu_kind(), host_pid=os.getpid())
    return row


def dead_row(campaign: Campaign, flight: int) -> Row:
    """The row of a flight whose worker died each time."""
    reason = "the process that flew it ended without a word, twice (killed, out of memory, or a crash in compiled code)"
    return make_row(campaign, campaign.plan(flight), FlightResult(WORKER_DIED, reason))


@lru_cache(maxsize=None)
def cpu_kind() -> str:
    """The processor: flights are the same bits on one kind, and the same to 1e-9 on others."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            names = [line.split(":", 1)[1].strip() for line in file if line.startswith("model name")]
    except OSError:
        names = []
    return names[0] if names else platform.machine()
