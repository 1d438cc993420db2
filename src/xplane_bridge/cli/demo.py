"""demo: a scripted flight from X-Plane's stand-in through the bridge into a bag, and a table of what came in."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence

from tqdm import tqdm

from xplane_bridge import xplane_names
from xplane_bridge.cli.entry import guarded, number
from xplane_bridge.cli.flight_report import write_report
from xplane_bridge.cli.scenario_player import scenario_of
from xplane_bridge.harness import control_check, flight_check
from xplane_bridge.harness.display import screen
from xplane_bridge.harness.flight import FlightPlan, fly
from xplane_bridge.harness.override_watch import OverrideWatch
from xplane_bridge.harness.processes import interrupted_by_signals
from xplane_bridge.harness.running_flight import RunningFlight
from xplane_bridge.harness.scenario_flight import scenario_plan
from xplane_bridge.resources import program

_FPS = 60
_SHORTEST_S = 5.0
_SCENARIO, _JOYSTICK = "demo_flight", "logitech_extreme_3d_pro"
#: Labels of the scenario after which there is something to judge.
_LABELS = {"back_by": "manual by the stick", "stuck": "left aileron stuck", "repaired": "repaired"}
#: From a frame to its picture on the screen [s]: longer than drawing takes, and said to both sides.
_DISPLAY_DELAY_S = 0.05


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = argparse.ArgumentParser(
        prog="demo",
        description=(
            "Flies a scripted flight with the emulator (no X-Plane needed) by joystick and by a controller, breaks an "
            "aileron (in flights of more than 35 s; judged in those of a minute), records it through the bridge into "
            "DIR/flight.bag and checks the recording, and that X-Plane got everything back. Exit code 0: all of it "
            "worked."
        ),
    )
    p.add_argument(
        "--duration",
        type=number(f"seconds, {_SHORTEST_S:g} or more", low=_SHORTEST_S),
        default=60.0,
        metavar="S",
        help="length of the recording, of simulated time [s] (%(default)g)",
    )
    p.add_argument("--output", type=Path, default=Path("out"), metavar="DIR", help="where to write (%(default)s)")
    p.add_argument("--aircraft", default="fixed_wing", metavar="NAME", help="aircraft to fly (%(default)s)")
    p.add_argument("--transport", choices=("rref", "data"), default="rref", help="how to ask X-Plane (%(default)s)")
    p.add_argument(
        "--version",
        choices=(*xplane_names.NEWEST, *xplane_names.VERSIONS),
        default="11",
        help="X-Plane's version, which the emulator plays (%(default)s)",
    )
    p.add_argument("--fps", type=int, default=_FPS, metavar="N", help="the emulator's frame rate [1/s] (%(default)s)")
    p.add_argument("--headless", action="store_true", help="draw the cockpit view, but not on this screen")
    p.add_argument(
        "launch_args", nargs="*", metavar="KEY:=VALUE", help="passed on to demo.launch, e.g. transport:=data"
    )
    return p


def _plan(args: argparse.Namespace) -> FlightPlan:
    launch_args: Dict[str, Any] = {"display_delay": _DISPLAY_DELAY_S}
    for text in args.launch_args:
        key, separator, value = text.partition(":=")
        if not separator or not key:
            parser().error(f"{text!r} is neither an option nor KEY:=VALUE for demo.launch")
        launch_args[key] = value
    transport = launch_args.pop("transport", args.transport)
    return scenario_plan(
        scenario_of(_SCENARIO),
        _SCENARIO,
        args.output,
        args.duration,
        aircraft=args.aircraft,
        joystick=_JOYSTICK,
        controller=[str(program("attitude_hold"))],
        controller_ready=r"^commanding on",
        emulator_options=[
            *("--version", args.version, "--fps", str(args.fps)),
            *("--window", "--pipeline-delay", f"{_DISPLAY_DELAY_S}s"),
        ],
        launch_args=launch_args,
        transport=transport,
    )


class _Overrides:
    """X-Plane's overrides during the flight, and after it."""

    def __init__(self) -> None:
        self._watch: Optional[OverrideWatch] = None
        self.verdicts: List[flight_check.Verdict] = []

    def watch(self, flight: RunningFlight) -> None:
        """Looks which are on."""
        if self._watch is None:
            self._watch = OverrideWatch(flight.emulator.port)
        self._watch.poll()

    def judge(self, _: RunningFlight) -> None:
        """Looks whether all are off."""
        if self._watch is not None:
            self.verdicts.append(self._watch.judge_end())

    def close(self) -> None:
        """Ends it."""
        if self._watch is not None:
            self._watch.close()


class _Progress:
    """A progress bar with the newest state beside it; a line now and then where there is no terminal."""

    _EVERY_S = 5.0

    def __init__(self, duration: float) -> None:
        self._terminal = sys.stderr.isatty()
        self._next_line = 0.0
        form = "{desc}|{bar}| {n:.0f}/{total:.0f} s {postfix}"
        self._bar = tqdm(total=duration, desc="flying", bar_format=form, disable=not self._terminal, leave=True)

    def __call__(self, flight: RunningFlight) -> None:
        self._bar.n = min(flight.elapsed, self._bar.total)
        self._bar.set_postfix_str(self._text(flight), refresh=True)
        if not self._terminal and flight.elapsed >= self._next_line:
            self._next_line += self._EVERY_S
            print(f"demo: {flight.elapsed:3.0f}/{self._bar.total:.0f} s  {self._text(flight)}", file=sys.stderr)

    @staticmethod
    def _text(flight: RunningFlight) -> str:
        state = flight.last
        return (
            f"{flight.states} states, {state.altitude_msl:.0f} m, {state.true_airspeed:.0f} m/s, "
            f"roll {state.roll_deg:+.0f} deg, heading {state.heading_true_deg:03.0f} deg"
        )

    def close(self) -> None:
        self._bar.close()


@guarded
def main(argv: Optional[Sequence[str]] = None) -> int:
    """Runs the program."""
    args = parser().parse_args(argv)
    plan = _plan(args)
    plan.make_folders()
    progress = _Progress(plan.duration)
    overrides = _Overrides()

    def observe(flight: RunningFlight) -> None:
        overrides.watch(flight)
        progress(flight)

    try:
        with interrupted_by_signals("demo"), screen(plan.logs, args.headless):
            fly(plan, observe, progress_line, afterwards=overrides.judge)
    finally:
        progress.close()
        overrides.close()
    print(flight_check.render(flight_check.summarise(plan.bag)))
    print()
    print(flight_check.pairing_text(plan.bag))
    print()
    verdicts = flight_check.judge(plan.bag, plan.truth)
    verdicts += control_check.judge_control(plan.bag, **_LABELS) + overrides.verdicts
    for verdict in verdicts:
        print(verdict.line)
    report = write_report([plan.bag], plan.report)
    failed = [verdict.name for verdict in verdicts if not verdict.passed]
    print()
    if failed:
        print(f"demo: failed: {', '.join(failed)}; logs: {plan.logs}", file=sys.stderr)
        return 1
    print(f"demo: all well; the recording is {plan.bag}, the report on it {report}")
    return 0


def progress_line(text: str) -> None:
    """Says what happens, without tearing the progress bar."""
    tqdm.write(f"demo: {text}", file=sys.stderr)
