"""Plays a scenario: time and state in, stick, handles and actions out. Pure: no clock, no input or output, no ROS."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Set, Tuple

from xplane_bridge.scenario import excitations
from xplane_bridge.scenario.holds import HoldAutopilot, HoldGains, Targets
from xplane_bridge.scenario.schema import STICK_AXES, Event, Scenario

#: Longest time step that the holds integrate over; after a gap they go on as if nothing had happened [s].
_MAX_STEP_S = 0.1


class FlightSample(NamedTuple):
    """What the player looks at: degrees, degrees/s, metres, m/s (`speed` is calibrated airspeed)."""

    roll: float = 0.0
    pitch: float = 0.0
    heading: float = 0.0
    altitude: float = 0.0
    agl: float = 0.0
    climb: float = 0.0
    speed: float = 0.0
    alpha: float = 0.0
    beta: float = 0.0
    roll_rate: float = 0.0
    pitch_rate: float = 0.0
    yaw_rate: float = 0.0
    load_factor: float = 1.0
    on_ground: bool = False
    stall_warning: bool = False
    mode: int = 1  #: MANUAL 1, AUTO 2; 1 where there is no arbiter


@dataclass(frozen=True)
class Action:
    """For the caller to do once.

    `mode`, `failure`, `clear_failures`, `excitation`, `reset`, `wind`, `disturb`, `weather`, `time`, `traffic`,
    `dataref`, `command`, `label`.
    """

    kind: str
    value: Any
    time: float  #: scenario time at which it happened [s]


@dataclass
class Commands:
    """What the scenario wants now."""

    stick: Dict[str, float] = field(default_factory=lambda: {"roll": 0.0, "pitch": 0.0, "yaw": 0.0})
    throttle: Optional[float] = None  #: None: never said, leave it
    handles: Dict[str, float] = field(default_factory=dict)  #: those said so far
    buttons: Set[int] = field(default_factory=set)  #: pressed ones
    taps: Set[int] = field(default_factory=set)  #: those of them that are pressed in this step only
    actions: List[Action] = field(default_factory=list)  #: new ones, in order
    finished: bool = False


@dataclass
class _Ramp:
    start_time: float
    duration: float
    start: float
    end: float

    def at(self, time: float) -> float:
        if self.duration <= 0.0:
            return self.end
        part = min(max((time - self.start_time) / self.duration, 0.0), 1.0)
        return self.start + part * (self.end - self.start)


class Player:
    """Plays one scenario from the first call of `step` on.

    Args:
        scenario: What to play.
        apply_excitations: Whether excitations of stick axes are added to the stick here (else they are only actions).
    """

    def __init__(self, scenario: Scenario, apply_excitations: bool = False) -> None:
        self.scenario = scenario
        self.targets = Targets()
        self._apply_excitations = apply_excitations
        self._autopilot = HoldAutopilot(dataclasses.replace(HoldGains(), **scenario.gains))
        self._moving: Dict[str, _Ramp] = {}  # stick movements under way
        self._moved: Dict[str, float] = {}  # where each axis is by its last one
        self._holding = False  # any of the targets
        self._handles: Dict[str, float] = {}
        self._buttons: Set[int] = set()
        self._taps: Set[int] = set()
        self._running: List[Tuple[float, Mapping[str, Any]]] = []
        self._held_back: List[Mapping[str, Any]] = []  # excitations, until there is a command that they are added to
        self._next = 0
        self._quiet_until = -math.inf  # no event before this time
        self._start: Optional[float] = None
        self._round_start = 0.0
        self._last_fired = 0.0
        self._last_time: Optional[float] = None
        self._waiting_since: Optional[float] = None
        self._finished = False
        self._throttle: Optional[float] = None
        self._held: Dict[str, float] = {}

    @property
    def time(self) -> float:
        """Scenario time of the last step, from the start of the first round [s]."""
        return 0.0 if self._start is None or self._last_time is None else self._last_time - self._start

    def step(self, sim_time: float, sample: FlightSample) -> Commands:
        """Goes on to `sim_time` [s]. The first call is scenario time 0; time that runs backwards starts it anew."""
        if self._start is None or (self._last_time is not None and sim_time < self._last_time):
            self.__init__(self.scenario, self._apply_excitations)  # type: ignore[misc]
            self._start = sim_time
        dt = 0.0 if self._last_time is None else min(sim_time - self._last_time, _MAX_STEP_S)
        self._last_time = sim_time
        now = sim_time - self._start
        # What costs time only where something happens: a campaign comes here in each frame.
        actions: List[Action] = []
        if self._held_back:
            held_back, self._held_back = self._held_back, []
            for value in held_back:
                self._excite(value, now, 0.0, actions)
        self._taps.clear()
        if now >= self._quiet_until:
            self._fire(now, sample, actions)
        stick = self._fly(now, dt, sample)
        taps = self._taps - self._buttons
        finished = self._finished and not self._held_back
        return Commands(stick, self._throttle, dict(self._handles), self._buttons | taps, taps, actions, finished)

    # --- events -------------------------------------------------------------------------------------------------------

    def _fire(self, now: float, sample: FlightSample, actions: List[Action]) -> None:
        events, repeat = self.scenario.events, self.scenario.repeat_every
        self._quiet_until = -math.inf
        while not self._finished:
            if self._next >= len(events):
                if repeat is None:
                    self._finished = True
                    return
                if now < self._round_start + repeat:
                    return
                # a round that waited longer than its length begins again at once
                self._round_start = max(self._round_start + repeat, now - repeat)
                self._last_fired = self._round_start
                self._next = 0
            elif repeat is not None and now >= self._round_start + repeat:
                self._next = len(events)
                self._waiting_since = None
                continue
            event = events[self._next]
            if event.at is None:
                due = self._last_fired + event.after
            else:  # it is its turn when the event before it has happened
                due = max(self._round_start + event.at, self._last_fired)
            if now < due:
                self._quiet_until = due if repeat is None else min(due, self._round_start + repeat)
                return
            if not self._ready(event, now, due, sample):
                return
            self._last_fired = due if not event.when else now
            self._waiting_since = None
            self._next += 1
            for kind, value in event.actions:
                self._act(kind, value, event, now, actions)

    def _ready(self, event: Event, now: float, due: float, sample: FlightSample) -> bool:
        if not event.when:
            return True
        values = {**sample._asdict(), "time": now - self._round_start, "on_ground": float(sample.on_ground)}
        if all(condition.holds(values) for condition in event.when):
            return True
        if self._waiting_since is None:
            self._waiting_since = due
        return event.timeout is not None and now - self._waiting_since >= event.timeout

    def _act(self, kind: str, value: Any, event: Event, now: float, actions: List[Action]) -> None:
        if kind == "stick":
            for axis, target in value.items():
                present = self._present(axis, now)
                self._moving[axis] = _Ramp(now, event.over, present, target)
                self._release(axis)
            self._holding = self.targets.any()
        elif kind == "hold":
            self.targets.update(value)
            self._holding = self.targets.any()
        elif kind == "handles":
            self._handles.update(value)
        elif kind == "buttons":
            self._buttons |= set(value.get("press", ()))
            self._buttons -= set(value.get("release", ()))
            self._taps |= set(value.get("tap", ()))
        elif kind == "end":
            self._finished = True
        elif kind != "excitation":
            actions.append(Action(kind, value, now))
        elif now > 0.0:
            self._excite(value, now, now, actions)
        else:  # the first commands are those of this step
            self._held_back.append(value)

    def _excite(self, value: Mapping[str, Any], now: float, event_time: float, actions: List[Action]) -> None:
        self._running.append((now, value))
        actions.append(Action("excitation", value, event_time))

    def _present(self, axis: str, now: float) -> float:
        """Where a movement of this axis begins: where a hold has it, or else the movement before."""
        if axis in self._held:
            return self._held[axis]
        if axis in self._moving:
            return self._moving[axis].at(now)
        if axis in self._moved:
            return self._moved[axis]
        return self._throttle or 0.0 if axis == "throttle" else 0.0

    def _release(self, axis: str) -> None:
        """A stick movement ends the holds of its axis."""
        for key in {
            "roll": ("roll", "heading"),
            "pitch": ("pitch", "climb", "altitude"),
            "yaw": ("yaw_rate",),
            "throttle": ("speed",),
        }[axis]:
            setattr(self.targets, key, None)

    # --- flying -------------------------------------------------------------------------------------------------------

    def _fly(self, now: float, dt: float, s: FlightSample) -> Dict[str, float]:
        """The stick, without the throttle, which it moves as well."""
        if self._holding:
            held = self._hold(now, dt, s)
            self._held = {axis: value for axis, value in held.items() if math.isfinite(value)}
            for axis in held:  # it does not go back to an earlier movement when it is let go
                self._moving.pop(axis, None)
                self._moved.pop(axis, None)
        else:
            held = {}
            self._autopilot.let_go()
            self._held.clear()
        if self._moving:
            for axis, ramp in self._moving.items():
                self._moved[axis] = ramp.at(now)
            self._moving = {axis: ramp for axis, ramp in self._moving.items() if now - ramp.start_time < ramp.duration}
        stick = {"roll": 0.0, "pitch": 0.0, "yaw": 0.0, **self._moved, **held}
        throttle = stick.pop("throttle", None)
        if throttle is not None and math.isfinite(throttle):
            self._throttle = throttle
        for axis, value in stick.items():
            value += self._excitation(axis, now) if self._apply_excitations else 0.0  # which also makes 0 of -0
            low, high = STICK_AXES[axis]
            stick[axis] = min(max(value, low), high)
        return stick

    def _hold(self, now: float, dt: float, s: FlightSample) -> Dict[str, float]:
        """What the targets make of stick and throttle, for the axes that they hold."""
        autopilot, targets = self._autopilot, self.targets
        held = {
            "roll": autopilot.roll(targets, s.roll, s.roll_rate, s.heading),
            "pitch": autopilot.pitch(
                targets, dt, s.pitch, s.pitch_rate, s.roll, s.climb, s.altitude, self._present("pitch", now)
            ),
            "yaw": autopilot.yaw(targets, s.yaw_rate),
            "throttle": autopilot.throttle(targets, dt, s.speed, 0.5 if self._throttle is None else self._throttle),
        }
        return {axis: value for axis, value in held.items() if value is not None}

    def _excitation(self, axis: str, now: float) -> float:
        self._running = [(start, p) for start, p in self._running if now - start < p["duration"]]
        total = sum(excitations.value(p, now - start) for start, p in self._running if p["target"] == axis)
        return total if math.isfinite(total) else 0.0
