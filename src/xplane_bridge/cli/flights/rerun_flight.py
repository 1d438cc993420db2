"""rerun_flight: flies a recorded flight again, from its passport, or by the commands that were recorded."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, Dict, Optional, Sequence, Tuple

from xplane_bridge.bags import Bags
from xplane_bridge.bags.passport import Passport, read_passports, shortened
from xplane_bridge.cli import run_scenario
from xplane_bridge.cli.entry import guarded, ros_arguments, writing
from xplane_bridge.cli.flights.recorded_commands import play, read_commands
from xplane_bridge.cli.flights.recorded_poses import play_poses, read_poses
from xplane_bridge.errors import XplaneBridgeError
from xplane_bridge.harness.processes import interrupted_by_signals
from xplane_bridge.topics import NAMESPACE, absolute

_BAG = "flight.bag"


class RerunError(XplaneBridgeError):
    """The flight cannot be flown again."""


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = argparse.ArgumentParser(
        prog="rerun_flight",
        description=(
            "Flies a flight of run_scenario again as its passport says (docs/experiments/passport.md): scenario, "
            "aircraft, seed, options. Exit code as run_scenario's. With --commands or --pose: plays what was recorded."
        ),
    )
    p.add_argument("bag", metavar="BAG", type=Path, help="the recording")
    p.add_argument("--output", type=Path, metavar="DIR", help="where to write (default: rerun_<scenario>)")
    played = p.add_mutually_exclusive_group()
    played.add_argument(
        "--commands",
        action="store_true",
        help="place the aircraft as the recording begins, and play its modes and commands through a running bridge",
    )
    played.add_argument(
        "--pose",
        action="store_true",
        help="move the aircraft of a running bridge along the recorded poses; its flight model stands still meanwhile",
    )
    p.add_argument("--namespace", type=absolute, metavar="NS", help=f"of that bridge ({NAMESPACE})")
    return p


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Runs the program."""
    args = parser().parse_args(ros_arguments(argv))
    into_bridge = args.commands or args.pose
    if args.namespace is not None and not into_bridge:
        raise RerunError(
            f"--namespace {args.namespace}: without --commands or --pose a bridge of its own is started; expected one "
            "of them, which play into a running bridge"
        )
    if into_bridge and args.output is not None:
        raise RerunError(f"--output {args.output}: not with --commands or --pose, which play into a running bridge")
    if into_bridge:
        namespace = (args.namespace or NAMESPACE).rstrip("/")
        with interrupted_by_signals("rerun_flight"):
            if args.commands:
                play(read_commands(args.bag), namespace, _say)
            else:
                play_poses(read_poses(args.bag), namespace, _say)
        return 0
    passport = passport_of(args.bag)
    flight = passport.flight
    if flight.get("program") != "run_scenario":
        raise RerunError(
            f"{args.bag}: its passport does not say how to start it: run_scenario has not flown it; "
            "--commands plays what was recorded"
        )
    output = args.output or Path(f"rerun_{flight['scenario']}")
    if (output / _BAG).resolve() in {path.resolve() for path in Bags(args.bag).paths}:
        raise RerunError(f"--output {output}: the recording itself is there; expected another folder")
    scenario, text = output / "scenario.yaml", str(flight["text"]).encode()
    with writing(RerunError, output, "expected a folder that can be written"):
        if scenario.exists() and scenario.read_bytes() != text:
            raise RerunError(
                f"--output {output}: {scenario} is there with another text than the passport's and is kept; "
                "expected another folder"
            )
        output.mkdir(parents=True, exist_ok=True)
        scenario.write_bytes(text)
    there = _made(output / _BAG)
    status = run_scenario.main([str(scenario), *map(str, flight["options"]), "--output", str(output)])
    if _made(output / _BAG) not in (None, there):
        for line in changes(passport, passport_of(output / _BAG)):
            print(f"made otherwise: {line}")
    return status


def _made(bag: Path) -> Optional[Tuple[int, int]]:
    """By what a recording differs from the one that had its name before; None where there is none."""
    try:
        status = bag.stat()
    except FileNotFoundError:
        return None
    return status.st_ino, status.st_mtime_ns


def _say(text: str) -> None:
    print(text, flush=True)


def passport_of(bag: Path) -> Passport:
    """The last passport of a recording.

    Raises:
        BagError: The bag cannot be read.
        RerunError: It has none.
    """
    with Bags(bag) as bags:
        found = read_passports(bags)
    if not found:
        raise RerunError(f"{bag}: no topic experiment in it, which says how it was made (since version 0.2.0)")
    return found[-1]


def changes(before: Passport, after: Passport) -> Sequence[str]:
    """What differs, a line each; of parameters that are of one start, nothing."""
    sides: Sequence[Dict[str, Any]] = (before.lines(), after.lines())
    own = ("host", "port", "data_port")
    names = [name for name in dict.fromkeys([*sides[0], *sides[1]]) if name not in own]
    texts = [(name, shortened([side.get(name) for side in sides])) for name in names]
    pairs = [(name, *("none" if text is None else text for text in each)) for name, each in texts]
    return [f"{name}: {was} -> {now}" for name, was, now in pairs if was != now]
