"""linearise_model: the linear model of an aircraft of the emulator."""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import Optional, Sequence

from xplane_bridge.cli.entry import guarded, number, positive
from xplane_bridge.identification.coefficients import geometry_of, read_geometry
from xplane_bridge.identification.files import write_model
from xplane_bridge.identification.model import AxisModel, Estimate, LinearModel

#: Derivatives in a line of the terminal.
_COLUMNS = 3


def parser() -> argparse.ArgumentParser:
    """Build the command line."""
    p = argparse.ArgumentParser(
        prog="linearise_model",
        description="Trims an aircraft of the emulator in level flight, perturbs it and writes its linear model.",
    )
    p.add_argument("aircraft", metavar="AIRCRAFT", help="fixed_wing, or tiltrotor with --speed 70")
    p.add_argument(
        "--speed", type=positive, metavar="M/S",
        help="true airspeed; default: at which it starts, of the tiltrotor a hover, which has no such model",
    )  # fmt: skip
    p.add_argument(
        "--altitude", type=number("a height [m]", -400.0, 15000.0), default=1000.0, metavar="M",
        help="above sea level; default: %(default)s",
    )  # fmt: skip
    p.add_argument(
        "--fuel", type=number("a mass [kg]", 0.0), nargs="+", metavar="KG", help="by tank; default: the aircraft's"
    )
    p.add_argument("--payload", type=number("a mass [kg]", 0.0), metavar="KG", help="default: the aircraft's")
    add_output_arguments(p)
    return p


def add_output_arguments(p: argparse.ArgumentParser) -> None:
    """Add what both programs that write models have."""
    p.add_argument(
        "-o", "--output", action="append", metavar="FILE",
        help="model.yaml, .json or .mat (MATLAB); may be given several times; default: model.yaml",
    )  # fmt: skip
    p.add_argument(
        "--geometry", metavar="FILE",
        help="sizes and inertia, for coefficients; default: config/geometry/<aircraft>.yaml where there is one",
    )  # fmt: skip


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Run the program."""
    args = parser().parse_args(argv)
    from xplane_bridge.identification.linearisation import Condition, linearise

    geometry = read_geometry(Path(args.geometry)) if args.geometry else geometry_of(args.aircraft)
    fuel = None if args.fuel is None else tuple(args.fuel)
    model = linearise(Condition(args.aircraft, args.speed, args.altitude, fuel, args.payload), geometry)
    for text in model.warnings:
        print(f"warning: {text}", file=sys.stderr)
    write_outputs(model, args.output)
    return 0


def write_outputs(model: LinearModel, outputs: Optional[Sequence[str]]) -> None:
    """Write the files and say what they hold."""
    for output in outputs or ["model.yaml"]:
        write_model(model, Path(output))
        print(output)
    for axis in model.axes.values():
        print("\n".join(summary(axis)))


def summary(axis: AxisModel) -> list[str]:
    """Lines about a model, for a terminal."""
    lines = [f"{axis.axis.name}:"]
    for mode in axis.modes:
        value = Estimate(mode.eigenvalue.real, "1/s", mode.interval_real)
        imaginary = f" +- {mode.eigenvalue.imag:.4g}i" if mode.eigenvalue.imag else ""
        interval = f" (95 %: +-{value.interval:.2g})" if value.interval == value.interval else ""
        lines.append(f"  {mode.name:<14}{value.value:9.4g}{imaginary} 1/s, damping {mode.damping:.3g}{interval}")
    found = axis.derivatives.items()
    if any(math.isfinite(entry.interval) for _, entry in found):
        cells = [f"{name:<9}{entry.value:>9.4g}{_width(entry):<13}" for name, entry in found]
        lines += ["  " + "".join(cells[k : k + _COLUMNS]).rstrip() for k in range(0, len(cells), _COLUMNS)]
        if any(entry.unsure for _, entry in found):
            lines.append("  ?: the interval (95 %) is more than half of the value")
    elif found:
        lines.append("  " + ", ".join(f"{name} {entry.value:.4g}" for name, entry in found))
    return lines


def _width(entry: Estimate) -> str:
    if not math.isfinite(entry.interval):
        return ""
    return f" +- {entry.interval:.2g}{' ?' if entry.unsure else ''}"
