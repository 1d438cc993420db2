"""compare_flights: what differs between recorded flights, and between how they were made, on one page."""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Set, Tuple

import numpy as np
import yaml

from xplane_bridge.analysis.comparison import SIGNALS, Matched
from xplane_bridge.analysis.frames import frames_of
from xplane_bridge.bags import Bags
from xplane_bridge.bags.columns import ColumnFile
from xplane_bridge.bags.files import bags_in
from xplane_bridge.bags.flight import Flight, read_flight
from xplane_bridge.bags.passport import Passport, read_passports
from xplane_bridge.cli.entry import guarded
from xplane_bridge.cli.flights.split_recordings import joined
from xplane_bridge.errors import XplaneBridgeError, is_number
from xplane_bridge.scenario import ScenarioError, parse_scenario
from xplane_bridge.scenario.judging import judge

_PLAYED = "played.json"


class CompareError(XplaneBridgeError):
    """The flights cannot be compared."""


class Read(NamedTuple):
    """One flight as it was read."""

    path: Path  #: of its first part
    parts: int  #: files of the recording
    variant: str
    flight: Flight
    labels: Dict[str, Set[int]]  #: receive times [ns] at which scenario/label was set in the flight, by its text
    passport: Optional[Passport]
    played: Mapping[str, Any]  #: of the player's log beside the bag; empty: there is none

    @property
    def scenario(self) -> str:
        """Name of the scenario that was played; empty: none, as far as is known."""
        named = self.passport.flight.get("scenario", "") if self.passport else ""
        return str(named or self.played.get("scenario", ""))


