"""run_scenario: flies a scenario with the emulator and the bridge, records it, and judges it by its criteria."""

from __future__ import annotations

import argparse
import json
import math
import shlex
import sys
from contextlib import nullcontext
from pathlib import Path
from typing import Any, Dict, Optional, Sequence

from xplane_bridge.analysis.scoring import Score
from xplane_bridge.bags import Bags
from xplane_bridge.bags.flight import read_flight
from xplane_bridge.campaign.definition import make_controller
from xplane_bridge.cli.entry import guarded, positive
from xplane_bridge.cli.scenario_player import scenario_file, scenario_of
from xplane_bridge.harness.display import screen
from xplane_bridge.harness.flight import FlightPlan, fly
from xplane_bridge.harness.lockstep_flight import Lockstep
from xplane_bridge.harness.processes import interrupted_by_signals
from xplane_bridge.harness.scenario_flight import scenario_plan
from xplane_bridge.scenario import Scenario, ScenarioError
from xplane_bridge.scenario.judging import judge
from xplane_bridge.scenario.late_actions import late_text

_FPS = 60.0
_PICTURES_HZ = 30.0  # in lock-step, as nearly as frames allow; otherwise capture_node's max_rate says it
#: Options that make a flight what it is.
_KEPT = ("aircraft", "transport", "joystick", "controller", "camera", "duration", "emulator", "seed")
_KEPT_LOCKSTEP = ("lockstep", "speed", "controller_node")
#: A scenario that has not ended so long after its last event could have come waits for something that never comes [s].
_PATIENCE_S = 600.0


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = argparse.ArgumentParser(
        prog="run_scenario",
        description=(
            "Flies a scenario (config/scenarios/README.md) with the emulator through the bridge, records "
            "DIR/flight.bag and measures the scenario's criteria in it. Exit code 0: every criterion is met; 1: one is "
            "missed, or something the scenario asked for was refused."
        ),
    )
    p.add_argument("scenario", metavar="SCENARIO", help="file, or stem of a file in config/scenarios")
    p.add_argument("--output", type=Path, metavar="DIR", help="where to write (default: scenario_<name>)")
    p.add_argument("--aircraft", metavar="NAME", help="aircraft to fly (default: the scenario's first)")
    p.add_argument("--transport", choices=("rref", "data"), default="rref", help="how to ask X-Plane (%(default)s)")
    p.add_argument("--joystick", metavar="NAME", help="fly through joystick_mapper_node as this device")
    p.add_argument(
        "--controller",
        metavar="COMMAND",
        help="program that flies in mode auto, started beside the bridge (default: the scenario's own)",
    )
    p.add_argument("--camera", action="store_true", help="draw and record the cockpit view")
    p.add_argument("--headless", action="store_true", help="draw it, but not on this screen")
    p.add_argument(
        "--duration",
        type=positive,
        metavar="S",
        help="end after so much simulated time; needed where a scenario repeats (default: when the scenario ends, or "
        f"{_PATIENCE_S:g} s after its last event could have come)",
    )
    p.add_argument(
        "--emulator",
        default="",
        metavar="OPTIONS",
        help='further options of xplane_emulator, e.g. --emulator="--pipeline-delay 50ms --fps 30"',
    )
    p.add_argument(
        "--lockstep",
        action="store_true",
        help="the emulator waits for all answers to each frame: the same flight every time, as fast as that goes; all "
        "times are simulated (docs/experiments/lockstep.md)",
    )
    p.add_argument("--speed", type=positive, metavar="X", help="of --lockstep: at most so many times real time")
    p.add_argument(
        "--controller-node",
        metavar="NAME",
        help="of --lockstep: name of --controller's node, which answers every frame (default: as its program)",
    )
    p.add_argument("--seed", type=int, default=0, metavar="N", help="of the emulator's turbulence and faults")
    return p


def plan_of(scenario: Scenario, args: argparse.Namespace) -> FlightPlan:
    """What to start for a scenario.

    Raises:
        ScenarioError: It cannot be flown so.
        CampaignError: Its controller cannot be had.
    """
    if scenario.repeat_every is not None and args.duration is None:
        raise ScenarioError(f"{scenario.name} repeats for ever (repeat_every): give --duration")
    if scenario.controller and not args.controller:
        make_controller(scenario.controller, {})  # as fly_controller will: what it refuses is said before a start
    lockstep = lockstep_of(args)
    options = ["--fps", f"{_FPS:g}", "--seed", str(args.seed), *(["--window"] if args.camera else [])]
    if lockstep is not None and args.camera:
        options += ["--picture-every", str(max(1, round(lockstep.fps / _PICTURES_HZ)))]
    return scenario_plan(
        scenario,
        args.scenario,
        args.output or Path(f"scenario_{scenario.name}"),
        args.duration or _longest(scenario),
        aircraft=args.aircraft,
        joystick=args.joystick,
        controller=["sh", "-c", f"exec {args.controller}"] if args.controller else (),
        emulator_options=[*options, *shlex.split(args.emulator)],
        launch_args={} if args.camera else {"capture": False},
        transport=args.transport,
        lockstep=lockstep,
    )


