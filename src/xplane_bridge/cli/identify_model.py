"""identify_model: linear models from the manoeuvres of a recorded flight."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Optional, Sequence

from xplane_bridge.bags import Bags
from xplane_bridge.cli.entry import guarded, number
from xplane_bridge.cli.linearise_model import add_output_arguments, write_outputs
from xplane_bridge.identification.coefficients import read_geometry
from xplane_bridge.identification.model import AXES, IdentificationError
from xplane_bridge.plotting.page_file import refuse_recordings, write_page

if TYPE_CHECKING:
    from xplane_bridge.identification.identify import AxisResult


def parser() -> argparse.ArgumentParser:
    """Build the command line."""
    p = argparse.ArgumentParser(
        prog="identify_model",
        description="Identifies linear models from the excitations (inject_excitation) of a recorded flight.",
    )
    p.add_argument("bags", nargs="+", metavar="BAG", help="the flight's bag, its split bags, or a folder of them")
    p.add_argument("--axis", choices=sorted(AXES), help="only this one; default: all that were excited")
    p.add_argument(
        "--aircraft", metavar="NAME",
        help="whose sizes in config/geometry are taken; default: those of the one that the recording names",
    )  # fmt: skip
    p.add_argument(
        "--tail", type=number("a time from 0 to 60 s", 0.0, 60.0), default=2.0, metavar="S",
        help="how long the motion is followed after each excitation; default: %(default)s",
    )  # fmt: skip
    p.add_argument(
        "--validate", metavar="ID",
        help="number of the excitation (excitation/state) kept for validation; of several with number 1: 1.1, 1.2, ...",
    )  # fmt: skip
    p.add_argument("--report", metavar="FILE", help="also write a page (HTML, needs no network)")
    p.add_argument("--accept", action="store_true", help="write the model in spite of what speaks against it")
    add_output_arguments(p)
    return p


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the program."""
    args = parser().parse_args(argv)
    from xplane_bridge.bags.flight import read_flight
    from xplane_bridge.bags.passport import read_passports
    from xplane_bridge.identification.aircraft import named_geometry, recorded_aircraft
    from xplane_bridge.identification.identify import identify
    from xplane_bridge.plotting import identification_page

    geometry = read_geometry(Path(args.geometry)) if args.geometry else None
    if geometry is None and args.aircraft is not None:
        geometry = named_geometry(args.aircraft)
    with Bags(args.bags) as bags:
        for output in filter(None, [args.report, *(args.output or [])]):
            refuse_recordings(Path(output), bags.paths)
        flight = read_flight(bags)
        aircraft = recorded_aircraft(read_passports(bags))
    without = aircraft.why_not if geometry is None else ""
    name = aircraft.name if args.aircraft is None else args.aircraft
    found = identify(flight, args.axis, geometry or aircraft.geometry, name, args.tail, args.validate)
    if without:
        for axis in found.model.axes.values():
            axis.warnings.insert(0, without)
    for text in found.notes + found.model.warnings:
        print(f"warning: {text}", file=sys.stderr)
    if args.report:
        _write_page(identification_page.build(found, flight), Path(args.report))
    if found.refusals and not args.accept:
        there = f" ({args.report} shows what was found)" if args.report else ""
        good = [
            f"--axis {name}{_without_validate(result, args.validate)} writes that axis alone, "
            for name, result in found.results.items()
            if not result.refusals
        ]
        msg = f"no model written: {'; '.join(found.refusals)}; {''.join(good)}--accept writes it all the same{there}"
        raise IdentificationError(msg)
    for text in found.refusals:
        print(f"warning: accepted: {text}", file=sys.stderr)
    write_outputs(found.model, args.output)
    return 0


def _without_validate(result: AxisResult, validate: Optional[str]) -> str:
    """For a hint to identify one axis: --validate is refused there where its excitation does not move that axis."""
    own = [window.excitation.name for window in result.windows + result.validation]
    return "" if validate is None or validate in own else " without --validate"


def _write_page(page: str, path: Path) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_page(path, page)
    except OSError as error:
        msg = f"{path}: {error.strerror or error}"
        raise IdentificationError(msg) from None
    print(path)
