"""White lines beside the emulator's runway, against where the labels of a recorded approach say they are."""

from __future__ import annotations

from pathlib import Path
from typing import List

import numpy as np
from registry import Context, Measure, benchmark

from support.white_lines import MEDIAN_PX, P95_PX, flight_of, measure_flight
from xplane_bridge.bags import Bags
from xplane_bridge.harness import HarnessError
from xplane_bridge.harness.display import screen
from xplane_bridge.harness.flight import fly
from xplane_bridge.harness.scenario_flight import scenario_plan
from xplane_bridge.resources import config_file
from xplane_bridge.scenario import load_scenario

_SCENARIO = "approach"
_FPS = 30
#: From a frame to its picture [s], said to both sides; longer than any drawing takes.
_DELAY_S = 0.1
#: The approach takes so long [s]; it is flown whole, however long measurements are to last.
_LONGEST_S = 150.0
#: Each second picture is enough.
_EVERY = 2


def fly_approach(folder: Path) -> Path:
    """Flies the approach in wind through the bridge and records it. Returns the bag."""
    options = ["--window", "--fps", str(_FPS), "--pipeline-delay", f"{_DELAY_S}s"]
    plan = scenario_plan(
        load_scenario(config_file("scenarios", f"{_SCENARIO}.yaml")),
        _SCENARIO,
        folder,
        _LONGEST_S,
        emulator_options=options,
        launch_args={"display_delay": _DELAY_S},
    )
    plan.make_folders()
    with screen(plan.logs, headless=True):
        fly(plan)
    return plan.bag


def measures(bag: Path, every: int = _EVERY) -> List[Measure]:
    """What is wanted of the labels of a flight."""
    with Bags(bag) as bags:
        flight = flight_of(bags)
        lines = measure_flight(bags, flight, every)
    if not len(lines.error):
        raise HarnessError(f"{bag}: no white line to measure in any picture")
    error = np.abs(lines.error)
    return [
        Measure("pictures with a line to measure", lines.pictures, "-"),
        Measure("places measured", len(error), "-"),
        Measure("white lines off their labels, median", float(np.median(error)), "px", MEDIAN_PX),
        Measure("white lines off their labels, p95", float(np.percentile(error, 95)), "px", P95_PX),
        Measure("mean, right of the line +", float(lines.error.mean()), "px"),
        Measure("pictures left out, by their own flags", lines.unsure, "-"),
        Measure("pictures without labels", sum(flight.left_out.values()), "-"),
    ]


@benchmark
def labels(context: Context) -> List[Measure]:
    """White lines of the drawn runway against the labels of an approach in gusts, at 30 frames/s."""
    return measures(fly_approach(context.folder))