def _longest(scenario: Scenario) -> float:
    """[s] of simulated time for which a scenario may fly that ends by itself."""
    return scenario.last_event + _PATIENCE_S


def lockstep_of(args: argparse.Namespace) -> Optional[Lockstep]:
    """How to fly in lock-step; None: in real time.

    Raises:
        ScenarioError: That cannot be.
    """
    if not args.lockstep:
        for option in ("speed", "controller_node"):
            if getattr(args, option) is not None:
                raise ScenarioError(f"--{option.replace('_', '-')} {getattr(args, option)}: needs --lockstep")
        return None
    if args.transport != "rref":
        raise ScenarioError("--lockstep flies with --transport rref")
    lockstep = Lockstep(speed=args.speed or 0.0, fps=_fps_of(args.emulator))
    if args.camera:
        lockstep.participants.append("capture_node")
    if args.controller:
        lockstep.participants.append(args.controller_node or Path(shlex.split(args.controller)[0]).name)
    return lockstep


def asked_for(scenario: Scenario, args: argparse.Namespace) -> Dict[str, Any]:
    """What the passport of the flight says of how it was started: enough for rerun_flight."""
    defaults = parser().parse_args([args.scenario])
    options = []
    for name in _KEPT + _KEPT_LOCKSTEP:
        value = getattr(args, name)
        if value != getattr(defaults, name):
            option = "--" + name.replace("_", "-")
            options.append(option if value is True else f"{option}={value}")
    text = scenario_file(args.scenario).read_text(encoding="utf-8")
    return {"program": "run_scenario", "scenario": scenario.name, "text": text, "options": options}


def _fps_of(emulator_options: str) -> float:
    """Frames a second that further options of the emulator ask for, written either way."""
    p = argparse.ArgumentParser(prog="run_scenario --emulator", add_help=False, allow_abbrev=False)
    p.add_argument("--fps", type=positive, default=_FPS)
    return float(p.parse_known_args(shlex.split(emulator_options))[0].fps)


def render(scores: Sequence[Score]) -> str:
    """A line for each criterion."""
    width = max([len(s.name) for s in scores] + [9])
    lines = []
    for s in scores:
        verdict = "met   " if s.passed else "MISSED"
        lines.append(f"{verdict}  {s.name:{width}}  {s.measure:10} {s.value:10.3f}  {s.text}")
    return "\n".join(lines)


def _plain(score: Score) -> Dict[str, Any]:
    """A criterion of scores.json: JSON has finite numbers only."""
    value = score.value
    return {**score._asdict(), "value": None if math.isnan(value) else "never" if math.isinf(value) else value}


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Runs the program."""
    args = parser().parse_args(argv)
    scenario = scenario_of(args.scenario)
    args.scenario = str(scenario_file(args.scenario).absolute())
    plan = plan_of(scenario, args)
    plan.experiment = asked_for(scenario, args)
    plan.make_folders()
    shown = screen(plan.logs, args.headless) if plan.draws else nullcontext()
    with interrupted_by_signals("run_scenario"), shown:
        fly(plan, say=lambda text: print(f"run_scenario: {text}", file=sys.stderr))
    played = json.loads(plan.played.read_text(encoding="utf-8"))
    for entry in played["late"]:
        print(f"run_scenario: {late_text(entry)}", file=sys.stderr)
    if not played["finished"] and args.duration is None:
        raise ScenarioError(
            f"{scenario.name} has not ended within {_longest(scenario):g} s: it waits for a condition; give it a "
            "timeout, or --duration"
        )
    with Bags(plan.bag) as bags:
        scores = judge(scenario, read_flight(bags), played)
    report = {"scenario": scenario.name, "played": played, "criteria": [_plain(s) for s in scores]}
    text = json.dumps(report, indent=2, allow_nan=False) + "\n"
    plan.scores.write_text(text, encoding="utf-8")
    missed = [s.name for s in scores if not s.passed]
    print(render(scores) if scores else f"{scenario.name} has no criteria")
    print(f"{scenario.name}: {len(scores) - len(missed)} of {len(scores)} criteria met; the recording is {plan.bag}")
    page = [str(plan.bag), "-o", str(plan.report)]
    print(f"for a report: scripts/flight_report {' '.join(map(shlex.quote, page))}")
    return 1 if missed else 0
