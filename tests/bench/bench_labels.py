"""White lines beside the emulator's runway, against where the labels of a recorded approach say they are."""

from __future__ import annotations

from pathlib import Path
from typing import List

from registry import Context, Measure, benchmark

from support.flights.approach_flight import fly_approach
from support.white_lines import MEDIAN_PX, P95_PX, flight_of, measure_flight
from xplane_bridge.bags import Bags
from xplane_bridge.harness import HarnessError

#: Each second picture is enough.
_EVERY = 2


def measures(bag: Path, every: int = _EVERY) -> List[Measure]:
    """What is wanted of the labels of a flight."""
    with Bags(bag) as bags:
        flight = flight_of(bags)
        lines = measure_flight(bags, flight, every)
    if not len(lines.error):
        raise HarnessError(f"{bag}: no white line to measure in any picture")
    return [
        Measure("pictures with a line to measure", lines.pictures, "-"),
        Measure("places measured", len(lines.error), "-"),
        Measure("white lines off their labels, median", lines.median, "px", MEDIAN_PX),
        Measure("white lines off their labels, p95", lines.p95, "px", P95_PX),
        Measure("mean, right of the line +", float(lines.error.mean()), "px"),
        Measure("pictures left out, by their own flags", lines.unsure, "-"),
        Measure("pictures without labels", sum(flight.left_out.values()), "-"),
    ]


@benchmark
def labels(context: Context) -> List[Measure]:
    """White lines of the drawn runway against the labels of an approach in gusts, at 30 frames/s."""
    return measures(fly_approach(context.folder))
