"""One flight of a campaign: an aircraft flown in process, its scenario and its controller."""

from __future__ import annotations

import hashlib
import struct
from collections import deque
from dataclasses import dataclass, field
from typing import Any, Callable, Dict, List, Mapping, Optional, Tuple

import numpy as np

from xplane_bridge.analysis.scoring import score
from xplane_bridge.campaign.definition import FlightPlan, make_controller
from xplane_bridge.campaign.distributions import CampaignError
from xplane_bridge.campaign.warnings_topic import WarningInStep, messages_a_second
from xplane_bridge.compiled import require
from xplane_bridge.emulator.flight.flight_model import FlightModelError, ModelState
from xplane_bridge.in_process.aircraft import AUTO, MANUAL, Aircraft, Conditions, excitation_limits_deg
from xplane_bridge.in_process.view import FlightView
from xplane_bridge.scenario import FlightSample, Player, parse_scenario
from xplane_bridge.scenario.ros_player import command_values, sample_of
from xplane_bridge.scenario.stall_warnings import awaits_stall

#: How a flight can end. Whatever it was, it is a row.
FLOWN, NO_START, GAVE_UP, CRASHED, UNFINISHED, CONTROLLER_FAILED = (
    "flown", "no start", "model gave up", "crashed", "not finished", "controller failed",
)  # fmt: skip
#: Scenario variables that criteria measure: the first ones of a sample.
_VARIABLES = FlightSample._fields[: FlightSample._fields.index("load_factor") + 1]
_STICK = ("stick_roll", "stick_pitch", "stick_yaw", "throttle")


class _RefusedError(Exception):
    """The arbiter refused a command of the controller."""


@dataclass
class FlightResult:
    """What became of a flight.

    Attributes:
        outcome: One of the words above.
        reason: In words; empty where it was flown to its end.
        passed: Whether it was flown to its end and met every criterion.
        duration: Simulated time [s].
        values: Criterion to what it measured.
        met: Criterion to whether it was met.
        sha256: Of the truth, frame by frame, in doubles.
        trace: Column to one number per frame, where it was asked for.
    """

    outcome: str
    reason: str = ""
    passed: bool = False
    duration: float = 0.0
    values: Dict[str, float] = field(default_factory=dict)
    met: Dict[str, bool] = field(default_factory=dict)
    sha256: str = ""
    trace: Optional[Dict[str, np.ndarray]] = None


