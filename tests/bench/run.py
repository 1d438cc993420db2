"""Runs benchmarks and prints a table; `scripts/bench` starts it. Modules bench_*.py beside it register theirs."""

from __future__ import annotations

import argparse
import importlib
import json
import os
import platform
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Dict, List, Optional, Sequence

from registry import BENCHMARKS, Context, Measure

from xplane_bridge.cli.entry import guarded
from xplane_bridge.harness import HarnessError

_MARKS = {True: "ok", False: "MISSED", None: ""}


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = argparse.ArgumentParser(
        prog="bench",
        description=(
            "Measures against the budgets of the design. Absolute figures are for a quiet machine of two cores; "
            "ratios hold anywhere. Exit code 1: a budget was missed or a benchmark failed."
        ),
    )
    p.add_argument("names", nargs="*", metavar="NAME", help="benchmarks to run (default: all)")
    p.add_argument("--list", action="store_true", help="list them and end")
    p.add_argument("--seconds", type=float, default=20.0, metavar="S", help="length of each measurement (%(default)g)")
    p.add_argument("--json", type=Path, metavar="FILE", help="write the results there too")
    return p


def _load() -> None:
    sys.path.append(str(Path(__file__).parents[1]))  # for tests/support
    for path in sorted(Path(__file__).parent.glob("bench_*.py")):
        importlib.import_module(path.stem)


def _row(measure: Measure) -> str:
    bound = ""
    if measure.budget is not None:
        bound = f"{'>=' if measure.at_least else '<='} {measure.budget:g}"
    return f"  {measure.name:44} {measure.value:12.3f} {measure.unit:8} {bound:>10}  {_MARKS[measure.passed]}".rstrip()


def _machine() -> Dict[str, object]:
    return {
        "cores": os.cpu_count(),
        "load": os.getloadavg()[0],
        "machine": platform.machine(),
        "python": sys.version.split()[0],
    }


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Runs the program."""
    p = parser()
    args = p.parse_args(argv)
    _load()
    if args.list:
        for name, function in BENCHMARKS.items():
            print(f"{name:24} {(function.__doc__ or '').splitlines()[0]}")
        return 0
    unknown = [name for name in args.names if name not in BENCHMARKS]
    if unknown:
        p.error(f"no benchmark {', '.join(unknown)}; there are: {', '.join(BENCHMARKS)}")
    machine = _machine()
    print(f"{machine['cores']} cores, load {machine['load']:.1f}")
    results: Dict[str, List[Measure]] = {}
    failed: List[str] = []
    with tempfile.TemporaryDirectory(prefix="xplane_bridge_bench_") as folder:
        for name in args.names or list(BENCHMARKS):
            print(f"{name}", flush=True)
            try:
                results[name] = BENCHMARKS[name](Context(Path(folder) / name, args.seconds))
            except HarnessError as error:
                failed.append(name)
                print(f"  failed: {error}")
                continue
            for measure in results[name]:
                print(_row(measure), flush=True)
    missed = [f"{name}: {m.name}" for name, measures in results.items() for m in measures if m.passed is False]
    if args.json:
        listing = {name: [{**asdict(m), "passed": m.passed} for m in measures] for name, measures in results.items()}
        report = {"machine": machine, "failed": failed, "results": listing}
        args.json.write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
    print(f"{len(results)} benchmarks run, {len(failed)} failed, {len(missed)} budgets missed")
    return 1 if failed or missed else 0


if __name__ == "__main__":
    sys.exit(main())
