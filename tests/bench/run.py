"""Runs benchmarks and prints a table; `scripts/bench` starts it. Modules bench_*.py beside it register theirs."""

from __future__ import annotations

import argparse
import importlib
import json
import os
import platform
import sys
import tempfile
import textwrap
import traceback
from dataclasses import asdict
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Tuple

from registry import BENCHMARKS, Context, Measure

from xplane_bridge.cli.entry import guarded

_MARKS = {True: "ok", False: "MISSED", None: ""}


def _json_file(text: str) -> Path:
    """The type of --json: a file that can be replaced, which a device, such as /dev/stdout, must not be."""
    file = Path(text).resolve()
    if file.exists() and not file.is_file():
        raise argparse.ArgumentTypeError(f"{text} is no regular file; name one, or a new one")
    return file


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = argparse.ArgumentParser(
        prog="bench",
        description=(
            "Measures against the budgets of docs/benchmarks.md. Absolute figures are for a quiet machine of two "
            "cores; ratios hold anywhere. Exit code 1: a budget was missed or a benchmark failed."
        ),
    )
    p.add_argument("names", nargs="*", metavar="NAME", help="benchmarks to run (default: all)")
    p.add_argument("--list", action="store_true", help="list them and end")
    p.add_argument("--seconds", type=float, default=20.0, metavar="S", help="length of each measurement (%(default)g)")
    p.add_argument("--json", type=_json_file, metavar="FILE", help="write the results there too, after each benchmark")
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


def _entry(measure: Measure) -> Dict[str, Any]:
    return {**asdict(measure), "value": float(measure.value), "passed": measure.passed}


def _measured(name: str, context: Context) -> Tuple[List[str], List[Dict[str, Any]]]:
    """Runs a benchmark. Returns its rows for the table and for the JSON file."""
    measures = BENCHMARKS[name](context)
    return [_row(measure) for measure in measures], [_entry(measure) for measure in measures]


def _write(report: Dict[str, Any], file: Optional[Path]) -> None:
    """Puts the whole report in the file's place at once, so that it is complete whenever the run ends."""
    if file is None:
        return
    part = file.with_name(f"{file.name}.part")
    part.write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
    part.replace(file)


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
    results: Dict[str, List[Dict[str, Any]]] = {}
    failed: List[str] = []
    report = {"machine": machine, "failed": failed, "results": results}
    try:
        _write(report, args.json)  # an earlier run's results are not taken for this one's
    except OSError as error:
        p.error(f"argument --json: {error}; name a file that can be written")
    with tempfile.TemporaryDirectory(prefix="xplane_bridge_bench_") as folder:
        for name in args.names or list(BENCHMARKS):
            print(f"{name}", flush=True)
            try:
                rows, results[name] = _measured(name, Context(Path(folder) / name, args.seconds))
            except Exception:  # whatever it is: the other benchmarks have nothing to do with it
                failed.append(name)
                rows = ["  failed:", textwrap.indent(traceback.format_exc().rstrip(), "    ")]
            _write(report, args.json)
            print("\n".join(rows), flush=True)
    missed = [f"{name}: {m['name']}" for name, listed in results.items() for m in listed if m["passed"] is False]
    print(f"{len(results)} benchmarks run, {len(failed)} failed, {len(missed)} budgets missed")
    return 1 if failed or missed else 0


if __name__ == "__main__":
    sys.exit(main())