class Flight:
    """A flight that has not begun.

    Args:
        plan: What to fly.
        watch: Called with what is seen of each frame.

    Raises:
        NotCompiledError: The compiled module is not there.
        ScenarioError: The scenario of the plan is none.
    """

    _aircraft: Aircraft

    def __init__(self, plan: FlightPlan, watch: Optional[Callable[[FlightView], None]] = None) -> None:
        self._truth_bytes = require("a campaign").truth_bytes
        self._watch = watch
        self._plan = plan
        self._scenario = parse_scenario(plan.scenario)
        self._labels: Dict[str, float] = {}
        self._excitation: Optional[Tuple[str, Any]] = None  # target, runner
        self._moved: Tuple[Optional[str], float] = (None, 0.0)  # by it, in this frame
        self._limits = excitation_limits_deg(plan.aircraft)
        self._modes = deque([MANUAL, MANUAL])  # at the end of the last two frames; MANUAL: not known yet
        self._stall: Optional[WarningInStep] = None  # where the scenario waits for it
        self._truth = hashlib.sha256()
        self._rows: List[Tuple[float, ...]] = []

    def fly(self, trace: bool = False) -> FlightResult:
        """Flies it; `trace` keeps what was flown, frame by frame.

        Raises:
            CampaignError, NotFlownError: The scenario asks for what this aircraft does not have.
        """
        try:
            self._start()
        except FlightModelError as error:
            return FlightResult(NO_START, str(error))
        outcome, reason = self._fly()
        columns = np.array(self._rows, dtype=float).reshape(len(self._rows), 1 + len(_VARIABLES) + len(_STICK))
        series = dict(zip(("time", *_VARIABLES, *_STICK), columns.T))
        criteria = self._scenario.criteria
        scores = score(criteria, series["time"], series, self._labels, {})
        return FlightResult(
            outcome,
            reason,
            outcome == FLOWN and all(s.passed for s in scores),
            float(series["time"][-1]),
            {s.name: s.value for s in scores},
            {c.name: bool(s.passed and (outcome == FLOWN or c.end is not None)) for c, s in zip(criteria, scores)},
            self._truth.hexdigest(),
            series if trace else None,
        )

    # ---- start

    def _start(self) -> None:
        self._aircraft = Aircraft(conditions_of(self._plan))
        self._player = Player(self._scenario)
        plan = self._plan
        if awaits_stall(self._scenario):
            self._stall = WarningInStep(plan.frame_rate, messages_a_second())
        self._controller = make_controller(plan.controller, plan.arguments) if plan.controller else None

    # ---- frames

    def _fly(self) -> Tuple[str, str]:
        aircraft = self._aircraft
        while True:
            now, view = aircraft.now, aircraft.view()
            if self._watch is not None:
                self._watch(view)
            # As through the nodes, where who flies and warns in a frame is known later.
            known_mode = self._modes.popleft()
            stall = self._stall is not None and self._stall.at(aircraft.frame, view.stall_warning)
            sample = sample_of(view, known_mode, stall)
            self._record(now, aircraft.state, sample)
            commands = self._player.step(aircraft.shown_time, sample)
            if now >= self._plan.longest and not commands.finished:
                return UNFINISHED, f"the scenario has not ended after {self._plan.longest:g} s (longest)"
            if self._excitation is not None:
                self._go_on_exciting(*self._excitation, view)
            for action in commands.actions:
                self._act(action.kind, action.value, now, view)
            if commands.finished:  # with what its last event asked for, as the other players do it
                return FLOWN, ""
            mode = aircraft.mode
            self._command(MANUAL, command_values(commands))
            if aircraft.mode != mode:  # taken over by the stick
                self._end_excitation()
            self._modes.append(aircraft.mode)
            try:
                self._control(view, known_mode)
            except Exception as error:
                return CONTROLLER_FAILED, f"at {now:.2f} s: {type(error).__name__}: {error}"
            try:
                state = aircraft.step(*self._moved)
            except (FlightModelError, ArithmeticError) as error:
                return GAVE_UP, f"at {now:.2f} s: {error}"
            if self._excitation is not None and not aircraft.commands(self._excitation[0]):
                self._end_excitation()
            if state.crashed:
                self._record(aircraft.now, state, sample_of(aircraft.view(), aircraft.mode, False))
                return CRASHED, f"at {aircraft.now:.2f} s"

    def _control(self, view: FlightView, known_mode: int) -> None:
        if self._controller is None:
            return
        if known_mode != AUTO and hasattr(self._controller, "restart"):
            self._controller.restart()
        self._command(AUTO, dict(self._controller.fly(view)))

    def _command(self, mode: int, values: Dict[str, float]) -> None:
        refusal = self._aircraft.command(mode, values)
        if refusal is not None:
            raise _RefusedError(f"command refused: {refusal}")

    def _go_on_exciting(self, target: str, runner: Any, view: FlightView) -> None:
        """The excitation of this frame: the channel that it moves, and by how much."""
        value = runner.step(view.sim_time, view.roll_deg, view.pitch_deg)
        if value is None:
            self._end_excitation()
        else:
            self._moved = (target, value)

    def _end_excitation(self) -> None:
        """It is over; or the mode has changed, or the axis's commands have ended."""
        self._excitation, self._moved = None, (None, 0.0)

    def _excite(self, parameters: Mapping[str, Any], view: FlightView) -> None:
        """As the service inject_excitation does it, whose numbers are float32: it begins in the next frame."""
        now, target = view.sim_time, parameters["target"]
        keys = ("amplitude", "duration", "frequency", "frequency_end")
        amplitude, duration, low, high = struct.unpack("<4f", struct.pack("<4f", *[parameters[key] for key in keys]))
        make = require("an excitation in process").Excitation
        try:
            runner = make(parameters["kind"], amplitude, duration, low, high, parameters["seed"], *self._limits, now)
        except ValueError as error:
            raise CampaignError(f"scenario: excitation at {now:g} s: {error}") from None
        why_not = ""
        if self._excitation is not None:
            why_not = "another runs: one at a time"
        elif not self._aircraft.commands(target):
            why_not = f"no source commands {target}: an excitation is added to a command"
        elif not (abs(view.roll_deg) < self._limits[0] and abs(view.pitch_deg) < self._limits[1]):
            why_not = "the attitude is beyond its limits already"
        if why_not:
            raise CampaignError(f"scenario: excitation at {now:g} s: {why_not}")
        self._excitation, self._moved = (target, runner), (target, 0.0)

    def _act(self, kind: str, value: Any, now: float, view: FlightView) -> None:
        if kind == "mode":
            if self._aircraft.set_mode(value, "scenario"):
                self._end_excitation()
        elif kind == "failure":
            self._aircraft.failures.act(value)
        elif kind == "clear_failures":
            self._aircraft.failures.clear()
        elif kind == "excitation":
            self._excite(value, view)
        elif kind == "label":
            self._labels.setdefault(value, now)

    def _record(self, now: float, state: ModelState, s: FlightSample) -> None:
        self._truth.update(self._truth_bytes(state))
        c = self._aircraft.controls
        self._rows.append((now, *s[: len(_VARIABLES)], c.roll, c.pitch, c.yaw, c.throttle[0]))


def conditions_of(plan: FlightPlan) -> Conditions:
    """How a flight begins and what it flies in."""
    return Conditions(
        plan.aircraft,
        start=parse_scenario(plan.scenario).start,
        weather=plan.weather,
        loading=plan.loading,
        frame_rate=plan.frame_rate,
        seed=plan.seed,
    )