def parser() -> argparse.ArgumentParser:
    """Build the command line."""
    p = argparse.ArgumentParser(
        prog="compare_flights",
        description="One self-contained HTML page of what differs between flights (docs/experiments/passport.md).",
    )
    p.add_argument(
        "flights", nargs="+", type=Path, metavar="BAG",
        help="a flight's bag or its split bags, or a folder: each flight below it is a repetition of the same; the "
        "first is the reference",
    )  # fmt: skip
    p.add_argument(
        "--match", choices=("scenario", "time"),
        help="time 0 is when the scenario began, or the first state; default: scenario where all have played the same",
    )  # fmt: skip
    p.add_argument(
        "--event", metavar="TEXT",
        help="time 0 is the first event of the flight, or label of a scenario, that has this text in it",
    )  # fmt: skip
    p.add_argument("-o", "--output", type=Path, default=Path("comparison.html"), metavar="FILE", help="(%(default)s)")
    return p


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the program."""
    from xplane_bridge.plotting import comparison
    from xplane_bridge.plotting.page_file import refuse_recordings, write_page

    args = parser().parse_args(argv)
    if args.match and args.event is not None:
        raise CompareError("--match and --event: give one of them")
    given = paths_of(args.flights)
    refuse_recordings(args.output, (path for paths, _ in given for path in paths))
    try:
        args.output.parent.mkdir(parents=True, exist_ok=True)
        store = ColumnFile(args.output.parent)
        found = [read(paths, variant, store) for paths, variant in given]
    except OSError as error:
        raise CompareError(f"{error.filename or args.output}: {error.strerror}") from None
    if len(found) < 2:
        raise CompareError(f"{found[0].path}: one flight alone; give two or more")
    by = args.match or ("event" if args.event is not None else usual(found))
    zero = {"scenario": "the begin of the scenario", "time": "the first flight state"}.get(
        by, f"the event {args.event!r}"
    )
    names = [
        f"{name} ({each.parts} parts)" if each.parts > 1 else name
        for name, each in zip(short_names([each.path for each in found]), found)
    ]
    flights = [matched(each, name, by, args.event) for each, name in zip(found, names)]
    text = comparison.build(flights, [each.passport for each in found], zero)
    try:
        write_page(args.output, text)
    except OSError as error:
        raise CompareError(f"{args.output}: {error.strerror}") from None
    print(args.output)
    return 0


def paths_of(given: Sequence[Path]) -> List[Tuple[List[Path], str]]:
    """The recordings, each with all its parts, and the variants they belong to.

    Raises:
        BagError: A bag that may be a part of another one's recording cannot be read.
        CompareError: A folder has no bag.
    """
    out: List[Tuple[List[Path], str]] = []
    files = list(dict.fromkeys(path for path in given if not path.is_dir()))
    parts = {path: paths for paths in joined(files) for path in paths}
    for path in given:
        if not path.is_dir():
            if path == parts[path][0]:
                out.append((parts[path], str(path)))
            continue
        bags = bags_in(path, "**/*.bag")
        if not bags:
            raise CompareError(f"{path}: a folder without any .bag file")
        out += [(paths, str(path)) for paths in joined(bags)]
    return out


def short_names(paths: Sequence[Path]) -> List[str]:
    """The paths without what all have in common; "flight.bag" alone identifies no flight."""
    parts = [path.resolve().parts for path in paths]
    common = 0
    while common < min(map(len, parts)) - 1 and len({each[common] for each in parts}) == 1:
        common += 1
    return ["/".join(each[common:]) for each in parts]


def read(paths: Sequence[Path], variant: str, store: Optional[ColumnFile] = None) -> Read:
    """Read one flight from its parts; its columns into `store`, into memory when omitted.

    Raises:
        BagError: The bag cannot be read.
        CompareError: It holds no flight, or what lies beside it is no log of a player.
    """
    path = paths[0]
    with Bags(paths) as bags:
        flight = read_flight(bags, store)
        passports = read_passports(bags)
        labels = labels_set(bags, flight)
    if "state" not in flight.tables:
        raise CompareError(f"{path}: no flight state in it")
    played: Mapping[str, Any] = {}
    beside = path.with_name(_PLAYED)
    if beside.is_file():
        try:
            played = json.loads(beside.read_text(encoding="utf-8"))
        except ValueError as error:
            raise CompareError(f"{beside}: no log of a scenario's player: {error}") from None
        if not _is_log(played):
            raise CompareError(
                f"{beside}: no log of a scenario's player; expected that of run_scenario, or none: move it away"
            )
    passport = passports[-1] if passports else None
    return Read(path, len(paths), variant, flight, labels, passport, played)


def labels_set(bags: Bags, flight: Flight) -> Dict[str, Set[int]]:
    """Receive times [ns] at which scenario/label was set, by its text; none of a text that was set before the flight.

    The label is latched: a recorder begins with the latest one, and rosbag writes it anew to each part.
    """
    times: Dict[str, Set[int]] = {}
    if not {"label", "state"} <= set(flight.tables):
        return times
    table = flight.tables["label"]
    repeated = bags.before_first(table.topic, flight.tables["state"].topic)
    last: Optional[str] = None
    for time, text, may_repeat in zip(table.time.tolist(), map(str, table["data"]), repeated.tolist()):
        of_text = times.setdefault(text, set())
        if not (may_repeat and last in (None, text)):
            of_text.add(time)
        last = text
    return times


def _is_log(played: Any) -> bool:
    """Returns whether it is what a player writes down, as `judge` takes it."""
    if not isinstance(played, dict) or not played.get("begin"):
        return isinstance(played, dict)
    begin, labels = played["begin"], played.get("labels")
    return (
        isinstance(begin, dict)
        and all(is_number(begin.get(name)) for name in ("epoch", "sim_time_unwrapped"))
        and isinstance(labels, dict)
        and all(map(is_number, labels.values()))
        and (not played.get("finished") or is_number(played.get("duration")))
    )


def usual(found: Sequence[Read]) -> str:
    """How flights are matched when nothing else is said."""
    names = {each.scenario for each in found}
    return (
        "scenario"
        if len(names) == 1 and all(each.played.get("begin") for each in found) and "" not in names
        else "time"
    )


def matched(each: Read, name: str, by: str, event: Optional[str]) -> Matched:
    """One flight on the time axis of the comparison: simulated time, each frame once.

    Raises:
        CompareError: What it is matched by is not in it.
    """
    state = each.flight.tables["state"]
    epoch, sim_time = state["epoch"], state["sim_time_unwrapped"]
    elapsed, once = frames_of(epoch, sim_time)
    zero = 0.0
    if by == "scenario":
        begin = each.played.get("begin")
        first = np.empty(0, dtype=int)
        if begin:
            first = np.flatnonzero((epoch == begin["epoch"]) & (sim_time >= begin["sim_time_unwrapped"] - 1e-6))
        if not len(first):
            raise CompareError(
                f"{each.path}: when its scenario began is not known ({_PLAYED} of run_scenario is not beside it); "
                "give --match time or --event TEXT"
            )
        zero = float(elapsed[first[0]])
    elif by == "event":
        zero = float(np.interp(event_time(each, str(event)) - state.stamp[0], state.stamp - state.stamp[0], elapsed))
    values = {column: np.asarray(state[column]) for column in SIGNALS if column in state}
    parts = each.flight.parts
    if not once.all():
        elapsed, values = elapsed[once], {column: samples[once] for column, samples in values.items()}
        kept = np.concatenate(([0], np.cumsum(once)))
        parts = [slice(int(kept[p.start]), int(kept[p.stop])) for p in parts if kept[p.start] < kept[p.stop]]
    return Matched(name, each.variant, elapsed - zero, values, parts, scores_of(each))


def event_time(each: Read, text: str) -> int:
    """[ns] stamp of the flight's first event with `text` in it.

    Raises:
        CompareError: There is none; the text lists what there is.
    """
    times = {said: set(stamps) for said, stamps in each.labels.items()}
    for event in each.flight.events:
        times.setdefault(event.text, set()).add(event.stamp)
    # The list of events is latched: those of earlier flights come with it.
    begin, end = each.flight.start, each.flight.end
    inside = {said: [stamp for stamp in stamps if begin <= stamp <= end] for said, stamps in times.items()}
    fitting = [stamp for said, stamps in inside.items() if text.lower() in said.lower() for stamp in stamps]
    if not fitting:
        outside = any(text.lower() in said.lower() for said in times)
        where = " between its first and its last flight state, only before or after" if outside else ""
        have = "; ".join(said for said, stamps in inside.items() if stamps) or "no event at all"
        raise CompareError(f"{each.path}: no event with {text!r} in it{where}; it has: {have}")
    return min(fitting)


def scores_of(each: Read) -> Dict[str, float]:
    """What the criteria of the played scenario measure; empty where it is not known."""
    text = each.passport.flight.get("text") if each.passport else None
    if not text or not each.played.get("begin"):
        return {}
    try:
        scenario = parse_scenario(yaml.safe_load(text))
        return {s.name: s.value for s in judge(scenario, each.flight, each.played) if not math.isnan(s.value)}
    except (yaml.YAMLError, ScenarioError) as error:
        raise CompareError(f"{each.path}: the scenario in its passport: {error}") from None
