"""A flight of a campaign once more, through the nodes: emulator and bridge in lock-step, recorded and compared."""

from __future__ import annotations

import dataclasses
import json
import sys
from functools import reduce
from pathlib import Path
from typing import Any, List, Mapping, NamedTuple, Optional, Sequence

import numpy as np
import yaml

from xplane_bridge.analysis.scoring import Score
from xplane_bridge.bags import Bags, Table
from xplane_bridge.bags.flight import read_flight
from xplane_bridge.campaign.definition import FlightPlan
from xplane_bridge.campaign.flight import FLOWN, FlightResult, conditions_of
from xplane_bridge.cli.flight_report import write_report
from xplane_bridge.harness import flight as harness_flight
from xplane_bridge.harness.lockstep_flight import Lockstep
from xplane_bridge.harness.processes import interrupted_by_signals
from xplane_bridge.harness.scenario_flight import scenario_plan
from xplane_bridge.resources import program
from xplane_bridge.scenario import parse_scenario
from xplane_bridge.scenario.judging import judge

_VECTORS = ("angular_velocity", "angular_acceleration", "velocity_ned", "velocity_body", "wind_ned", "specific_force")
#: Fields of FlightState that a flight in process has, too.
COMPARED = (
    "sim_time_unwrapped",
    "latitude", "longitude", "altitude_msl", "altitude_agl", "roll_deg", "pitch_deg", "heading_true_deg",
    *(f"{vector}.{axis}" for vector in _VECTORS for axis in "xyz"),
    "vertical_speed", "ground_speed", "track_deg", "flight_path_angle_deg", "alpha_deg", "beta_deg",
    "calibrated_airspeed", "equivalent_airspeed", "true_airspeed", "mach", "dynamic_pressure", "air_density",
    "load_factor_normal", "load_factor_axial", "load_factor_side", "wind_speed", "wind_from_deg",
    "control_roll", "control_pitch", "control_yaw", "control_throttle",
)  # fmt: skip
#: Where it is flown on after the end in process, so that the end of the scenario shows [s].
_BEYOND_S = 1.0
_EMULATOR = "xplane_bridge.cli.flights.conditioned_emulator"


class Difference(NamedTuple):
    """Where two sequences of states part."""

    frame: int
    field: str
    in_process: float
    nodes: float


def fly(plan: FlightPlan, duration: float, output: Path) -> harness_flight.FlightPlan:
    """Flies it; gives where everything lies.

    Args:
        plan: The flight.
        duration: Of it in process [s].
        output: Folder of the recording.

    Raises:
        HarnessError: A program failed.
    """
    scenario_file, conditions_file = output / "scenario.yaml", output / "conditions.json"
    lockstep = Lockstep(fps=plan.frame_rate)
    controller: List[str] = []
    if plan.controller:
        arguments = yaml.safe_dump(plan.arguments, default_flow_style=True, width=sys.maxsize).strip()
        controller = [str(program("fly_controller")), plan.controller, "--any-aircraft", "--arguments", arguments]
        lockstep.participants.append("fly_controller")
    flown = scenario_plan(
        parse_scenario(plan.scenario),
        str(scenario_file.resolve()),
        output,
        min(plan.longest, duration + _BEYOND_S),
        aircraft=plan.aircraft,
        controller=controller,
        launch_args={"capture": False},
        lockstep=lockstep,
    )
    flown.emulator_command = [sys.executable, "-m", _EMULATOR, str(conditions_file.resolve())]
    flown.experiment = {"program": "run_campaign", "flight": plan.flight, "seed": plan.seed}
    flown.make_folders()
    scenario_file.write_text(yaml.safe_dump(plan.scenario, sort_keys=False), encoding="utf-8")
    conditions_file.write_text(json.dumps(dataclasses.asdict(conditions_of(plan))), encoding="utf-8")
    with interrupted_by_signals("run_campaign"):
        harness_flight.fly(flown, say=lambda text: print(f"run_campaign: {text}", file=sys.stderr))
    return flown


def first_difference(seen: Sequence[Any], states: Table, first: int) -> Optional[Difference]:
    """Where the states through the nodes, from `first` on, part from those in process; None: nowhere."""
    found: List[Difference] = []
    for name in COMPARED:
        mine = np.array([reduce(getattr, name.split("."), view) for view in seen])
        theirs = np.asarray(states[name][first : first + len(mine)], dtype=float)
        if name == "sim_time_unwrapped":  # it begins with X-Plane
            mine, theirs = mine - mine[0], theirs - theirs[0]
        mine = mine[: len(theirs)]
        unknown = np.isnan(mine) & np.isnan(theirs)
        differing = np.flatnonzero((mine != theirs) & ~unknown)
        if len(differing):
            frame = int(differing[0])
            found.append(Difference(frame, name, float(mine[frame]), float(theirs[frame])))
    return min(found, key=lambda difference: difference.frame, default=None)


def first_state(states: Table, played: Mapping[str, Any]) -> int:
    """Row of the state with which the scenario began."""
    begin = played["begin"]
    good = (states["epoch"] == begin["epoch"]) & (states["sim_time_unwrapped"] >= begin["sim_time_unwrapped"] - 1e-6)
    return int(np.flatnonzero(good)[0])


def render(result: FlightResult, scores: Sequence[Score]) -> str:
    """The criteria of both, side by side."""
    width = max([len(s.name) for s in scores] + [9])
    lines = [f"{'criterion':{width}}  {'in process':>18}  {'through the nodes':>18}"]
    for s in scores:
        mine = f"{result.values[s.name]:.4f} {'met   ' if result.met[s.name] else 'missed'}"
        lines.append(f"{s.name:{width}}  {mine:>18}  {s.value:11.4f} {'met   ' if s.passed else 'missed'}")
    return "\n".join(lines)


def compare(plan: FlightPlan, result: FlightResult, seen: Sequence[Any], output: Path) -> bool:
    """Flies it through the nodes into a folder and says what differs; returns whether it was the same flight.

    Args:
        plan: The flight.
        result: Of it in process.
        seen: Its states in process.
        output: Folder of the recording and the report.

    Raises:
        HarnessError: A program failed.
        ScenarioError: No state was recorded.
    """
    flown = fly(plan, result.duration, output)
    played = json.loads(flown.played.read_text(encoding="utf-8"))
    with Bags(flown.bag) as bags:
        recorded = read_flight(bags)
        scores = judge(parse_scenario(plan.scenario), recorded, played, len(seen))
    page = write_report([flown.bag], flown.report)
    print(f"through the nodes: {flown.bag}, drawn in {page}")
    print(render(result, scores))
    states = recorded.tables["state"]
    first = first_state(states, played)
    frames = len(states["epoch"]) - first
    difference = first_difference(seen, states, first)
    # What did not end by the scenario is flown on a little through the nodes.
    whole = frames == len(seen) if result.outcome == FLOWN else frames >= len(seen)
    if difference is not None:
        print(
            f"not the same states: from frame {difference.frame} of {len(seen)} on, {difference.field} is "
            f"{difference.in_process:.9g} in process, {difference.nodes:.9g} through the nodes "
            "(docs/experiments/campaigns.md)"
        )
    elif not whole:
        print(f"not the same states: {len(seen)} frames in process, {frames} through the nodes; the same until then")
    else:
        print(f"the same states as in process: {len(COMPARED)} fields of {len(seen)} frames, to the last bit")
    return difference is None and whole and all(s.passed == result.met[s.name] for s in scores)
