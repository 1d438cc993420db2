"""run_campaign: flies a scenario hundreds of times in process, with parameters drawn anew for each flight."""

from __future__ import annotations

import argparse
import os
import sys
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any, Iterator, List, Optional, Sequence

import pandas as pd
from tqdm import tqdm

from xplane_bridge import dask_scheduler
from xplane_bridge.analysis.intervals import wilson
from xplane_bridge.campaign import cluster, report
from xplane_bridge.campaign.definition import Campaign, load_campaign
from xplane_bridge.campaign.distributions import CampaignError
from xplane_bridge.campaign.flight import Flight
from xplane_bridge.campaign.runner import TABLE, CampaignFolder, in_process
from xplane_bridge.campaign.threads import one_thread
from xplane_bridge.cli.entry import guarded, writing
from xplane_bridge.cli.flights import through_nodes
from xplane_bridge.in_process.view import FlightView

PAGE = "report.html"


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = argparse.ArgumentParser(
        prog="run_campaign",
        description=(
            "Flies a campaign (docs/experiments/campaigns.md) into DIR: table.parquet has a row for each flight, "
            "report.html shows them. What was interrupted, by whatever, goes on where it stopped if started again."
        ),
    )
    p.add_argument("campaign", metavar="CAMPAIGN", nargs="?", type=Path, help="file; none with --refly")
    p.add_argument("-o", "--output", required=True, type=Path, metavar="DIR", help="folder of the campaign's results")
    p.add_argument("--flights", type=int, metavar="N", help="fly so many instead of the file's number")
    p.add_argument("--workers", type=int, metavar="N", help="processes (default: one a processor); 0: fly in this one")
    p.add_argument("--scheduler", metavar="ADDRESS", help="fly on a Dask cluster, e.g. tcp://10.0.0.1:8786")
    p.add_argument(
        "--refly", type=int, metavar="I", help="fly flight I of DIR again, and compare; writes DIR/refly_I.csv"
    )
    p.add_argument(
        "--through-nodes",
        action="store_true",
        help="of --refly: fly it also with emulator and bridge in lock-step, and compare; writes DIR/refly_I/ with the "
        "recording and its report",
    )
    return p


@contextmanager
def executor_of(args: argparse.Namespace) -> Iterator[Any]:
    """Who flies."""
    one_thread()
    if args.scheduler:
        context: Any = cluster.running_cluster(args.scheduler)
    else:
        workers = (os.cpu_count() or 1) if args.workers is None else args.workers
        if workers < 0:
            raise CampaignError(f"--workers: {workers}; expected 0 or more")
        if workers > 0 and not dask_scheduler.available():
            print(f"run_campaign: {dask_scheduler.MISSING}: flying in one process", file=sys.stderr)
            workers = 0
        context = cluster.local_cluster(workers) if workers else nullcontext(in_process)
    with context as executor:
        yield executor


def render(campaign: Campaign, table: pd.DataFrame) -> str:
    """The result in a few lines."""
    lines = []
    for name, column in (("all", "passed"), *((name, f"met_{name}") for name in campaign.criteria)):
        passed = int(table[column].sum())
        low, high = wilson(passed, len(table))
        share = passed / len(table)
        lines.append(f"{name:16} {passed:6} of {len(table)}  {share:7.1%}  (95 %: {low:.1%} .. {high:.1%})")
    outcomes = ", ".join(f"{count} {name}" for name, count in table["outcome"].value_counts().items())
    return "\n".join([*lines, f"outcomes: {outcomes}"])


def refly(folder: CampaignFolder, flight: int, nodes: bool) -> int:
    """Flies one flight again, also through the nodes if asked for; exit code 0: it was the same, to the last bit."""
    campaign, table = folder.load(), folder.table()
    rows = table[table["flight"] == flight]
    if not len(rows):
        raise CampaignError(f"--refly {flight}: {folder.folder} has no such flight; it has {len(table)} of them")
    plan = campaign.plan(flight)
    seen: List[FlightView] = []
    result = Flight(plan, seen.append if nodes else None).fly(trace=True)
    if result.trace is not None:
        path = folder.folder / f"refly_{flight}.csv"
        with writing(
            CampaignError,
            path,
            "--refly writes beside the campaign: copy DIR to where you can write, and give the copy",
        ):
            pd.DataFrame(result.trace).to_csv(path, index=False, float_format="%.9g")
        print(f"flight {flight}: {path}")
    row = rows.iloc[0]
    print(f"outcome {result.outcome} {result.reason}; sha256 {result.sha256 or '(none: it did not begin)'}")
    if (row["outcome"], row["sha256"]) != (result.outcome, result.sha256):
        print(f"not the same flight: the table has outcome {row['outcome']}, sha256 {row['sha256']}, flown on "
              f"{row['host_cpu']}")  # fmt: skip
        return 1
    print("the same flight as in the table, to the last bit")
    if not nodes:
        return 0
    if not seen:
        raise CampaignError(f"--through-nodes: flight {flight} did not begin ({result.reason}); expected one that did")
    output = folder.folder / f"refly_{flight}"
    with writing(CampaignError, output, "the recording goes into a folder of this name"):
        output.mkdir(exist_ok=True)
    return 0 if through_nodes.compare(plan, result, seen, output) else 1


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Runs the program."""
    args = parser().parse_args(argv)
    folder = CampaignFolder(args.output)
    if args.refly is not None:
        given = {"CAMPAIGN": args.campaign, "--flights": args.flights, "--workers": args.workers,
                 "--scheduler": args.scheduler}  # fmt: skip
        for name, value in given.items():
            if value is not None:
                raise CampaignError(f"{name} {value}: not with --refly, which flies what {args.output} holds")
        return refly(folder, args.refly, args.through_nodes)
    if args.through_nodes:
        raise CampaignError("--through-nodes: flies one flight again; expected --refly I with it")
    if args.campaign is None:
        raise CampaignError("CAMPAIGN is missing: expected a file, e.g. config/campaigns/stuck_aileron.yaml")
    campaign = load_campaign(args.campaign, args.flights)
    with executor_of(args) as executor, tqdm(total=campaign.flights, unit="flight", disable=None) as bar:
        table = folder.fly(campaign, executor, bar.update)
    campaign = folder.load()  # as it was flown: the file may name the same parameters in another order
    print(render(campaign, table))
    write_page(folder, campaign, table)
    print(f"{campaign.name}: {len(table)} flights in {args.output / TABLE}, drawn in {args.output / PAGE}")
    return 0


def write_page(folder: CampaignFolder, campaign: Campaign, table: pd.DataFrame) -> None:
    """Draws the campaign; the worst flights are flown again for their traces."""
    design, traces = campaign.design, {}
    for flight in report.flights_to_draw(campaign, table):
        trace = Flight(campaign.plan(flight, design)).fly(trace=True).trace
        if trace is not None:
            traces[flight] = trace
    refly = f"scripts/run_campaign -o {folder.folder} --refly"
    text, path = report.page(campaign, table, traces, refly), folder.folder / PAGE
    with writing(CampaignError, path, f"all flights are in {TABLE}: the same command draws them, and flies none again"):
        path.write_text(text, encoding="utf-8")
